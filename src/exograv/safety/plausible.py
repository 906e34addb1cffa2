"""Table of plausible torques: products of sines and cosines, in place of the model that the guard must not know."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.signals import Joints

GRAVITY_LEVEL_MAX = 1.8
"""Gravity level in the pull-up of a parabolic flight [-]; the arm is then pushed down with 0.8 of its weight."""


class Features:
    """Products of one factor per joint out of 1, cos and sin, 3ⁿ of them; the weight of a chain is a sum of these.

    The factor of the first joint changes fastest.
    """

    def __init__(self, joints: int, most_factors: int):
        digits = np.arange(3**joints) // 3 ** np.arange(joints)[:, None] % 3
        self.kept = np.flatnonzero(np.count_nonzero(digits, axis=0) <= most_factors)
        """Indices of the products with no more than `most_factors` factors beside 1."""
        self.count = len(self.kept)
        factors = np.ones((joints, 3))
        self._cos, self._sin = factors[:, 1], factors[:, 2]
        # Each step multiplies the products so far by the next joint's factors in place, so a tick allocates no array.
        self._steps, self._all = [], factors[0]
        for three in factors[1:]:
            product = np.empty((3, len(self._all)))
            self._steps.append((three[:, None], self._all[None, :], product))
            self._all = product.reshape(-1)

    def of(self, q: Joints) -> Float[np.ndarray, " product"]:
        """All 3ⁿ products at the joint angles of the chain [rad]; overwritten by the next call."""
        np.cos(q, self._cos)
        np.sin(q, self._sin)
        for factors, so_far, product in self._steps:
            factors.dot(so_far, product)  # outer product, in a quarter of the time of `np.multiply`
        return self._all


@dataclass(frozen=True)
class LimbTable:
    """Table of one limb, whose joints carry nothing of another limb."""

    joints: tuple[int, ...]
    """Indices of the limb's joints in each per-joint array."""

    most_factors: int
    """Largest number of factors of a product in `Features`."""

    exo: Float[np.ndarray, "joint feature"]
    """Torque that carries the machine [N·m]."""

    arm: Float[np.ndarray, "joint feature"]
    """Torque that carries the whole weight of the arm in it [N·m]."""


@dataclass(frozen=True)
class PlausibleTable:
    """Gravity torque of a machine and of the person's arm in it, over all postures.

    The table is made when a person's parameters are accepted (`session`), with a bound on its error. After that neither
    control nor identification can change it.
    """

    chains: tuple[LimbTable, ...]

    error: Joints
    """The table's largest error over the postures that it was checked at [N·m]."""

    dry: Joints
    """Largest torque of the calibrated friction of a joint at rest or in slow motion, under load [N·m]."""

    viscous: Joints
    """Further friction torque per unit of speed [N·m·s/rad]."""

    def __post_init__(self):
        joints = sorted(joint for chain in self.chains for joint in chain.joints)
        if joints != list(range(len(self.error))):
            raise ConfigError(f"The plausible table has joints {joints}; it must have each of {len(self.error)} once.")
        for name, values in (("error", self.error), ("dry", self.dry), ("viscous", self.viscous)):
            if not (np.isfinite(values) & (values >= 0.0)).all():
                raise ConfigError(f"The plausible table's {name} is {values}; it must be finite and not negative.")
        if not all(np.isfinite(part).all() for chain in self.chains for part in (chain.exo, chain.arm)):
            raise ConfigError("The plausible table has entries that are not finite. Compute it again.")

    @cached_property
    def _ready(self) -> list["_Ready"]:
        return [_Ready(chain) for chain in self.chains]

    def torque(self, q: Joints | Sequence[float], gravity_level: float) -> list[float]:
        """Torque that carries machine and arm at rest, where the arm feels `gravity_level` of its weight.

        Args:
            q: Joint positions (joint,) [rad].
            gravity_level: 0 to `GRAVITY_LEVEL_MAX`; above 1 the arm is pushed down.

        Returns:
            Torque of each joint [N·m].
        """
        tau = [0.0] * len(q)
        for chain in self._ready:
            found = chain.torque(np.array([q[joint] for joint in chain.joints]), gravity_level)
            for joint, one in zip(chain.joints, found, strict=True):
                tau[joint] = one
        return tau


class _Ready:
    """Table of one chain, with zeros for the products that it does not use."""

    def __init__(self, chain: LimbTable):
        self.joints, self._features = chain.joints, Features(len(chain.joints), chain.most_factors)
        self._exo, self._arm = np.zeros((2, len(chain.joints), 3 ** len(chain.joints)))
        self._exo[:, self._features.kept], self._arm[:, self._features.kept] = chain.exo, chain.arm
        self._level, self._at_level = math.nan, self._exo

    def torque(self, q: Joints, gravity_level: float) -> list[float]:
        """Torques of the chain's joints [N·m] at their positions [rad]."""
        if gravity_level != self._level:
            self._level, self._at_level = gravity_level, self._exo + (1.0 - gravity_level) * self._arm
        return self._at_level.dot(self._features.of(q)).tolist()
