"""Table of plausible torques: products of sines and cosines, in place of the model that the guard must not know."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from exograv.errors import ConfigError
from exograv.signals import Joints

from .native import core
from .record import GuardRecord

GRAVITY_LEVEL_MAX = core.GRAVITY_LEVEL_MAX


class Features:
    """Products of one factor per joint out of 1, cos and sin, 3ⁿ of them; the weight of a chain is a sum of these.

    The factor of the first joint changes fastest.
    """

    def __init__(self, joints: int, most_factors: int, least_factors: int = 0):
        digits = np.arange(3**joints) // 3 ** np.arange(joints)[:, None] % 3
        factors = np.count_nonzero(digits, axis=0)
        self.kept = np.flatnonzero((least_factors <= factors) & (factors <= most_factors))
        """Indices of the products with `least_factors` to `most_factors` factors beside 1."""
        self._digits = digits[:, self.kept]
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

    def slopes(
        self, j: int, products: Float[np.ndarray, "posture product"]
    ) -> tuple[Int[np.ndarray, " some"], Float[np.ndarray, "posture some"]]:
        """Return the derivatives of the kept products by the angle of joint `j`.

        Returns:
            Places among the kept products that depend on the angle, and their derivatives.
        """
        places = np.flatnonzero(self._digits[j])
        is_cosine = self._digits[j, places] == 1
        other = self.kept[places] + np.where(is_cosine, 3**j, -(3**j))  # sine for cosine, cosine for sine
        return places, np.where(is_cosine, -1.0, 1.0) * products[:, np.searchsorted(self.kept, other)]


def _no_potential() -> Float[np.ndarray, "part further"]:
    return np.zeros((2, 0))


@dataclass(frozen=True)
class LimbTable:
    """Table of one limb, whose joints carry nothing of another limb.

    The torque of a joint is a sum of products of `Features`, by numbers of its own. A limb of many joints also has a
    potential, a sum of products with more factors; the torque of a joint contains its derivative by the joint's angle.
    """

    joints: tuple[int, ...]
    """Indices of the limb's joints in each per-joint array."""

    most_factors: int
    """Largest number of factors of a product in a joint's own sum."""

    exo: Float[np.ndarray, "joint feature"]
    """Torque that carries the machine [N·m]."""

    arm: Float[np.ndarray, "joint feature"]
    """Torque that carries the whole weight of the arm in it [N·m]."""

    potential_factors: int = 0
    """Largest number of factors of a product in the potential; 0 without a potential, as in older recordings."""

    potential: Float[np.ndarray, "part further"] = field(default_factory=_no_potential)
    """Potential of the machine, and of the whole weight of the arm in it, for the products with more than
    `most_factors` factors [N·m]."""


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
        parts = [part for chain in self.chains for part in (chain.exo, chain.arm, chain.potential)]
        if not all(np.isfinite(part).all() for part in parts):
            raise ConfigError("The plausible table has entries that are not finite. Compute it again.")

    def packed(self) -> "array[float]":
        """Table as the flat numbers that `core.carried` reads, with room for its results."""
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
    """Numbers of one limb as `core.carried` reads them."""
    joints = len(chain.joints)
    most = min(joints, max(chain.most_factors, chain.potential_factors))
    order, runs = _runs(joints, most)
    row = Features(joints, chain.most_factors).count
    inner = max(row, 1 + 2 * joints) if most <= chain.most_factors else Features(joints, most - 1).count
    products, values, leaves = _padded(row), _padded(inner), max(len(order) - inner, 0)
    ahead = sum(first < inner for *_, first in runs)
    runs = [(*some, first if k < ahead else first + values - inner) for k, (*some, first) in enumerate(runs)]
    tables = [_in_order(part, order[:row], joints, products).ravel() for part in (chain.exo, chain.arm)]
    if leaves:
        potentials = _in_order(chain.potential, order[row:], joints, len(order) - row)
        steady = np.hstack([np.zeros((2, row)), potentials[:, : inner - row], np.zeros((2, 2 * values - inner))])
        tables = [np.concatenate(parts) for parts in zip(tables, steady, potentials[:, inner - row :], strict=True)]
    sizes = [joints, products, values, leaves, ahead, len(runs), *chain.joints]
    return np.concatenate([sizes, np.ravel(runs), *tables, np.zeros(len(tables[0]) + values)])


def _padded(count: int) -> int:
    """Smallest multiple of eight from `count` on."""
    return count + -count % 8


def _in_order(
    part: Float[np.ndarray, "row product"], order: list[int], joints: int, width: int
) -> Float[np.ndarray, "row number"]:
    """Columns of a table, sorted by index in `Features`, in the order of `core.carried`; then zeros."""
    columns = np.searchsorted(np.sort(order), order)
    return np.hstack([part[:, columns], np.zeros((len(part), width - len(order)))])


def _runs(joints: int, most_factors: int) -> tuple[list[int], list[tuple[int, int, int, int]]]:
    """Order the products by number of factors, then by last joint, so that neighbours have neighbours as parents.

    Returns:
        Index of each product in `Features`, and the runs that make those of two factors and more: first parent, number
        of parents, cosine of the joint, first child.
    """
    order, runs = [0], list[tuple[int, int, int, int]]()
    parents = [(j, digit * 3**j) for j in range(joints) for digit in (1, 2)]
    begin = 1  # place of the first product with one factor less
    for _ in range(min(joints, most_factors) - 1):
        products = list[tuple[int, int]]()
        order += [index for _, index in parents]
        first = len(order)
        for j in range(joints):
            some = [index for last, index in parents if last < j]
            if some:
                runs.append((begin, len(some), 1 + 2 * j, first + len(products)))
                products += [(j, index + digit * 3**j) for digit in (1, 2) for index in some]
        parents, begin = products, first
    return order + [index for _, index in parents if most_factors > 0], runs
