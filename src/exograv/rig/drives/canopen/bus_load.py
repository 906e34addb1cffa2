"""How full the wire is: bits of the frames of one period, at most, by the bit stuffing that CAN does."""

from exograv.rig.drives.settings import Drives

from . import objects as at

BITRATE = 1_000_000
"""Where nobody says another, as CiA 301's greatest [bit/s]."""

OVERHEAD, STUFFED_OVERHEAD = 47, 34
"""Bits of a frame with eleven-bit number beside its data, with the three behind it; those among them that can be
stuffed, one for each four. Source: ISO 11898-1."""


def frame_bits(data_bytes: int) -> int:
    """Of one frame at most."""
    return OVERHEAD + 8 * data_bytes + (STUFFED_OVERHEAD + 8 * data_bytes - 1) // 4


def answer_bits(drives: Drives) -> int:
    """From the SYNC to the last drive's answer."""
    measured = frame_bits(at.layout(at.MEASURED).size)
    motor = 0 if drives.rad_per_motor_count is None else frame_bits(at.layout(at.MOTOR).size)
    return frame_bits(0) + len(drives.each) * (measured + motor)


def load(drives: Drives) -> float:
    """Share of the wire's time that one period of this machine takes [-]; above 1 it does not fit."""
    command = frame_bits(at.layout((*at.COMMAND, at.DAMPING)).size)
    slow = frame_bits(at.layout(at.SLOW).size) / at.SLOW_SYNCS
    bits = answer_bits(drives) + len(drives.each) * (command + slow)
    # Our heartbeat with every second command, and each drive's once in a watchdog's time.
    beats = frame_bits(1) * (0.5 + len(drives.each) * drives.period_s / drives.watchdog_s)
    bus = drives.settings.canopen
    bitrate = BITRATE if bus is None or bus.bitrate is None else bus.bitrate
    return (bits + beats) / (bitrate * drives.period_s)
