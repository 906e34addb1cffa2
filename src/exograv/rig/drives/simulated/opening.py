"""Simulated drives by the bus that `drives.toml` names."""

from collections.abc import Callable

from exograv.rig.drives.opening import imported_class

from .devices import SimulatedDevices

SIMULATED = {
    "udp": "udp.simulated.controller:UdpController",
    "canopen": "canopen.simulated.network:CanopenDevices",
    "moteus": "moteus.simulated.bus:MoteusDevices",
}
"""Module in the folder of drives and class, by bus; imported when it is asked for."""


def simulated_devices(bus: str) -> Callable[..., SimulatedDevices]:
    """Class of the simulated drives on a bus.

    Raises:
        ConfigError: A package is missing.
    """
    return imported_class(SIMULATED, bus)
