"""Packets of the UDP protocol: `decode` may only refuse them, and what it accepts encodes to the same bytes."""

import random

from exograv.rig.drives.udp.packets import RefusedError, decode, encode, nameplates, refuse_wrong_command
from udp_attack import Attack, sealed

PACKETS = 200


def seeds() -> list[bytes]:
    """Return packets of two ordinary hosts and of an attacker, as benchmarks/udp_fuzz.py sends them."""
    attack = Attack(1000)
    return [attack.next(150 * k)[0] for k in range(PACKETS)]


def mutate(data: bytes, size: int, seed: int, change) -> bytes:
    """Change a packet, in most cases below a right check sum."""
    if len(data) < 8 or random.Random(seed).random() < 0.2:
        return change(data, size)
    return sealed(change(data[:-4], size - 4))


def read(data: bytes) -> None:
    """Decode a packet; an accepted one must have the bytes that we would send.

    Raises:
        AssertionError: The packet was accepted, and its content encodes to other fields.
    """
    try:
        packet = decode(data)
        # Bytes that the layout does not use may differ, and a NaN equals nothing: both texts have the same fields.
        if repr(decode(encode(*packet))) != repr(packet):
            raise AssertionError(f"{packet} is not what was encoded")
        nameplates(packet) if packet.header.kind == 2 else refuse_wrong_command(packet)
    except RefusedError:
        pass
