"""Difference between replayed and recorded torques: per joint and phase, first and largest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.safety.guard import SafeState

from .columns import Columns, ReplayedDecisions, Torques

RESOLUTION_NM = 1e-6
"""Largest difference at which two torques count as the same decision [N·m]. It is a thousandth of the resolution of a
current sensor, and far above the rounding differences between processors or engines."""

WHAT = ("tau_desired", "tau_commanded")
STOPPED = int(SafeState.DESCENT) + 1


@dataclass(frozen=True)
class TorqueDifference:
    """Largest and RMS difference, one value per joint [N·m]; empty where nothing is compared."""

    max: list[float]
    rms: list[float]


@dataclass(frozen=True)
class FirstDifference:
    """First tick that differs."""

    tick: int
    t: float
    what: str
    joint: str
    Nm: float | None
    """Difference [N·m]; None if only the run or only the replay has a decision."""


@dataclass(frozen=True)
class PhaseDifference:
    """Difference in one phase of the run."""

    name: str
    from_s: float
    ticks: int
    tau_desired: TorqueDifference
    tau_commanded: TorqueDifference


@dataclass(frozen=True)
class Difference:
    """Difference of one kind of torque, in ticks that follow each other."""

    by_tick: Float[np.ndarray, "tick joint"]
    """Replayed minus recorded torque [N·m]; NaN where nothing is compared."""

    is_identical: bool
    """True if every compared tick is equal to the last bit."""

    differs: Bool[np.ndarray, " tick"]
    """True if the difference exceeds the resolution, or if only one of recording and replay has a decision."""


class Spread:
    """Largest and RMS difference of one kind of torque, in constant memory."""

    def __init__(self, joints: int):
        self.ticks = 0
        """Ticks that are compared."""
        self._largest, self._squares = np.zeros(joints), np.zeros(joints)

    def add(self, by_tick: Float[np.ndarray, "tick joint"]) -> None:
        """Take differences [N·m]; ticks with a NaN are left out."""
        chosen = by_tick[np.isfinite(by_tick).all(axis=1)]
        self.ticks += len(chosen)
        self._largest = np.maximum(self._largest, np.abs(chosen).max(axis=0, initial=0.0))
        self._squares += (chosen**2).sum(axis=0)

    @property
    def difference(self) -> TorqueDifference:
        """Largest and RMS difference so far, one value per joint [N·m]."""
        if not self.ticks:
            return TorqueDifference([], [])
        columns = self._largest, np.sqrt(self._squares / self.ticks)
        return TorqueDifference(*([float(f"{value:.4g}") for value in column] for column in columns))


class Comparison:
    """Comparison of a replay with its recording, piece by piece: its memory does not grow with the recording."""

    def __init__(self, joints: tuple[str, ...], phases: Sequence[str]):
        self._joints, self._phase_names = joints, phases
        self.ticks = self.given = self.other_states = 0
        """Ticks; those whose torque of control was taken from the recording; those with another safe state."""
        self.first_other_state_s: float | None = None
        self.first: FirstDifference | None = None
        self.recorded_stops_s = list[float]()
        """Times at which the guard began a soft descent in the run [s]."""
        self.is_identical: dict[str, bool] = dict.fromkeys(WHAT, True)
        self.spreads: dict[str, Spread] = {name: Spread(len(joints)) for name in WHAT}
        self._phases: dict[int, _Phase] = {}
        self._was_stopped = False

    def add(self, columns: Columns, again: ReplayedDecisions) -> Mapping[str, Difference]:
        """Take the next ticks, and return their differences for the desired and the commanded torque."""
        found = differences(columns, again)
        self.ticks += len(columns)
        self.given += int(np.count_nonzero(~again.is_rebuilt))
        self.first = self.first or first_difference(columns, self._joints, found)
        for name, one in found.items():
            self.is_identical[name] &= one.is_identical
            self.spreads[name].add(one.by_tick)
        self._add_phases(columns, found)
        self._add_states(columns, again)
        return found

    @property
    def phases(self) -> list[PhaseDifference]:
        """Differences of each phase, in the order of the run."""
        return [
            PhaseDifference(
                self._phase_names[number] or "before the first phase",
                one.from_s,
                one.ticks,
                **{name: spread.difference for name, spread in one.spreads.items()},
            )
            for number, one in sorted(self._phases.items())
        ]

    def _add_phases(self, columns: Columns, found: Mapping[str, Difference]) -> None:
        numbers = np.array(columns.phase)
        for number in np.unique(numbers).tolist():
            ticks = np.flatnonzero(numbers == number)
            if number not in self._phases:
                spreads = {name: Spread(len(self._joints)) for name in WHAT}
                self._phases[number] = _Phase(columns.t[ticks[0]], spreads)
            phase = self._phases[number]
            phase.ticks += len(ticks)
            for name, one in found.items():
                phase.spreads[name].add(one.by_tick[ticks])

    def _add_states(self, columns: Columns, again: ReplayedDecisions) -> None:
        states = np.array(columns.safe_state)
        others = np.flatnonzero((states != again.safe_state) & again.knows_guard)
        self.other_states += len(others)
        if len(others) and self.first_other_state_s is None:
            self.first_other_state_s = round(columns.t[others[0]], 6)
        stopped = states >= STOPPED
        begins = np.flatnonzero(stopped & ~np.concatenate(([self._was_stopped], stopped[:-1])))
        self.recorded_stops_s += [round(columns.t[k], 6) for k in begins]
        self._was_stopped = bool(stopped[-1])


@dataclass
class _Phase:
    """Differences of one phase so far."""

    from_s: float
    spreads: dict[str, Spread]
    ticks: int = 0


def differences(columns: Columns, again: ReplayedDecisions) -> Mapping[str, Difference]:
    """Differences between replayed and recorded torque, for the desired and the commanded torque.

    Only ticks count in which the internal states of control and guard equal those of the run.
    """
    comparable = {
        "tau_desired": again.is_rebuilt & again.knows_control,
        # The guard's rate limit carries a wrong torque on for some time, so the commanded torque needs both memories.
        "tau_commanded": again.knows_guard & again.knows_control,
    }
    return {
        name: difference(columns[name], getattr(again, name), comparable[name], is_answer=name == "tau_desired")
        for name in WHAT
    }


def difference(
    recorded: Torques, again: Torques, comparable: Bool[np.ndarray, " tick"], *, is_answer: bool
) -> Difference:
    """Difference of two torque columns.

    Args:
        recorded: Recorded torque [N·m].
        again: Replayed torque [N·m].
        comparable: Ticks that are compared.
        is_answer: True if a NaN means that control did not answer. Two missing answers are equal.
    """
    by_tick = again - recorded
    is_none = np.isnan(recorded).all(axis=1) & np.isnan(again).all(axis=1) & is_answer
    compared = comparable & ~is_none
    equal = (by_tick == 0.0).all(axis=1)
    within = (np.abs(by_tick) <= RESOLUTION_NM).all(axis=1)  # False for a NaN.
    shown = np.where(compared[:, None], by_tick, np.nan)
    return Difference(shown, bool(equal[compared].all()), compared & ~within)


def first_difference(
    columns: Columns, joints: tuple[str, ...], found: Mapping[str, Difference]
) -> FirstDifference | None:
    """First tick that differs, with torque, joint and difference. If both torques differ, the desired one counts."""
    ticks = [(int(one.differs.argmax()), order, name) for order, (name, one) in enumerate(found.items())]
    ticks = [entry for entry in ticks if found[entry[2]].differs[entry[0]]]
    if not ticks:
        return None
    tick, _, name = min(ticks)
    gaps = np.abs(found[name].by_tick[tick])
    joint = int(np.argmax(np.where(np.isnan(gaps), np.inf, gaps)))
    size = found[name].by_tick[tick, joint]
    shown = None if np.isnan(size) else float(f"{size:.4g}")
    return FirstDifference(columns.first + tick, round(columns.t[tick], 6), name, joints[joint], shown)
