"""What a torque may plausibly be: a table of sines and cosines in place of the model that the guard must not know."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError

Joints = Float[np.ndarray, " joint"]

GRAVITY_LEVEL_MAX = 1.8
"""Of the pull-up of a parabola [-]; the arm is then pushed down with 0.8 of its weight."""


class Features:
    """Products of one of 1, cos and sin a joint, 3ⁿ of them: the weight of a chain is a sum of these."""

    def __init__(self, joints: int, most_factors: int):
        digits = np.arange(3**joints) // 3 ** np.arange(joints)[:, None] % 3
        few = np.count_nonzero(digits, axis=0) <= most_factors
        self._values = np.ones((joints, 3))
        self._flat = self._values.reshape(-1)
        self._places = 3 * np.arange(joints)[:, None] + digits[:, few]
        self.count = self._places.shape[1]
        """Of the products with no more than so many factors beside 1."""

    def of(self, q: Joints) -> Float[np.ndarray, " feature"]:
        """At the angles of the chain's joints [rad]."""
        np.cos(q, out=self._values[:, 1])
        np.sin(q, out=self._values[:, 2])
        return np.multiply.reduce(self._flat[self._places])


@dataclass(frozen=True)
class Chain:
    """One limb's table: its joints carry nothing of another limb."""

    joints: tuple[int, ...]
    """Their places in every per-joint array."""

    most_factors: int
    """Of `Features`."""

    exo: Float[np.ndarray, "joint feature"]
    """Torque that carries the machine [N·m]."""

    arm: Float[np.ndarray, "joint feature"]
    """Torque that carries the whole weight of the arm in it [N·m]."""


@dataclass(frozen=True)
class PlausibleTable:
    """Gravity torque of a machine and of the person's arm in it, over all postures.

    Made when a person's parameters are accepted (`session`), with a bound on its error; from then on nothing that
    control or identification does can change it.
    """

    chains: tuple[Chain, ...]

    error: Joints
    """The table's largest error over the postures that it was checked at [N·m]."""

    dry: Joints
    """Torque that the calibrated friction of a joint can take at most at rest or slow motion, under load [N·m]."""

    viscous: Joints
    """What it takes more per speed [N·m·s/rad]."""

    def __post_init__(self):
        joints = sorted(joint for chain in self.chains for joint in chain.joints)
        if joints != list(range(len(self.error))):
            raise ConfigError(f"The plausible table has joints {joints}; it must have each of {len(self.error)} once.")
        for name, values in (("error", self.error), ("dry", self.dry), ("viscous", self.viscous)):
            if not (np.isfinite(values) & (values >= 0.0)).all():
                raise ConfigError(f"The plausible table's {name} is {values}; it must be finite and not negative.")
        if not all(np.isfinite(part).all() for chain in self.chains for part in (chain.exo, chain.arm)):
            raise ConfigError("The plausible table has entries that are not finite. Make it anew.")

    @cached_property
    def _stacked(self) -> list[tuple[list[int], Features, np.ndarray]]:
        """Of each chain: joints, features, and both tables in one."""
        return [
            (list(c.joints), Features(len(c.joints), c.most_factors), np.vstack([c.exo, c.arm])) for c in self.chains
        ]

    def torque(self, q: Joints, gravity_level: float) -> Joints:
        """Torque that carries machine and arm at `q` [rad] at rest, where the arm feels `gravity_level` of its weight.

        Args:
            q: Joint positions (joint,) [rad].
            gravity_level: 0 to `GRAVITY_LEVEL_MAX`; above 1 the arm is pushed down.
        """
        tau = np.empty(len(q))
        for joints, features, table in self._stacked:
            both = table @ features.of(q[joints])
            n = len(joints)
            tau[joints] = both[:n] + (1.0 - gravity_level) * both[n:]
        return tau
