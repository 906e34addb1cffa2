"""Curves of a replay for its figure, collected piece by piece in memory that does not grow with the recording."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int, UInt32

BINS = 600
"""Number of stretches of a curve. Each shows its smallest and its largest value, so that no single tick is lost."""

Torques = Float[np.ndarray, "tick joint"]


class Curve:
    """Smallest and largest torque of each joint in each stretch (stretch, joint) [N·m]; NaN without values."""

    def __init__(self, stretches: int, joints: int):
        self.low, self.high = np.full((2, stretches, joints), np.nan)

    def add(self, values: Torques, starts: Int[np.ndarray, " stretch"], which: Int[np.ndarray, " stretch"]) -> None:
        """Take values of the stretches `which`, which begin at the rows `starts`."""
        self.low[which] = np.fmin(self.low[which], np.fmin.reduceat(values, starts))
        self.high[which] = np.fmax(self.high[which], np.fmax.reduceat(values, starts))


class ReplaySeries:
    """Curves of the figure, from one tick of the run to its last."""

    def __init__(self, joints: Sequence[str], phases: Sequence[str], ticks: tuple[int, int], resolution: float):
        """Begin without ticks.

        Args:
            joints: Names of the joints.
            phases: Names of the phases by their number in a tick.
            ticks: First tick that is shown, and number of ticks of the recording.
            resolution: Largest difference that counts as none [N·m].
        """
        self.joints, self.resolution = tuple(joints), resolution
        self._names, self._ticks, self._phase = phases, ticks, -1
        shown = ticks[1] - ticks[0]
        self._starts = np.unique(np.linspace(0, shown, BINS, endpoint=False).astype(int))
        n = len(self._starts), len(joints)
        self.recorded, self.again, self.difference = Curve(*n), Curve(*n), Curve(*n)
        self._ends_s = np.full((2, n[0]), np.nan)  # time of the first and the last tick of each stretch
        self.phases = list[tuple[float, str]]()
        """Beginning [s] and name of each phase."""
        self.gaps = list[float]()
        """Times at which ticks are missing [s]."""
        self.largest, self._squares, self._compared = np.zeros(n[1]), np.zeros(n[1]), np.zeros(n[1], int)

    @property
    def t(self) -> Float[np.ndarray, " stretch"]:
        """Mean time of each stretch on the rig's clock [s]."""
        return 0.5 * (self._ends_s[0] + self._ends_s[1])

    @property
    def span_s(self) -> tuple[float, float]:
        """Time of the first and of the last tick [s]."""
        return float(self._ends_s[0, 0]), float(self._ends_s[1, -1])

    @property
    def rms(self) -> Float[np.ndarray, " joint"]:
        """RMS difference of each joint [N·m]; NaN without a comparison."""
        with np.errstate(invalid="ignore"):
            return np.sqrt(self._squares / self._compared)

    def add(
        self,
        first: int,
        t: Float[np.ndarray, " tick"],
        phase: UInt32[np.ndarray, " tick"],
        torques: tuple[Torques, Torques, Torques],
    ) -> None:
        """Take the next ticks.

        Args:
            first: Number of the first of them in the recording.
            t: Time on the rig's clock [s].
            phase: Number of the phase.
            torques: Recorded and replayed torque, and their difference [N·m].
        """
        begin = max(self._ticks[0] - first, 0)
        t, phases = t[begin:], phase[begin:].astype(int)
        if not len(t):
            return
        numbers = first + begin - self._ticks[0] + np.arange(len(t))
        stretch = np.searchsorted(self._starts, numbers, side="right") - 1
        starts = np.flatnonzero(np.diff(stretch, prepend=-1))
        which = stretch[starts]
        for curve, values in zip((self.recorded, self.again, self.difference), torques, strict=True):
            curve.add(values[begin:], starts, which)
        is_new = numbers[starts] == self._starts[which]
        self._ends_s[0, which[is_new]] = t[starts[is_new]]
        self._ends_s[1, which] = t[np.append(starts[1:], len(t)) - 1]
        begun = np.flatnonzero(np.diff(phases, prepend=self._phase))
        self.phases += [(t[k], self._names[int(phases[k])]) for k in begun]
        self._phase = int(phases[-1])
        self._measure(torques[2][begin:])

    def _measure(self, difference: Torques) -> None:
        finite = np.where(np.isfinite(difference), difference, 0.0)
        self.largest = np.maximum(self.largest, np.abs(finite).max(axis=0))
        self._squares += (finite**2).sum(axis=0)
        self._compared += np.isfinite(difference).sum(axis=0)
