"""Signals of the wearer's muscles (EMG): hidden parameters map them to torque, and are never compensated.

The map from the signals to torque is unknown and is learned beside the arm. The machine moves the arm, so the torque of
the muscles does not repeat with the posture. What the signals do not explain stays in the slow disturbance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from .hidden_cuffs import Slipping
from .interface import Joints, Parameters, Sample, TorqueModel
from .tissue import FIXED, Hidden

CONTRACTION_NM = 60.0
"""Torque of a maximum voluntary contraction at shoulder or elbow [N·m]: the order of healthy adults. It is the standard
deviation of the map, so a third or three times of it is learned from the motion."""

DRIFT_SHARE = 0.3
"""Standard deviation of each part of a gain's drift over the gain [-]. Assumed: skin, electrodes and fatigue change the
size of EMG by some tens of per cent."""

DRIFT_TIMES_S = (20.0, 180.0)
"""Time constants of the parts of the drift [s]. Assumed: a fast and a slow part, as of the tissue's creep."""

FAST_SHARE = 1.0
"""Standard deviation of the share of the signals' fast part in the torque [-]."""

SMOOTHED_S = 0.4
"""Standard deviation of the weights over time of the slow part of the signals [s].

The filter learns from changes within its correlation times. In less than a second, the error of EMG changes more than
the torque of a wearer who does not relax. A map of the whole signal, learned from such changes, is several times too
small. The size of the fast part is therefore learned by itself.
"""

REACH = 3.0
"""Largest distance in time of an averaged sample [standard deviations]."""


@dataclass(frozen=True)
class MuscleSignals:
    """Measured signals of the wearer's muscles, as `Sample.muscles` has them."""

    channels: int

    torque_Nm: float = CONTRACTION_NM
    """Standard deviation of the torque at each freedom of a whole contraction of each channel [N·m]; the sign is
    unknown."""


class MuscleModel:
    """Model of an arm with the map from muscle signals to torque after all other parameters.

    A muscle torque replaces torque of the motors. The expected torque is therefore that of the arm minus the map's:

        τ = τ_arm − B M (1 + D b(t)) (e_slow + f (e − e_slow))

    with the signals e of the channels, their slow part, the map M to each freedom of the arm, and the torque B of the
    motors per torque at the freedoms, which depends on the posture. The gain of each channel drifts by the parts D of
    b(t). The share f of the fast part is 1 for exact signals, and small if their fast part is mostly error. The
    parameters are M, row by row, then D, channel by channel, then f.
    """

    def __init__(
        self, model: TorqueModel, hidden: Hidden | None, signals: MuscleSignals, torque_at: slice | None = None
    ):
        """Extend `model`.

        Args:
            model: Model whose own hidden parameters have the prior `hidden`.
            hidden: Prior of these parameters.
            signals: Measured signals.
            torque_at: Parameters of `model` that are a torque at each freedom, positive in the direction in which it
                helps the motors, such as the spring offsets; None for a map to the joints of the motors.
        """
        self._model, self._channels, self._torque_at = model, signals.channels, torque_at
        self.n_joints = model.n_joints
        self._freedoms = self.n_joints if torque_at is None else torque_at.stop - torque_at.start
        self._mapped = self._freedoms * self._channels
        drifts = self._channels * len(DRIFT_TIMES_S)
        self._count = self._mapped + drifts + 1
        self.n_parameters = model.n_parameters + self._count
        sd, group = (np.zeros(0), np.zeros(0, dtype=int)) if hidden is None else (hidden.sd, hidden.group)
        of_map, of_drift = np.full(self._mapped, signals.torque_Nm), np.full(drifts, DRIFT_SHARE)
        self.hidden = Hidden(
            np.concatenate([sd, of_map, of_drift, [FAST_SHARE]]), np.append(group, np.full(self._count, FIXED))
        )
        """Prior of all hidden parameters."""

    def restart(self) -> None:
        """Start a new motion."""
        self._model.restart()

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m], as of the arm model."""
        return self._model.direction_uncertainty(v)

    def slipped(self, x: Parameters) -> Float[np.ndarray, " cuff"]:
        """Return the distance by which each cuff has slipped along the limb, RMS over the motion [m]."""
        return self._model.slipped(x[: -self._count]) if isinstance(self._model, Slipping) else np.zeros(0)

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] and its derivative; without signals, that of silent muscles."""
        tau, derivative = self._model.linearise(sample, x[: -self._count])
        # Without a closed posture the arm model returns zeros, and the sample must teach nothing.
        if sample.muscles is None or not derivative.any():
            return tau, np.hstack([derivative, np.zeros((len(tau), self._count))])
        by_torque = -np.eye(len(tau)) if self._torque_at is None else derivative[:, self._torque_at]
        own, parts = x[-self._count :], 1.0 - np.exp(-sample.t / np.array(DRIFT_TIMES_S))
        torque = own[: self._mapped].reshape(self._freedoms, self._channels)
        gain = 1.0 + own[self._mapped : -1].reshape(self._channels, -1) @ parts
        slow = sample.muscles if sample.muscles_slow is None else sample.muscles_slow
        fast = sample.muscles - slow
        shown = slow + own[-1] * fast
        by_map = (by_torque[:, :, None] * (gain * shown)).reshape(len(tau), -1)
        by_drift = ((by_torque @ (torque * shown))[:, :, None] * parts).reshape(len(tau), -1)
        by_share = by_torque @ (torque @ (gain * fast))
        columns = np.column_stack([by_map, by_drift, by_share])
        return tau + by_map @ own[: self._mapped], np.hstack([derivative, columns])


def with_slow_parts(samples: Sequence[Sample]) -> list[Sample]:
    """Return the samples with the slow part of their signals: means over `SMOOTHED_S` before and after each sample.

    The newest samples have neighbours on one side only, until later ones follow.
    """
    found = list(samples)
    signals = [(k, sample.t, sample.muscles) for k, sample in enumerate(samples) if sample.muscles is not None]
    if not signals:
        return found
    at, times, values = zip(*signals, strict=True)
    t, shown = np.array(times), np.array(values)
    total, weight = shown.copy(), np.ones(len(t))
    for apart in range(1, len(t)):
        distance = (t[apart:] - t[:-apart]) / SMOOTHED_S
        if distance.min() > REACH:
            break
        shared = np.where(distance <= REACH, np.exp(-0.5 * distance**2), 0.0)
        total[apart:] += shared[:, None] * shown[:-apart]
        total[:-apart] += shared[:, None] * shown[apart:]
        weight[apart:] += shared
        weight[:-apart] += shared
    for k, slow in zip(at, total / weight[:, None], strict=True):
        found[k] = replace(samples[k], muscles_slow=slow)
    return found
