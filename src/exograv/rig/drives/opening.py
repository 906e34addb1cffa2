"""The driver of a machine, by the bus that its `drives.toml` names; its libraries are imported when it is asked for."""

import importlib
from typing import Protocol, runtime_checkable

from exograv.errors import ConfigError
from exograv.rig.interface import Powered, Rig

from .settings import Drives

DRIVERS = {
    "udp": ("exograv.rig.drives.udp", "UdpRig"),
    "canopen": ("exograv.rig.drives.canopen", "CanopenRig"),
    "moteus": ("exograv.rig.drives.moteus", "MoteusRig"),
}
EXTRAS = {"canopen": "can"}
"""Of exograv, where it is not named as the bus."""


@runtime_checkable
class DrivenRig(Rig, Powered, Protocol):
    """A machine of drives."""

    def __enter__(self) -> "DrivenRig": ...

    def expect_silence(self) -> None:
        """For examiners in lock-step: nobody answers from now on, and time passes all the same."""
        ...


def open_drives(drives: Drives, lock_step: bool = False) -> DrivenRig:
    """Not opened yet: `with` does that.

    Args:
        drives: Of the machine.
        lock_step: Whether simulated drives wait for us as we for them, and time is counted in periods.

    Raises:
        ConfigError: A package is missing.
    """
    bus = drives.settings.bus
    module, name = DRIVERS[bus]
    try:
        return getattr(importlib.import_module(module), name)(drives, lock_step=lock_step)
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"Drives on {bus} need '{error.name}', which is not installed: pip install "
            f"'exograv[{EXTRAS.get(bus, bus)}]'."
        ) from error
