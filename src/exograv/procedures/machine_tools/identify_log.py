"""Identification of a payload from recorded logs of a robot, with the methods that serve the arm."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError, IdentificationError, RecordingError
from exograv.identification.core.interface import Estimate, Method, Sample
from exograv.identification.methods import BUILDERS, built
from exograv.identification.payload.first_fit import FirstFit, cost_at, first_fit
from exograv.identification.payload.payload import PAYLOAD, PayloadModel
from exograv.identification.payload.payload_gradient import PayloadGradient, rehearsed_step
from exograv.identification.payload.payload_outcome import (
    NOT_FITTED_RATIO,
    PayloadOutcome,
    judge,
    mass_interval,
    refuse_negative_mass,
)
from exograv.identification.payload.payload_samples import refuse_other_robots, samples_of_log
from exograv.identification.payload.payload_setting import payload_setting
from exograv.identification.payload.robot_from_log import RobotFromLog, robot_from_log
from exograv.identification.payload.trial_load import rehearsed
from exograv.identification.recursive.recursive import Recursive
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

COMPLETE = ("recursive", "oracle")
"""Methods whose covariance contains the coloured residual, the gain errors and the changes of the robot's friction. The
covariance of another method is at least that of the direct fit."""


@dataclass(frozen=True)
class _Loaded:
    """Data from which the loaded run starts."""

    model: PayloadModel
    robot: RobotFromLog
    unloaded: list[list[Sample]]
    samples: list[Sample]
    first: FirstFit

    @property
    def all_unloaded(self) -> list[Sample]:
        """Samples of all unloaded logs, one log after the other."""
        return [sample for log in self.unloaded for sample in log]


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
    gains_Nm_per_A: Sequence[float] | None
    """Gains of the options; None if the logs contain torques."""
    gain_sd: float
    gain_errors: list[float]
    """Error of each joint's torque, relative to those of the other joints [-]."""
    gain_errors_sd: list[float]
    rejected_share: float
    joints: tuple[str, ...]
    residual_rms_Nm: dict[str, list[float]]
    log: LogRows
    unloaded: list[LogRows]


def identify_log(options: LogOptions, progress: Progress = lambda _text, _share: None) -> LogResult:
    """Identify the empty robot from unloaded logs, then its payload from another log.

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
    log, *unloaded = logs = _read_all(tree, options)
    gains = np.ones(len(tree.joints)) if options.torque else np.array(options.gains)
    paths = (options.log, *options.unloaded)
    samples, *samples_unloaded = (_samples(one, path, gains) for one, path in zip(logs, paths, strict=True))
    progress("Identifying the empty robot", 0.0)
    robot = robot_from_log(model, *samples_unloaded)
    first = first_fit(model, robot, samples)
    refuse_negative_mass(first)
    loaded = _Loaded(model, robot, samples_unloaded, samples, first)
    true_kg = options.true_kg
    estimate, masses = _follow(loaded, options.method, true_kg is not None, progress)
    is_fitted = cost_at(model, robot, samples, estimate.x) <= NOT_FITTED_RATIO * first.cost
    estimate = _widened(estimate, options.method, first) if is_fitted else replace(estimate, covariance=None)
    interval = mass_interval(estimate, options.gain_sd)
    residuals = _residuals(loaded, estimate)
    worse = np.max(residuals["loaded_with_payload"] / residuals["unloaded"])
    gain, gain_sd = (values[model.blocks.gain] for values in (estimate.x, np.sqrt(np.diag(robot.covariance))))
    return LogResult(
        payload=_payload(estimate, interval),
        time_to_10pct_s=None if true_kg is None else _time_to_stay_within(FOUND * true_kg, masses, true_kg),
        duration_s=_digits(log.t[-1] - log.t[0]),
        samples=len(samples),
        outcome=judge(estimate, interval, float(worse), is_fitted),
        method=options.method,
        payload_frame=options.payload_frame,
        true_kg=true_kg,
        gains_Nm_per_A=None if options.torque else options.gains,
        gain_sd=options.gain_sd,
        gain_errors=_digits(gain),
        gain_errors_sd=_digits(gain_sd),
        rejected_share=_digits(estimate.rejected_share),
        joints=tree.joint_names,
        residual_rms_Nm={name: _digits(rms) for name, rms in residuals.items()},
        log=LogRows(log.rows, log.skipped),
        unloaded=[LogRows(one.rows, one.skipped) for one in unloaded],
    )


def _refuse_options(tree: Tree, options: LogOptions) -> None:
    true_kg, method, gain_sd = options.true_kg, options.method, options.gain_sd
    if not options.unloaded:
        raise ConfigError("--unloaded names no log. Give one or more logs of the robot without the payload.")
    if options.torque and len(options.gains) > 0:
        raise ConfigError("--torque means that the logs contain torques; leave out --gains, or --torque.")
    if not options.torque:
        _refuse_gains(tree, options.gains)
    if true_kg is not None and not 0.0 < true_kg < np.inf:
        raise ConfigError(f"--true-kg is {true_kg}; it must be a positive mass in kg. Leave it out if it is not known.")
    if not 0.0 <= gain_sd < 1.0:
        raise ConfigError(f"--gain-sd is {gain_sd}; allowed: a share from 0 to below 1, for instance 0.05 for 5 %.")
    if method not in METHODS:
        raise ConfigError(
            f"--method {method} is for arms: a payload has no table and no cuffs. "
            f"Choose {', '.join(METHODS[:-1])} or {METHODS[-1]}."
        )


def _refuse_gains(tree: Tree, gains: Sequence[float]) -> None:
    names = ", ".join(tree.joint_names)
    if len(gains) == 0:
        raise ConfigError(
            "--gains is missing: the joint torque per motor current [N·m/A], one per joint. If the logs contain joint "
            "torques, give --torque."
        )
    if len(gains) != len(tree.joints):
        raise ConfigError(
            f"--gains has {len(gains)} numbers; {tree.name} has {len(tree.joints)} joints ({names}) and needs one each "
            "[N·m/A]."
        )
    for name, gain in zip(tree.joint_names, gains, strict=True):
        if not np.isfinite(gain) or gain == 0.0:
            raise ConfigError(f"--gains of joint '{name}' is {gain}; it must be finite and not zero [N·m/A].")


def _read_all(tree: Tree, options: LogOptions) -> list[MotionLog]:
    """Read the loaded log, then the unloaded ones."""
    chosen = [None] * len(options.unloaded) if options.rows_unloaded is None else options.rows_unloaded.split(",")
    if len(chosen) != len(options.unloaded):
        raise ConfigError(
            f"--rows-unloaded has {len(chosen)} ranges for {len(options.unloaded)} unloaded logs; give one for each, "
            "separated by commas."
        )
    logs = []
    for path, rows in zip((options.log, *options.unloaded), (options.rows, *chosen), strict=True):
        log = read_log(path, tree.joint_names, rows, options.columns, is_torque=options.torque)
        refuse_other_robots(log, tree, path)
        logs.append(log)
    return logs


def _samples(log: MotionLog, path: Path, gains: Float[np.ndarray, " joint"]) -> list[Sample]:
    samples = samples_of_log(log, gains)
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
                looks.append((sample.t, _parameters(identifier)[0]))
    progress("Identifying the payload", 1.0)
    estimate = identifier.estimate()
    if not np.isfinite(estimate.x).all():
        raise IdentificationError(f"{method} diverged: its parameters are not finite. Use --method recursive.")
    return estimate, np.array(looks).reshape(-1, 2)


def _parameters(identifier: Method) -> Float[np.ndarray, " parameter"]:
    """Present parameters, without the covariance where the method can leave it out."""
    return identifier.parameters() if isinstance(identifier, Recursive) else identifier.estimate().x


def _widened(estimate: Estimate, method: MethodName, first: FirstFit) -> Estimate:
    """Replace a covariance that is smaller than that of the direct fit; see `COMPLETE`."""
    if estimate.covariance is None or method in COMPLETE or estimate.covariance[0, 0] >= first.covariance[0, 0]:
        return estimate
    covariance = estimate.covariance.copy()
    covariance[PAYLOAD, PAYLOAD] = first.covariance
    return replace(estimate, covariance=covariance)


def _method(loaded: _Loaded, method: MethodName, progress: Progress) -> Method:
    setting = payload_setting(loaded.model, loaded.robot, loaded.all_unloaded + loaded.samples, loaded.first.x)
    text = "Rehearsing on the unloaded log"
    progress(text, 0.0)
    if method == "gradient":
        return PayloadGradient(loaded.model, setting.mean, rehearsed_step(setting, loaded.unloaded[0]))
    tuning = rehearsed(method, setting, loaded.unloaded[0], lambda share: progress(text, share))
    return built(method, setting, tuning)


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
        ("unloaded", loaded.all_unloaded, loaded.robot.x),
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
