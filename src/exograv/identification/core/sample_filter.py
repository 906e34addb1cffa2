"""Filter of the samples: the same low-pass for positions and torques, with velocity and acceleration as states."""

import casadi as ca
import numpy as np
from jaxtyping import Float
from scipy.linalg import expm

from exograv import kernel

from .interface import RequestedMotion, Sample

Joints = Float[np.ndarray, " joint"]


class SampleFilter:
    """Third-order Bessel filter whose states are the filtered position, velocity and acceleration.

    The group delay of a Bessel filter is flat: a slow motion and its torques are only delayed, both equally. The model
    may therefore be evaluated at the filtered motion. Corner frequency: 1.75/`delay_s` rad/s.
    """

    def __init__(self, joints: int, dt: float, delay_s: float = 0.04):
        self._kernel = kernel.compile(_filter_function(joints, dt, delay_s), carry={"state": "state_next"})
        self._q_in, self._tau_in = self._kernel.inputs["q"], self._kernel.inputs["tau"]
        self._q_asked_in = self._kernel.inputs["q_asked"]
        self._state: Float[np.ndarray, "input 4"] = self._kernel.inputs["state"]
        self._dt, self._delay_s = dt, delay_s
        self._of_velocity: SampleFilter | None = None
        self._of_muscles: SampleFilter | None = None
        self._t = 0.0
        self._transient = self._warm_up = round(6 * delay_s / dt)
        self.settled = False
        """True once the transient of the start has decayed."""
        value, rate, second, _ = self._state.T
        of_q, of_tau, of_asked = (slice(k * joints, (k + 1) * joints) for k in range(3))
        self.sample = Sample(0.0, value[of_q], rate[of_q], second[of_q], value[of_tau])
        """Newest filtered sample; `update` overwrites its arrays."""
        self._asked = RequestedMotion(value[of_asked], rate[of_asked], second[of_asked])

    def restart(self) -> None:
        """Restart the filter, for example after a gap in the measurements; the time of motion continues."""
        self._state[:] = 0.0
        self._warm_up, self.settled = self._transient, False
        for other in (self._of_velocity, self._of_muscles):
            if other is not None:
                other.restart()

    def update(
        self,
        q: Joints,
        tau: Joints,
        q_asked: Joints | None = None,
        v: Joints | None = None,
        muscles: Float[np.ndarray, " channel"] | None = None,
    ) -> Sample:
        """Filter one tick.

        Args:
            q: Measured position [rad].
            tau: Measured torque [N·m].
            q_asked: Requested position [rad].
            v: Measured velocity, in every tick or in none [rad/s]; differentiated from `q` if None.
            muscles: Signals of the muscles as in `Sample.muscles`, in every tick or in none.
        """
        self._q_in[:] = q
        self._tau_in[:] = tau
        self._q_asked_in[:] = q if q_asked is None else q_asked
        self.sample.asked = None if q_asked is None else self._asked
        if self._warm_up > 0 and not self._state[:, 0].any():
            self._state[:, 0] = self._state[:, 3] = [*q, *tau, *self._q_asked_in]
        self._kernel.evaluate()
        if self._warm_up > 0:
            self._warm_up -= 1
        else:
            self.settled = True
            self._t += self._dt
        self.sample.t = self._t
        if v is not None:
            self._take_velocity(v, tau)
        if muscles is not None:
            if self._of_muscles is None:
                self._of_muscles = SampleFilter(len(muscles), self._dt, self._delay_s)
            self.sample.muscles = self._of_muscles.update(muscles, muscles).q
        return self.sample

    def _take_velocity(self, v: Joints, tau: Joints) -> None:
        """Replace the sample's velocity and acceleration by the measured velocity and its derivative."""
        if self._of_velocity is None:
            self._of_velocity = SampleFilter(len(v), self._dt, self._delay_s)
        filtered = self._of_velocity.update(v, tau)
        self.sample.v, self.sample.a = filtered.q, filtered.v


def _filter_function(joints: int, dt: float, delay_s: float) -> ca.Function:
    """Filter step of one tick: value and two derivatives of each position and torque, and the input.

    The input is interpolated linearly between two ticks. A held input would be a staircase: at constant speed v, the
    acceleration at the ticks would be wrong by 15 w³ dt²/12 · v, 0.3 v at 4 ms, which looks like viscous friction.
    """
    w = 1.0 / delay_s
    # 15 w³ / (s³ + 6 w s² + 15 w² s + 15 w³), with the input and its change per tick as further states.
    continuous = np.zeros((5, 5))
    continuous[:4, :4] = [[0, 1, 0, 0], [0, 0, 1, 0], [-15 * w**3, -15 * w**2, -6 * w, 15 * w**3], [0, 0, 0, 0]]
    continuous[3, 4] = 1.0 / dt
    step = ca.DM(np.asarray(expm(continuous * dt))[:4])
    q, tau, q_asked = (ca.SX.sym(name, joints) for name in ("q", "tau", "q_asked"))
    state = ca.SX.sym("state", 3 * joints, 4)
    change = ca.vertcat(q, tau, q_asked) - state[:, 3]
    state_next = ca.horzcat(state, change) @ step.T
    names = ["q", "tau", "q_asked", "state"]
    return ca.Function("sample_filter", [q, tau, q_asked, state], [state_next], names, ["state_next"])
