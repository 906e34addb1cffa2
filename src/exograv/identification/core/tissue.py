"""Tissue of a wearer beyond linear springs: hidden parameters for torque that elasticity, time and a late shoulder add.

No law of a real joint is known, so each departure is a family with a prior over its size. The hidden parameters are
estimated beside the told ones and are never compensated: what they explain is not weight.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from .interface import Joints, Parameters, Sample, TorqueModel

RELAX_TIMES_S = (0.5, 1.5, 5.0)
"""Time constants of the decaying parts of a joint's elasticity [s]. Together they approximate any time from 0.5 to 8 s
(docs/explanation/arm.md)."""

RELAX_SHARE_SD = 0.2
"""Standard deviation of each decaying part over the permanent elasticity [-]; the project's ranges are 0 to 0.5."""

SHAPE_RAD = 0.3
"""Standard deviation of a joint's elastic torque around its straight line, over its stiffness [rad]. Published curves
of relaxed joints are exponential at both ends and flat between them (docs/explanation/arm.md)."""

SHAPE_LENGTH_RAD, SHAPE_REACH_RAD, SHAPE_FUNCTIONS = 0.7, 2.5, 8
"""Correlation length of that torque over the angle [rad], reach of its functions from the neutral angle [rad], and
their number per freedom. The shortest wave of eight functions is 1.25 rad long."""

COUPLING_SHARE = 0.25
"""Standard deviation of the coupling between two freedoms, over the smaller of their stiffnesses [-]: muscles cross
shoulder and elbow."""

CREEP_RAD, CREEP_TIMES_S = 0.17, (20.0, 180.0)
"""Standard deviation [rad] and time constants [s] of a rest posture that moves during the session, in two parts.
Assumed: a fast and a slow part, which together approximate other times and laws."""

LATE_TIMES_S = (0.15, 0.6)
"""Times by which parts of the shoulder girdle may follow the arm late [s]. Assumed."""

LATE_SD = 0.009
"""Standard deviation of each late part of the shoulder's shift per axis [m/rad]; both together are a little more than
that of the shift itself."""

ROUNDING_RAD = 0.05
"""Rounding of the elevation near a hanging arm, as in `model.loops` [rad]."""

Freedoms = Float[np.ndarray, " freedom"]


@dataclass(frozen=True)
class Shoulder:
    """Shoulder and elbow of one arm among the parameters."""

    freedoms: slice
    """Freedoms of shoulder and elbow, which are coupled: flexion, abduction, rotation, elbow."""

    offset: slice
    """Offset of the shoulder's centre (3,) among the parameters [m]."""


@dataclass(frozen=True)
class Springs:
    """Parameters of the elasticity of the wearer's joints, for methods with a non-linear elastic law."""

    stiffness: slice
    """Stiffness of each freedom [N·m/rad]."""

    offset: slice
    """Stiffness times neutral angle [N·m]."""

    angles: Callable[[TorqueModel], Freedoms]
    """Function that returns the angles of the sample that this model linearised last [rad]."""

    usual_stiffness: Freedoms
    """Stiffness of a usual person [N·m/rad], positive. A belief about one person gives no size: it can be zero."""

    usual_neutral: Freedoms
    """Neutral angles of a usual person [rad]."""

    shoulders: tuple[Shoulder, ...] = ()
    """Shoulders of all arms."""

    end_stops: Callable[[TorqueModel], Joints] | None = None
    """Function that returns the standard deviation of the torque by the ends of the joints' ranges [N·m], for the
    sample that this model linearised last."""


FIXED, TISSUE, CUFFS = -1, 0, 1
"""Groups of hidden parameters. The size of the first is known; those of the others are weighed by the data."""


@dataclass(frozen=True)
class Hidden:
    """Prior of hidden parameters: independent, with zero mean."""

    sd: Float[np.ndarray, " hidden"]
    """Standard deviation of each parameter."""

    group: Int[np.ndarray, " hidden"]
    """Group of each parameter whose size the data weigh: `FIXED`, `TISSUE`, or `CUFFS`."""


class TissueModel:
    """Model of an arm with the hidden parameters after all others.

    Without them, torque that decays after a motion is learned as damping, and a curved spring as weight, with more
    confidence the longer the motion lasts. The parts, in their order:

    - relaxation: standard linear solids, the linear spring's torque through a high-pass filter per time constant;
    - shape: a smooth function of each freedom's angle, in sines (Solin & Särkkä 2020, Stat. Comput. 30:419);
    - coupling: torque of one freedom in proportion to the angle of another, symmetric, so that it stores energy;
    - creep: change of the spring offset with time, in two parts;
    - late shoulder: offset of the shoulder's centre in proportion to the part of the elevation that is still to come,
      in two parts.
    """

    def __init__(self, model: TorqueModel, springs: Springs):
        """Extend `model`; the usual springs give size and centre of the tissue."""
        self._model, self._springs = model, springs
        K, self._neutral = springs.usual_stiffness, springs.usual_neutral
        pairs = [
            (a, b)
            for shoulder in springs.shoulders
            for a in range(shoulder.freedoms.start, shoulder.freedoms.stop)
            for b in range(a + 1, shoulder.freedoms.stop)
        ]
        self._pairs = np.array(pairs, dtype=int).reshape(-1, 2).T
        offsets = [list(range(shoulder.offset.start, shoulder.offset.stop)) for shoulder in springs.shoulders]
        self._offsets = np.array(offsets, dtype=int).reshape(-1, 3)
        self._waves = 0.5 * np.pi / SHAPE_REACH_RAD * np.arange(1, SHAPE_FUNCTIONS + 1)
        parts = [
            (np.tile(RELAX_SHARE_SD * K, len(RELAX_TIMES_S)), FIXED),
            (np.outer(SHAPE_RAD * K, self._wave_sd()).ravel(), TISSUE),
            (COUPLING_SHARE * K[self._pairs].min(axis=0), TISSUE),
            (np.tile(CREEP_RAD * K, len(CREEP_TIMES_S)), TISSUE),
            (np.full(3 * len(LATE_TIMES_S) * len(springs.shoulders), LATE_SD), FIXED),
        ]
        self.hidden = Hidden(
            np.concatenate([sd for sd, _ in parts]), np.concatenate([np.full(len(sd), group) for sd, group in parts])
        )
        """Prior of the hidden parameters."""
        self.n_joints, self.n_parameters = model.n_joints, model.n_parameters + len(self.hidden.sd)
        self._forget()

    def _wave_sd(self) -> Float[np.ndarray, " function"]:
        """Return the standard deviation of each coefficient for a field of unit variance, from its spectral density."""
        ell = SHAPE_LENGTH_RAD
        density = np.sqrt(2.0 * np.pi) * ell * np.exp(-0.5 * (ell * self._waves) ** 2)
        return np.sqrt(density / SHAPE_REACH_RAD)

    def _forget(self) -> None:
        self._t: float | None = None
        self._relaxed = np.zeros(())
        self._elevation = np.zeros(len(self._springs.shoulders))
        self._late = np.zeros((len(LATE_TIMES_S), len(self._elevation)))

    def restart(self) -> None:
        """Start a new motion, with the tissue relaxed and the shoulder in its place."""
        self._model.restart()
        self._forget()

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m]: that of the arm model, and of the end stops."""
        of_model, end_stops = self._model.direction_uncertainty(v), self._springs.end_stops
        return of_model if end_stops is None else np.hypot(of_model, end_stops(self._model))

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] and its derivative; call for the samples of a motion in order."""
        n = len(self.hidden.sd)
        tau, derivative = self._model.linearise(sample, x[:-n])
        if not derivative.any():
            # Without a closed posture the arm model returns zeros, and its angles have no meaning.
            return tau, np.zeros((len(tau), self.n_parameters))
        angle = self._springs.angles(self._model) - self._neutral
        by_torque = -derivative[:, self._springs.offset]
        first, second = self._pairs
        creep = 1.0 - np.exp(-sample.t / np.array(CREEP_TIMES_S))
        columns = np.hstack([
            self._fast(sample.t, derivative[:, self._springs.stiffness]),
            self._shapes(by_torque, angle),
            by_torque[:, first] * angle[second] + by_torque[:, second] * angle[first],
            _side_by_side(creep[:, None, None] * by_torque),
            self._lateness(sample.t, derivative),
        ])  # fmt: skip
        self._t = sample.t
        return tau + columns @ x[-n:], np.hstack([derivative, columns])

    def _fast(self, t: float, stretched: Float[np.ndarray, "joint freedom"]) -> Float[np.ndarray, "joint part"]:
        """Torque of the decaying parts per fast stiffness, for all freedoms of one time constant after another."""
        if self._t is None:
            self._relaxed = np.tile(stretched, (len(RELAX_TIMES_S), 1, 1))
        else:
            # Exact decay over the step, with the stretch held at its new value.
            moved = 1.0 - np.exp((self._t - t) / np.array(RELAX_TIMES_S))
            self._relaxed = self._relaxed + moved[:, None, None] * (stretched - self._relaxed)
        return _side_by_side(stretched - self._relaxed)

    def _shapes(
        self, by_torque: Float[np.ndarray, "joint freedom"], angle: Freedoms
    ) -> Float[np.ndarray, "joint function"]:
        """Torque of the elastic functions of all freedoms, per coefficient."""
        within = np.clip(angle, -SHAPE_REACH_RAD, SHAPE_REACH_RAD)
        sines = np.sin(np.outer(within + SHAPE_REACH_RAD, self._waves))
        return (by_torque[:, :, None] * sines).reshape(len(by_torque), -1)

    def _lateness(self, t: float, derivative: Float[np.ndarray, "joint parameter"]) -> Float[np.ndarray, "joint part"]:
        """Torque of late shoulders, per part, shoulder and axis."""
        shoulders = self._springs.shoulders
        if not shoulders:
            return np.zeros((len(derivative), 0))
        elevation, times = _elevations(self._springs.angles(self._model), shoulders), np.array(LATE_TIMES_S)[:, None]
        if self._t is None:
            self._late = np.tile(elevation, (len(LATE_TIMES_S), 1))
        elif t > self._t:
            # Exact step of the low-pass filters while the elevation moves at constant speed.
            lag = times / (t - self._t) * (elevation - self._elevation)
            self._late = elevation - lag + (self._late - self._elevation + lag) * np.exp((self._t - t) / times)
        self._elevation = elevation
        behind = (self._late - elevation)[:, :, None]
        return (derivative[:, self._offsets][:, None] * behind).reshape(len(derivative), -1)


def _side_by_side(parts: Float[np.ndarray, "part joint freedom"]) -> Float[np.ndarray, "joint column"]:
    """Return the columns of all parts in order."""
    return parts.transpose(1, 0, 2).reshape(parts.shape[1], -1)


def _elevations(z: Freedoms, shoulders: Sequence[Shoulder]) -> Float[np.ndarray, " shoulder"]:
    """Angles of the upper arms from hanging [rad]."""
    cosines = np.array([np.cos(z[one.freedoms.start]) * np.cos(z[one.freedoms.start + 1]) for one in shoulders])
    return np.arctan2(np.sqrt(1.0 - cosines**2 + ROUNDING_RAD**2), cosines)
