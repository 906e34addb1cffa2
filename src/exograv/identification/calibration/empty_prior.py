"""Prior of an empty machine, and the order of its unknowns in one vector."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

from exograv.model.description import RigDescription
from exograv.model.tree import Tree

# Prior of a drive by its kind: mean and standard deviation (docs/reference/robots.md).
GAIN_SD = 0.08  # share: unit tolerance of a torque constant 5-10 %
COULOMB = {"harmonic": (2.5, 1.5), "quasi_direct": (0.3, 0.2)}  # N·m
VISCOUS = {"harmonic": (1.5, 1.5), "quasi_direct": (0.08, 0.08)}  # N·m·s/rad
RATED_NM = {"harmonic": 30.0, "quasi_direct": 15.0}
"""Largest torque of the drives above [N·m]; the friction of smaller ones is assumed proportional to it."""
LOAD_SHARE = {"harmonic": (0.06, 0.05), "quasi_direct": (0.01, 0.02)}
ASYMMETRY_SD = {"harmonic": 0.3, "quasi_direct": 0.05}  # N·m
BREAKAWAY, BREAKAWAY_SD = 1.25, 0.25  # static over Coulomb friction
V_STRIBECK, V_STRIBECK_LOG_SD = 0.05, 0.5  # rad/s; harmonic drives 0.02-0.1
RIPPLE_SD = {"harmonic": 0.15, "quasi_direct": 0.10}  # N·m
ROTOR_SD = 0.4  # share
WARMING_SD = (
    0.15  # share by which friction falls in ten minutes: a tenth to a fifth in half an hour, most of it at first
)
VISCOUS_POWER_SD = 0.3  # of the exponent of speed in viscous friction, which is 1 for a Newtonian grease
OFFSET_SD = np.deg2rad(0.7)  # of an encoder whose zero is set at a jig or a stop
LINK_MASS_SD = 0.04  # share: links against their drawings
LINK_CENTRE_SD_M = 0.004
LINK_INERTIA_SD = 0.10  # share of the mean moment
TILT_SD = np.deg2rad(1.0)  # of a base that is set up by eye and a spirit level
WEIGHT_SD = 0.002  # share: a known weight is put on a scale before it hangs

PER_JOINT: tuple[str, ...] = (
    "inverse_gain", "coulomb", "viscous", "load_share", "asymmetry", "rotor", "breakaway", "log_v_stribeck",
    "coulomb_warming", "viscous_warming", "offset", "ripple_sine", "ripple_cosine",
)  # fmt: skip
"""Unknowns of every joint. The gain is a share of the nominal one. Warming is the relative excess of friction ten
minutes before the end. Offset is measured minus true position [rad]. Ripple is friction with a period of one turn of
the motor [N·m]."""

Unknowns = Float[np.ndarray, " unknown"]


@dataclass(frozen=True)
class EmptyLayout:
    """Slices of the unknowns: per joint in the order of `per_joint`, tilt, shares of the weights, links."""

    joints: int
    weights: int
    per_joint: tuple[str, ...] = PER_JOINT
    """Names of the unknowns of every joint."""

    def of(self, name: str) -> slice:
        """Slice of the unknown `name` of all joints."""
        k = self.per_joint.index(name)
        return slice(k * self.joints, (k + 1) * self.joints)

    @property
    def tilt(self) -> slice:
        """Slice of the direction of gravity: its horizontal components, divided by its magnitude (2,) [-]."""
        start = len(self.per_joint) * self.joints
        return slice(start, start + 2)

    @property
    def weight(self) -> slice:
        """Slice of the known weights: true mass over stated mass [-]."""
        return slice(self.tilt.stop, self.tilt.stop + self.weights)

    @property
    def links(self) -> slice:
        """Slice of the links' inertial parameters, ten per joint."""
        return slice(self.weight.stop, self.weight.stop + 10 * self.joints)


@dataclass(frozen=True)
class EmptyPrior:
    """Mean and covariance of all unknowns."""

    layout: EmptyLayout
    mean: Unknowns
    covariance: Float[np.ndarray, "unknown unknown"]

    def with_sd(self, block: slice, sd: float) -> "EmptyPrior":
        """Return a copy with another, independent standard deviation of a block."""
        covariance = self.covariance.copy()
        covariance[block, :] = covariance[:, block] = 0.0
        covariance[block, block] = sd**2 * np.eye(block.stop - block.start)
        return EmptyPrior(self.layout, self.mean, covariance)


def drive_sizes(description: RigDescription) -> Float[np.ndarray, " joint"]:
    """Friction of drives of this size, as a share of that in the tables (joint,) [-]."""
    rated = np.array([RATED_NM[actuator.drive] for actuator in description.settings.actuators])
    return np.minimum(description.per_actuator("torque_max_Nm") / rated, 1.0)


def usual_friction(
    description: RigDescription, table: Mapping[str, tuple[float, float]]
) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]]:
    """Mean and standard deviation (joint,) of a friction table for drives of this machine's sizes."""
    rows = np.array([table[actuator.drive] for actuator in description.settings.actuators])
    mean, sd = (rows * drive_sizes(description)[:, None]).T
    return mean, sd


def data_sheet_prior(description: RigDescription, tree: Tree, per_joint: tuple[str, ...] = PER_JOINT) -> EmptyPrior:
    """Prior from the URDF, `rig.toml` and usual values of such drives, for these unknowns of every joint."""
    n, weights = len(tree.joints), len(description.calibration.weights_kg)
    kinds = [actuator.drive for actuator in description.settings.actuators]
    rotor = description.per_actuator("rotor_inertia_kgm2")

    one, ripple = np.ones(n), np.array([RIPPLE_SD[kind] for kind in kinds])
    rows = {
        "inverse_gain": (one, GAIN_SD * one),
        "coulomb": usual_friction(description, COULOMB),
        "viscous": usual_friction(description, VISCOUS),
        "load_share": tuple(np.array([LOAD_SHARE[kind] for kind in kinds]).T),
        "asymmetry": (0 * one, np.array([ASYMMETRY_SD[kind] for kind in kinds])),
        "ripple_sine": (0 * one, ripple),
        "ripple_cosine": (0 * one, ripple),
        "rotor": (rotor, ROTOR_SD * rotor + 1e-4),
        "breakaway": (BREAKAWAY * one, BREAKAWAY_SD * one),
        "log_v_stribeck": (np.log(V_STRIBECK) * one, V_STRIBECK_LOG_SD * one),
        "coulomb_warming": (0 * one, WARMING_SD * one),
        "viscous_warming": (0 * one, WARMING_SD * one),
        "offset": (0 * one, OFFSET_SD * one),
        "viscous_power": (one, VISCOUS_POWER_SD * one),
    }
    means, sds = zip(*(rows[name] for name in per_joint), strict=True)
    mean = np.concatenate([*means, np.zeros(2), np.ones(weights), tree.phi.ravel()])
    sd = np.concatenate([*sds, np.full(2, TILT_SD), np.full(weights, WEIGHT_SD)])
    links = [_link_covariance(phi) for phi in tree.phi]
    return EmptyPrior(EmptyLayout(n, weights, per_joint), mean, np.asarray(block_diag(np.diag(sd**2), *links)))


def _link_covariance(phi: Float[np.ndarray, " 10"]) -> Float[np.ndarray, "10 10"]:
    """Covariance of a link's inertial parameters: errors of mass, centre and inertia against the drawing."""
    mass, com = phi[0], phi[1:4] / phi[0]
    by_mass = LINK_MASS_SD * phi
    covariance = np.outer(by_mass, by_mass)
    by_centre = np.zeros((10, 3))
    by_centre[1:4] = mass * LINK_CENTRE_SD_M * np.eye(3)
    x, y, z = mass * LINK_CENTRE_SD_M * com
    by_centre[4:] = [[0, 2 * y, 2 * z], [-y, -x, 0], [2 * x, 0, 2 * z], [-z, 0, -x], [0, -z, -y], [2 * x, 2 * y, 0]]
    covariance += by_centre @ by_centre.T
    spread = LINK_INERTIA_SD * (phi[4] + phi[6] + phi[9]) / 3
    covariance[4:, 4:] += spread**2 * np.eye(6)
    return covariance
