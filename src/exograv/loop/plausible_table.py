"""Builder of the guard's torque table from the model. It runs once, when a person's parameters are accepted."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from exograv.control.resting import RestingTorque
from exograv.control.tick import ControlMode
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout, Parameters
from exograv.errors import ModelError
from exograv.model.assembly import Assembly
from exograv.safety.plausible import GRAVITY_LEVEL_MAX, Features, LimbTable, PlausibleTable
from exograv.sobol import sobol_points

MOST_FACTORS = 4
"""Largest number of joints whose sines and cosines are multiplied. Four joints are exact; beyond that the table's error
contains the missing products."""

ROW_MOST = 256
"""Largest number of products in the row of a joint. Products with more factors are in the limb's potential, where the
joints share their numbers: the time of a tick grows with the numbers. Up to five joints need no potential."""

PER_FEATURE = 4
"""Number of fitted postures per feature."""

RIDGE_SHARE = 1e-12
"""Weight of the potential's size in its fit, as a share of the mean variance of its slopes [-]. Over a narrow range of
angles some products hardly differ. Shares from 1e-14 to 1e-9 gave the same errors (recupera_like_7)."""

CHECKED = 2048
"""Number of postures for the error, apart from the fitted ones. With a probability of 1 − 10⁻⁶ at most 0.7 % of all
postures exceed the error found (0.993²⁰⁴⁸ < 10⁻⁶)."""

CLOSED_SHARE_MIN = 0.3
"""Smallest share of postures at which the arm lies in its cuffs. Below it, little more than one posture per product
remains for the fit.

Arms drawn from the prior lay in their cuffs in 86 to 100 % of the postures (eight arms, four and seven joints)."""

MARGIN_SD = 3.0
"""Half-width of the plausible range of the arm's torque, in standard deviations [-]."""

ROUNDING_SHARE = 1e-12
"""Share of the largest eigenvalue below which a variance is rounding error [-]."""

Postures = Float[np.ndarray, "posture joint"]
Joints = Float[np.ndarray, " joint"]
Phi = Float[np.ndarray, " phi"]
Covariance = Float[np.ndarray, "parameter parameter"]


class TableMaker:
    """Maker of tables for one arm in one machine. The slow steps are done once, so that later tables are quick."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine, x: Parameters):
        """Find the rest postures of the arm.

        Args:
            assembly: The machine with the person's arm in it.
            machine: The machine as calibrated.
            x: Parameters of this arm, or of an arm that lies in the cuffs in nearly the same way.
        """
        self._assembly, self._machine = assembly, machine
        self.resting = RestingTorque(assembly, machine)
        most = max(Features(len(joints), MOST_FACTORS).count for joints in _chains(assembly))
        self._postures = _postures(assembly, PER_FEATURE * most + CHECKED)
        self._x, self._z = x, self.resting.cold_start(self._postures, x)

    def table(self, x: Parameters, payload: Phi | None = None, margin: Joints | None = None) -> PlausibleTable:
        """Table of the torque that carries machine and arm, over all postures within the joints' limits.

        Args:
            x: The person's parameters as accepted.
            payload: Payload of the arm, carried in full at every gravity level; none if absent.
            margin: Torque uncertainty while the arm is not known well (joint,) [N·m]; added to the table's error.

        Raises:
            ModelError: The arm lies in its cuffs in too few postures.
        """
        z = self._in_cuffs_alone(x)
        carried, closed = _torques(self.resting, self._postures, z, x)
        if payload is not None:
            loaded = x.copy()
            loaded[ParameterLayout.of(self._assembly).phi] += payload
            found = self.resting(self._postures, self._same(loaded), z)
            carried = {level: tau + (found.tau_desired - carried[0.0]) for level, tau in carried.items()}
            closed = closed & found.is_closed
        name = self._assembly.description.name
        if closed.mean() < CLOSED_SHARE_MIN:
            raise ModelError(
                f"The arm lies in the cuffs of {name} in only {closed.mean():.0%} of the postures that its joints "
                f"allow; {CLOSED_SHARE_MIN:.0%} are needed for the guard's table. Correct the joints' limits in the "
                "URDF."
            )
        table = self._fitted(x, {level: tau[closed] for level, tau in carried.items()}, self._postures[closed])
        return table if margin is None else replace(table, error=table.error + margin)

    def margin(self, x: Parameters, covariance: Covariance, q: Postures) -> Joints:
        """Uncertainty (joint,) of the torque that carries an arm, over all postures `q` [rad] [N·m].

        Three standard deviations of the torque under `covariance`, at the posture with the largest value. Cuffs make
        the torque non-linear: of a step forwards and one backwards along each principal axis, the larger counts.
        """
        z = self.resting.cold_start(q, x)
        known = self.resting(q, np.tile(x, (len(q), 1)), z)
        values, vectors = np.linalg.eigh(covariance)
        some = values > ROUNDING_SHARE * values.max()
        steps = (vectors[:, some] * np.sqrt(values[some])).T
        arms = x + np.vstack([steps, -steps])
        found = self.resting(
            np.tile(q, (len(arms), 1)),
            np.repeat(arms, len(q), axis=0),
            np.tile(known.z, (len(arms), 1)),
            x_start=np.tile(x, (len(arms) * len(q), 1)),
        )
        off = found.tau_desired.reshape(len(arms), len(q), -1) - known.tau_desired
        usable = known.is_closed & found.is_closed.reshape(len(arms), -1).all(axis=0)
        larger = np.abs(off[:, usable]).reshape(2, len(steps), -1, off.shape[2]).max(axis=0)
        return MARGIN_SD * np.sqrt((larger**2).sum(axis=0)).max(axis=0)

    def _in_cuffs_alone(self, x: Parameters) -> Postures:
        """Posture of this weightless arm [rad], with a warm start from the arm for which the postures were found."""
        light = self.resting.weightless(self._same(x))
        return self.resting(self._postures, light, self._z, x_start=self.resting.weightless(self._same(self._x))).z

    def _same(self, x: Parameters) -> Float[np.ndarray, "posture parameter"]:
        return np.tile(x, (len(self._postures), 1))

    def _fitted(self, x: Parameters, carried: dict[float, Postures], postures: Postures) -> PlausibleTable:
        assembly = self._assembly
        checked = slice(len(postures) - round(len(postures) / len(self._postures) * CHECKED), None)
        fitted = slice(0, checked.start)
        exo, arm = carried[1.0], carried[0.0] - carried[1.0]
        chains = tuple(_chain(joints, postures[fitted], exo[fitted], arm[fitted]) for joints in _chains(assembly))
        dry, viscous = _dry(assembly, self._machine, x, carried[0.0]), x[ParameterLayout.of(assembly).viscous]
        table = PlausibleTable(chains, np.zeros(assembly.n), dry, viscous)
        off = [
            np.abs([table.torque(q, level) for q in postures[checked]] - tau[checked]) for level, tau in carried.items()
        ]
        return replace(table, error=np.max(off, axis=(0, 1)))


def _torques(
    resting: RestingTorque, postures: Postures, z: Float[np.ndarray, "posture freedom"], x: Parameters
) -> tuple[dict[float, Postures], Bool[np.ndarray, " posture"]]:
    """Torque that carries machine and arm by gravity level, and True where a rest posture was found at all levels."""
    arms = np.tile(x, (len(postures), 1))
    carried, closed = dict[float, Postures](), np.ones(len(postures), dtype=bool)
    for level in (0.0, 1.0, GRAVITY_LEVEL_MAX):
        found = resting(postures, arms, z, ControlMode(gravity_level=level))
        carried[level], closed = found.tau_desired, closed & found.is_closed
    return carried, closed


def _postures(assembly: Assembly, count: int) -> Postures:
    """Postures spread over the whole range of the joints' limits [rad]."""
    lower, upper = np.array([(joint.lower, joint.upper) for joint in assembly.exo.joints]).T
    return lower + sobol_points(assembly.n, count) * (upper - lower)


def _chains(assembly: Assembly) -> list[tuple[int, ...]]:
    """List the groups of joints that carry each other: all joints that hang from the same joint of the base."""
    joints, root = assembly.exo.joints, dict[int, int]()
    for j, joint in enumerate(joints):
        root[j] = root[joint.parent] if joint.parent >= 0 else j
    return [tuple(j for j in root if root[j] == first) for first in sorted(set(root.values()))]


def row_factors(joints: int) -> int:
    """Largest number of factors of a product in a joint's own row."""
    return max(k for k in range(1, MOST_FACTORS + 1) if k == 1 or Features(joints, k).count <= ROW_MOST)


def _chain(joints: tuple[int, ...], postures: Postures, exo: Postures, arm: Postures) -> LimbTable:
    at, most = list(joints), row_factors(len(joints))
    in_row, further = Features(len(joints), most), Features(len(joints), MOST_FACTORS, most + 1)
    both = [(all_of[in_row.kept], all_of[further.kept]) for all_of in map(in_row.of, postures[:, at])]
    F, products = (np.array(part) for part in zip(*both, strict=True))
    torque = np.stack([exo[:, at], arm[:, at]], axis=2)
    if further.count == 0:
        table = np.linalg.lstsq(F, np.hstack([exo[:, at], arm[:, at]]), rcond=None)[0].T
        return LimbTable(joints, most, table[: len(at)], table[len(at) :])
    potential = _potential(F, further, products, torque)
    for j in range(len(at)):
        places, slopes = further.slopes(j, products)
        torque[:, j] -= slopes @ potential[places]
    table = np.linalg.lstsq(F, np.hstack([torque[:, :, 0], torque[:, :, 1]]), rcond=None)[0].T
    return LimbTable(joints, most, table[: len(at)], table[len(at) :], MOST_FACTORS, potential.T)


def _potential(
    F: Float[np.ndarray, "posture feature"],
    further: Features,
    products: Float[np.ndarray, "posture further"],
    torque: Float[np.ndarray, "posture joint part"],
) -> Float[np.ndarray, "further part"]:
    """Fit the potential to the torque minus the rows of the joints, which are sums of `F` (least squares)."""
    basis = np.linalg.qr(F)[0]
    normal, right = np.zeros((further.count, further.count)), np.zeros((further.count, torque.shape[2]))
    for j in range(torque.shape[1]):
        places, slopes = further.slopes(j, products)
        slopes -= basis @ (basis.T @ slopes)
        normal[np.ix_(places, places)] += slopes.T @ slopes
        right[places] += slopes.T @ torque[:, j]
    normal[np.diag_indices(further.count)] += RIDGE_SHARE * np.trace(normal) / further.count
    return np.linalg.solve(normal, right)


def _dry(
    assembly: Assembly, machine: CalibratedMachine, x: Parameters, carried: Postures
) -> Float[np.ndarray, " joint"]:
    """Upper bound of the calibrated dry friction: breakaway under the heaviest load [N·m]."""
    friction, coulomb = machine.friction, x[ParameterLayout.of(assembly).coulomb]
    loaded = np.asarray(friction.load_share) * np.abs(carried).max(axis=0)
    return coulomb * np.maximum(np.asarray(friction.breakaway), 1.0) + loaded + np.abs(np.asarray(friction.asymmetry))
