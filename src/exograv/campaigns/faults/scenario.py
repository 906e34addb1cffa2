"""Scenario from its seed: participant, posture, faults and onsets; and the verdict on its log."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from exograv.model.support import sample_postures

from .acceptance import HAND_MAX_M_S, Measure
from .driver_faults import ALL, ONLY_DRIVES, injector_of
from .fault_plant import FaultParticipant, FaultPlant, FlightStart, PlantSource, TruthSample, TwinPlants
from .fault_table import AFTER_MS, EARLIER, FAULTS, LATER
from .flight import FaultFlight
from .injector import Injector
from .judging import Misses, detection_begin, detection_ms, misses_of_group, misses_of_one
from .scenario_log import ScenarioLog

POSTURES = 64
ONSET_MS = (300, 700)
DOUBLE_SHARE, SWARM_SHARE = 0.2, 0.1
"""Shares of scenarios with two faults, and with three to five."""

LATER_EVERY = 5
"""Period of scenarios with a row of `LATER` [-]. It shares no factor with the usual number of participants, so that
each row meets each of them."""

AGAINST_HEALTHY = {Measure.SPEED, Measure.WAY, Measure.DRIFT}
"""Measures that compare a flight with the same flight without the fault."""

MOVES_SHARE, MOVES_NM = 0.6, 6.0
"""Share of wearers who push against the machine [-], and the amplitude of their push [N·m]."""


@dataclass(frozen=True)
class Scenario:
    """Scenario of a campaign, determined by its number."""

    campaign: int
    number: int
    faults: tuple[str, ...]
    """Identifiers of the faults."""

    options: str = ""
    """Options of the campaign that differ from the defaults. Without them the same number is another flight."""

    @classmethod
    def drawn(cls, campaign: int, number: int, options: str = "") -> "Scenario":
        """Draw a scenario. Single faults take the table's rows in turn; pairs and larger sets are drawn at random.

        Every `LATER_EVERY`-th scenario has a row of `LATER`, so that the other numbers keep their faults.
        """
        cycle, place = divmod(number, LATER_EVERY)
        is_later = place == LATER_EVERY - 1
        generator = np.random.default_rng([campaign, number, 3 if is_later else 0])
        names, kind = list(FAULTS if is_later else EARLIER), generator.random()
        count = 1
        if kind < SWARM_SHARE:
            count = int(generator.integers(3, 6))
        elif kind < SWARM_SHARE + DOUBLE_SHARE:
            count = 2
        own = list(LATER)[cycle % len(LATER)] if is_later else names[number % len(names)]
        if count == 1:
            return cls(campaign, number, (own,), options)
        if not is_later:
            return cls(campaign, number, tuple(names[k] for k in _some(generator, len(names), count)), options)
        others = [name for name in names if name != own]
        return cls(campaign, number, (own, *(others[k] for k in _some(generator, len(others), count - 1))), options)

    @property
    def command(self) -> str:
        """Command line that replays the scenario."""
        replay = f"{self.number}:{'+'.join(self.faults)}"
        return f"exograv dev faults --seed {self.campaign}{self.options} --replay '{replay}'"


@dataclass(frozen=True)
class ScenarioVerdict:
    """Verdict on one scenario."""

    scenario: Scenario
    course: ScenarioLog
    false_trip: bool
    """True if the guard stopped before the first fault."""

    found: dict[str, float | None]
    """Time until the safe state was reached, by fault [ms]; None if the fault was not detected."""

    missed: tuple[str, ...]
    """Faults with a missed criterion: budget, safe state or limit."""

    quiet_s: float
    """Time before the first fault [s]."""

    relaxed: bool
    unexplained: tuple[str, ...] = ()
    """Faults with a miss that has no known cause."""

    figures: Mapping[str, float | None] = field(default_factory=dict)
    """Missed figures of a single fault by the name of their measure; None for a fault that was not found in time."""


THE_TWIN = TwinPlants()


def _some(generator: np.random.Generator, size: int, count: int) -> list[int]:
    """Draw different numbers below `size`."""
    return generator.choice(size, count, replace=False).tolist()


def fly(participant: FaultParticipant, scenario: Scenario, ground: PlantSource = THE_TWIN) -> ScenarioVerdict:
    """Fly a scenario and judge it."""
    generator = np.random.default_rng([scenario.campaign, scenario.number, 1])
    joints = len(participant.limits.torque_max_Nm)
    postures = sample_postures(participant.laboratory.description, POSTURES)[1:]
    posture = postures[int(generator.integers(len(postures)))]
    moves = np.zeros(joints)
    relaxed = bool(generator.random() >= MOVES_SHARE)
    push = generator.uniform(-MOVES_NM, MOVES_NM, joints)
    # All numbers are drawn in any case, so that a scenario shrunk to fewer faults has the same beginning.
    onsets = {name: int(generator.integers(*ONSET_MS)) // ground.period_ms for name in EARLIER}
    drawn = generator.integers(2**32, size=len(EARLIER))
    seeds = {name: int(seed) for name, seed in zip(EARLIER, drawn, strict=True)}
    if not relaxed:
        moves = push
    for more, stream in ((ONLY_DRIVES, 2), (LATER, 4)):
        extra = np.random.default_rng([scenario.campaign, scenario.number, stream])
        onsets |= {name: int(extra.integers(*ONSET_MS)) // ground.period_ms for name in more}
        seeds |= {name: int(extra.integers(2**32)) for name in more}
    faults: dict[str, Injector] = {}
    own = participant
    for name in scenario.faults:
        injector = injector_of(name, ground.bus)
        onset = 0 if injector.begins_at_once else onsets[name]
        faults[name] = injector(np.random.default_rng(seeds[name]), joints, onset, ground.period_ms)
        participant = faults[name].known(participant)
    ends = [fault.onset + ALL[name].after_ms // ground.period_ms for name, fault in faults.items()]
    ticks = max(ends, default=AFTER_MS // ground.period_ms)
    start = FlightStart(int(generator.integers(2**31)), posture, moves)
    healthy: Sequence[TruthSample] = ()
    if relaxed and any(AGAINST_HEALTHY & set(ALL[name].limits) for name in scenario.faults):
        with ground.stand(participant, start) as stand:
            FaultFlight(participant, stand, posture, ()).fly(ticks)
            healthy = stand.sights()
    with ground.stand(participant, start) as stand:
        flight = FaultFlight(participant, stand, posture, list(faults.values()))
        course = flight.fly(ticks, healthy)
    if len(faults) == 1:
        (fault,) = faults.values()
        course.unbalanced = fault.unbalanced
        if relaxed and fault.unbalanced and course.flight_hand_m_s > HAND_MAX_M_S:
            with ground.stand(own, start) as stand:
                course.healthy_hand_m_s = _healthy_hand_m_s(own, stand, posture, range(fault.onset, course.ticks))
    noise, watch = participant.laboratory.machine.sensors.current_noise, flight.watch
    begins: dict[str, float] = {}
    for name, injector in faults.items():
        begins[name] = detection_begin(course, ALL[name], injector.shows(watch.told, watch.moves, noise))
    return _verdict(scenario, course, {name: fault.onset for name, fault in faults.items()}, begins, relaxed)


def _healthy_hand_m_s(participant: FaultParticipant, stand: FaultPlant, posture: np.ndarray, ticks: range) -> float:
    """Fly the same flight without faults; return its fastest hand in these ticks [m/s]."""
    FaultFlight(participant, stand, posture, ()).fly(ticks.stop)
    return max((sight.hand_m_s for sight in stand.sights()[ticks.start : ticks.stop]), default=0.0)


def _verdict(
    scenario: Scenario, course: ScenarioLog, onsets: dict[str, int], begins: dict[str, float], relaxed: bool
) -> ScenarioVerdict:
    first = min(onsets.values(), default=course.ticks)
    false_trip = course.stopped_tick is not None and course.stopped_tick < first
    found: dict[str, float | None] = {}
    misses = Misses()
    if false_trip or course.crashed:
        pass
    elif len(onsets) == 1:
        name = scenario.faults[0]
        found[name] = detection_ms(course, ALL[name], begins[name])
        misses = misses_of_one(course, ALL[name], begins[name], relaxed)
    elif onsets:
        misses = misses_of_group(course, begins)
    quiet_s = 1e-3 * course.period_ms * first
    return ScenarioVerdict(
        scenario, course, false_trip, found, misses.missed, quiet_s, relaxed, misses.unexplained, misses.figures
    )


def shrunk(participant: FaultParticipant, verdict: ScenarioVerdict, ground: PlantSource = THE_TWIN) -> Scenario:
    """Return the same scenario with as few faults as still fail."""
    scenario = verdict.scenario
    for name in list(scenario.faults):
        fewer = tuple(other for other in scenario.faults if other != name)
        if fewer and is_bad(fly(participant, replace(scenario, faults=fewer), ground)):
            scenario = replace(scenario, faults=fewer)
    return scenario


def is_bad(verdict: ScenarioVerdict) -> bool:
    """Return True for a violation of the envelope, a miss without a known cause, a crash or a false trip."""
    return bool(verdict.course.violated_ticks or verdict.unexplained or verdict.course.crashed or verdict.false_trip)


def names_of(text: str) -> Sequence[str]:
    """Split the fault identifiers of a replay line."""
    return text.split("+") if text else []
