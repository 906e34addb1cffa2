"""`exograv twin fit`: the twin of a machine from recordings of the empty machine, as a folder with `twin.toml`."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv import __version__
from exograv.identification.calibration.empty_machine import calibration_of
from exograv.identification.machine_twin.axis_inertia import axis_inertia
from exograv.identification.machine_twin.friction_laws import LAWS
from exograv.identification.machine_twin.gain_temperature import GainByTemperature
from exograv.identification.machine_twin.machine_fit import MachineFit, fit_machine
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.procedures.calibration.breakaway_checks import refuse_joints_without_motor
from exograv.procedures.calibration.segment_lengths import settings_of_lengths
from exograv.report.figures.twin_fit_data import (
    AxisInertia,
    CuffFigures,
    FittedParameter,
    FurtherMotion,
    GearFigures,
    JointFriction,
    JointResiduals,
    LawScore,
    TwinFigures,
    WarmGain,
)
from exograv.storage.calibration_file import identity_of
from exograv.storage.sealed_file import refuse_other_kind, sealed
from exograv.storage.twin_file import (
    HEAD,
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

from .fit_checks import fit_warnings, refuse_other_frame, refuse_reversed_currents, refuse_unknown_frame
from .further_motion import MOTION, further_motion, write_further_motion
from .machine_folder import copy_machine
from .options import TwinFitOptions
from .read_motions import ReadRecording, read_motions
from .worn_cuffs import WORN_LEAST_S, WornCuffs, worn_cuffs

DIGITS = 9
"""Significant digits of the stored numbers [-]."""

REPORT = "twin_{rig}.html"
"""Name of the page of a fit."""

Progress = Callable[[str, float], None]

UNITS: Mapping[str, str] = {
    "inverse_gain": "-", "coulomb": "N·m", "viscous": "N·m·s/rad", "load_share": "-", "asymmetry": "N·m",
    "rotor": "kg·m²", "breakaway": "-", "log_v_stribeck": "-", "viscous_power": "-", "offset": "rad",
}  # fmt: skip
"""Parameters of a joint that the report shows, with their units."""


@dataclass(frozen=True)
class TwinFitResult:
    """Result of `exograv twin fit`."""

    figures: TwinFigures
    folder: Path
    """Folder of the machine with its twin."""
    hash: str
    report: Path
    """Page of the fit."""
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
    tree = adjusted(read_exoskeleton(description), description, lengths)
    force_frame = options.force_frame or description.calibration.mount
    refuse_unknown_frame(tree, force_frame)
    recordings = read_motions(
        description, options.recordings, weights, is_torque=options.torque, is_degrees=options.degrees
    )
    if options.force_frame is None:
        refuse_other_frame(recordings, force_frame)
    motions = tuple(motion for recording in recordings for motion in recording.motions)
    has_force_sensor = any(motion.wrench is not None for motion in motions)
    found = fit_machine(description, tree, motions, progress, force_frame if has_force_sensor else None)
    refuse_reversed_currents(description, found)
    progress("Fitting the cuffs", 0.85)
    cuffs = worn_cuffs(description, calibration_of(description, found.fit).machine, recordings)
    whole = stored_twin(description, found, recordings, lengths, now, cuffs)
    copy_machine(description, folder)
    write_twin(folder / NAME, whole)
    axes = axis_inertia(tree, found.fit)
    progress("Designing further motion", 0.9)
    motion = write_further_motion(folder / MOTION, description, tree, found, shown_parameters(description, found))
    figures = _figures(description, found, recordings, axes, motion, cuffs)
    from exograv.report.of_recording.twin_report import write_twin_report  # Matplotlib: 0.4 s

    report = write_twin_report(figures, out / REPORT.format(rig=description.name))
    progress("The twin is fitted", 1.0)
    return TwinFitResult(figures, folder, whole.content_sha256, report, round(time.perf_counter() - start, 2))


def stored_twin(
    description: RigDescription,
    found: MachineFit,
    recordings: tuple[ReadRecording, ...],
    lengths: Mapping[str, float],
    now: datetime,
    cuffs: WornCuffs | None = None,
) -> StoredTwin:
    """Return the fit in the form of the file."""
    layout, response = found.fit.prior.layout, found.response
    compliance, compliance_sd = found.gears.compliance, found.gears.sd
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
        schema_version=3,
        identity=identity_of(description, "from recordings"),
        provenance=Provenance(
            at_utc=now,
            exograv=__version__,
            held_out_s=round(found.validation.seconds, 3),
            lengths_m=dict(lengths),
            recordings=[
                FittedRecording(file=one.path.name, sha256=one.sha256, seconds=round(one.seconds, 3))
                for one in recordings
                if one.motions
            ],
        ),
        delay_ms=delay_ms if drives else [],
        first_order_delay_ms=_short(1e3 * np.array([response.first_order_delay_s])) if drives else [],
        drives=drives,
        gears=[
            FittedGear(
                joint=joint,
                compliance_rad_per_Nm=_short(compliance)[j],
                compliance_sd_rad_per_Nm=_short(compliance_sd)[j],
            )
            for j, joint in enumerate(description.joints)
            if np.isfinite(compliance[j])
        ],
        has_motor_encoders=found.has_motor_encoders,
        gain_by_temperature=_warm_rows(description, found.warmth),
        cuffs=[] if cuffs is None else [_cuff_row(cuffs)],
        joints=_joint_rows(description, found),
        posterior=Posterior(
            per_joint=list(layout.per_joint),
            weights=layout.weights,
            mean=_short(found.fit.theta),
            covariance=covariance,
        ),
    )
    return sealed(whole)


def _cuff_row(cuffs: WornCuffs) -> FittedCuffs:
    (stiffness, rotation), sd = _short(cuffs.mean), cuffs.sd
    stiffness_sd, rotation_sd = _short(sd)
    return FittedCuffs(
        log_stiffness=stiffness,
        log_stiffness_sd=stiffness_sd,
        log_rotational_stiffness=rotation,
        log_rotational_stiffness_sd=rotation_sd,
        correlation=float(np.clip(cuffs.covariance[0, 1] / (sd[0] * sd[1]), -1.0, 1.0)),
        recordings=[
            FittedRecording(file=one.path.name, sha256=one.sha256, seconds=round(seconds, 3))
            for one, seconds in zip(cuffs.recordings, cuffs.seconds, strict=True)
        ],
    )


def _warm_rows(description: RigDescription, warmth: GainByTemperature) -> list[FittedWarmGain]:
    columns = {
        "slope_per_C": warmth.slope_per_C,
        "slope_sd_per_C": warmth.sd,
        "at_C": warmth.mean_C,
        "lowest_C": warmth.lowest_C,
        "highest_C": warmth.highest_C,
    }
    return [
        FittedWarmGain.model_validate({"joint": joint} | {name: _short(column)[j] for name, column in columns.items()})
        for j, joint in enumerate(description.joints)
        if np.isfinite(warmth.slope_per_C[j])
    ]


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


def _figures(
    description: RigDescription,
    found: MachineFit,
    recordings: tuple[ReadRecording, ...],
    axes: tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]],
    motion: FurtherMotion,
    cuffs: WornCuffs | None,
) -> TwinFigures:
    validation, response = found.validation, found.response
    rows = zip(
        validation.rms_Nm, validation.noise_Nm, validation.over_noise, validation.slow_rms_Nm, validation.fitted_rms_Nm,
        found.moved_s, strict=True,
    )  # fmt: skip
    delay, half = 1e3 * response.delay_s, 1.96e3 * response.delay_sd_s
    is_known = bool(np.isfinite(response.delay_s))
    return TwinFigures(
        rig=description.name,
        side=description.side,
        recordings=[one.path.name for one in recordings],
        recorded_s=round(sum(one.seconds for one in recordings), 1),
        held_out_s=round(validation.seconds, 1),
        is_simulated=any(one.is_simulated for one in recordings),
        held_out=[
            JointResiduals(joint, law, *(float(value) for value in row))
            for joint, law, row in zip(description.joints, found.laws, rows, strict=True)
        ],
        friction=[_friction(description, found, j) for j in range(len(description.joints))],
        parameters=_parameters(description, found),
        axis_inertia=[
            AxisInertia(joint, value, (value - 1.96 * sd, value + 1.96 * sd))
            for joint, value, sd in zip(description.joints, *(one.tolist() for one in axes), strict=True)
        ],
        delay_ms=delay if is_known else None,
        delay_ci95_ms=(max(delay - half, 0.0), delay + half) if is_known else None,
        gears=[
            GearFigures(joint, 1e3 * value, (1e3 * (value - 1.96 * sd), 1e3 * (value + 1.96 * sd)))
            for joint, value, sd in zip(
                description.joints, found.gears.compliance.tolist(), found.gears.sd.tolist(), strict=True
            )
            if np.isfinite(value)
        ],
        has_motor_encoders=found.has_motor_encoders,
        gain_by_temperature=_warm_gains(description, found.warmth),
        bandwidth_Hz=[value if np.isfinite(value) else None for value in response.bandwidth_Hz.tolist()],
        cuffs=[] if cuffs is None else _cuff_figures(cuffs),
        warnings=fit_warnings(description, found, recordings) + _worn(recordings, cuffs),
        further_motion=further_motion(description, found, axes),
        designed_motion=motion,
    )


def _warm_gains(description: RigDescription, warmth: GainByTemperature) -> list[WarmGain]:
    rows = list[WarmGain]()
    columns = (100.0 * warmth.slope_per_C, 196.0 * warmth.sd, warmth.lowest_C, warmth.highest_C)
    for joint, slope, half, low, high in zip(description.joints, *(one.tolist() for one in columns), strict=True):
        is_told, is_measured = bool(np.isfinite(slope)), bool(np.isfinite(low))
        ci95 = (slope - half, slope + half) if is_told else None
        rows.append(WarmGain(joint, slope if is_told else None, ci95, (low, high) if is_measured else None))
    return rows


def _friction(description: RigDescription, found: MachineFit, j: int) -> JointFriction:
    curve, choice = found.curve, found.choices[j]
    v, torque, half = curve.v[:, j], curve.torque[:, j], 1.96 * curve.sd[:, j]
    is_shown = np.isfinite(curve.measured[:, j])
    return JointFriction(
        joint=description.joints[j],
        law=choice.law,
        v_rad_s=_short(v),
        torque_Nm=_short(torque),
        ci95_Nm=list(zip(_short(torque - half), _short(torque + half), strict=True)),
        measured_v_rad_s=_short(curve.measured_v[is_shown, j]),
        measured_Nm=_short(curve.measured[is_shown, j]),
        laws=[LawScore(law, excess, choice.excess_sd[law]) for law, excess in choice.excess.items()],
    )


def shown_parameters(description: RigDescription, found: MachineFit) -> list[tuple[int, str]]:
    """Joint and name of each parameter of the report: those of the joint's law, gain, rotor and encoder offset."""
    always = ("inverse_gain", "coulomb", "viscous", "rotor", "offset")
    return [
        (j, name)
        for j in range(len(description.joints))
        for name in UNITS
        if name in always or name in LAWS[found.laws[j]]
    ]


def _parameters(description: RigDescription, found: MachineFit) -> list[FittedParameter]:
    prior, rows = found.fit.prior, list[FittedParameter]()
    for j, name in shown_parameters(description, found):
        k = prior.layout.of(name).start + j
        value, sd = float(found.fit.theta[k]), float(found.fit.sd[k])
        before, before_sd = float(prior.mean[k]), float(np.sqrt(prior.covariance[k, k]))
        ci95, learned = (value - 1.96 * sd, value + 1.96 * sd), round(1.0 - sd / before_sd, 3)
        rows.append(FittedParameter(description.joints[j], name, UNITS[name], value, ci95, before, before_sd, learned))
    return rows


def _cuff_figures(cuffs: WornCuffs) -> list[CuffFigures]:
    rows = zip(("translation", "rotation"), cuffs.mean.tolist(), cuffs.sd.tolist(), cuffs.learned.tolist(), strict=True)
    return [
        CuffFigures(
            name,
            float(np.exp(mean)),
            (float(np.exp(mean - 1.96 * sd)), float(np.exp(mean + 1.96 * sd))),
            round(learned, 3),
        )
        for name, mean, sd, learned in rows
    ]


def _worn(recordings: tuple[ReadRecording, ...], cuffs: WornCuffs | None) -> list[str]:
    seconds = sum(one.worn_s for one in recordings)
    if seconds == 0.0 or cuffs is not None:
        return []
    return [
        f"{seconds:.0f} s with an arm in the machine are left out. The cuffs are not fitted, because no identification "
        f"of an arm of {WORN_LEAST_S:g} s or more is among them: in the twin they are those of any machine."
    ]
