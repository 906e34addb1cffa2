"""Cuffs of a machine's twin from worn recordings: their stiffness, as the estimator learns it beside an arm."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.errors import ExogravError, RecordingError
from exograv.identification.core.interface import Estimate
from exograv.identification.core.prior import CUFF_LOG_STIFFNESS_SD
from exograv.model.anthropometry import Body
from exograv.model.description import RigDescription
from exograv.model.loops import FIT
from exograv.model.support import assemble
from exograv.procedures.identification.estimator_session import EstimatorSession

from .read_motions import ReadRecording
from .recorded_columns import WornMotion

CUFF_ENTRIES = ("cuff_log_stiffness", "cuff_log_rotational_stiffness")
"""Entries of the fit of one arm that are written: translation, then rotation."""

METHOD = "recursive"
"""Estimator that learns the cuffs beside the arm."""

WORN_LEAST_S = 20.0
"""Shortest identification that is used [s]. Before it, the belief about the cuffs is mostly the prior."""

Two = Float[np.ndarray, " 2"]


@dataclass(frozen=True)
class WornCuffs:
    """Stiffness of the cuffs over that in `rig.toml`: natural logarithms, in translation and in rotation [-]."""

    mean: Two
    covariance: Float[np.ndarray, "2 2"]
    """Uncertainty of the estimates, and the spread between recordings if there are several."""

    recordings: tuple[ReadRecording, ...]
    """Recordings that were used."""

    seconds: tuple[float, ...]
    """Length of the identification in each of them [s]."""

    @property
    def sd(self) -> Two:
        """Standard deviation of each logarithm [-]."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def learned(self) -> Two:
        """Share that the recordings tell: 1 − standard deviation after them / before them [-]."""
        return 1.0 - self.sd / CUFF_LOG_STIFFNESS_SD


def worn_cuffs(
    description: RigDescription, machine: CalibratedMachine, recordings: Sequence[ReadRecording]
) -> WornCuffs | None:
    """Identify the arm of each worn recording with the fitted machine, and return what this tells about the cuffs.

    The torque of such a recording is its current by the fitted gains. Several recordings are of several people or days:
    their estimates are averaged, and their spread is added to the uncertainty.

    Args:
        description: The machine.
        machine: Gains, friction, links and rotors by the fit to the empty machine.
        recordings: All recordings of the fit; those without an identification of an arm are passed over.

    Returns:
        The cuffs; None if no recording has an identification of `WORN_LEAST_S`.

    Raises:
        RecordingError: A recording states no body data, or its arm does not fit the machine.
    """
    used = [one for one in recordings if one.worn is not None and one.worn.seconds >= WORN_LEAST_S]
    if not used:
        return None
    found = [_of_recording(description, machine, one) for one in used]
    means = np.concatenate([mean for mean, _ in found])
    covariance = np.mean(np.concatenate([part for _, part in found]), axis=0)
    if len(means) > 1:
        covariance = covariance + np.cov(means.T)
    seconds = tuple(one.worn.seconds for one in used if one.worn is not None)
    return WornCuffs(means.mean(axis=0), covariance, tuple(used), seconds)


def _of_recording(
    description: RigDescription, machine: CalibratedMachine, recording: ReadRecording
) -> tuple[Float[np.ndarray, "arm 2"], Float[np.ndarray, "arm 2 2"]]:
    """Mean and covariance of the cuffs of each arm in one recording."""
    worn = recording.worn
    assert worn is not None
    try:
        assembly = assemble(description, _body(recording, worn.wearer))
        session = EstimatorSession(assembly, machine, METHOD, worn.period_s)
        estimate = _estimate(session, worn, machine)
    except ExogravError as error:
        raise RecordingError(f"{recording.path}: the cuffs cannot be fitted to its identification. {error}") from error
    if estimate.covariance is None:
        raise RecordingError(f"{recording.path}: the estimator states no uncertainty of the cuffs.")
    start, count = ParameterLayout.of(assembly).fit.start, len(assembly.arm.limbs)
    at = start + np.array([[limb * len(FIT) + FIT.index(name) for name in CUFF_ENTRIES] for limb in range(count)])
    return estimate.x[at], np.array([estimate.covariance[np.ix_(rows, rows)] for rows in at])


def _estimate(session: EstimatorSession, worn: WornMotion, machine: CalibratedMachine) -> Estimate:
    """Return the last estimate of the identification in a recording."""
    torque = worn.current * machine.actuators.gain
    for begin, end in worn.pieces:
        session.interrupt()
        for k in range(begin, end):
            published = session.take(worn.q[k], torque[k], None)
            if published is not None and session.is_to_note:
                session.judge(session.estimate())
    session.judge(session.last())
    return session.close().last


def _body(recording: ReadRecording, wearer: Mapping[str, Any]) -> Body:
    """Return the body data that a recording states.

    Raises:
        RecordingError: It states none.
    """
    try:
        return Body(wearer["height_m"], wearer["mass_kg"], wearer["sex"], wearer.get("lengths_m"))
    except KeyError as error:
        raise RecordingError(
            f"{recording.path} states no {error.args[0]} of the person in the machine, and the cuffs need body data. "
            "Leave this recording out."
        ) from error
