"""Laws of friction from which the recordings choose, each a restriction of the next one's parameters."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from exograv.identification.calibration.empty_prior import PER_JOINT, EmptyPrior

TWIN_PER_JOINT = (*PER_JOINT, "viscous_power")
"""Unknowns of every joint of a twin: those of a calibration, and the power of the speed in viscous friction."""

LAWS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "coulomb-viscous": (),
        "asymmetric": ("asymmetry",),
        "stribeck": ("breakaway", "log_v_stribeck"),
        "stribeck-asymmetric": ("breakaway", "log_v_stribeck", "asymmetry"),
        "stribeck-asymmetric-load": ("breakaway", "log_v_stribeck", "asymmetry", "load_share"),
        "stribeck-asymmetric-load-power": ("breakaway", "log_v_stribeck", "asymmetry", "load_share", "viscous_power"),
    }
)
"""Parameters of each law beside Coulomb and viscous friction, from the simplest law to the richest."""

ABSENT: Mapping[str, float] = MappingProxyType(
    {"asymmetry": 0.0, "breakaway": 1.0, "load_share": 0.0, "viscous_power": 1.0}
)
"""Value of each parameter in a law without it. The Stribeck speed has no effect if the breakaway is 1."""

LITTLE = 0.02
"""Excess of the mean logarithm of the loss that is worth no further parameter [-]."""

FIXED_SD = 1e-5
"""Standard deviation of a parameter that a law does not have."""


def of_laws(prior: EmptyPrior, laws: tuple[str, ...]) -> EmptyPrior:
    """Return the prior of a machine whose joints have these laws of friction."""
    mean, covariance = prior.mean.copy(), prior.covariance.copy()
    for joint, law in enumerate(laws):
        for name, value in ABSENT.items():
            if name not in LAWS[law]:
                k = prior.layout.of(name).start + joint
                mean[k] = value
                covariance[k, :] = covariance[:, k] = 0.0
                covariance[k, k] = FIXED_SD**2
    return EmptyPrior(prior.layout, mean, covariance)


@dataclass(frozen=True)
class LawChoice:
    """Law of friction that a joint's recordings chose, and the laws that were compared."""

    law: str
    excess: Mapping[str, float]
    """Mean excess of the logarithm of the held-out loss over that of the best law, by law [-]."""

    excess_sd: Mapping[str, float]
    """Standard deviation of this mean [-]."""


def chosen_laws(losses: Mapping[str, np.ndarray], blocks: np.ndarray) -> tuple[LawChoice, ...]:
    """Choose the simplest law of each joint that the held-out samples do not contradict.

    Args:
        losses: Squared residual over noise of each held-out sample and joint by law (sample, joint) [-]; NaN where a
            sample does not count.
        blocks: Block of the recording of each sample, with independent errors.
    """
    names = list(losses)
    joints = losses[names[0]].shape[1]
    return tuple(_chosen({name: losses[name][:, joint] for name in names}, blocks) for joint in range(joints))


def _chosen(losses: Mapping[str, np.ndarray], blocks: np.ndarray) -> LawChoice:
    """Choose the first law whose loss exceeds that of the best by chance or by little.

    Logarithms of the blocks' losses are compared: a few blocks with a large loss must not hide the others.
    """
    by_block = {name: _by_block(loss, blocks) for name, loss in losses.items()}
    best = min(by_block, key=lambda name: float(by_block[name].mean()))
    excess = {name: loss - by_block[best] for name, loss in by_block.items()}
    mean = {name: float(one.mean()) for name, one in excess.items()}
    sd = {name: float(one.std() / np.sqrt(len(one))) for name, one in excess.items()}
    law = next(name for name in by_block if mean[name] <= min(sd[name], LITTLE))
    return LawChoice(law, mean, sd)


def _by_block(loss: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Logarithm of the mean loss of each block that has samples."""
    counts = np.isfinite(loss)
    return np.array([np.log(loss[counts & (blocks == k)].mean()) for k in np.unique(blocks[counts])])
