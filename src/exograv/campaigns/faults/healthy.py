"""Healthy use without a fault: hours in which every stop of the guard is a false trip."""

from typing import Literal, NamedTuple

import numpy as np

from exograv.model.support import sample_postures

from .fault_plant import FaultParticipant, FlightStart, PlantSource, TwinPlants
from .flight import KEPT_TICKS, SEGMENT_TICKS, FaultFlight
from .scenario import MOVES_NM, POSTURES, THE_TWIN, Scenario, ScenarioVerdict

Kind = Literal["quiet", "lively", "tremor"]
KINDS: tuple[Kind, ...] = ("quiet", "lively", "tremor")

CYCLE, SHORT_MIN, LONG_MIN = 21, 3, 60
"""Number of flights in a cycle, duration of all but the last, and of the last [min]. A cycle has two hours; slow faults
of the guard need the long flights."""

CYCLE_H = ((CYCLE - 1) * SHORT_MIN + LONG_MIN) / 60.0

WITHOUT_TRUTH = TwinPlants(keeps_truth=False)

TREMOR_HZ, TREMOR_NM = 5.0, 6.0
"""Frequency and largest amplitude of a tremor at one joint [Hz, N·m]."""


class HealthyUse(NamedTuple):
    """Use of the machine in one flight."""

    kind: Kind
    minutes: int

    @classmethod
    def of(cls, number: int) -> "HealthyUse":
        """Use in the flight of this number. All kinds of use have long and short flights."""
        cycle, place = divmod(number, CYCLE)
        return cls(KINDS[(cycle + place) % len(KINDS)], LONG_MIN if place == CYCLE - 1 else SHORT_MIN)


def flights_of(hours: float) -> int:
    """Return the number of flights that last this long together, in whole cycles."""
    return CYCLE * max(int(np.ceil(hours / CYCLE_H)), 1)


def rate_bound_per_hour(trips: int, hours: float) -> float:
    """Upper 95 % bound of a rate, for a number of Poisson events in some hours [1/h]."""
    from scipy.special import gammaincinv  # imported here: the import takes 0.1 s

    return float(gammaincinv(trips + 1, 0.95)) / hours


def fly_healthy(participant: FaultParticipant, scenario: Scenario, ground: PlantSource = THE_TWIN) -> ScenarioVerdict:
    """Fly without a fault, up to the first stop or to the end."""
    use, start = start_of(participant, scenario)
    ticks = 60_000 * use.minutes // ground.period_ms
    if isinstance(ground, TwinPlants):
        ground = WITHOUT_TRUTH
    with ground.stand(participant, start) as stand:
        flight = FaultFlight(participant, stand, start.posture, ())
        course = flight.watch.course
        while course.ticks < ticks and course.stopped_tick is None and course.crashed is None:
            flight.fly_segment(min(SEGMENT_TICKS, ticks - course.ticks), KEPT_TICKS)
            stand.forget()
    quiet_s, is_stopped = 1e-3 * course.period_ms * course.ticks, course.stopped_tick is not None
    return ScenarioVerdict(scenario, course, is_stopped, {}, (), quiet_s, use.kind == "quiet")


def start_of(participant: FaultParticipant, scenario: Scenario) -> tuple[HealthyUse, FlightStart]:
    """Draw the use of the machine in a flight, and its start."""
    use, generator = HealthyUse.of(scenario.number), np.random.default_rng([scenario.campaign, scenario.number, 5])
    joints = len(participant.limits.torque_max_Nm)
    postures = sample_postures(participant.laboratory.description, POSTURES)[1:]
    posture = postures[int(generator.integers(len(postures)))]
    start = FlightStart(int(generator.integers(2**31)), posture, np.zeros(joints))
    if use.kind == "lively":
        start = start._replace(moves=generator.uniform(-MOVES_NM, MOVES_NM, joints))
    elif use.kind == "tremor":
        trembling = np.where(np.arange(joints) == generator.integers(joints), TREMOR_NM, 0.0)
        start = start._replace(moves=trembling, hz=TREMOR_HZ)
    return use, start
