"""`exograv twin fit`: the twin of a machine from recordings of the empty machine, as a folder with `twin.toml`."""

import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv import __version__
from exograv.identification.machine_twin.axis_inertia import axis_inertia
from exograv.identification.machine_twin.friction_laws import LAWS
from exograv.identification.machine_twin.machine_fit import MachineFit, fit_machine
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.procedures.calibration.breakaway_checks import refuse_joints_without_motor
from exograv.procedures.calibration.segment_lengths import settings_of_lengths
from exograv.storage.calibration_file import identity_of
from exograv.storage.sealed_file import refuse_other_kind, sealed
from exograv.storage.twin_file import (
    HEAD,
    NAME,
    FittedDrive,
    FittedJoint,
    FittedRecording,
    Posterior,
    Provenance,
    StoredTwin,
    write_twin,
)

from .further_motion import further_motion
from .options import TwinFitOptions
from .read_motions import ReadRecording, read_motions

DIGITS = 9
"""Significant digits of the stored numbers [-]."""

Progress = Callable[[str, float], None]

UNITS: Mapping[str, str] = {
    "inverse_gain": "-", "coulomb": "N·m", "viscous": "N·m·s/rad", "load_share": "-", "asymmetry": "N·m",
    "rotor": "kg·m²", "breakaway": "-", "log_v_stribeck": "-", "viscous_power": "-", "offset": "rad",
}  # fmt: skip
"""Parameters of a joint that the report shows, with their units."""


@dataclass(frozen=True)
class FittedParameter:
    """Parameter of a joint, with what the recordings tell about it."""

    joint: str
    parameter: str
    unit: str
    estimate: float
    ci95: tuple[float, float]
    learned: float
    """1 if the recordings tell all about it, 0 if its interval is that of the data sheet: 1 − sd after / sd before."""


@dataclass(frozen=True)
class AxisInertia:
    """Inertia about a joint's axis with all joints at zero: rotor and links together."""

    joint: str
    inertia_kgm2: float
    inertia_ci95_kgm2: tuple[float, float]


@dataclass(frozen=True)
class JointResiduals:
    """Residual torque of a joint on the held-out part of the recordings."""

    joint: str
    law: str
    rms_Nm: float
    noise_Nm: float
    over_noise: float
    slow_rms_Nm: float
    """Residual below 7 Hz, where most of the noise is filtered away."""
    moved_s: float


@dataclass(frozen=True)
class TwinFitResult:
    """Result of `exograv twin fit`."""

    rig: str
    side: str
    folder: Path
    """Folder of the machine with its twin."""
    hash: str
    recordings: list[str]
    recorded_s: float
    held_out_s: float
    held_out: list[JointResiduals]
    parameters: list[FittedParameter]
    axis_inertia: list[AxisInertia]
    delay_ms: float | None
    delay_ci95_ms: tuple[float, float] | None
    bandwidth_Hz: list[float | None]
    warnings: list[str]
    further_motion: list[str]
    """Motions that would tell what these recordings do not."""
    wall_s: float


def fit_and_write(
    options: TwinFitOptions, out: Path, progress: Progress = lambda _text, _share: None, now: datetime | None = None
) -> TwinFitResult:
    """Fit the twin of a machine, and write the folder of the machine with the twin in it.

    Raises:
        ConfigError: The machine or an option cannot be used, or the folder cannot be written.
        RecordingError: A recording cannot be read.
        IdentificationError: The recordings do not move the machine enough.
    """
    start, now = time.perf_counter(), (now or datetime.now(UTC)).replace(microsecond=0)
    description = load_rig(options.machine, options.side)
    refuse_joints_without_motor(description)
    lengths = settings_of_lengths(description, options.lengths)
    folder = out / description.name
    refuse_other_kind(folder / NAME, StoredTwin, HEAD, "--out")
    progress("Reading the recordings", 0.0)
    weights = options.weight_of_file()
    recordings = read_motions(description, options.recordings, weights, is_torque=options.torque)
    motions = tuple(motion for recording in recordings for motion in recording.motions)
    tree = adjusted(read_exoskeleton(description), description, lengths)
    found = fit_machine(description, tree, motions, progress)
    whole = _stored(description, found, recordings, lengths, now)
    copy_machine(description, folder)
    write_twin(folder / NAME, whole)
    progress("The twin is fitted", 1.0)
    axes = axis_inertia(tree, found.fit)
    return _result(description, found, recordings, whole, folder, axes, time.perf_counter() - start)


def copy_machine(description: RigDescription, folder: Path) -> None:
    """Copy the folder of a machine, without its twin."""
    if folder.exists() and folder.samefile(description.folder):
        return
    shutil.copytree(description.folder, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns(NAME))


def _stored(
    description: RigDescription,
    found: MachineFit,
    recordings: tuple[ReadRecording, ...],
    lengths: Mapping[str, float],
    now: datetime,
) -> StoredTwin:
    """Return the fit in the form of the file."""
    layout, response = found.fit.prior.layout, found.response
    covariance = [_short(row[: k + 1]) for k, row in enumerate(found.fit.covariance)]
    drives = [
        FittedDrive(
            joint=joint,
            bandwidth_Hz=float(response.bandwidth_Hz[j]),
            bandwidth_sd_log=float(response.bandwidth_sd_log[j]),
            damping=float(np.nan_to_num(response.damping[j])),
            first_order_Hz=float(response.first_order_Hz[j]),
        )
        for j, joint in enumerate(description.joints)
        if np.isfinite(response.bandwidth_Hz[j])
    ]
    delay_ms = _short(1e3 * np.array([response.delay_s, response.delay_sd_s]))
    whole = StoredTwin(
        schema_version=1,
        identity=identity_of(description, "from recordings"),
        provenance=Provenance(
            at_utc=now,
            exograv=__version__,
            held_out_s=round(found.validation.seconds, 3),
            lengths_m=dict(lengths),
            recordings=[
                FittedRecording(file=one.path.name, sha256=one.sha256, seconds=round(one.seconds, 3))
                for one in recordings
            ],
        ),
        delay_ms=delay_ms if drives else [],
        first_order_delay_ms=_short(1e3 * np.array([response.first_order_delay_s])) if drives else [],
        drives=drives,
        joints=_joint_rows(description, found),
        posterior=Posterior(
            per_joint=list(layout.per_joint),
            weights=layout.weights,
            mean=_short(found.fit.theta),
            covariance=covariance,
        ),
    )
    return sealed(whole)


def _joint_rows(description: RigDescription, found: MachineFit) -> list[FittedJoint]:
    layout, theta, sd, validation = found.fit.prior.layout, found.fit.theta, found.fit.sd, found.validation
    gain = description.nominal_gain / theta[layout.of("inverse_gain")]
    columns = {
        "gain_Nm_per_A": gain,
        "gain_sd_Nm_per_A": gain * sd[layout.of("inverse_gain")] / theta[layout.of("inverse_gain")],
        "v_stribeck_rad_per_s": np.exp(theta[layout.of("log_v_stribeck")]),
        "encoder_offset_deg": np.rad2deg(theta[layout.of("offset")]),
        "encoder_offset_sd_deg": np.rad2deg(sd[layout.of("offset")]),
        "rotor_inertia_kgm2": theta[layout.of("rotor")],
        "rotor_inertia_sd_kgm2": sd[layout.of("rotor")],
        "encoder_step_rad": found.encoder_step,
        "noise_Nm": found.noise_A * gain,
        "held_out_rms_Nm": validation.rms_Nm,
        "held_out_slow_rms_Nm": validation.slow_rms_Nm,
        "moved_s": found.moved_s,
        "fastest_rad_per_s": found.fastest,
    }
    for name, unit in (
        ("coulomb", "_Nm"), ("viscous", "_Nms_per_rad"), ("viscous_power", ""), ("breakaway", ""),
        ("load_share", ""), ("asymmetry", "_Nm"),
    ):  # fmt: skip
        columns[f"{name}{unit}"], columns[f"{name}_sd{unit}"] = theta[layout.of(name)], sd[layout.of(name)]
    return [
        FittedJoint.model_validate(
            {"joint": joint, "law": found.laws[j]} | {name: _short(column)[j] for name, column in columns.items()}
        )
        for j, joint in enumerate(description.joints)
    ]


def _short(values: Float[np.ndarray, " value"]) -> list[float]:
    return [float(f"{value:.{DIGITS}g}") for value in values.tolist()]


def _result(
    description: RigDescription,
    found: MachineFit,
    recordings: tuple[ReadRecording, ...],
    whole: StoredTwin,
    folder: Path,
    axes: tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]],
    wall_s: float,
) -> TwinFitResult:
    validation, delay = found.validation, whole.delay_ms
    columns = (validation.rms_Nm, validation.noise_Nm, validation.over_noise, validation.slow_rms_Nm, found.moved_s)
    rows = zip(description.joints, found.laws, *(column.tolist() for column in columns), strict=True)
    bandwidth = {drive.joint: drive.bandwidth_Hz for drive in whole.drives}
    return TwinFitResult(
        rig=description.name,
        side=description.side,
        folder=folder,
        hash=whole.content_sha256,
        recordings=[one.path.name for one in recordings],
        recorded_s=round(sum(one.seconds for one in recordings), 1),
        held_out_s=round(validation.seconds, 1),
        held_out=[JointResiduals(*row) for row in rows],
        parameters=_parameters(description, found),
        axis_inertia=[
            AxisInertia(joint, value, (value - 1.96 * sd, value + 1.96 * sd))
            for joint, value, sd in zip(description.joints, *(one.tolist() for one in axes), strict=True)
        ],
        delay_ms=delay[0] if delay else None,
        delay_ci95_ms=(delay[0] - 1.96 * delay[1], delay[0] + 1.96 * delay[1]) if delay else None,
        bandwidth_Hz=[bandwidth.get(joint) for joint in description.joints],
        warnings=_warnings(description, found),
        further_motion=further_motion(description, found, axes),
        wall_s=round(wall_s, 2),
    )


def _parameters(description: RigDescription, found: MachineFit) -> list[FittedParameter]:
    layout, prior_sd = found.fit.prior.layout, np.sqrt(np.diag(found.fit.prior.covariance))
    rows = []
    for j, joint in enumerate(description.joints):
        for name, unit in UNITS.items():
            is_chosen = name in LAWS[found.laws[j]] or name in ("inverse_gain", "coulomb", "viscous", "rotor", "offset")
            if not is_chosen:
                continue
            k = layout.of(name).start + j
            value, sd = float(found.fit.theta[k]), float(found.fit.sd[k])
            learned = 1.0 - sd / float(prior_sd[k])
            rows.append(
                FittedParameter(joint, name, unit, value, (value - 1.96 * sd, value + 1.96 * sd), round(learned, 3))
            )
    return rows


def _warnings(description: RigDescription, found: MachineFit) -> list[str]:
    told = []
    for joint, over in zip(description.joints, found.validation.over_noise.tolist(), strict=True):
        if over > OVER_NOISE_MAX:
            told.append(
                f"The residual of joint '{joint}' on the held-out part is {over:.2f} times its noise; the law of "
                "friction may be another, a part may rub, or a weight is not stated."
            )
    if found.response.delay_spread > SPREAD_MAX:
        told.append(
            f"The delays of the joints differ by {found.response.delay_spread:.1f} standard deviations: the twin has "
            "one delay for all, with a wider interval."
        )
    return told


OVER_NOISE_MAX = 1.2
"""Largest residual on the held-out part over the noise without a warning [-]."""

SPREAD_MAX = 3.0
"""Largest disagreement of the joints' delays without a warning, in standard deviations [-]."""
