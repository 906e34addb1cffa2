"""The last stage before the motors: whatever control asks for, what reaches a person is finite, bounded and slow.

A first envelope: torque, torque rate, speed, finiteness. Research software, informed by the medical standards, not
compliant with them; a worn machine needs an independent hardware emergency stop.
"""

import enum
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError

Joints = Float[np.ndarray, " joint"]

V_CREDIBLE_RAD_S = 1e3
"""No joint is faster; beyond, a velocity is a broken signal, whose product with the damping must still be finite."""


@dataclass(frozen=True)
class Limits:
    """What may reach a joint. Sources: safety figures in docs/safety.md."""

    torque_max_Nm: Joints
    damping_Nms_per_rad: Joints
    """Of the soft descent."""

    torque_rate_max_Nm_per_s: float = 150.0
    """A wrong torque found after 10 ms is then at most 1.5 N·m."""

    v_damping_rad_s: float = 4.0
    """Speed above which motion is braked."""

    v_trip_rad_s: float = 5.0
    """Speed at which the soft descent starts."""

    descent_s: float = 3.0
    """Time over which the soft descent fades the torque: the hand stays below about 0.6 m/s."""

    def __post_init__(self):
        for name in ("torque_max_Nm", "damping_Nms_per_rad"):
            values = getattr(self, name)
            bad = np.flatnonzero(~(np.isfinite(values) & (values > 0.0)))
            if bad.size:
                raise ConfigError(
                    f"envelope.{name} of joint {bad[0]} is {values[bad[0]]}; it must be positive and finite. "
                    "Correct it in the rig file: zero would let the arm fall."
                )
        for name in ("torque_rate_max_Nm_per_s", "v_damping_rad_s", "v_trip_rad_s", "descent_s"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise ConfigError(f"envelope.{name} is {value}; it must be positive and finite. Correct it.")


class StopReason(enum.Enum):
    """Why the soft descent started; the value is a sentence for the operator."""

    NOT_FINITE = "Control asked for a torque that is not a number."
    TOO_FAST = "A joint moved faster than allowed."
    NO_MEASUREMENT = "A joint's velocity is not a number."
    MODEL_LOST = "The model of the arm in the machine no longer fits its posture."


class Envelope:
    """Keeps every command inside `Limits`; after a fault it is latched in a soft descent until `reset`."""

    def __init__(self, limits: Limits, dt: float):
        self.limits = limits
        self.stop: StopReason | None = None
        """Set once, by the first fault."""
        self.clipped_ticks = 0
        """How often torque or torque rate was limited."""
        self._rate = limits.torque_rate_max_Nm_per_s * dt
        self._dt = dt
        self._tau: Joints = np.zeros_like(limits.torque_max_Nm)
        self._tau_at_stop: Joints = np.zeros_like(limits.torque_max_Nm)
        self._since_stop = 0.0

    def limit(self, tau_desired: Joints, v: Joints) -> Joints:
        """Torque (joint,) [N·m] that may go out, for a desired one and the joints' velocity [rad/s]."""
        # Finite on both sides: minimum and maximum would hide a NaN.
        v_is_finite = bool(np.isfinite(v).all())
        if self.stop is None:
            self._watch(tau_desired, v, v_is_finite)
        wanted = tau_desired if self.stop is None else self._descent()
        wanted = wanted - (self._damping(v) if v_is_finite else 0.0)
        bounded = np.clip(wanted, -self.limits.torque_max_Nm, self.limits.torque_max_Nm)
        tau = np.clip(bounded, self._tau - self._rate, self._tau + self._rate)
        if self.stop is None and not np.array_equal(tau, wanted):
            self.clipped_ticks += 1
        self._tau = tau
        # A copy: what the caller does with it must not move the limits of the next tick.
        return tau.copy()

    def trip(self, reason: StopReason) -> None:
        """Start the soft descent for a reason that somebody else found; the first reason stays."""
        if self.stop is None:
            self.stop = reason
            self._tau_at_stop = self._tau

    def reset(self) -> None:
        """Leave the latched stop; an act of the operator. Torque goes on from where the descent has brought it."""
        self.stop = None
        self._since_stop = 0.0

    def _watch(self, tau_desired: Joints, v: Joints, v_is_finite: bool) -> None:
        if not v_is_finite:
            self.stop = StopReason.NO_MEASUREMENT
        elif not np.isfinite(tau_desired).all():
            self.stop = StopReason.NOT_FINITE
        elif np.abs(v).max() > self.limits.v_trip_rad_s:
            self.stop = StopReason.TOO_FAST
        self._tau_at_stop = self._tau

    def _descent(self) -> Joints:
        self._since_stop += self._dt
        return self._tau_at_stop * max(0.0, 1.0 - self._since_stop / self.limits.descent_s)

    def _damping(self, v: Joints) -> Joints:
        """Damping torque: on all motion while descending, on the excess over the first speed limit otherwise."""
        v = np.clip(v, -V_CREDIBLE_RAD_S, V_CREDIBLE_RAD_S)
        if self.stop is not None:
            return self.limits.damping_Nms_per_rad * v
        excess = np.abs(v) - self.limits.v_damping_rad_s
        return self.limits.damping_Nms_per_rad * np.sign(v) * np.maximum(excess, 0.0)
