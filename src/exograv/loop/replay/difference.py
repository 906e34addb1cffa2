"""How far what was decided once more is from what was recorded: per joint and phase, first and largest."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.safety.guard import SafeState

from .columns import Columns, ReplayedDecisions, Torques

RESOLUTION_NM = 1e-6
"""Up to which two torques are the same decision [N·m]: a thousandth of what a current sensor tells, and far above the
rounding by which another processor or another engine differs."""

WHAT = ("tau_desired", "tau_commanded")
STOPPED = int(SafeState.DESCENT) + 1


@dataclass(frozen=True)
class TorqueDifference:
    """Largest and RMS difference, a value a joint [N·m]; empty where nothing is compared."""

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
    """None where it is decided in one of the two only."""


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
    """Of one kind of torque."""

    by_tick: Float[np.ndarray, "tick joint"]
    """Once more minus recorded [N·m]; NaN where nothing is compared."""

    is_identical: bool
    """To the last bit, in every tick that is compared."""

    differs: Bool[np.ndarray, " tick"]
    """By more than the resolution, or decided in one of the two only."""

    def of(self, ticks: Bool[np.ndarray, " tick"]) -> TorqueDifference:
        """Largest and RMS of these ticks, a value a joint [N·m]."""
        chosen = self.by_tick[ticks]
        chosen = chosen[np.isfinite(chosen).all(axis=1)]
        if not len(chosen):
            return TorqueDifference([], [])
        columns = np.abs(chosen).max(axis=0), np.sqrt((chosen**2).mean(axis=0))
        return TorqueDifference(*([float(f"{value:.4g}") for value in column] for column in columns))


def differences(columns: Columns, again: ReplayedDecisions) -> Mapping[str, Difference]:
    """Of desired and of commanded torque, where the memory behind them is that of the run."""
    comparable = {
        "tau_desired": again.is_rebuilt & again.knows_control,
        # A wrong torque goes through the guard for as long as the rate lets it: it needs both memories.
        "tau_commanded": again.knows_guard & again.knows_control,
    }
    return {
        name: difference(columns[name], getattr(again, name), comparable[name], is_answer=name == "tau_desired")
        for name in WHAT
    }


def difference(
    recorded: Torques, again: Torques, comparable: Bool[np.ndarray, " tick"], *, is_answer: bool
) -> Difference:
    """Of two columns.

    Args:
        recorded: [N·m]
        again: [N·m]
        comparable: Ticks that are compared.
        is_answer: Whether a NaN stands for no answer, which is the same as no answer.
    """
    by_tick = again - recorded
    is_none = np.isnan(recorded).all(axis=1) & np.isnan(again).all(axis=1) & is_answer
    compared = comparable & ~is_none
    equal = (by_tick == 0.0).all(axis=1)
    within = (np.abs(by_tick) <= RESOLUTION_NM).all(axis=1)  # a NaN is not
    shown = np.where(compared[:, None], by_tick, np.nan)
    return Difference(shown, bool(equal[compared].all()), compared & ~within)


def first_difference(
    columns: Columns, joints: tuple[str, ...], found: Mapping[str, Difference]
) -> FirstDifference | None:
    """Which tick is the first that differs, in what and by how much; where both torques do, in the desired one."""
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
    """A row a phase, in the order of the run."""
    phase, rows = np.array(columns.phase), []
    for number in np.unique(phase).tolist():
        ticks = phase == number
        t = np.array(columns.t)[ticks]
        name, torques = names[number] or "before the first phase", {what: found[what].of(ticks) for what in WHAT}
        rows.append(PhaseDifference(name, float(t[0]), int(ticks.sum()), **torques))
    return rows


def recorded_stops(columns: Columns) -> list[float]:
    """When the guard let the arm down in the run [s]."""
    stopped = np.array(columns.safe_state) >= STOPPED
    begins = np.flatnonzero(stopped & ~np.concatenate(([False], stopped[:-1])))
    return [round(columns.t[k], 6) for k in begins]
