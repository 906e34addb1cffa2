"""What a controller says of itself is held against `drives.toml` before anything is switched on."""

import math

from exograv.errors import ConfigError
from exograv.rig.drives.settings import Drives

from .packets import Nameplate, Packet, RefusedError, nameplates

SAME = 1e-3
"""Relative: a float of four bytes is the same number as the file's."""


def refuse_other_controller(packet: Packet, drives: Drives) -> None:
    """Joints, currents, brakes, watchdog and period must be those of the file.

    Raises:
        ConfigError: Names the joint, both values and what to do.
    """
    address = drives.settings.udp
    where = "" if address is None else f" at {address.host}:{address.port}"
    try:
        plates = nameplates(packet)
    except RefusedError as error:
        raise ConfigError(f"The controller{where} has a joint whose name is no text. Correct it there.") from error
    if (names := [plate.joint for plate in plates]) != list(drives.joints):
        raise ConfigError(
            f"The controller{where} moves {', '.join(names)}; drives.toml and the machine have "
            f"{', '.join(drives.joints)}. Both need the same joints in the same order: correct the controller, or take "
            "the machine's own file."
        )
    watchdog_us, period_us = packet.own
    _compare("watchdog", 1e-3 * watchdog_us, "watchdog_ms", drives.settings.watchdog_ms, "ms", where)
    _compare("period", 1e-3 * period_us, "period_ms", 1e3 * drives.period_s, "ms", where)
    for plate, drive in zip(plates, drives.each, strict=True):
        _compare_plate(plate, drive.current_rated_A, drive.current_max_A, drive.brake_Nms_per_rad)


def _compare_plate(plate: Nameplate, rated: float, most: float, brake: float) -> None:
    of = f" of joint {plate.joint}"
    _compare("rated current", plate.current_rated_A, "current_rated_A", rated, "A", of)
    _compare("greatest current", plate.current_max_A, "current_max_A", most, "A", of)
    _compare("brake", plate.brake_Nms_per_rad, "brake_Nms_per_rad", brake, "N·m·s/rad", of)


def _compare(what: str, said: float, key: str, stated: float, unit: str, where: str) -> None:
    if not math.isclose(said, stated, rel_tol=SAME):
        raise ConfigError(
            f"The {what}{where} is {said:g} {unit} by the controller, and {key} in drives.toml is {stated:g} {unit}. "
            "Find out which is right by the data sheet and correct the other; nothing was switched on."
        )
