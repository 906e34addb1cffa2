"""Stage 0, the empty machine: torque gain, friction and what its own links weigh, from sweeps with known weights."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import block_diag

from exograv import kernel
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.friction import Friction, friction_torque
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.rnea import rnea
from exograv.errors import IdentificationError
from exograv.model.description import RigDescription
from exograv.model.tree import Tree, inertial_parameters

from .correlation import integrated_correlation

# What is believed of a drive before it moved, by its kind: mean and standard deviation (docs/robots.md).
GAIN_SD = 0.08  # share: unit tolerance of a torque constant 5-10 %
COULOMB = {"harmonic": (2.5, 1.5), "quasi_direct": (0.3, 0.2)}  # N·m
VISCOUS = {"harmonic": (1.5, 1.5), "quasi_direct": (0.08, 0.08)}  # N·m·s/rad
LOAD_SHARE = {"harmonic": (0.06, 0.05), "quasi_direct": (0.01, 0.02)}
ASYMMETRY_SD = {"harmonic": 0.3, "quasi_direct": 0.05}  # N·m
ROTOR_SD = 0.4  # share
LINK_MASS_SD = 0.04  # share: links against their drawings
LINK_CENTRE_SD_M = 0.004
LINK_INERTIA_SD = 0.10  # share of the mean moment
TILT_SD = np.deg2rad(0.5)  # of the base: a spirit level

V_CLEAR = 0.04
"""Slower samples are left out: there friction has no clear direction [rad/s]."""
V_REST = 0.02
BREAKAWAY, BREAKAWAY_SD = 1.25, 0.2  # static over Coulomb friction
V_STRIBECK, V_STRIBECK_LOG_SD = 0.05, 0.5  # rad/s; harmonic drives 0.02-0.1
PER_JOINT = 8  # unknowns of every joint
ITERATIONS = 8
SETTLED_SD = 0.01  # a step this small against the uncertainty changes nothing
FIRST_NOISE_NM = 0.2  # before the residuals are known
SAMPLE_PERIOD_S = 0.04


Joints = Float[np.ndarray, " joint"]
Samples = Float[np.ndarray, "sample joint"]


@dataclass(frozen=True)
class Sweeps:
    """What was measured while the empty machine swept; one row a sample, `SAMPLE_PERIOD_S` apart within a sweep."""

    q: Float[np.ndarray, "sample joint"]
    v: Float[np.ndarray, "sample joint"]
    a: Float[np.ndarray, "sample joint"]
    current: Float[np.ndarray, "sample joint"]
    """[A]"""

    weight: Float[np.ndarray, " sample"]
    """Known weight on the mount [kg]."""


def calibrate(description: RigDescription, tree: Tree, sweeps: Sweeps) -> CalibratedMachine:
    """The machine that explains the sweeps best, with the data sheet as prior: Gauss–Newton, maximum a posteriori.

    The current stands on the output side: as a regressor its noise would shrink the gain.

    Raises:
        IdentificationError: A joint moved too little.
    """
    problem = _Problem(description, tree)
    clear = np.abs(sweeps.v) > V_CLEAR
    for joint, moving in zip(description.joints, clear.sum(axis=0), strict=True):
        if moving * SAMPLE_PERIOD_S < 2.0:
            raise IdentificationError(
                f"Joint '{joint}' moved for only {moving * SAMPLE_PERIOD_S:.1f} s of the calibration; 2 s are needed. "
                "Is it blocked, or its motor disconnected?"
            )
    tau_nominal = description.nominal_gain * sweeps.current
    # Two rounds: the first tells how large and how correlated the residuals are.
    first = problem.fit(problem.mean, sweeps, tau_nominal, np.where(clear, 1.0 / FIRST_NOISE_NM, 0.0))
    noise_sd, correlation_s = _noise(first.residual, clear)
    repeats = np.maximum(correlation_s / SAMPLE_PERIOD_S, 1.0)
    second = problem.fit(first.theta, sweeps, tau_nominal, np.where(clear, 1.0 / (noise_sd * np.sqrt(repeats)), 0.0))
    return problem.machine(second, *_noise(second.residual, clear))


def _noise(residual: Samples, clear: Bool[np.ndarray, "sample joint"]) -> tuple[Joints, Joints]:
    """Standard deviation [N·m] and correlation time [s] of what the fit leaves, per joint."""
    noise_sd = np.sqrt(np.nanmean(np.where(clear, residual, np.nan) ** 2, axis=0))
    times = [integrated_correlation(r[c], SAMPLE_PERIOD_S) for r, c in zip(residual.T, clear.T, strict=True)]
    return noise_sd, np.array(times)


@dataclass(frozen=True)
class _Fit:
    """Where the fit ended."""

    theta: Float[np.ndarray, " unknown"]
    covariance: Float[np.ndarray, "unknown unknown"]
    residual: Samples
    """Of the nominal torque, at the last linearisation [N·m]."""


class _Problem:
    """The fit's unknowns and its torque.

    Unknowns: inverse gain share, Coulomb, viscous, load share, asymmetry, rotor, breakaway, logarithm of the Stribeck
    speed (joint each), tilt (2), links (10 each).
    """

    def __init__(self, description: RigDescription, tree: Tree):
        self.description, self.tree = description, tree
        self.n = len(tree.joints)
        kinds = [actuator.drive for actuator in description.settings.actuators]
        rotor = description.per_actuator("rotor_inertia_kgm2")
        means = [np.ones(self.n), *(np.array([t[k][0] for k in kinds]) for t in (COULOMB, VISCOUS, LOAD_SHARE))]
        means += [np.zeros(self.n), rotor, np.full(self.n, BREAKAWAY), np.full(self.n, np.log(V_STRIBECK))]
        means += [np.zeros(2), tree.phi.ravel()]
        sds = [np.full(self.n, GAIN_SD), *(np.array([t[k][1] for k in kinds]) for t in (COULOMB, VISCOUS, LOAD_SHARE))]
        sds += [np.array([ASYMMETRY_SD[k] for k in kinds]), ROTOR_SD * rotor + 1e-4]
        sds += [np.full(self.n, BREAKAWAY_SD), np.full(self.n, V_STRIBECK_LOG_SD), np.full(2, TILT_SD)]
        self.mean = np.concatenate(means)
        links = [_link_covariance(phi) for phi in tree.phi]
        self._covariance: Float[np.ndarray, "unknown unknown"] = np.asarray(
            block_diag(np.diag(np.concatenate(sds) ** 2), *links)
        )
        self._batch = kernel.compile(self._function(), lanes=0, shared=("theta",))

    def fit(self, theta: Float[np.ndarray, " unknown"], sweeps: Sweeps, tau_nominal: Samples, weight: Samples) -> _Fit:
        """Gauss–Newton from `theta` to the optimum; each sample and joint with its weight [1/(N·m)]."""
        samples = self._batch.bind(len(sweeps.q))
        for name in ("q", "v", "a", "weight"):
            samples.inputs[name][...] = getattr(sweeps, name).T
        covariance, residual = self._covariance, np.empty_like(tau_nominal)
        for _ in range(ITERATIONS):
            samples.inputs["theta"][:] = theta
            tau, derivative = samples().values()
            residual = tau_nominal - tau.T
            information = np.linalg.inv(self._covariance)
            slope = information @ (self.mean - theta)
            for of_joint, error, w in zip(derivative, residual.T, weight.T, strict=True):
                weighted = w * of_joint
                information += weighted @ weighted.T
                slope += weighted @ (w * error)
            covariance = np.linalg.inv(information)
            step = covariance @ slope
            theta = theta + step
            if np.abs(step / np.sqrt(np.diag(covariance))).max() < SETTLED_SD:
                break
        return _Fit(theta, covariance, residual)

    def machine(self, fit: _Fit, noise_sd: Joints, correlation_s: Joints) -> CalibratedMachine:
        """The calibrated machine; torque unit: true newton metres."""
        n, theta, sd = self.n, fit.theta, np.sqrt(np.diag(fit.covariance))
        rows, tilt, phi = theta[: PER_JOINT * n].reshape(PER_JOINT, n), PER_JOINT * n, PER_JOINT * n + 2
        inverse, coulomb, viscous, load_share, asymmetry, rotor, breakaway, log_v_stribeck = rows
        sds = sd[: PER_JOINT * n].reshape(PER_JOINT, n)
        gain = self.description.nominal_gain / inverse
        v_stribeck = np.exp(log_v_stribeck)
        return CalibratedMachine(
            ActuatorGain(gain, gain * sds[0] / inverse),
            Friction(
                coulomb,
                viscous,
                np.maximum(breakaway, 1.0),
                np.maximum(load_share, 0.0),
                asymmetry,
                v_stribeck,
                V_REST,
            ),
            Friction(sds[1], sds[2], sds[6], sds[3], sds[4], v_stribeck * sds[7], V_REST),
            theta[phi:].reshape(n, 10),
            _tilted(theta[tilt:phi]),
            rotor,
            noise_sd / inverse,
            correlation_s,
        )

    def _function(self) -> ca.Function:
        n = self.n
        q, v, a, weight = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("a", n), ca.SX.sym("weight")
        theta = ca.SX.sym("theta", len(self.mean))
        inverse, coulomb, viscous, load_share, asymmetry, rotor, breakaway, log_v_stribeck = ca.vertsplit(
            theta[: PER_JOINT * n], n
        )
        tilt, phi = theta[PER_JOINT * n : PER_JOINT * n + 2], ca.reshape(theta[PER_JOINT * n + 2 :], 10, n)
        mount = self.tree.frame(self.description.calibration.mount)
        hung = inertial_parameters(1.0, mount.p_body_frame, np.zeros((3, 3)))
        phi[:, mount.body] += weight * ca.DM(hung)
        g = float(np.linalg.norm(GRAVITY))
        gravity = g * ca.vertcat(tilt[0], tilt[1], -ca.sqrt(1 - tilt[0] ** 2 - tilt[1] ** 2))
        load = rnea(self.tree, q, v, a, phi, gravity) + rotor * a
        friction = Friction(coulomb, viscous, breakaway, load_share, asymmetry, ca.exp(log_v_stribeck), V_REST)
        tau = inverse * (load + friction_torque(friction, v, load))
        names = ["q", "v", "a", "weight", "theta"]
        return ca.Function(
            "empty", [q, v, a, weight, theta], [tau, ca.jacobian(tau, theta)], names, ["tau", "derivative"]
        )


def _tilted(tilt: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " 3"]:
    return float(np.linalg.norm(GRAVITY)) * np.array([tilt[0], tilt[1], -np.sqrt(1 - tilt @ tilt)])


def _link_covariance(phi: Float[np.ndarray, " 10"]) -> Float[np.ndarray, "10 10"]:
    """Of a link's inertial parameters: mass, centre and inertia off their drawing."""
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
