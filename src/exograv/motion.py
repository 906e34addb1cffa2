"""Reference motions, tabulated at the period of the control loop before the machine moves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]
Table = Float[np.ndarray, "tick joint"]
Three = tuple[np.ndarray, np.ndarray, np.ndarray]
Eased = tuple[float, float, float]
"""Time [ticks], rate of time [-] and its slope [1/s] of a motion from rest."""


@dataclass(frozen=True)
class Trajectory:
    """Reference position, velocity and acceleration of the joints at every tick."""

    q: Table
    """Reference joint position [rad]."""

    v: Table
    """Reference joint velocity [rad/s]."""

    a: Table
    """Reference joint acceleration [rad/s²]."""

    dt: float
    """Period of the table [s]."""

    def __len__(self) -> int:
        return len(self.q)

    @property
    def seconds(self) -> float:
        """Duration of the motion [s]."""
        return len(self) * self.dt

    def at(self, tick: int) -> Three:
        """Return position [rad], velocity [rad/s] and acceleration [rad/s²] at a tick, which counts from 0."""
        return self.q[tick], self.v[tick], self.a[tick]


def hold(q: Joints, seconds: float, dt: float) -> Trajectory:
    """Return a motion that stays at `q` [rad]."""
    ticks = round(seconds / dt)
    still = np.zeros((ticks, len(q)))
    return Trajectory(np.tile(q, (ticks, 1)), still, still, dt)


def smooth_share(s: np.ndarray) -> np.ndarray:
    """Share of the path of a minimum-jerk motion at the share `s` of its duration, both 0 to 1 [-].

    Source: Flash & Hogan 1985, J Neurosci 5:1688, eq. 7.
    """
    return 10 * s**3 - 15 * s**4 + 6 * s**5


def minimum_jerk(q_start: Joints, q_goal: Joints, seconds: float, dt: float) -> Trajectory:
    """Return a motion from rest at `q_start` to rest at `q_goal` [rad], with the profile `smooth_share`."""
    ticks = round(seconds / dt)
    s = np.arange(1, ticks + 1)[:, None] / ticks
    # A whole number of ticks: the last one is at rest at the goal.
    return Trajectory(*_minimum_jerk(q_start, q_goal - q_start, s, ticks * dt), dt)


def _minimum_jerk(q_start: Joints, way: Joints, s: np.ndarray, seconds: float) -> Three:
    """Position, velocity and acceleration at the share `s` of the duration `seconds` [s]."""
    q = q_start + way * smooth_share(s)
    v = way / seconds * (30 * s**2 - 60 * s**3 + 30 * s**4)
    a = way / seconds**2 * (60 * s - 180 * s**2 + 120 * s**3)
    return q, v, a


def go_to(q_start: Joints, q_goal: Joints, v_max: float, dt: float) -> Trajectory:
    """Return a minimum-jerk motion of at least 0.5 s whose fastest joint does not exceed `v_max` [rad/s]."""
    return minimum_jerk(q_start, q_goal, _seconds(q_start, q_goal, v_max), dt)


def _seconds(q_start: Joints, q_goal: Joints, v_max: float) -> float:
    # 1.875 = 15/8: peak speed over mean speed of a minimum-jerk motion.
    return max(0.5, 1.875 * float(np.abs(q_goal - q_start).max()) / v_max)


@dataclass(frozen=True)
class Passage:
    """Motion of `go_to` and a rest at its goal, computed tick by tick; a table would take longer than a tick."""

    q_start: Joints
    """Posture at the start [rad]."""

    q_goal: Joints
    """Posture at the end [rad]."""

    ticks: int
    """Duration of the motion without the rest [ticks]."""

    rest_ticks: int
    """Duration of the rest at the goal [ticks]."""

    dt: float
    """Period [s]."""

    @classmethod
    def planned(cls, q_start: Joints, q_goal: Joints, v_max: float, rest_s: float, dt: float) -> "Passage":
        """Return a passage whose fastest joint does not exceed `v_max` [rad/s], with a rest of `rest_s` [s]."""
        return cls(q_start, q_goal, round(_seconds(q_start, q_goal, v_max) / dt), round(rest_s / dt), dt)

    def __len__(self) -> int:
        return self.ticks + self.rest_ticks

    @property
    def seconds(self) -> float:
        """Duration of the motion [s]."""
        return len(self) * self.dt

    def at(self, tick: int) -> Three:
        """Return position [rad], velocity [rad/s] and acceleration [rad/s²] at a tick, which counts from 0."""
        share = np.array([min((tick + 1) / self.ticks, 1.0)])
        return _minimum_jerk(self.q_start, self.q_goal - self.q_start, share, self.ticks * self.dt)

    def table(self) -> Trajectory:
        """Return the motion as a table."""
        way = minimum_jerk(self.q_start, self.q_goal, self.ticks * self.dt, self.dt)
        return joined([way, hold(self.q_goal, self.rest_ticks * self.dt, self.dt)])


@dataclass(frozen=True)
class Cycles:
    """Sine from one posture to another and back, several times, eased in and out, computed tick by tick."""

    low: Joints
    """Posture at the start and at the end [rad]."""

    high: Joints
    """Posture at the other end of the path [rad]."""

    period_s: float
    """Duration of one cycle, there and back [s]."""

    count: int
    """Number of cycles."""

    ease_s: float
    """Time from rest to the sine's speed, and back to rest [s]."""

    dt: float
    """Period of the control loop [s]."""

    def __len__(self) -> int:
        return self._sine_ticks + round(self.ease_s / 2 / self.dt)

    def at(self, tick: int) -> Three:
        """Return position [rad], velocity [rad/s] and acceleration [rad/s²] at a tick, which counts from 0.

        The values are those of `table` without its interpolation.
        """
        before_end, rate_out, slope_out = self._eased(float(len(self) - 1 - tick))
        when, rate, slope = self._eased(max(self._sine_ticks - 1 - before_end, 0.0))
        omega = 2.0 * np.pi / self.period_s
        angle, half = omega * (when + 1.0) * self.dt, 0.5 * (self.high - self.low)
        v_sine = half * (omega * np.sin(angle))
        v = v_sine * rate
        a = half * (omega**2 * np.cos(angle) * rate**2) + v_sine * slope
        q = 0.5 * (self.low + self.high) - half * np.cos(angle)
        return q, v * rate_out, a * rate_out**2 - v * slope_out

    def table(self) -> Trajectory:
        """Return the motion as a table."""
        centre, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        still, seconds = np.zeros_like(half), self.count * self.period_s + self.ease_s / 2
        path = fourier(centre, still[None], -half[None], self.period_s, seconds, self.dt)
        return eased_out(eased_in(path, self.ease_s), self.ease_s)

    @property
    def _sine_ticks(self) -> int:
        return round((self.count * self.period_s + self.ease_s / 2) / self.dt)

    def _eased(self, index: float) -> Eased:
        return _eased(index, self.ease_s, self.dt)


@dataclass(frozen=True)
class Harmonics:
    """Sum of harmonics about a posture (`fourier`), eased in and out, computed tick by tick."""

    centre: Joints
    """Mean posture [rad]."""

    sine: Table
    """Amplitudes of sin(k ω t) in position, row k−1 for harmonic k (harmonic, joint) [rad]."""

    cosine: Table
    """Amplitudes of cos(k ω t) in position (harmonic, joint) [rad]."""

    period_s: float
    """2π/ω [s]."""

    seconds: float
    """Duration of the motion, from rest to rest [s]."""

    ease_s: float
    """Time from rest to the full speed, and back to rest [s]."""

    dt: float
    """Period of the control loop [s]."""

    def __len__(self) -> int:
        return self._path_ticks + round(self.ease_s / 2 / self.dt)

    def at(self, tick: int) -> Three:
        """Return position [rad], velocity [rad/s] and acceleration [rad/s²] at a tick, which counts from 0.

        The values are those of `table` without its interpolation.
        """
        before_end, rate_out, slope_out = _eased(float(len(self) - 1 - tick), self.ease_s, self.dt)
        when, rate, slope = _eased(max(self._path_ticks - 1 - before_end, 0.0), self.ease_s, self.dt)
        omega = 2.0 * np.pi / self.period_s * np.arange(1, len(self.sine) + 1)
        angle = omega * ((when + 1.0) * self.dt)
        s, c = np.sin(angle), np.cos(angle)
        v_path = (c * omega) @ self.sine - (s * omega) @ self.cosine
        a_path = -(s * omega**2) @ self.sine - (c * omega**2) @ self.cosine
        q, v = self.centre + s @ self.sine + c @ self.cosine, v_path * rate
        a = a_path * rate**2 + v_path * slope
        return q, v * rate_out, a * rate_out**2 - v * slope_out

    def table(self) -> Trajectory:
        """Return the motion as a table."""
        path = fourier(self.centre, self.sine, self.cosine, self.period_s, self.seconds - self.ease_s / 2, self.dt)
        return eased_out(eased_in(path, self.ease_s), self.ease_s)

    @property
    def _path_ticks(self) -> int:
        return round((self.seconds - self.ease_s / 2) / self.dt)


Planned = Passage | Cycles | Harmonics
"""Motion that is computed tick by tick."""


def _eased(index: float, ease_s: float, dt: float) -> Eased:
    """Return time, rate and slope of a motion that starts from rest within `ease_s` [s], as `eased_in`, at a tick."""
    ticks = round(ease_s / dt)
    s = min(index / ticks, 1.0)
    when = ticks * (s**3 - s**4 / 2) + max(index - ticks, 0.0)
    return when, 3 * s**2 - 2 * s**3, 6 * (s - s**2) / ease_s


def fourier(centre: Joints, sine: Table, cosine: Table, period: float, seconds: float, dt: float) -> Trajectory:
    """Return a sum of harmonics about `centre`: it passes postures often, at different speeds and in both directions.

    Args:
        centre: Mean posture [rad].
        sine: Amplitudes of sin(k ω t) in *position*, row k−1 for harmonic k (harmonic, joint) [rad].
        cosine: Amplitudes of cos(k ω t) in position (harmonic, joint) [rad].
        period: 2π/ω [s].
        seconds: Duration [s].
        dt: Period of the table [s].

    Source: Swevers 1997, IEEE T-RA 13:730, eq. 9, with position amplitudes in place of velocity amplitudes.
    """
    t = np.arange(1, round(seconds / dt) + 1)[:, None] * dt
    omega = 2 * np.pi / period * np.arange(1, len(sine) + 1)[None, :]
    s, c = np.sin(omega * t), np.cos(omega * t)
    q = centre + s @ sine + c @ cosine
    v = (c * omega) @ sine - (s * omega) @ cosine
    a = -(s * omega**2) @ sine - (c * omega**2) @ cosine
    return Trajectory(q, v, a, dt)


def sweep(q: Joints, joint: int, goal: float, speed: float, dt: float) -> Trajectory:
    """Return a motion of one joint from `q` to `goal` [rad] and back; see `there_and_back`."""
    q_goal = q.copy()
    q_goal[joint] = goal
    return there_and_back(q, q_goal, speed, dt)


def there_and_back(q_start: Joints, q_goal: Joints, speed: float, dt: float) -> Trajectory:
    """Return a straight motion between two postures [rad] and back, with smooth reversals.

    The joint with the longest way moves at the constant `speed` [rad/s]. A path too short for the reversals is slower.
    """
    way = q_goal - q_start
    farthest = float(np.abs(way).max())
    rounding = 0.3  # [s] Short compared with the sweep, long compared with the response time of the drives.
    speed = min(speed, farthest / rounding)
    ramp = np.clip(np.arange(0.5, rounding / dt) * dt / rounding, 0.0, 1.0)
    cruise = round((farthest / speed - rounding) / dt) if speed > 0.0 else 0
    there = np.concatenate([ramp, np.ones(cruise), ramp[::-1]]) * speed
    share = way / farthest if farthest > 0.0 else np.zeros_like(way)
    v = np.concatenate([there, -there])[:, None] * share
    a = np.asarray(np.gradient(v, dt, axis=0))
    return Trajectory(q_start + np.cumsum(v, axis=0) * dt, v, a, dt)


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Return the motions one after the other. All have the period of the first."""
    return Trajectory(
        np.concatenate([part.q for part in parts]),
        np.concatenate([part.v for part in parts]),
        np.concatenate([part.a for part in parts]),
        parts[0].dt,
    )


def eased_in(trajectory: Trajectory, seconds: float) -> Trajectory:
    """Return the same path with a start from rest: the rate of time rises smoothly from 0 to 1.

    A periodic motion starts with a speed; the machine starts at rest.
    """
    dt = trajectory.dt
    ticks = round(seconds / dt)
    index = np.arange(len(trajectory), dtype=float)
    s = np.minimum(index / ticks, 1.0)
    rate = 3 * s**2 - 2 * s**3
    rate_slope = 6 * (s - s**2) / seconds
    when = ticks * (s**3 - s**4 / 2) + np.maximum(index - ticks, 0.0)  # Integral of the rate [ticks].

    def at(table: Table) -> Table:
        return np.column_stack([np.interp(when, index, column) for column in table.T])

    v = at(trajectory.v)
    return Trajectory(
        at(trajectory.q), v * rate[:, None], at(trajectory.a) * rate[:, None] ** 2 + v * rate_slope[:, None], dt
    )


def eased_out(trajectory: Trajectory, seconds: float) -> Trajectory:
    """Return the same path with an end at rest, slowed down over `seconds` [s]; it takes `seconds` / 2 longer."""
    # Easing loses seconds / 2 of a path, because its rate of time rises slowly. The lead makes up for that.
    lead = hold(trajectory.q[0], seconds / 2, trajectory.dt)
    return backwards(eased_in(backwards(joined([lead, trajectory])), seconds))


def backwards(trajectory: Trajectory) -> Trajectory:
    """Return the same path from its end to its start."""
    return Trajectory(trajectory.q[::-1], -trajectory.v[::-1], trajectory.a[::-1], trajectory.dt)
