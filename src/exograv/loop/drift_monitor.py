"""Drift monitor: compares the delivered torque with the model of machine and arm while the arm floats.

Every driver of a control step feeds it: the pilot in lock-step, control's process in a live run, and the flights of the
fault campaign. It has no access to the guard. Its finding is a value, and its caller lets the arm down.
"""

from collections.abc import Generator

import numpy as np
from jaxtyping import Bool

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.discrepancy import CLOSURE_ERROR_NM
from exograv.identification.core.interface import Covariance, Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.prior import disturbance_sd, prior
from exograv.identification.drift.arm_scale import ArmScale, ScaleCheck
from exograv.identification.drift.residual_test import Bound, ResidualTest

from .arm_controller import ArmController
from .drift_finding import ALL_JOINTS, ONE_JOINT, OTHER_ARM, DriftFinding

Joints = np.ndarray

Judging = Generator[None, None, "DriftFinding | None"]
"""Judgement of a sample in parts; it returns a new finding, or None."""

PERIOD_S = 0.04
"""Time over which positions and torques are averaged [s]; velocity and acceleration are differences of such means."""

TOO_LARGE_NM = {"shoulder": 2.0, "elbow": 1.0, "wrist": 0.25}
"""Residual torque beyond friction and the model's interval above which the arm is lowered [N·m]: a quarter of what a
weak adult can resist (docs/explanation/safety.md). A wearer who holds a posture against a machine that is in order
gives up to half of it, and the monitor cannot tell this torque from a fault's."""

TOLD_NM = {"shoulder": 0.25, "elbow": 0.125, "wrist": 0.03}
"""Residual torque beyond friction and the model's interval above which the operator is told [N·m]: half of the coarse
target for the residual torque after an identification."""

STOP_MEAN_S, TOLD_MEAN_S = 1000 * 3600.0, 100 * 3600.0
"""Mean time between false alarms of one machine in use, for a descent and for a message [s]."""

SETTLES_S = 2.0
"""Time after the arm was taken or new parameters came before the monitor compares [s]."""

BLUR_RAD_S = 0.05
"""Speed at which the direction of motion within `PERIOD_S` is uncertain [rad/s]."""

STOP_NEAR_RAD = np.deg2rad(3.0)
"""Distance from a joint's stop within which the stop may carry a part of the torque [rad]."""


class DriftMonitor:
    """Drift monitor of one arm in one machine."""

    def __init__(
        self,
        controller: ArmController,
        covariance: Covariance | None,
        period_s: float,
        model: ArmModel | None = None,
        in_parts: bool = False,
    ):
        """Begin without a sample.

        Args:
            controller: Controller that carries the arm. Its mode and parameters are read in each sample.
            covariance: Covariance of its parameters; None for the arm of the body-segment table.
            period_s: Time between two ticks [s].
            model: Model of this arm in this machine; made anew if absent.
            in_parts: True to judge a sample over several ticks, one part in each. In real time a sample in one piece,
                after 40 ms of other code, takes up to 2 ms and delays the next answer of control.
        """
        assembly, machine = controller.assembly, controller.machine
        self.controller, self._period_s = controller, period_s
        self._model = (model or ArmModel(assembly, machine)).again()
        self._covariance = prior(assembly, machine)[1] if covariance is None else covariance
        self._layout, places = ParameterLayout.of(assembly), assembly.description.places
        noise = Noise(machine.residual_sd, machine.correlation_s, disturbance_sd(places))
        told, large = (np.array([of[place] for place in places]) for of in (TOLD_NM, TOO_LARGE_NM))
        bounds = Bound(told, TOLD_MEAN_S), Bound(large, STOP_MEAN_S)
        self._test, self._scale = ResidualTest(noise, bounds), ArmScale(noise)
        self._told, self._large = told, large
        self._unmodelled = np.hypot(CLOSURE_ERROR_NM, machine.residual_sd)
        self._lower, self._upper = np.array([(joint.lower, joint.upper) for joint in assembly.exo.joints]).T
        self._breakaway = np.asarray(machine.friction.breakaway)
        self._load_share = np.asarray(machine.friction.load_share)
        self._ticks = max(round(PERIOD_S / period_s), 1)
        self._sums, self._count = np.zeros((2, assembly.n)), 0
        self._means: list[np.ndarray] = []
        self._in_parts = in_parts
        self._judging: Judging | None = None
        self._waits_s, self._is_closed = SETTLES_S, False
        self.finding: DriftFinding | None = None
        """Last finding; None if there was none."""
        self.check: ScaleCheck | None = None
        """Result of the last re-check of the arm's weight; None before the first."""

    def take(self, q: Joints, tau: Joints) -> DriftFinding | None:
        """Take one tick: measured position [rad] and torque [N·m]. Return a new finding; None in all other ticks."""
        sums = self._sums
        sums[0] += q
        sums[1] += tau
        self._count += 1
        if self._count < self._ticks:
            return self._judge_part()
        means = sums / self._count
        sums[:], self._count = 0.0, 0
        unfinished = self._judge_rest()  # only if a sample has more parts than ticks
        self._take_mean(means)
        return unfinished or (self._judge_part() if self._in_parts else self._judge_rest())

    def restart(self) -> None:
        """Begin a new motion, after a stop or a gap in the measurements."""
        self._sums[:], self._count, self._means = 0.0, 0, []
        self._judging, self._is_closed = None, False
        self._test.restart()
        self._scale.restart()
        self._waits_s, self.finding = SETTLES_S, None

    def rehearse(self, q: Joints) -> None:
        """Run the code of a sample at the posture `q` [rad] once. The first run is slower than a tick."""
        self._waits_s = 0.0
        self._judging = self._judge(Sample(0.0, q.copy(), np.zeros_like(q), np.zeros_like(q), np.zeros_like(q)))
        self._judge_rest()
        self.restart()

    @property
    def _dt(self) -> float:
        return self._ticks * self._period_s

    def _judge_part(self) -> DriftFinding | None:
        """Do the next part of a judgement; return its finding at the end."""
        if self._judging is None:
            return None
        try:
            next(self._judging)
        except StopIteration as end:
            self._judging = None
            return end.value
        return None

    def _judge_rest(self) -> DriftFinding | None:
        """Do all parts that are left; return the finding."""
        found = None
        while self._judging is not None:
            found = self._judge_part()
        return found

    def _take_mean(self, means: np.ndarray) -> None:
        mode = self.controller.mode
        if mode.arm_share < 1.0 or mode.gravity_level != 0.0 or not np.isfinite(means).all():
            # Where the wearer carries a part of the arm, the machine cannot tell this part from a lie.
            if self._means or self._waits_s < SETTLES_S:
                self.restart()
            return
        self._means = [*self._means[-2:], means]
        if len(self._means) < 3:
            return
        (q0, _), (q, tau), (q2, _) = self._means
        if self._waits_s > 0.0:
            self._waits_s -= self._dt
        sample = Sample(0.0, q, (q2 - q0) / (2.0 * self._dt), (q2 - 2.0 * q + q0) / self._dt**2, tau)
        self._judging = self._judge(sample)

    def _judge(self, sample: Sample) -> Judging:
        """Judge a sample; each `yield` ends a part."""
        x = self.controller.carried
        if not self._is_closed:
            self._model.continue_at(sample.q, self.controller.z)
            self._is_closed = True
            yield
        expected, D = self._model.linearise(sample, x)
        yield
        residual = sample.tau - expected
        sd = np.sqrt(((D @ self._covariance) * D).sum(axis=1) + self._unmodelled**2)
        friction = self._friction(sample, expected, x)
        if self._waits_s > 0.0:
            return None
        yield
        test, dt, may_rise = self._test, self._dt, self._may_rise(sample.q)
        test.take(dt, residual, friction, sd, may_rise)
        yield
        arm = D[:, self._layout.phi] @ x[self._layout.phi]
        check = self._scale.take(dt, residual, arm, np.where(may_rise.all(axis=0), friction, np.inf), sd, test.scale)
        self.check = check or self.check
        return self._found(check, arm)

    def _friction(self, sample: Sample, expected: Joints, x: np.ndarray) -> Joints:
        """Return the torque that friction may hide at this speed (joint,) [N·m]; infinite near a singular posture."""
        if (self._model.direction_uncertainty(sample.v) > 10.0 * self._large.max()).any():
            return np.full(len(sample.q), np.inf)
        still = 1.0 / np.cosh(np.minimum(np.abs(sample.v) / BLUR_RAD_S, 20.0)) ** 2
        size = self._breakaway * x[self._layout.coulomb] + self._load_share * np.abs(expected)
        return size * still

    def _may_rise(self, q: Joints) -> Bool[np.ndarray, "2 joint"]:
        """Return False where a joint's stop may push: up from the lower stop, down from the upper one."""
        return np.array([q < self._upper - STOP_NEAR_RAD, q > self._lower + STOP_NEAR_RAD])

    def _found(self, check: ScaleCheck | None, arm: Joints) -> DriftFinding | None:
        """Return a finding that is new. A descent may follow a message, and nothing follows a descent."""
        known = self.finding
        if known is not None and known.stops:
            return None
        if (joint := self._test.beyond(1)) is not None:
            found = DriftFinding(joint, self._test.mean(joint), True, self._cause())
        elif check is not None and check.is_contradicted:
            joint = int(np.abs(arm).argmax())
            found = DriftFinding(joint, float(-check.excess * arm[joint]), True, OTHER_ARM)
        elif known is None and (joint := self._test.beyond(0)) is not None:
            found = DriftFinding(joint, self._test.mean(joint), False, self._cause())
        else:
            return None
        self.finding = found
        return found

    def _cause(self) -> str:
        large = np.abs(self._test.means()) > 2.0 * self._told
        return ONE_JOINT if large.sum() <= 1 else ALL_JOINTS
