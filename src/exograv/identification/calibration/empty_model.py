"""Torque of an empty machine and its derivative, as a function of all unknowns of the calibration."""

import casadi as ca
import numpy as np

from exograv import kernel
from exograv.dynamics.frame_wrench import frame_torque
from exograv.dynamics.friction import Friction, friction_torque
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.rnea import rnea
from exograv.model.description import RigDescription
from exograv.model.tree import Tree, inertial_parameters

from .empty_prior import EmptyLayout

AGE_S = 600.0
"""Unit in which the age of a sample is counted, for the friction of a drive that warms up [s]."""

V_SHARP = 2e-4
"""Replacement of `Friction.v_rest` [rad/s]. It is small so that all used samples have their full friction; samples
without a clear direction are left out. A start from rest is a sample ten times as fast."""

FILTER_DELAY_S = 0.04
"""Delay of the sample filter [s]; it attenuates fast ripple."""

ARGUMENTS = ("q", "v", "a", "age", "hung", "wrench", "theta")
WRENCH = 6
"""Components of a wrench: force, then moment."""


def compile_model(
    description: RigDescription, tree: Tree, layout: EmptyLayout, force_frame: str | None = None
) -> kernel.Batch:
    """Nominal torque, gain × current by the data sheet (joint,) [N·m], and its derivative (joint, unknown).

    Arguments: measured position q [rad], v, a, age of the sample before the end [AGE_S], known weights at the mounts
    (mount × weight, all weights of the first mount first) [-], the wrench of a force sensor on the machine (6,)
    [N, N·m] at `force_frame`, in its axes, and the unknowns theta. Without a frame the wrench has no effect.
    """
    recipe = kernel.Recipe(_model_function, (description, tree, layout, force_frame))
    return kernel.compile(recipe, lanes=0, shared=("theta",))


def _model_function(
    description: RigDescription, tree: Tree, layout: EmptyLayout, force_frame: str | None
) -> ca.Function:
    n, mounts = layout.joints, description.mounts
    q, v, a = (ca.SX.sym(name, n) for name in ("q", "v", "a"))
    age, hung, wrench = ca.SX.sym("age"), ca.SX.sym("hung", len(mounts) * layout.weights), ca.SX.sym("wrench", WRENCH)
    theta = ca.SX.sym("theta", layout.links.stop)
    unknown = {name: theta[layout.of(name)] for name in layout.per_joint}
    phi = ca.reshape(theta[layout.links], 10, n)
    masses = ca.reshape(hung, layout.weights, len(mounts)).T @ (
        theta[layout.weight] * ca.DM(description.calibration.weights_kg)
    )
    for mount, mass in zip(mounts, ca.vertsplit(masses), strict=True):
        frame = tree.frame(mount)
        phi[:, frame.body] += mass * ca.DM(inertial_parameters(1.0, frame.p_body_frame, np.zeros((3, 3))))
    true_q = q - unknown["offset"]
    load = rnea(tree, true_q, v, a, phi, _gravity(theta[layout.tilt])) + unknown["rotor"] * a
    if force_frame is not None:
        # A Jacobian needs a symbol for the positions.
        at = ca.SX.sym("at", n)
        load -= ca.substitute(frame_torque(tree, at, force_frame, wrench), at, true_q)
    rubbed = friction_by_unknowns(unknown, age, v, load) + _ripple(description, unknown, q, v)
    tau = unknown["inverse_gain"] * (load + rubbed)
    return ca.Function(
        "empty",
        [q, v, a, age, hung, wrench, theta],
        [tau, ca.jacobian(tau, theta)],
        list(ARGUMENTS),
        ["tau", "derivative"],
    )


def _gravity(tilt: ca.SX) -> ca.SX:
    return float(np.linalg.norm(GRAVITY)) * ca.vertcat(tilt[0], tilt[1], -ca.sqrt(1 - tilt[0] ** 2 - tilt[1] ** 2))


def friction_by_unknowns(unknown: dict[str, ca.SX], age: ca.SX, v: ca.SX, load: ca.SX) -> ca.SX:
    """Friction (joint,) [N·m] at the age of a sample; breakaway also applies to the parts by load and direction."""
    coulomb = unknown["coulomb"] * (1 + age * unknown["coulomb_warming"])
    none = ca.SX.zeros(v.numel())
    viscous = unknown["viscous"] * (1 + age * unknown["viscous_warming"])
    if "viscous_power" in unknown:
        # The samples have a clear direction: the power of a speed of zero does not occur.
        viscous *= ca.fmax(ca.fabs(v), V_SHARP) ** (unknown["viscous_power"] - 1)
    friction = Friction(
        coulomb + unknown["asymmetry"] * ca.sign(v) + unknown["load_share"] * ca.fabs(load),
        viscous,
        unknown["breakaway"],
        none,
        none,
        ca.exp(unknown["log_v_stribeck"]),
        V_SHARP,
    )
    return friction_torque(friction, v, none)


def _ripple(description: RigDescription, unknown: dict[str, ca.SX], q: ca.SX, v: ca.SX) -> ca.SX:
    """Friction (joint,) [N·m] with a period of one motor turn, attenuated by the sample filter."""
    turns = ca.DM(description.per_actuator("gear_ratio"))
    # |15 / (s³ + 6 s² + 15 s + 15)|: the filter's Bessel polynomial at the ripple's frequency.
    s = turns * ca.fabs(v) * FILTER_DELAY_S
    passed = 15 / ca.sqrt((15 - 6 * s**2) ** 2 + (15 * s - s**3) ** 2)
    wave = unknown["ripple_sine"] * ca.sin(turns * q) + unknown["ripple_cosine"] * ca.cos(turns * q)
    return passed * wave * ca.sign(v)
