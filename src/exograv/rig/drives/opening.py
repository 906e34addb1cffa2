"""The driver of a machine by the bus that `drives.toml` names."""

import importlib
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from exograv.errors import ConfigError
from exograv.rig.interface import Powered, Rig

from .settings import Drives

DRIVERS = {"udp": "udp:UdpRig", "canopen": "canopen:CanopenRig", "moteus": "moteus:MoteusRig"}
"""Module in this folder and class, by bus; imported when it is asked for, because each has libraries of its own."""

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
