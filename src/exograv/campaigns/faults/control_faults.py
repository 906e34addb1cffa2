"""Faults of control and of its arm parameters."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from exograv.loop.arm_controller import ArmController
from exograv.safety.guard import ControlRequest

from .acceptance import MOMENTS_MAX, MOMENTS_MIN
from .fault_plant import World
from .injector import Injector
from .scenario_log import ScenarioLog


class OccasionalLateTicks(Injector):
    """F14: control is late in one to three ticks."""

    def draw(self) -> None:
        self.count = self.ticks(int(self.generator.integers(1, 4)))

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        return None if tick < self.onset + self.count else submitted


class RepeatedLateTicks(Injector):
    """F14: control is late in every other tick."""

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        return None if (tick - self.onset) % 2 == 0 else submitted


class Hang(Injector):
    """F15: control repeats its last answer."""

    def draw(self) -> None:
        self.last: ControlRequest | None = None

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        self.last = self.last or submitted
        return self.last


class ControlKilled(Injector):
    """F16: control stops answering."""

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        return None


class WrongTorque(Injector):
    """Control asks for faulty torques: NaN, huge, of the wrong sign, or oscillating."""

    def draw(self) -> None:
        self.kind = str(self.generator.choice(["nan", "huge", "sign", "tremble"]))

    def answered(self, submitted: ControlRequest | None, tick: int) -> ControlRequest | None:
        if submitted is None:
            return None
        change: dict[str, Callable[[float], float]] = {
            "nan": lambda _: np.nan,
            "huge": lambda tau: 1e3 * np.sign(tau),
            "sign": lambda tau: -tau,
            "tremble": lambda tau: tau + 40.0 * (-1.0) ** (tick // self.ticks(5)),
        }
        return submitted._replace(tau=self.at_joint(submitted.tau, change[self.kind]))


class WrongArmParameters(Injector):
    """F25: the arm parameters in force are 10, 2.2 or 0.1 times the real ones, and pass all checks."""

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            x = controller.x
            x[: 10 * len(controller.assembly.arm.segments)] *= float(self.generator.choice([10.0, 2.2046, 0.1]))
            controller.put_in_force(x)


class DivergedEstimate(Injector):
    """F26: identification publishes NaN, an impossible body, or five times the arm, every 50 ms."""

    def draw(self) -> None:
        self.kind = str(self.generator.choice(["nan", "impossible", "far"]))
        self.refused = 0
        self._watch: ParametersWatch | None = None

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if self._watch is None:
            self._watch = ParametersWatch(controller, 1e-3 * self.period_ms)
        if (tick - self.onset) % self.ticks(50) == 0:
            x = controller.x.copy()
            bodies = slice(0, 10 * len(controller.assembly.arm.segments))
            x[bodies] *= {"nan": np.nan, "impossible": -1.0, "far": 5.0}[self.kind]
            self.refused += not controller.publish(x, world.q)
        self._watch.look(controller, world.q)

    def report(self, course: ScenarioLog) -> None:
        if self._watch is not None:
            course.gravity_torque_change_Nm_s = self._watch.torque_change_Nm_s
            course.arm_bound = self._watch.bound


class ParametersWatch:
    """Watch of the arm parameters in force: how fast their torque changes, and whether the arm stays plausible."""

    def __init__(self, controller: ArmController, period_s: float):
        """Begin with the parameters in force; `period_s` is the time between two calls of `look` [s]."""
        self._period_s, self._before = period_s, controller.x.copy()
        self._table_moment = first_moment(controller.assembly.arm.phi)
        self.torque_change_Nm_s = 0.0
        """Largest change of the carrying torque per second so far [N·m/s]."""

        self.bound = 0.0
        """First moments of the arm, relative to the nearer of their bounds, the largest so far [-]."""

    def look(self, controller: ArmController, q: Float[np.ndarray, " joint"]) -> None:
        """Compare the parameters in force with those of the previous call, in the posture `q` [rad]."""
        x, arm = controller.x, controller.assembly.arm
        if not np.array_equal(x, self._before):
            # Both torques are of the same posture, so that only the parameters differ.
            change = controller.torque_at_rest(q, x) - controller.torque_at_rest(q, self._before)
            self.torque_change_Nm_s = _most(self.torque_change_Nm_s, float(np.abs(change).max()) / self._period_s)
            self._before = x.copy()
        share = first_moment(x[: 10 * len(arm.segments)]) / self._table_moment
        self.bound = _most(self.bound, share / MOMENTS_MAX, MOMENTS_MIN / share if share else np.inf)


def _most(*values: float) -> float:
    """Return the largest value; a value that is not a number counts as infinite."""
    return max(value if np.isfinite(value) else np.inf for value in values)


def first_moment(phi: Float[np.ndarray, " phi"]) -> float:
    """Sum over all segments of mass times the distance of the centre of mass from the joint [kg·m]."""
    return float(np.linalg.norm(phi.reshape(-1, 10)[:, 1:4], axis=1).sum())
