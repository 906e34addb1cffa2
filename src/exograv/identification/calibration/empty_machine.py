"""Stage 0, the empty machine: torque gain, friction and weight of its links, from sweeps with known weights."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.friction import Friction
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import IdentificationError
from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .empty_checks import refuse_incredible, refuse_wrong_weights
from .empty_fit import SAMPLE_PERIOD_S as SAMPLE_PERIOD_S
from .empty_fit import V_CLEAR as V_CLEAR
from .empty_fit import V_START as V_START
from .empty_fit import EmptyMachine, Fit
from .empty_fit import Sweeps as Sweeps
from .empty_prior import COULOMB as COULOMB
from .empty_prior import GAIN_SD as GAIN_SD
from .empty_prior import PER_JOINT, EmptyPrior
from .empty_prior import V_STRIBECK as V_STRIBECK
from .empty_prior import VISCOUS as VISCOUS

V_REST = 0.02
MOVED_S = 2.0  # shortest time of clear motion
CHANGING = ("coulomb", "viscous", "asymmetry")
"""Names of the parameters that a re-check measures again."""
CHANGE_SD = 0.3  # share: standard deviation of their change between two days
KNOWN_SD = 1e-6  # standard deviation of parameters that a re-check keeps
WEIGHT_LOOSE_SD = 1.0  # share: the first fit does not trust the stated masses of the weights

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class Calibration:
    """Calibration of an empty machine by stage 0, at the time of its last sample."""

    machine: CalibratedMachine
    tilt: Float[np.ndarray, " 2"]
    """Tilt of the base: components of gravity along x and y of the base, divided by the magnitude of gravity [-]."""
    tilt_sd: Float[np.ndarray, " 2"]
    offset: Joints
    """Encoder offsets: measured minus true position [rad]."""
    offset_sd: Joints
    phi_sd: Float[np.ndarray, "joint 10"]
    """Standard deviations of the links' inertial parameters, in the units of `phi`."""


def calibrate(description: RigDescription, tree: Tree, sweeps: Sweeps, known: EmptyPrior | None = None) -> Calibration:
    """Fit the machine to its sweeps, with what is `known` as prior; with the data sheet if nothing is.

    Raises:
        IdentificationError: A joint moved too little, or the result is not plausible.
    """
    _refuse_unmoved(description, sweeps)
    model = EmptyMachine(description, tree)
    prior = model.prior if known is None else known
    first = model.fit(sweeps, prior.with_sd(prior.layout.weight, WEIGHT_LOOSE_SD))
    refuse_wrong_weights(description, first)
    fit = model.fit(sweeps, prior, first)
    refuse_incredible(description, fit)
    return calibration_of(description, fit)


def recheck(description: RigDescription, tree: Tree, sweeps: Sweeps, before: Calibration) -> Calibration:
    """Measure the current friction from sweeps without weights; all other values stay as in `before`.

    Raises:
        IdentificationError: A joint moved too little.
    """
    _refuse_unmoved(description, sweeps)
    model = EmptyMachine(description, tree)
    prior = as_it_was(description, model.prior, before)
    found = calibration_of(description, model.fit(sweeps, prior, model.fit(sweeps, prior))).machine
    friction, friction_sd = (
        replace(old, **{name: getattr(new, name) for name in CHANGING})
        for old, new in (
            (before.machine.friction, found.friction),
            (before.machine.friction_sd, found.friction_sd),
        )
    )
    return replace(before, machine=replace(before.machine, friction=friction, friction_sd=friction_sd))


def as_it_was(description: RigDescription, data_sheets: EmptyPrior, before: Calibration) -> EmptyPrior:
    """Prior of a re-check: the previous calibration, with free friction and free ripple, which is not stored."""
    layout, machine, friction = data_sheets.layout, before.machine, before.machine.friction
    mean, sd = data_sheets.mean.copy(), np.full(len(data_sheets.mean), KNOWN_SD)
    known = {
        "inverse_gain": description.nominal_gain / machine.actuators.gain,
        "coulomb": friction.coulomb,
        "viscous": friction.viscous,
        "load_share": friction.load_share,
        "asymmetry": friction.asymmetry,
        "rotor": machine.rotor_inertia,
        "breakaway": friction.breakaway,
        "log_v_stribeck": np.log(np.asarray(friction.v_stribeck)),
        "offset": before.offset,
    }
    for name, values in known.items():
        mean[layout.of(name)] = values
    mean[layout.tilt], mean[layout.links] = before.tilt, machine.phi.ravel()
    coulomb, viscous, asymmetry = (np.abs(np.asarray(known[name])) for name in CHANGING)
    # Asymmetry may also appear where there was none: a tenth of the Coulomb friction.
    for name, size in zip(CHANGING, (coulomb, viscous, np.hypot(asymmetry, 0.1 * coulomb)), strict=True):
        sd[layout.of(name)] = CHANGE_SD * size
    for name in ("ripple_sine", "ripple_cosine"):
        sd[layout.of(name)] = np.sqrt(np.diag(data_sheets.covariance)[layout.of(name)])
    return EmptyPrior(layout, mean, np.diag(sd**2))


def _refuse_unmoved(description: RigDescription, sweeps: Sweeps) -> None:
    moved_s = (sweeps.clear & ~sweeps.start[:, None]).sum(axis=0) * SAMPLE_PERIOD_S
    for joint, seconds in zip(description.joints, moved_s, strict=True):
        if seconds < MOVED_S:
            raise IdentificationError(
                f"Joint '{joint}' moved for only {seconds:.1f} s of the calibration; {MOVED_S:g} s are needed. "
                "Is it blocked, or its motor disconnected?"
            )


def calibration_of(description: RigDescription, fit: Fit) -> Calibration:
    """Build the calibration from a fit; torques are in true N·m, not in nominal ones."""
    layout, theta = fit.prior.layout, fit.theta
    value = {name: theta[layout.of(name)] for name in PER_JOINT}
    sd = {name: fit.sd[layout.of(name)] for name in PER_JOINT}
    gain = description.nominal_gain / value["inverse_gain"]
    v_stribeck = np.exp(value["log_v_stribeck"])
    machine = CalibratedMachine(
        ActuatorGain(gain, gain * sd["inverse_gain"] / value["inverse_gain"]),
        Friction(
            value["coulomb"],
            value["viscous"],
            np.maximum(value["breakaway"], 1.0),
            np.maximum(value["load_share"], 0.0),
            value["asymmetry"],
            v_stribeck,
            V_REST,
        ),
        Friction(
            sd["coulomb"],
            sd["viscous"],
            sd["breakaway"],
            sd["load_share"],
            sd["asymmetry"],
            v_stribeck * sd["log_v_stribeck"],
            V_REST,
        ),
        theta[layout.links].reshape(-1, 10),
        tilted_gravity(theta[layout.tilt]),
        value["rotor"],
        fit.noise_and_ripple.sd / value["inverse_gain"],
        fit.noise_and_ripple.correlation_s,
    )
    phi_sd = fit.sd[layout.links].reshape(-1, 10)
    return Calibration(machine, theta[layout.tilt], fit.sd[layout.tilt], value["offset"], sd["offset"], phi_sd)


def tilted_gravity(tilt: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " 3"]:
    """Gravity (3,) in a base with `tilt` (2,), as in `Calibration` [m/s²]."""
    return float(np.linalg.norm(GRAVITY)) * np.array([tilt[0], tilt[1], -np.sqrt(1 - tilt @ tilt)])
