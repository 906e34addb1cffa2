"""Driver of a laboratory's own real-time controller over UDP: `docs/udp_protocol.md`."""

from .host import UdpRig as UdpRig
