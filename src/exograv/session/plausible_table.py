"""Makes the guard's table from the model, once, when a person's parameters are accepted."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from exograv.control.resting import RestingTorque
from exograv.control.tick import Mode
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Layout, Parameters
from exograv.errors import ModelError
from exograv.model.assembly import Assembly
from exograv.safety.plausible import GRAVITY_LEVEL_MAX, Chain, Features, PlausibleTable

MOST_FACTORS = 4
"""Joints whose sines and cosines are multiplied; what more would bring, the error says. Four joints are exact."""

PER_FEATURE = 4
"""Postures to fit one feature by."""

CHECKED = 2048
"""Postures, others than the fitted ones, at which the error is taken: with a probability of 1 − 10⁻⁶ it is not exceeded
in more than 0.7 % of all postures (0.993²⁰⁴⁸ < 10⁻⁶)."""

CLOSED_SHARE_MIN = 0.5
"""Share of the postures at which the arm lies in its cuffs; with less there is no table to trust [-]."""

Postures = Float[np.ndarray, "posture joint"]


def plausible_table(
    assembly: Assembly, machine: CalibratedMachine, x: Parameters, resting: RestingTorque | None = None
) -> PlausibleTable:
    """Table of the torque that carries machine and arm, over all postures that the joints allow.

    Args:
        assembly: The machine with the person's arm in it.
        machine: As calibrated.
        x: The person's parameters as accepted.
        resting: Of the same, where there is one already.

    Raises:
        ModelError: The arm lies in its cuffs in too few postures.
    """
    resting = resting or RestingTorque(assembly, machine)
    most = max(Features(len(joints), MOST_FACTORS).count for joints in _chains(assembly))
    postures = _postures(assembly, PER_FEATURE * most + CHECKED)
    carried, closed = _torques(resting, postures, x)
    if closed.mean() < CLOSED_SHARE_MIN:
        raise ModelError(
            f"The arm lies in the cuffs of {assembly.description.name} in only {closed.mean():.0%} of the postures "
            f"that its joints allow; {CLOSED_SHARE_MIN:.0%} are needed for the guard's table. Correct the joints' "
            "limits in the URDF."
        )
    postures, carried = postures[closed], {level: tau[closed] for level, tau in carried.items()}
    checked = slice(len(postures) - round(closed.mean() * CHECKED), None)
    fitted = slice(0, checked.start)
    exo, arm = carried[1.0], carried[0.0] - carried[1.0]
    chains = tuple(_chain(joints, postures[fitted], exo[fitted], arm[fitted]) for joints in _chains(assembly))
    dry, viscous = _dry(assembly, machine, x, carried[0.0]), x[Layout.of(assembly).viscous]
    table = PlausibleTable(chains, np.zeros(assembly.n), dry, viscous)
    off = [np.abs([table.torque(q, level) for q in postures[checked]] - tau[checked]) for level, tau in carried.items()]
    return replace(table, error=np.max(off, axis=(0, 1)))


def _torques(
    resting: RestingTorque, postures: Postures, x: Parameters
) -> tuple[dict[float, Postures], Bool[np.ndarray, " posture"]]:
    """What carries machine and arm at three gravity levels, and whether the posture was found at all of them."""
    arms, z = np.tile(x, (len(postures), 1)), resting.cold_start(postures, x)
    carried, closed = dict[float, Postures](), np.ones(len(postures), dtype=bool)
    for level in (0.0, 1.0, GRAVITY_LEVEL_MAX):
        found = resting(postures, arms, z, Mode(gravity_level=level))
        carried[level], z, closed = found.tau_desired, found.z, closed & found.is_closed
    return carried, closed


def _postures(assembly: Assembly, count: int) -> Postures:
    """Spread over everything that the joints' limits allow [rad]."""
    from scipy.stats import qmc  # 0.3 s that no tick has to wait for

    lower, upper = np.array([(joint.lower, joint.upper) for joint in assembly.exo.joints]).T
    exponent = int(np.ceil(np.log2(count)))
    points = qmc.Sobol(assembly.n, scramble=False).random_base2(exponent)
    return lower + points * (upper - lower)


def _chains(assembly: Assembly) -> list[tuple[int, ...]]:
    """Joints that carry each other: those that hang from the same joint of the base."""
    joints, root = assembly.exo.joints, dict[int, int]()
    for j, joint in enumerate(joints):
        root[j] = root[joint.parent] if joint.parent >= 0 else j
    return [tuple(j for j in root if root[j] == first) for first in sorted(set(root.values()))]


def _chain(joints: tuple[int, ...], postures: Postures, exo: Postures, arm: Postures) -> Chain:
    at, features = list(joints), Features(len(joints), MOST_FACTORS)
    F = np.array([features.of(q)[features.kept] for q in postures[:, at]])
    table = np.linalg.lstsq(F, np.hstack([exo[:, at], arm[:, at]]), rcond=None)[0].T
    return Chain(joints, MOST_FACTORS, table[: len(at)], table[len(at) :])


def _dry(
    assembly: Assembly, machine: CalibratedMachine, x: Parameters, carried: Postures
) -> Float[np.ndarray, " joint"]:
    """The most that the calibrated friction can take breaking away under the heaviest load [N·m]."""
    friction, coulomb = machine.friction, x[Layout.of(assembly).coulomb]
    loaded = np.asarray(friction.load_share) * np.abs(carried).max(axis=0)
    return coulomb * np.maximum(np.asarray(friction.breakaway), 1.0) + loaded + np.abs(np.asarray(friction.asymmetry))
