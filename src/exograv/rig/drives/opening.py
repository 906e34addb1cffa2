"""Driver of a machine for the bus that `drives.toml` names."""

import importlib
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from exograv.errors import ConfigError
from exograv.rig.interface import Powered, Rig

from .settings import Drives

DRIVERS = {"udp": "udp:UdpRig", "canopen": "canopen:CanopenRig", "moteus": "moteus:MoteusRig"}
"""Module in this folder and class, by bus. They are imported at the first use, because each needs its own libraries."""

EXTRAS = {"canopen": "can"}
"""Extra of the exograv package, where its name is not the name of the bus."""


@runtime_checkable
class DrivenRig(Rig, Powered, Protocol):
    """Machine whose joints are moved by drives on a bus."""

    def __enter__(self) -> "DrivenRig": ...

    @property
    def is_in_lock_step(self) -> bool:
        """True if time is counted in periods: simulated drives wait for this driver."""
        ...

    def begin_at(self, t: float) -> None:
        """Start the clock of a machine in lock-step at `t` [s], before it is opened."""
        ...

    def expect_silence(self) -> None:
        """Expect no answers from now on while time passes. Only for examiners in lock-step."""
        ...


def open_drives(drives: Drives, lock_step: bool = False) -> DrivenRig:
    """Return the driver of a machine. It is not open yet: `with` opens it.

    Args:
        drives: Drives of the machine.
        lock_step: True if simulated drives run in lock-step with this driver, and time is counted in periods.

    Raises:
        ConfigError: A package is missing.
    """
    return imported_class(DRIVERS, drives.settings.bus)(drives, lock_step=lock_step)


def imported_class(classes: Mapping[str, str], bus: str) -> Any:
    """Import the class of a bus.

    Args:
        classes: Module in this folder and class, by bus.
        bus: Key of the table.

    Raises:
        ConfigError: A package is missing.
    """
    module, name = classes[bus].split(":")
    try:
        return getattr(importlib.import_module(f"{__package__}.{module}"), name)
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"Drives on {bus} need '{error.name}', which is not installed: pip install "
            f"'exograv[{EXTRAS.get(bus, bus)}]'."
        ) from error
