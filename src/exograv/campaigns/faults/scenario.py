"""A scenario from its seed: who, where, which faults and when; and the verdict over its course."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from exograv.model.support import sample_postures
from exograv.safety.guard import SafeState

from .driver_faults import ALL, ONLY_DRIVES, injector_of
from .fault_plant import FaultParticipant, FlightStart, PlantSource, TwinPlants
from .fault_table import FAULTS, Fault
from .flight import FaultFlight
from .oracle import ROUNDING_NM
from .scenario_log import ScenarioLog

POSTURES = 64
ONSET_MS = (300, 700)
AFTER_MS = 1300
"""From the last onset on: the hand is fastest within the first second of a descent."""

DOUBLE_SHARE, SWARM_SHARE = 0.2, 0.1
"""Of the scenarios with two faults, and with three to five."""

MOVES_SHARE, MOVES_NM = 0.6, 6.0
"""Share of the people who move by themselves, and how much they push at most [N·m]."""

HAND_MAX_M_S = 1.0
"""After a fault of a relaxed arm."""

SPIKE_STEP_NM = 0.15
"""What one tick may change, up to rounding [N·m]."""


@dataclass(frozen=True)
class Scenario:
    """What its number says."""

    campaign: int
    number: int
    faults: tuple[str, ...]
    """Identifiers."""

    options: str = ""
    """Of the campaign, where they are not the usual ones: without them its number means another flight."""

    @classmethod
    def drawn(cls, campaign: int, number: int, options: str = "") -> "Scenario":
        """Singles go through the whole table in turn; doubles and swarms are drawn."""
        generator, names = np.random.default_rng([campaign, number, 0]), list(FAULTS)
        kind = generator.random()
        if kind < SWARM_SHARE:
            chosen = generator.choice(len(names), generator.integers(3, 6), replace=False).tolist()
        elif kind < SWARM_SHARE + DOUBLE_SHARE:
            chosen = generator.choice(len(names), 2, replace=False).tolist()
        else:
            chosen = [number % len(names)]
        return cls(campaign, number, tuple(names[k] for k in chosen), options)

    @property
    def command(self) -> str:
        """Which replays it."""
        return f"exograv faults --seed {self.campaign}{self.options} --replay '{self.number}:{'+'.join(self.faults)}'"


@dataclass(frozen=True)
class ScenarioVerdict:
    """Of one scenario."""

    scenario: Scenario
    course: ScenarioLog
    false_trip: bool
    """The guard stopped before anything was wrong."""

    found: dict[str, float | None]
    """By fault: after how many milliseconds its safe state was there; None where it was not found."""

    missed: tuple[str, ...]
    """Faults whose budget was missed, or that led to the wrong state."""

    quiet_s: float
    """Time before the first fault [s]."""

    relaxed: bool


THE_TWIN = TwinPlants()


def fly(participant: FaultParticipant, scenario: Scenario, ground: PlantSource = THE_TWIN) -> ScenarioVerdict:
    """Run it."""
    generator = np.random.default_rng([scenario.campaign, scenario.number, 1])
    joints = len(participant.limits.torque_max_Nm)
    postures = sample_postures(participant.laboratory.description, POSTURES)[1:]
    posture = postures[int(generator.integers(len(postures)))]
    moves = np.zeros(joints)
    relaxed = bool(generator.random() >= MOVES_SHARE)
    push = generator.uniform(-MOVES_NM, MOVES_NM, joints)
    # Every number is drawn whatever it is for, so that a scenario shrunk to fewer faults has the same beginning.
    onsets = {name: int(generator.integers(*ONSET_MS)) // ground.period_ms for name in FAULTS}
    seeds = {name: int(seed) for name, seed in zip(FAULTS, generator.integers(2**32, size=len(FAULTS)), strict=True)}
    if not relaxed:
        moves = push
    extra = np.random.default_rng([scenario.campaign, scenario.number, 2])
    onsets |= {name: int(extra.integers(*ONSET_MS)) // ground.period_ms for name in ONLY_DRIVES}
    seeds |= {name: int(extra.integers(2**32)) for name in ONLY_DRIVES}
    faults = {
        name: injector_of(name, ground.bus)(np.random.default_rng(seeds[name]), joints, onsets[name], ground.period_ms)
        for name in scenario.faults
    }
    last = max((fault.onset for fault in faults.values()), default=0)
    with ground.stand(participant, FlightStart(int(generator.integers(2**31)), posture, moves)) as stand:
        flight = FaultFlight(participant, stand, posture, list(faults.values()))
        course = flight.fly(last + AFTER_MS // ground.period_ms)
    noise, watch = participant.laboratory.machine.sensors.current_noise, flight.watch
    begins: dict[str, float] = {}
    for name, injector in faults.items():
        shows = injector.shows(watch.told, noise)
        if ALL[name].shows_in_motion:
            shows = shows & watch.moves[:, injector.joint]
        begins[name] = _begin(course, ALL[name], shows)
    return _verdict(scenario, course, {name: fault.onset for name, fault in faults.items()}, begins, relaxed)


def _begin(course: ScenarioLog, fault: Fault, shows: Bool[np.ndarray, " tick"]) -> float:
    """Tick from which on the time runs to find a fault; infinite where it never showed for long enough.

    What stops and shows again begins anew: its time runs from the beginning of the last stretch before the stop, or of
    the first one that was long enough to find it in.
    """
    ticks, budget = len(shows), _budget(fault) / course.period_ms
    edges = np.flatnonzero(np.diff(shows.astype(int), prepend=0, append=0)).reshape(-1, 2)
    for begin, end in edges.tolist():
        is_last = end == ticks or (course.stopped_tick is not None and course.stopped_tick <= end + budget)
        if is_last or end - begin > budget:
            return float(begin)
    return np.inf


def _budget(fault: Fault) -> float:
    return fault.budget_ms or 0.0


def _verdict(
    scenario: Scenario, course: ScenarioLog, onsets: dict[str, int], begins: dict[str, float], relaxed: bool
) -> ScenarioVerdict:
    first = min(onsets.values(), default=course.ticks)
    false_trip = course.stopped_tick is not None and course.stopped_tick < first
    found: dict[str, float | None] = {}
    missed: tuple[str, ...] = ()
    if false_trip or course.crashed:
        pass
    elif len(onsets) == 1:
        name = scenario.faults[0]
        found[name] = _found(course, ALL[name], begins[name])
        missed = (name,) if _is_missed(course, ALL[name], found[name], begins[name], relaxed) else ()
    elif len(onsets) == 2:
        missed = scenario.faults if _is_pair_missed(course, begins) else ()
    return ScenarioVerdict(scenario, course, false_trip, found, missed, 1e-3 * course.period_ms * first, relaxed)


def _found(course: ScenarioLog, fault: Fault, begin: float) -> float | None:
    """After how many milliseconds the safe state was there, by the right reason; None where it was not."""
    if fault.at_drive:
        tick = course.braked_tick
    else:
        tick = course.since.get(fault.safe_state) if course.reason in fault.reasons else None
    return None if tick is None else course.period_ms * max(tick - begin, 0.0)


def _is_missed(course: ScenarioLog, fault: Fault, found: float | None, begin: float, relaxed: bool) -> bool:
    if fault.is_borne:
        too_far = fault.id == "F03 spike" and relaxed and course.torque_step_Nm > SPIKE_STEP_NM + ROUNDING_NM
        return too_far or (fault.safe_state is SafeState.BRIDGE and course.worst > SafeState.BRIDGE)
    if found is None:
        return begin + _budget(fault) / course.period_ms < course.ticks
    return found > _budget(fault)


def _is_pair_missed(course: ScenarioLog, begins: dict[str, float]) -> bool:
    """Whether nothing protected the person within both budgets together, from the first that could be found on.

    One of the two may hide the other, or the state for it; then what is asked for is the lesser of both.
    """
    to_find = {name: begin for name, begin in begins.items() if not ALL[name].is_borne}
    until = min(to_find.values(), default=np.inf) + sum(_budget(ALL[name]) for name in begins) / course.period_ms
    if until >= course.ticks:
        return False
    least = min(ALL[name].safe_state for name in to_find)
    if all(ALL[name].at_drive for name in to_find):
        ticks = [course.braked_tick]
    else:
        ticks = [course.since.get(max(least, SafeState.DESCENT)), course.braked_tick]
    return min((tick for tick in ticks if tick is not None), default=np.inf) > until


def shrunk(participant: FaultParticipant, verdict: ScenarioVerdict, ground: PlantSource = THE_TWIN) -> Scenario:
    """The same scenario with as few faults as still go wrong."""
    scenario = verdict.scenario
    for name in list(scenario.faults):
        fewer = tuple(other for other in scenario.faults if other != name)
        if fewer and is_bad(fly(participant, replace(scenario, faults=fewer), ground)):
            scenario = replace(scenario, faults=fewer)
    return scenario


def is_bad(verdict: ScenarioVerdict) -> bool:
    """Whether anything happened that must never happen."""
    return bool(verdict.course.violated_ticks or verdict.missed or verdict.course.crashed or verdict.false_trip)


def names_of(text: str) -> Sequence[str]:
    """Identifiers in the form of a replay line."""
    return text.split("+")
