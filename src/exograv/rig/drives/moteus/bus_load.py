"""How full the wire is: bits of the CAN-FD frames of one period, at most, by the bit stuffing that CAN does."""

from exograv.rig.drives.settings import Drives

SLOW_BITS, SLOW_BIT_s, FAST_BIT_s = 57, 1e-6, 0.2e-6
"""A frame with extended number up to the switch of rates, and from its acknowledgement on, a quarter of the former
stuffed; bits at 1 and 5 Mbit/s. Source: ISO 11898-1; mjbots moteus, docs/protocol/can.md."""

FAST_BITS = 32
"""Of a frame beside its data: its size, 21 bits of check with their stuffing."""

QUESTION, ANSWER, COMMAND = 8, 20, 48
"""Bytes, filled up."""


def frame_s(data_bytes: int) -> float:
    """Of one frame at most [s]."""
    return SLOW_BITS * SLOW_BIT_s + (FAST_BITS + 10 * data_bytes) * FAST_BIT_s


def load(drives: Drives) -> float:
    """Share of the wire's time that one period of this machine takes [-]; above 1 it does not fit."""
    each = frame_s(QUESTION) + frame_s(ANSWER) + frame_s(COMMAND)
    return len(drives.each) * each / drives.period_s
