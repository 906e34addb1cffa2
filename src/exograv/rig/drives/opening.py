"""The driver of a machine, or simulated drives, by the bus that `drives.toml` names."""

import importlib
from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

from exograv.errors import ConfigError
from exograv.rig.interface import Powered, Rig

from .settings import Drives
from .simulated.devices import SimulatedDevices

DRIVERS = {"udp": "udp:UdpRig", "canopen": "canopen:CanopenRig", "moteus": "moteus:MoteusRig"}
"""Module in this folder and class, by bus; imported when it is asked for, because each has libraries of its own."""

SIMULATED = {
    "udp": "udp.simulated.controller:UdpController",
    "canopen": "canopen.simulated.network:CanopenDevices",
    "moteus": "moteus.simulated.bus:MoteusDevices",
}
"""The same of the simulated drives."""

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
    return _imported(DRIVERS, drives.settings.bus)(drives, lock_step=lock_step)


def simulated_devices(bus: str) -> Callable[..., SimulatedDevices]:
    """Class of the simulated drives on a bus.

    Raises:
        ConfigError: A package is missing.
    """
    return _imported(SIMULATED, bus)


def _imported(classes: Mapping[str, str], bus: str) -> Any:
    module, name = classes[bus].split(":")
    try:
        return getattr(importlib.import_module(f"{__package__}.{module}"), name)
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"Drives on {bus} need '{error.name}', which is not installed: pip install "
            f"'exograv[{EXTRAS.get(bus, bus)}]'."
        ) from error
