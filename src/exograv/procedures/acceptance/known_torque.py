"""Torque of the dummy by its file, against the torque that the machine carries after its identification."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import ParameterLayout, Parameters
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Covariance
from exograv.identification.core.prior import CUFF_LOG_STIFFNESS_SD
from exograv.model.assembly import Assembly
from exograv.model.loops import FIT
from exograv.study.targets import TARGET_NM

from .dummy import LIMB, Dummy

Joints = Float[np.ndarray, " joint"]
Postures = Float[np.ndarray, "posture joint"]


@dataclass(frozen=True)
class KnownLeftOver:
    """Carried torque minus the dummy's torque by its file, RMS over postures, per joint [N·m]."""

    rms: Joints
    dummy_sd: Joints
    """Standard deviation of the dummy's own torque, by the errors in its file, RMS over the same postures."""
    limits: Joints
    """Root of the sum of squares of the project's target and twice `dummy_sd`."""


def dummy_parameters(dummy: Dummy, assembly: Assembly) -> tuple[Parameters, Covariance]:
    """Return parameters of the dummy in a machine, and their covariance, as in `dynamics.parameters`.

    The dummy has no elastic joints, its elbow is at right angles to its limbs, and its shoulder is in the centre of the
    machine's. Its covariance has the errors of its file and the usual spread of the straps' stiffness.
    """
    layout, arms = ParameterLayout.of(assembly), len(assembly.arm.limbs)
    x, covariance = np.zeros(layout.count), np.zeros((layout.count, layout.count))
    x[layout.phi] = np.tile(np.concatenate([dummy.phi(segment) for segment in LIMB]), arms)
    for number, body in enumerate(layout.bodies):
        covariance[body, body] = dummy.phi_covariance(LIMB[number % len(LIMB)])
    sd = np.array([_fit_sd(dummy, name) for name in FIT])
    covariance[layout.fit, layout.fit] = np.diag(np.tile(sd**2, arms))
    return x, covariance


def known_left_over(model: ArmModel, carried: Parameters, dummy: Dummy, postures: Postures) -> KnownLeftOver:
    """Compare the carried torque at rest with that of the dummy.

    Args:
        model: Model of the dummy's form in the machine as calibrated.
        carried: Parameters that the machine carries.
        dummy: Dummy in the machine.
        postures: Postures that the identification did not visit [rad].
    """
    model = model.again()
    x, covariance = dummy_parameters(dummy, model.assembly)
    asked = np.array([model.at_rest(q, carried)[0] for q in postures])
    true, slopes = (np.array(part) for part in zip(*(model.at_rest(q, x) for q in postures), strict=True))
    variance = np.einsum("pji,ik,pjk->pj", slopes, covariance, slopes)
    sd = np.sqrt(variance.mean(axis=0))
    targets = np.array([TARGET_NM[place] for place in model.assembly.description.places])
    rms = np.sqrt(((asked - true) ** 2).mean(axis=0))
    return KnownLeftOver(rms, sd, np.hypot(targets, 2.0 * sd))


def _fit_sd(dummy: Dummy, name: str) -> float:
    if name.startswith("shoulder_offset"):
        return 0.5e-3 * dummy.settings.within.shoulder_mm
    return CUFF_LOG_STIFFNESS_SD if name in ("cuff_log_stiffness", "cuff_log_rotational_stiffness") else 0.0
