"""Twin of a shipped machine whose posterior is the data sheet's prior, for tests of everything behind the fit."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from exograv.identification.calibration.empty_prior import data_sheet_prior
from exograv.identification.machine_twin.friction_laws import TWIN_PER_JOINT
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.procedures.calibration.segment_lengths import settings_of_lengths
from exograv.procedures.machine_twin.machine_folder import copy_machine
from exograv.storage.calibration_file import identity_of
from exograv.storage.sealed_file import sealed
from exograv.storage.twin_file import (
    NAME,
    FittedCuffs,
    FittedDrive,
    FittedGear,
    FittedJoint,
    FittedRecording,
    FittedWarmGain,
    Posterior,
    Provenance,
    StoredTwin,
    write_twin,
)

NUMBERS = {name: 1.0 for name in FittedJoint.model_fields if name not in ("joint", "law")}


WARM_GAIN = FittedWarmGain(
    joint="elbow_flexion", slope_per_C=-0.003, slope_sd_per_C=0.0005, at_C=40.0, lowest_C=25.0, highest_C=55.0
)
"""Gain of a motor with warm magnets, told by some recordings."""

CUFFS = FittedCuffs(
    log_stiffness=0.3,
    log_stiffness_sd=0.1,
    log_rotational_stiffness=-0.2,
    log_rotational_stiffness_sd=0.3,
    correlation=-0.5,
    recordings=[FittedRecording(file="worn.mcap", sha256="1", seconds=60.0)],
)
"""Cuffs that some recording of an arm in the machine tells."""


def made_twin(
    description: RigDescription,
    share: float = 0.2,
    has_motor_encoders: bool = True,
    gain_by_temperature: Sequence[FittedWarmGain] = (),
    cuffs: Sequence[FittedCuffs] = (),
) -> StoredTwin:
    """Return a twin with the data sheet's values, and this share of their standard deviations."""
    lengths = settings_of_lengths(description, ())
    prior = data_sheet_prior(description, adjusted(read_exoskeleton(description), description, lengths), TWIN_PER_JOINT)
    covariance = share**2 * prior.covariance
    joints = description.joints
    whole = StoredTwin(
        schema_version=3,
        identity=identity_of(description, "from recordings"),
        provenance=Provenance(
            at_utc=datetime(2026, 1, 1, tzinfo=UTC),
            exograv="0",
            held_out_s=1.0,
            lengths_m=lengths,
            recordings=[FittedRecording(file="made.mcap", sha256="0", seconds=1.0)],
        ),
        delay_ms=[1.5, 0.1],
        first_order_delay_ms=[1.5],
        drives=[
            FittedDrive(joint=joint, bandwidth_Hz=25.0, bandwidth_sd_log=0.05, damping=0.0, first_order_Hz=25.0)
            for joint in joints[1:]
        ],
        gears=[FittedGear(joint=joints[0], compliance_rad_per_Nm=1e-4, compliance_sd_rad_per_Nm=1e-6)],
        has_motor_encoders=has_motor_encoders,
        gain_by_temperature=list(gain_by_temperature),
        cuffs=list(cuffs),
        joints=[FittedJoint(joint=joint, law="stribeck", **NUMBERS) for joint in joints],
        posterior=Posterior(
            per_joint=list(TWIN_PER_JOINT),
            weights=prior.layout.weights,
            mean=prior.mean.tolist(),
            covariance=[row[: k + 1].tolist() for k, row in enumerate(np.asarray(covariance))],
        ),
    )
    return sealed(whole)


def with_twin_in(folder: Path, description: RigDescription, whole: StoredTwin) -> Path:
    """Copy the machine into a folder, and put the twin beside it."""
    copy_machine(description, folder)
    write_twin(folder / NAME, whole)
    return folder
