"""Person whose arm was learned live: the content of the participant's file."""

from datetime import UTC, datetime

import numpy as np

from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.participant_session import NOT_KEPT, stored_person
from exograv.recording.rounding import rounded
from exograv.storage.participant_schema import Identified, StoredParticipant, StoredPerson, prior_hash

from .arm_worker import LearnedArm


def learned_person(
    code: str,
    body: Body,
    prepared: ControllerKnowledge,
    serial: str,
    learned: LearnedArm,
    predicted: np.ndarray,
    before: StoredParticipant | None,
) -> StoredParticipant | None:
    """Return the sealed content of the person's file; None if the estimate is not that of a relaxed arm.

    Args:
        code: Code of the person.
        body: Body data of the person.
        prepared: Machine with the arm in it.
        serial: Serial number of the machine.
        learned: Estimate of the arm.
        predicted: Predicted residual torque per joint [N·m].
        before: File of an earlier donning, if there is one.
    """
    estimate, assembly = learned.estimate, prepared.assembly
    if estimate.covariance is None or learned.outcome in NOT_KEPT:
        return None
    identified = Identified(
        at_utc=datetime.now(UTC).replace(microsecond=0),
        donnings=1 if before is None else before.identified.donnings + 1,
        method="recursive",
        prior_sha256=prior_hash(assembly, prior(assembly, prepared.machine)),
        motion="designed",
        motion_s=round(estimate.t, 3),
        calibration_sha256="",
        outcome=learned.outcome.value,
        predicted_left_over_Nm=rounded(predicted),
        # The worker has seen every sample, so no data are held out for a test of its estimate.
        held_out_error_Nm=[],
        held_out_s=0.0,
    )
    found = estimate.x, estimate.covariance
    return stored_person(StoredPerson.of(code, body), assembly, serial, identified, found)
