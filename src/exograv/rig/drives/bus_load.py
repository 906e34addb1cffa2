"""How full the wire of a CAN bus is: frames of one period at most, with all the stuffing bits that CAN can add."""

from exograv.errors import ConfigError

from .settings import Drives

OVERHEAD, STUFFED_OVERHEAD = 47, 34
"""Bits of a frame with eleven-bit number beside its data, with the three behind it; those among them that can be
stuffed, one for each four. Source: ISO 11898-1."""

SLOW_BITS, SLOW_BIT_s, FAST_BIT_s = 57, 1e-6, 0.2e-6
"""A CAN-FD frame with extended number up to the switch of rates, and from its acknowledgement on, a quarter of the
former stuffed; bits at 1 and 5 Mbit/s. Source: ISO 11898-1; mjbots moteus, docs/protocol/can.md."""

FAST_BITS = 32
"""Of a CAN-FD frame beside its data: its size, 21 bits of check with their stuffing."""


def frame_bits(data_bytes: int) -> int:
    """Bits of one CAN frame at most."""
    return OVERHEAD + 8 * data_bytes + (STUFFED_OVERHEAD + 8 * data_bytes - 1) // 4


def fd_frame_s(data_bytes: int) -> float:
    """Time of one CAN-FD frame at most [s]."""
    return SLOW_BITS * SLOW_BIT_s + (FAST_BITS + 10 * data_bytes) * FAST_BIT_s


def refuse_overload(drives: Drives, load: float) -> None:
    """Refuse frames that take more of a period than there is.

    Raises:
        ConfigError: `load`, the share of the wire's time that one period takes [-], is above 1.
    """
    if load > 1.0:
        raise ConfigError(
            f"{len(drives.each)} drives at period_ms = {drives.settings.period_ms} need {load:.0%} of the CAN bus: it "
            "would fall behind for ever. Set period_ms to the next of 1, 2, 4, or use a higher bit rate."
        )
