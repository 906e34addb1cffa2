"""Load of a CAN bus: the longest possible frames of one period, with all stuffing bits that CAN can add."""

from exograv.errors import ConfigError

from .settings import Drives

OVERHEAD, STUFFED_OVERHEAD = 47, 34
"""Bits of a frame with eleven-bit number beside its data, and those among them that can be stuffed, one in four.

The three bits behind the frame are included. Source: ISO 11898-1.
"""

SLOW_BITS, SLOW_BIT_s, FAST_BIT_s = 57, 1e-6, 0.2e-6
"""Bits of a CAN-FD frame at the slow rate, and durations of a bit at 1 and 5 Mbit/s [s].

The slow bits lie before the switch of rates and from the acknowledgement on, in a frame with extended number; a quarter
of those before the switch is added for stuffing. Source: ISO 11898-1; mjbots moteus, docs/protocol/can.md.
"""

FAST_BITS = 32
"""Fast bits of a CAN-FD frame beside its data: its size, and 21 bits of check sum with their stuffing."""


def frame_bits(data_bytes: int) -> int:
    """Largest number of bits of one CAN frame."""
    return OVERHEAD + 8 * data_bytes + (STUFFED_OVERHEAD + 8 * data_bytes - 1) // 4


def fd_frame_s(data_bytes: int) -> float:
    """Longest duration of one CAN-FD frame [s]."""
    return SLOW_BITS * SLOW_BIT_s + (FAST_BITS + 10 * data_bytes) * FAST_BIT_s


def refuse_overload(drives: Drives, load: float) -> None:
    """Refuse frames that need more time than a period has.

    Raises:
        ConfigError: `load`, the share of the wire's time that one period needs [-], is above 1.
    """
    if load > 1.0:
        raise ConfigError(
            f"{len(drives.each)} drives at period_ms = {drives.settings.period_ms} need {load:.0%} of the CAN bus; "
            "at most 100 % is possible. Set period_ms to the next of 1, 2, 4, or use a higher bit rate."
        )
