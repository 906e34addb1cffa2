"""Where simulated drives are reached on this computer when several machines are simulated at once."""

import socket


def free_port() -> int:
    """Of UDP, that nobody listens on now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("", 0))
        return int(one.getsockname()[1])
