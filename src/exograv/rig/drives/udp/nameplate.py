"""Comparison of a controller's nameplate with `drives.toml`, before a motor is switched on."""

from exograv.errors import ConfigError
from exograv.rig.drives.nameplate import refuse_other_value
from exograv.rig.drives.settings import Drives

from .packets import Nameplate, Packet, RefusedError, nameplates

PLATE = (
    ("rated current", "current_rated_A", "A"),
    ("greatest current", "current_max_A", "A"),
    ("brake", "brake_Nms_per_rad", "N·m·s/rad"),
)
"""Quantity of each drive, its key, and its unit."""


def agreed_nameplates(packet: Packet, drives: Drives) -> list[Nameplate]:
    """Return the nameplates of a controller whose joints, currents, brakes, watchdog and period equal the file's.

    Raises:
        ConfigError: A value differs. The message names the joint, both values and the next step.
    """
    address = drives.settings.udp
    where = "" if address is None else f" at {address.host}:{address.port}"
    try:
        plates = nameplates(packet)
    except RefusedError as error:
        raise ConfigError(
            f"The controller{where} has a joint whose name is not valid UTF-8. Correct it there."
        ) from error
    if (names := [plate.joint for plate in plates]) != list(drives.joints):
        raise ConfigError(
            f"The controller{where} moves {', '.join(names)}; drives.toml and the machine have "
            f"{', '.join(drives.joints)}. Both need the same joints in the same order: correct the controller, or give "
            "the file of this machine."
        )
    watchdog_us, period_us = packet.own
    refuse_other_value(f"watchdog{where}", 1e-3 * watchdog_us, "watchdog_ms", drives.settings.watchdog_ms, "ms")
    refuse_other_value(f"period{where}", 1e-3 * period_us, "period_ms", 1e3 * drives.period_s, "ms")
    for plate, drive in zip(plates, drives.each, strict=True):
        for what, key, unit in PLATE:
            said, stated = getattr(plate, key), getattr(drive, key)
            refuse_other_value(f"{what} of joint {plate.joint}", said, key, stated, unit)
    return plates
