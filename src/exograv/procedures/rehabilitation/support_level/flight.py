"""Support test with one person: the guard ramps the support, the person tries targets, and a sinking arm is rescued.

The arm is fully carried at first, and support decreases from there. An arm that sinks is fully carried again.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.loop.floating_machine import FloatingMachine
from exograv.task.levels import slewing_s

from .targets import TARGETS, TIME_S, ReachJudge, Target

Place = Float[np.ndarray, " 3"]

MOVE_S = 2.0
"""Duration of a reach, and of the return [s]. Assumed: a weak person is asked not to hurry."""

SETTLE_S = 0.5
"""Time after a ramp or a motion before the arm's position counts [s]."""

SINK_M = 0.12
"""Drop of the fingertip below its rest position at which the arm counts as sinking, and is carried again [m]."""

FALL_M_S = 0.8
"""Downward speed of a fingertip that counts as falling. The return from the highest target has 0.5 at `MOVE_S`."""

ASTRAY_M = 0.10
"""Largest distance from the rest position before an attempt. Beyond, the person cannot hold the arm at rest."""


@dataclass(frozen=True)
class Attempt:
    """Attempt at one target."""

    target: int
    support: float
    """Share of the arm's weight that the machine carried [-]."""

    reached: bool
    nearest_m: float | None
    """Smallest distance to the target; None if the person could not hold the arm at rest."""

    rescued: bool
    """True if the machine took the whole weight again, because the arm sank."""


@runtime_checkable
class InstructedPerson(Protocol):
    """Person in the machine who follows instructions: simulated, or real and told by the operator."""

    def rest(self, seconds: float = MOVE_S, gravity_level: float | None = None) -> None:
        """Go to rest within a time [s], while the felt gravity level changes to this value, if one is given."""
        ...

    def attempt(self) -> None:
        """Get ready for the next attempt."""
        ...

    def reach(self, target: int, place: Place) -> None:
        """Reach for a target, by its number from 0 and its place in the base frame [m]."""
        ...


class SupportFlight:
    """Run of the machine with the attempts. It knows the arm only by the controller's estimate."""

    def __init__(self, machine: FloatingMachine, person: InstructedPerson, side: str):
        """Move the floating arm to rest. The guard must have the person's limits.

        Raises:
            RigError: The machine was stopped, here or in the following methods.
        """
        self._machine, self._person = machine, person
        self._tip, self._tip_t, self._begin = np.zeros(3), machine.t, machine.t
        self._rest_tip: Place | None = None
        self._rescued = False
        self.rescues = 0
        machine.begin("go to rest")
        person.rest()
        self._run(2.0 * MOVE_S)
        self._rest_tip = self._tip.copy()
        self.places = tuple(target_places(np.array(machine.skeleton(machine.q)[1]), side))
        """Places of the targets in the base frame, for this arm by the controller's model [m]."""

    @property
    def support(self) -> float:
        """Share of the arm's weight that the machine carries now [-]."""
        return 1.0 - self._machine.gravity_level

    @property
    def seconds(self) -> float:
        """Time since the start of the test [s]."""
        return self._machine.t - self._begin

    def attempt(self, target: int, support: float) -> Attempt:
        """Ramp the support to this share by the guard, let the person try, and return to rest."""
        self._note("reach_began", target, support, place_m=self.places[target].tolist())
        self._person.attempt()
        held = self._brought_to(support)
        judge = ReachJudge(self.places[target])
        if held:
            self._person.reach(target, self.places[target])
            self._run(TIME_S, lambda t: judge.see(t, self._tip) or self._rescued)
        result = Attempt(target, support, judge.reached, judge.nearest_m if held else None, self._rescued)
        self._note("reach_ended", target, support, reached=judge.reached, rescued=self._rescued)
        self._come_back()
        return result

    def carry_all(self) -> None:
        """Carry the whole weight again."""
        seconds = max(slewing_s(1.0 - self.support, 0.0), MOVE_S)
        self._machine.feel(0.0)
        self._person.rest(seconds, 0.0)
        self._run(seconds + SETTLE_S)

    def _brought_to(self, support: float) -> bool:
        """Ramp the support. Return True if the person then holds the arm at rest."""
        level = 1.0 - support
        ramp_s = slewing_s(1.0 - self.support, level)
        if ramp_s > 0.0:
            self._machine.feel(level)
            self._person.rest(max(ramp_s, SETTLE_S), level)
            self._run(ramp_s + SETTLE_S, lambda _t: self._rescued)
        astray = 0.0 if self._rest_tip is None else float(np.linalg.norm(self._tip - self._rest_tip))
        return not self._rescued and astray < ASTRAY_M

    def _come_back(self) -> None:
        if self._rescued:
            self.rescues += 1
            self.carry_all()
            self._rescued = False
        self._person.rest()
        self._run(MOVE_S + SETTLE_S, lambda _t: self._rescued)
        if self._rescued:
            self._come_back()

    def _run(self, seconds: float, done: Callable[[float], bool] = lambda _t: False) -> None:
        """Let the person act for a time [s], or until `done`."""

        def look(t: float, q: np.ndarray) -> bool:
            self._look(t, q)
            return done(t)

        self._machine.float_for(seconds, look)

    def _look(self, t: float, q: np.ndarray) -> None:
        """Compute the fingertip position by the controller's model. If the arm sinks, support it fully."""
        exo, arm = self._machine.skeleton(q)
        before, self._tip = self._tip, np.array(arm[-1])
        passed_s, self._tip_t = t - self._tip_t, t
        self._machine.write("/skeleton", t, {"exo": exo, "arm": arm})
        if self._rescued or self._rest_tip is None or self.support == 1.0:
            return
        if before[2] - self._tip[2] > FALL_M_S * passed_s or self._tip[2] < self._rest_tip[2] - SINK_M:
            self._rescued = True
            self._machine.feel(0.0)

    def _note(self, kind: str, target: int, support: float, **more: object) -> None:
        record = {"kind": kind, "target": target, "targets": len(TARGETS), "support": support, **more}
        self._machine.write("/task", self._machine.t, {"kind": kind, "record": record})


def _length(arm: Float[np.ndarray, "point 3"]) -> float:
    """Length from the shoulder over elbow and wrist to the fingertip [m]."""
    return float(np.linalg.norm(np.diff(arm, axis=0), axis=1).sum())


def target_places(arm: Float[np.ndarray, "point 3"], side: str, targets: tuple[Target, ...] = TARGETS) -> list[Place]:
    """Return the places of the targets in the base frame [m]."""
    return [target.place(arm[0], _length(arm), side) for target in targets]
