"""Driver of a laboratory's own real-time controller over UDP: `docs/reference/udp_protocol.md`."""

from .host import UdpRig as UdpRig
