"""Simulated drives for the bus that `drives.toml` names."""

from collections.abc import Callable

from exograv.rig.drives.opening import imported_class

from .devices import SimulatedDevices

SIMULATED = {
    "udp": "udp.simulated.controller:UdpController",
    "canopen": "canopen.simulated.network:CanopenDevices",
    "moteus": "moteus.simulated.bus:MoteusDevices",
}
"""Module in the folder of drives and class, by bus. They are imported at the first use."""


def simulated_devices(bus: str) -> Callable[..., SimulatedDevices]:
    """Return the class of the simulated drives on a bus.

    Raises:
        ConfigError: A package is missing.
    """
    return imported_class(SIMULATED, bus)
