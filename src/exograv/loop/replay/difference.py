"""Difference between replayed and recorded torques: per joint and phase, first and largest."""

from collections.abc import Mapping
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
    """Difference of one kind of torque."""

    by_tick: Float[np.ndarray, "tick joint"]
    """Replayed minus recorded torque [N·m]; NaN where nothing is compared."""

    is_identical: bool
    """True if every compared tick is equal to the last bit."""

    differs: Bool[np.ndarray, " tick"]
    """True if the difference exceeds the resolution, or if only one of recording and replay has a decision."""

    def of(self, ticks: Bool[np.ndarray, " tick"]) -> TorqueDifference:
        """Largest and RMS difference of these ticks, one value per joint [N·m]."""
        chosen = self.by_tick[ticks]
        chosen = chosen[np.isfinite(chosen).all(axis=1)]
        if not len(chosen):
            return TorqueDifference([], [])
        columns = np.abs(chosen).max(axis=0), np.sqrt((chosen**2).mean(axis=0))
        return TorqueDifference(*([float(f"{value:.4g}") for value in column] for column in columns))


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
    return FirstDifference(tick, round(columns.t[tick], 6), name, joints[joint], shown)


def by_phase(columns: Columns, names: list[str], found: Mapping[str, Difference]) -> list[PhaseDifference]:
    """Differences of each phase, in the order of the run."""
    phase, rows = np.array(columns.phase), []
    for number in np.unique(phase).tolist():
        ticks = phase == number
        t = np.array(columns.t)[ticks]
        name, torques = names[number] or "before the first phase", {what: found[what].of(ticks) for what in WHAT}
        rows.append(PhaseDifference(name, float(t[0]), int(ticks.sum()), **torques))
    return rows


def recorded_stops(columns: Columns) -> list[float]:
    """Return the times at which the guard began a soft descent in the run [s]."""
    stopped = np.array(columns.safe_state) >= STOPPED
    begins = np.flatnonzero(stopped & ~np.concatenate(([False], stopped[:-1])))
    return [round(columns.t[k], 6) for k in begins]
