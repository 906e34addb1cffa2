"""A scenario from its seed: who, where, which faults and when; and the verdict over its course."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exograv.model.support import sample_postures
from exograv.safety.envelope import StopReason
from exograv.safety.guard import SafeState
from exograv.safety.monitors import TORQUE_OFF_NM

from .flight import Course, Flight, Subject
from .injectors import Injector
from .table import FAULTS, Fault

POSTURES = 64
ONSET_TICKS = (300, 700)
AFTER_TICKS = 1300
"""From the last onset on: the hand is fastest within the first second of a descent."""

DOUBLE_SHARE, SWARM_SHARE = 0.2, 0.1
"""Of the scenarios with two faults, and with three to five."""

MOVES_SHARE, MOVES_NM = 0.6, 6.0
"""Share of the people who move by themselves, and how much they push at most [N·m]."""

HAND_MAX_M_S = 1.0
"""After a fault of a relaxed arm."""

SPIKE_STEP_NM = 0.15

WEAKEST_LOSS = 0.7
"""Share of its torque that the strongest of the weak motors loses [-]."""


@dataclass(frozen=True)
class Scenario:
    """What its number says."""

    campaign: int
    number: int
    faults: tuple[str, ...]
    """Identifiers."""

    @classmethod
    def drawn(cls, campaign: int, number: int) -> "Scenario":
        """Singles go through the whole table in turn; doubles and swarms are drawn."""
        generator, names = np.random.default_rng([campaign, number, 0]), list(FAULTS)
        kind = generator.random()
        if kind < SWARM_SHARE:
            chosen = generator.choice(len(names), generator.integers(3, 6), replace=False).tolist()
        elif kind < SWARM_SHARE + DOUBLE_SHARE:
            chosen = generator.choice(len(names), 2, replace=False).tolist()
        else:
            chosen = [number % len(names)]
        return cls(campaign, number, tuple(names[k] for k in chosen))

    @property
    def command(self) -> str:
        """Which replays it."""
        return f"exograv faults --seed {self.campaign} --replay '{self.number}:{'+'.join(self.faults)}'"


@dataclass(frozen=True)
class Verdict:
    """Of one scenario."""

    scenario: Scenario
    course: Course
    false_trip: bool
    """The guard stopped before anything was wrong."""

    found: dict[str, float | None]
    """By fault: after how many milliseconds its safe state was there; None where it was not found."""

    missed: tuple[str, ...]
    """Faults whose budget was missed, or that led to the wrong state."""

    quiet_s: float
    """Time before the first fault [s]."""

    relaxed: bool


def fly(subject: Subject, scenario: Scenario) -> Verdict:
    """Run it."""
    generator = np.random.default_rng([scenario.campaign, scenario.number, 1])
    joints = len(subject.limits.torque_max_Nm)
    postures = sample_postures(subject.laboratory.description, POSTURES)[1:]
    posture = postures[int(generator.integers(len(postures)))]
    moves = np.zeros(joints)
    relaxed = bool(generator.random() >= MOVES_SHARE)
    push = generator.uniform(-MOVES_NM, MOVES_NM, joints)
    # Every number is drawn whatever it is for, so that a scenario shrunk to fewer faults has the same beginning.
    onsets = {name: int(generator.integers(*ONSET_TICKS)) for name in FAULTS}
    seeds = {name: int(seed) for name, seed in zip(FAULTS, generator.integers(2**32, size=len(FAULTS)), strict=True)}
    if not relaxed:
        moves = push
    faults = {
        name: FAULTS[name].injector(np.random.default_rng(seeds[name]), joints, onsets[name])
        for name in scenario.faults
    }
    flight = Flight(subject, int(generator.integers(2**31)), posture, list(faults.values()), moves)
    last = max((fault.onset for fault in faults.values()), default=0)
    course = flight.fly(last + AFTER_TICKS)
    return _verdict(scenario, course, faults, relaxed)


def _verdict(scenario: Scenario, course: Course, faults: dict[str, Injector], relaxed: bool) -> Verdict:
    first = min((fault.onset for fault in faults.values()), default=course.ticks)
    false_trip = course.stopped_tick is not None and course.stopped_tick < first
    found: dict[str, float | None] = {}
    missed: list[str] = []
    if len(faults) == 1 and not false_trip:
        (name, injector), fault = next(iter(faults.items())), FAULTS[next(iter(faults))]
        begin = injector.onset
        if fault.shows_in_motion:
            begin = course.moving_since.get(injector.joint, course.ticks)
        if fault.reasons:
            found[name] = _milliseconds(course, fault, begin)
            if _is_missed(course, fault, found[name], begin) and not _is_too_little(course, fault, injector):
                missed.append(name)
        elif fault.safe_state is SafeState.BRIDGE and course.worst > SafeState.BRIDGE:
            missed.append(name)
        if name == "F03 spike" and course.torque_step_Nm > SPIKE_STEP_NM and relaxed:
            missed.append(name)
    return Verdict(scenario, course, false_trip, found, tuple(missed), first * 0.001, relaxed)


def _milliseconds(course: Course, fault: Fault, begin: int) -> float | None:
    if course.reason not in fault.reasons or course.stopped_tick is None:
        return None
    return max(float(course.stopped_tick - begin), 0.0)


def _is_missed(course: Course, fault: Fault, found: float | None, begin: int) -> bool:
    if found is None:
        # What nobody can tell from rest has to be found only where there was time for it to show.
        return not (fault.shows_in_motion and begin + (fault.budget_ms or 0.0) >= course.ticks)
    return course.worst < fault.safe_state or (fault.budget_ms is not None and found > fault.budget_ms)


def _is_too_little(course: Course, fault: Fault, injector: Injector) -> bool:
    """A motor that is told little may give little less, unseen."""
    if fault.reasons != (StopReason.TORQUE_WRONG,) or course.told_Nm is None:
        return False
    return bool(course.told_Nm[injector.joint] < TORQUE_OFF_NM / WEAKEST_LOSS)


def shrunk(subject: Subject, verdict: Verdict) -> Scenario:
    """The same scenario with as few faults as still go wrong."""
    scenario = verdict.scenario
    for name in list(scenario.faults):
        fewer = tuple(other for other in scenario.faults if other != name)
        if fewer and is_bad(fly(subject, Scenario(scenario.campaign, scenario.number, fewer))):
            scenario = Scenario(scenario.campaign, scenario.number, fewer)
    return scenario


def is_bad(verdict: Verdict) -> bool:
    """Whether anything happened that must never happen."""
    return bool(verdict.course.violated_ticks or verdict.missed or verdict.course.crashed or verdict.false_trip)


def names_of(text: str) -> Sequence[str]:
    """Identifiers in the form of a replay line."""
    return text.split("+")
