"""Path on which a weight is most informative: to and fro, faster than a restless wearer's torque changes.

A wearer who should be relaxed adds a slow torque that changes over seconds. It hardly imitates a weight torque that
changes every second or two. So the largest change of torque at a quick pace matters, not the longest lever. The
weight's own inertia is less informative than gravity, because the weight swings in the soft cuffs.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.dynamics import parameters
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.prior import disturbance_sd
from exograv.motion import Cycles

from .slow_torque import CORRELATION_S

Joints = Float[np.ndarray, " joint"]

MODEL_ERROR_NM = 0.1  # between two postures; only a larger change of torque helps against it, not more time
PERIOD_MIN_S = 3.0  # of a sine; in a shorter period a weight would swing in the cuffs
LISTEN_S = 30.0
EASE_S = 1.0  # from rest to the sine's speed


@dataclass(frozen=True)
class WeighingPath:
    """Path from one posture to another and back."""

    low: Joints
    """First posture, in which less torque is needed [rad]."""

    high: Joints
    """Second posture, at the other end of the path [rad]."""

    speed: float
    """Largest speed of a joint [rad/s]."""

    @property
    def period_s(self) -> float:
        """Duration of one cycle, there and back [s]."""
        return _period(self.low, self.high, self.speed)

    def cycles(self, seconds: float, dt: float) -> Cycles:
        """Return a sine from `low` to `high` and back, once or as often as fits into `seconds`; it ends at `low`.

        A path with harmonics would make a weight swing in the soft cuffs, and would rest for longer at its ends.
        """
        count = max(1, round((seconds - EASE_S) / self.period_s))
        return Cycles(self.low, self.high, self.period_s, count, EASE_S, dt)


def _period(start: Joints, goal: Joints, speed: float) -> float:
    """Period of a sine between two postures with this largest speed [s]."""
    return max(PERIOD_MIN_S, np.pi * float(np.abs(goal - start).max()) / speed)


def informative_path(
    model: ArmModel,
    x: parameters.Parameters,
    added: Float[np.ndarray, " phi"],
    speed: float,
    postures: Float[np.ndarray, "posture joint"],
) -> WeighingPath:
    """Return the path on which the masses `added` to the arm are most informative.

    The criterion is signal over noise, summed over the joints. Signal is the squared change of torque between two
    postures; noise is the slow torque's power at the frequency of the path, and the model's own error.

    Args:
        model: Model of this arm in its machine.
        x: Parameters of the arm.
        added: Unknown weight, as a change of the arm's inertial parameters.
        speed: Largest speed of a joint [rad/s].
        postures: Two postures or more; every pair is a possible path [rad].
    """
    phi = parameters.ParameterLayout.of(model.assembly).phi
    loaded = x.copy()
    loaded[phi] += added
    asked = np.array([model.at_rest(q, loaded)[1][:, phi] @ added for q in postures])
    pairs = list(itertools.combinations(range(len(postures)), 2))
    omega = np.array([2.0 * np.pi / _period(postures[i], postures[j], speed) for i, j in pairs])
    changes = [asked[i] - asked[j] for i, j in pairs]
    told = [
        float(np.sum(d**2 / (_slow_power(model, w) + MODEL_ERROR_NM**2))) for d, w in zip(changes, omega, strict=True)
    ]
    # The path begins at the posture with the smaller torque.
    low, high = sorted(pairs[int(np.argmax(told))], key=lambda i: float(np.abs(asked[i]).sum()))
    return WeighingPath(postures[low], postures[high], speed)


def _slow_power(model: ArmModel, omega: float) -> Joints:
    """Power of a wearer's slow torque in the amplitude of an angular frequency, after `LISTEN_S` (joint,) [N²·m²]."""
    sd = disturbance_sd(model.assembly.description.places)
    return 4.0 * sd**2 * CORRELATION_S / (1.0 + (omega * CORRELATION_S) ** 2) / LISTEN_S
