"""Free addresses on this computer for several simulated machines at once."""

import socket


def free_port() -> int:
    """Return a UDP port on which no process listens now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("", 0))
        return int(one.getsockname()[1])
