"""A laboratory's own real-time controller, spoken to by datagrams: `docs/udp_protocol.md`."""

from .host import UdpRig as UdpRig
