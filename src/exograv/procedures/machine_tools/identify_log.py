"""Identification of a payload from recorded logs of a robot, with the methods that serve the arm."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError, IdentificationError, RecordingError
from exograv.identification.core.interface import Estimate, Method, Sample
from exograv.identification.methods import BUILDERS, built
from exograv.identification.payload.payload import PAYLOAD, PayloadModel
from exograv.identification.payload.payload_gradient import PayloadGradient, rehearsed_step
from exograv.identification.payload.payload_outcome import PayloadOutcome, judge, mass_interval, refuse_negative_mass
from exograv.identification.payload.payload_samples import refuse_other_robots, samples_of_log
from exograv.identification.payload.payload_setting import payload_setting
from exograv.identification.payload.robot_from_log import RobotFromLog, robot_from_log
from exograv.identification.payload.trial_load import rehearsed
from exograv.loop.pilot import Progress
from exograv.model.tree import Tree
from exograv.model.urdf import read_urdf
from exograv.procedures.identification.method_names import MethodName
from exograv.recording import MotionLog, read_log

from .options import LogOptions

LOOK_PERIOD_S = 0.1
"""Time between estimates that are compared with a known mass [s]."""

OFFLINE_LOOK_PERIOD_S = 5.0
"""Time between estimates of a method that solves for all samples anew each time [s]."""

METHODS = ("gradient", *BUILDERS)
"""Methods that can identify a payload."""

SAMPLES_MIN = 100
FOUND = 0.1  # allowed error as a share of the known mass


@dataclass(frozen=True)
class _Loaded:
    """Data from which the loaded run starts."""

    model: PayloadModel
    robot: RobotFromLog
    unloaded: list[Sample]
    samples: list[Sample]


@dataclass(frozen=True)
class PayloadFigures:
    """Payload in its frame, with standard deviations where the method states an uncertainty."""

    mass_kg: float
    ci95_kg: list[float] | None
    com_m: list[float]
    com_sd_m: list[float] | None


@dataclass(frozen=True)
class LogRows:
    """Rows of a log that were used."""

    rows: tuple[int, int]
    skipped_rows: int


@dataclass(frozen=True)
class LogResult:
    """Result of `exograv arm identify-log`."""

    payload: PayloadFigures
    time_to_10pct_s: float | None
    """Time of motion from which the mass stayed within 10 % of the known one [s]; None if it never did."""
    duration_s: float
    samples: int
    outcome: PayloadOutcome
    method: str
    payload_frame: str
    true_kg: float | None
    gains_Nm_per_A: Sequence[float]
    gain_sd: float
    rejected_share: float
    joints: tuple[str, ...]
    residual_rms_Nm: dict[str, list[float]]
    log: LogRows
    unloaded: LogRows


def identify_log(options: LogOptions, progress: Progress = lambda _text, _share: None) -> LogResult:
    """Identify the empty robot from one log, then its payload from another.

    Raises:
        ConfigError: An option cannot be used.
        ModelError: The description cannot be read, or has no such frame.
        RecordingError: A log cannot be read, or is not of this robot.
        IdentificationError: The payload has a negative mass.
    """
    tree = read_urdf(options.urdf)
    _refuse_options(tree, options)
    model = PayloadModel(tree, options.payload_frame)
    progress("Reading the logs", 0.0)
    paths, true_kg = (options.unloaded, options.log), options.true_kg
    chosen = (options.rows_unloaded, options.rows)
    logs = [_read(path, tree, rows) for path, rows in zip(paths, chosen, strict=True)]
    samples_unloaded, samples = (_samples(one, path, options.gains) for one, path in zip(logs, paths, strict=True))
    progress("Identifying the empty robot", 0.0)
    robot = robot_from_log(model, samples_unloaded)
    refuse_negative_mass(model, robot, samples)
    loaded = _Loaded(model, robot, samples_unloaded, samples)
    estimate, masses = _follow(loaded, options.method, true_kg is not None, progress)
    interval = mass_interval(estimate, options.gain_sd)
    residuals = _residuals(loaded, estimate)
    worse = np.max(residuals["loaded_with_payload"] / residuals["unloaded"])
    return LogResult(
        payload=_payload(estimate, interval),
        time_to_10pct_s=None if true_kg is None else _time_to_stay_within(FOUND * true_kg, masses, true_kg),
        duration_s=_digits(logs[1].t[-1] - logs[1].t[0]),
        samples=len(samples),
        outcome=judge(estimate, interval, float(worse)),
        method=options.method,
        payload_frame=options.payload_frame,
        true_kg=true_kg,
        gains_Nm_per_A=options.gains,
        gain_sd=options.gain_sd,
        rejected_share=_digits(estimate.rejected_share),
        joints=tree.joint_names,
        residual_rms_Nm={name: _digits(rms) for name, rms in residuals.items()},
        log=LogRows(logs[1].rows, logs[1].skipped),
        unloaded=LogRows(logs[0].rows, logs[0].skipped),
    )


def _refuse_options(tree: Tree, options: LogOptions) -> None:
    gains, true_kg, method, gain_sd = options.gains, options.true_kg, options.method, options.gain_sd
    names = ", ".join(tree.joint_names)
    if len(gains) != len(tree.joints):
        raise ConfigError(
            f"--gains has {len(gains)} numbers; {tree.name} has {len(tree.joints)} joints ({names}) and needs one each "
            "[N·m/A]."
        )
    for name, gain in zip(tree.joint_names, gains, strict=True):
        if not np.isfinite(gain) or gain == 0.0:
            raise ConfigError(f"--gains of joint '{name}' is {gain}; it must be finite and not zero [N·m/A].")
    if true_kg is not None and not 0.0 < true_kg < np.inf:
        raise ConfigError(f"--true-kg is {true_kg}; it must be a positive mass in kg. Leave it out if it is not known.")
    if not 0.0 <= gain_sd < 1.0:
        raise ConfigError(f"--gain-sd is {gain_sd}; allowed: a share from 0 to below 1, for instance 0.05 for 5 %.")
    if method not in METHODS:
        raise ConfigError(
            f"--method {method} is for arms: a payload has no table and no cuffs. "
            f"Choose {', '.join(METHODS[:-1])} or {METHODS[-1]}."
        )


def _read(path: Path, tree: Tree, rows: str | None) -> MotionLog:
    log = read_log(path, len(tree.joints), rows)
    refuse_other_robots(log, tree, path)
    return log


def _samples(log: MotionLog, path: Path, gains: Sequence[float]) -> list[Sample]:
    samples = samples_of_log(log, np.array(gains))
    if len(samples) < SAMPLES_MIN:
        raise RecordingError(
            f"{path}: {len(samples)} samples remain of rows {log.rows[0]}–{log.rows[1]} after the filter has settled; "
            f"{SAMPLES_MIN} are needed. Record a longer motion or choose more rows."
        )
    return samples


def _follow(
    loaded: _Loaded, method: MethodName, watch_mass: bool, progress: Progress
) -> tuple[Estimate, Float[np.ndarray, "look 2"]]:
    """Return the last estimate, and time [s] and mass [kg] during the run if `watch_mass` is set."""
    identifier = _method(loaded, method, progress)
    looks, look_t = [], 0.0
    period_s = OFFLINE_LOOK_PERIOD_S if getattr(identifier, "offline", False) else LOOK_PERIOD_S
    last = loaded.samples[-1].t
    for sample in loaded.samples:
        identifier.update(sample)
        if sample.t >= look_t:
            look_t += period_s
            progress("Identifying the payload", sample.t / last)
            if watch_mass:
                looks.append((sample.t, identifier.estimate().x[0]))
    progress("Identifying the payload", 1.0)
    estimate = identifier.estimate()
    if not np.isfinite(estimate.x).all():
        raise IdentificationError(f"{method} diverged: its parameters are not finite. Use --method recursive.")
    return estimate, np.array(looks).reshape(-1, 2)


def _method(loaded: _Loaded, method: MethodName, progress: Progress) -> Method:
    setting = payload_setting(loaded.model, loaded.robot, loaded.unloaded + loaded.samples)
    text = "Rehearsing on the unloaded log"
    progress(text, 0.0)
    if method == "gradient":
        return PayloadGradient(loaded.model, setting.mean, rehearsed_step(setting, loaded.unloaded))
    return built(method, setting, rehearsed(method, setting, loaded.unloaded, lambda share: progress(text, share)))


def _payload(estimate: Estimate, interval: Any) -> PayloadFigures:
    mass, com, com_sd = estimate.x[0], estimate.x[1:4] / estimate.x[0], None
    if estimate.covariance is not None:
        derivative = np.column_stack([-com, np.eye(3)]) / mass
        com_sd = np.sqrt(np.einsum("ai,ij,aj->a", derivative, estimate.covariance[:4, :4], derivative))
    return PayloadFigures(_digits(mass), _digits(interval), _digits(com), _digits(com_sd))


def _time_to_stay_within(band_kg: float, masses: Float[np.ndarray, "look 2"], true_kg: float) -> float | None:
    """Time of motion from which the mass stays within the band [s]; None if it ends outside."""
    outside = np.flatnonzero(~(np.abs(masses[:, 1] - true_kg) <= band_kg))
    if outside.size == 0:
        return 0.0
    return None if outside[-1] == len(masses) - 1 else round(float(masses[outside[-1] + 1, 0]), 2)


def _residuals(loaded: _Loaded, estimate: Estimate) -> dict[str, Float[np.ndarray, " joint"]]:
    """Unexplained torque, RMS per joint [N·m].

    In the loaded log without the payload, it is the torque by the payload's weight.
    """
    without = estimate.x.copy()
    without[PAYLOAD] = 0.0
    runs = (
        ("unloaded", loaded.unloaded, loaded.robot.x),
        ("loaded_without_payload", loaded.samples, without),
        ("loaded_with_payload", loaded.samples, estimate.x),
    )
    rms = {}
    for name, samples, x in runs:
        errors = np.array([sample.tau - loaded.model.linearise(sample, x)[0] for sample in samples])
        rms[name] = np.sqrt(np.mean(errors**2, axis=0))
    return rms


def _digits(value: Any) -> Any:
    """Round to four decimals; None stays None."""
    if value is None:
        return None
    return np.round(np.asarray(value, dtype=float), 4).tolist()
