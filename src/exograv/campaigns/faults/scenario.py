"""Scenario from its seed: participant, posture, faults and onsets; and the verdict on its log."""

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
"""Time flown after the last onset [ms]. The hand is fastest within the first second of a descent."""

DOUBLE_SHARE, SWARM_SHARE = 0.2, 0.1
"""Shares of scenarios with two faults, and with three to five."""

MOVES_SHARE, MOVES_NM = 0.6, 6.0
"""Share of wearers who push against the machine [-], and the amplitude of their push [N·m]."""

HAND_MAX_M_S = 1.0
"""Largest hand speed allowed after a fault with a relaxed arm [m/s]."""

SPIKE_STEP_NM = 0.15
"""Largest change of a command per tick, up to rounding [N·m]."""


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
        """Draw a scenario. Single faults take the table's rows in turn; pairs and larger sets are drawn at random."""
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
    """Faults with a missed budget or a wrong safe state."""

    quiet_s: float
    """Time before the first fault [s]."""

    relaxed: bool


THE_TWIN = TwinPlants()


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
    """Tick from which the detection time counts; infinite if the fault never showed for long enough.

    A fault that stops showing and shows again starts anew. Its time counts from the beginning of the last stretch
    before the stop, or of the first stretch that was long enough for a detection.
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
    """Time until the safe state was reached for a permitted reason [ms]; None if it was not reached."""
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
    """Return True if no safe state was reached within the sum of both budgets after the first detectable fault.

    One fault may hide the other or the other's safe state, so the weaker of both safe states is required.
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
    """Return the same scenario with as few faults as still fail."""
    scenario = verdict.scenario
    for name in list(scenario.faults):
        fewer = tuple(other for other in scenario.faults if other != name)
        if fewer and is_bad(fly(participant, replace(scenario, faults=fewer), ground)):
            scenario = replace(scenario, faults=fewer)
    return scenario


def is_bad(verdict: ScenarioVerdict) -> bool:
    """Return True for a violation of the envelope, a missed budget, a crash or a false trip."""
    return bool(verdict.course.violated_ticks or verdict.missed or verdict.course.crashed or verdict.false_trip)


def names_of(text: str) -> Sequence[str]:
    """Split the fault identifiers of a replay line."""
    return text.split("+")
