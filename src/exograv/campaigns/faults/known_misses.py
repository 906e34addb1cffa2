"""Criteria of the fault table that are missed, each with its cause. Every other miss fails the campaign.

An entry never removes or widens a budget: its flights still count as missed, and the table shows them. `up_to` follows
from the cause and is not the largest figure of a campaign.
"""

from collections.abc import Mapping
from types import MappingProxyType

from .acceptance import KnownMiss, Measure

_WEIGHT = (
    "A weight that comes or goes moves the arm as its wearer does, and no current changes. A force sensor at the cuff "
    "of the forearm or in the grip would show it."
)
_BALANCED = (
    "A floating arm gets the model's torque in every posture, so the drift monitor sees only the motion that the fault "
    "causes. Friction or the wearer carries a part of it, in a resting harmonic drive all. {} would show it."
)
_FALLING = (
    "The machine carries another weight than the arm's, all signals agree, and the relaxed arm falls or rises as its "
    "wearer could move it. Explained up to the speed that the unbalanced share of the weight gives along the way of "
    "the flight, with the energy of the same flight without the fault. A force sensor at the cuff would show it."
)

_MISSES = (
    KnownMiss(
        "F08",
        Measure.TIME,
        112.0,
        "The guard compares both encoders from 2° on, for 10 ms. An encoder that slips slowly reaches 2° up to 100 ms "
        "after its first motion; the time counts from the first motion.",
    ),
    KnownMiss(
        "F09",
        Measure.TIME,
        None,
        "The current keeps its commanded value, so the wrong torque shows only as acceleration, like a push of the "
        "wearer. A force sensor at the cuff or a torque sensor at the joint would show it.",
    ),
    KnownMiss(
        "F29",
        Measure.POWER,
        40.0,
        "A joint that bounces off turns back faster than its braking torque can fade at 150 N·m/s. A joint that was "
        "too fast gets no torque any more, and the arm's own weight then counts as power.",
    ),
    KnownMiss("F28", Measure.TIME, None, _WEIGHT),
    KnownMiss("F28", Measure.DRIFT, None, _WEIGHT),
    KnownMiss("F50", Measure.HAND, None, _WEIGHT),
    KnownMiss("F51", Measure.HAND, None, _WEIGHT),
    KnownMiss(
        "F45",
        Measure.TIME,
        None,
        _BALANCED.format("The tilt changes the weight of a joint by at most a sixth. An inertial sensor at the base"),
    ),
    KnownMiss(
        "F46",
        Measure.TIME,
        None,
        _BALANCED.format("The current keeps its commanded value. A torque sensor at the joint"),
    ),
    KnownMiss(
        "F48",
        Measure.TIME,
        None,
        _BALANCED.format("The other arm's torque stays within the bounds of its file. A weighing before the session"),
    ),
    KnownMiss(
        "F49",
        Measure.TIME,
        None,
        _BALANCED.format(
            "The loops of the model still close, and a small residual takes longer than 5 s. A force sensor at the cuff"
        ),
    ),
    KnownMiss("F48", Measure.HAND, None, _FALLING, by_fall=True),
    KnownMiss(
        "F17",
        Measure.TIME,
        30.0,
        "Only the guard's process has the drives. After its end each drive brakes by its own watchdog, 20 ms after the "
        "last command has expired.",
    ),
)

KNOWN_MISSES: Mapping[tuple[str, Measure], KnownMiss] = MappingProxyType(
    {(miss.fault, miss.measure): miss for miss in _MISSES}
)
"""Requirements that are known to be missed, by fault and measure, each with its cause."""
