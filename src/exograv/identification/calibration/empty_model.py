"""The torque of an empty machine and its derivative, as a function of everything that calibration does not know."""

import casadi as ca
import numpy as np

from exograv import kernel
from exograv.dynamics.friction import Friction, friction_torque
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.rnea import rnea
from exograv.model.description import RigDescription
from exograv.model.tree import Tree, inertial_parameters

from .empty_prior import PER_JOINT, EmptyLayout

AGE_S = 600.0
"""Over which warming is stated [s]."""

V_SHARP = 2e-4
"""In place of `Friction.v_rest`: samples without a clear direction of friction are left out, and the others keep all of
their friction; a start from rest is a sample ten times as fast [rad/s]."""

FILTER_DELAY_S = 0.04
"""Of the filter that all samples have passed: fast ripple reaches them weakened [s]."""

ARGUMENTS = ("q", "v", "a", "age", "hung", "theta")


def compile_model(description: RigDescription, tree: Tree, layout: EmptyLayout) -> kernel.Batch:
    """Nominal torque, gain × current by the data sheet (joint,) [N·m], and its derivative (joint, unknown).

    Of measured position q [rad], v, a, the age of the sample, counted back from the end [AGE_S], and which of the known
    weights hang at which mount (mount × weight, mounts together) [-].
    """
    n, mounts = layout.joints, description.mounts
    q, v, a = (ca.SX.sym(name, n) for name in ("q", "v", "a"))
    age, hung = ca.SX.sym("age"), ca.SX.sym("hung", len(mounts) * layout.weights)
    theta = ca.SX.sym("theta", layout.links.stop)
    unknown = {name: theta[layout.of(name)] for name in PER_JOINT}
    phi = ca.reshape(theta[layout.links], 10, n)
    masses = ca.reshape(hung, layout.weights, len(mounts)).T @ (
        theta[layout.weight] * ca.DM(description.calibration.weights_kg)
    )
    for mount, mass in zip(mounts, ca.vertsplit(masses), strict=True):
        frame = tree.frame(mount)
        phi[:, frame.body] += mass * ca.DM(inertial_parameters(1.0, frame.p_body_frame, np.zeros((3, 3))))
    load = rnea(tree, q - unknown["offset"], v, a, phi, _gravity(theta[layout.tilt])) + unknown["rotor"] * a
    rubbed = _friction(unknown, age, v, load) + _ripple(description, unknown, q, v)
    tau = unknown["inverse_gain"] * (load + rubbed)
    function = ca.Function(
        "empty", [q, v, a, age, hung, theta], [tau, ca.jacobian(tau, theta)], list(ARGUMENTS), ["tau", "derivative"]
    )
    return kernel.compile(function, lanes=0, shared=("theta",))


def _gravity(tilt: ca.SX) -> ca.SX:
    return float(np.linalg.norm(GRAVITY)) * ca.vertcat(tilt[0], tilt[1], -ca.sqrt(1 - tilt[0] ** 2 - tilt[1] ** 2))


def _friction(unknown: dict[str, ca.SX], age: ca.SX, v: ca.SX, load: ca.SX) -> ca.SX:
    """Friction (joint,) [N·m] at the age of a sample; what depends on load and direction breaks away like the rest."""
    coulomb = unknown["coulomb"] * (1 + age * unknown["coulomb_warming"])
    none = ca.SX.zeros(v.numel())
    friction = Friction(
        coulomb + unknown["asymmetry"] * ca.sign(v) + unknown["load_share"] * ca.fabs(load),
        unknown["viscous"] * (1 + age * unknown["viscous_warming"]),
        unknown["breakaway"],
        none,
        none,
        ca.exp(unknown["log_v_stribeck"]),
        V_SHARP,
    )
    return friction_torque(friction, v, none)


def _ripple(description: RigDescription, unknown: dict[str, ca.SX], q: ca.SX, v: ca.SX) -> ca.SX:
    """Friction (joint,) [N·m] that comes and goes once a turn of the motor, as the filter lets it through."""
    turns = ca.DM(description.per_actuator("gear_ratio"))
    # |15 / (s³ + 6 s² + 15 s + 15)|: the filter's Bessel polynomial at the ripple's frequency.
    s = turns * ca.fabs(v) * FILTER_DELAY_S
    passed = 15 / ca.sqrt((15 - 6 * s**2) ** 2 + (15 * s - s**3) ** 2)
    wave = unknown["ripple_sine"] * ca.sin(turns * q) + unknown["ripple_cosine"] * ca.cos(turns * q)
    return passed * wave * ca.sign(v)
