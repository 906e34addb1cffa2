"""Table of plausible torques: products of sines and cosines, in place of the model that the guard must not know."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.signals import Joints

from .native import core
from .record import GuardRecord

GRAVITY_LEVEL_MAX = core.GRAVITY_LEVEL_MAX


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

    def packed(self) -> "array[float]":
        """Table as the flat numbers that `core.carried` reads, with places for what it computes."""
        parts = [_packed(chain) for chain in self.chains]
        return array("d", [float(len(parts)), math.nan, *np.concatenate(parts)])

    @cached_property
    def _alone(self) -> tuple["GuardRecord", "array[float]"]:
        return GuardRecord(len(self.error), 0.0), self.packed()

    def torque(self, q: Joints | Sequence[float], gravity_level: float) -> list[float]:
        """Torque that carries machine and arm at rest, where the arm feels `gravity_level` of its weight.

        Args:
            q: Joint positions (joint,) [rad].
            gravity_level: 0 to `GRAVITY_LEVEL_MAX`; above 1 the arm is pushed down.

        Returns:
            Torque of each joint [N·m].
        """
        record, table = self._alone
        record.put(core.Q, np.asarray(q))
        record.carried(table, gravity_level)
        return record.of(core.CARRIED).tolist()


def _packed(chain: LimbTable) -> Float[np.ndarray, " number"]:
    """Numbers of one limb: sizes, joints, runs of products, tables, and places for what is computed."""
    joints = len(chain.joints)
    kept = Features(joints, chain.most_factors).kept.tolist()
    order, runs = _runs(joints, chain.most_factors)
    place = {index: at for at, index in enumerate(kept)}
    columns, padded = [place[index] for index in order], -len(order) % 8
    empty = np.zeros((joints, padded))
    tables = [np.hstack([part[:, columns], empty]).ravel() for part in (chain.exo, chain.arm)]
    places = np.zeros(joints * (len(order) + padded) + 2 * joints + len(order) + padded)
    sizes = [joints, len(order) + padded, len(runs), *chain.joints]
    return np.concatenate([sizes, np.ravel(runs), *tables, places])


def _runs(joints: int, most_factors: int) -> tuple[list[int], list[tuple[int, int, int, int]]]:
    """Order the products by number of factors, then by last joint, so that neighbours have neighbours as parents.

    Returns:
        Index of each product in `Features`, and the runs: first parent, number of parents, joint, first child.
    """
    order, runs = [0], list[tuple[int, int, int, int]]()
    parents, begin = [(-1, 0)], 0  # last joint and index of each product with one factor less
    for _ in range(min(joints, most_factors)):
        products = list[tuple[int, int]]()
        first = len(order)
        for j in range(joints):
            some = [index for last, index in parents if last < j]
            if some:
                runs.append((begin, len(some), j, first + len(products)))
                products += [(j, index + digit * 3**j) for digit in (1, 2) for index in some]
        order += [index for _, index in products]
        parents, begin = products, first
    return order, runs
