"""Fit of a machine's twin: law of friction, parameters with their covariance, and validation on held-out motion."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, sosfiltfilt

from exograv.errors import IdentificationError
from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, EmptyMachine, Fit, Sweeps
from exograv.identification.calibration.empty_prior import EmptyPrior, Unknowns
from exograv.identification.core.physical import PhysicalProjection
from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .drawing_errors import likely_link_errors, with_link_errors
from .drive_response import DriveResponse, drive_response, encoder_step
from .friction_laws import LAWS, TWIN_PER_JOINT, chosen_laws, of_laws
from .measured_motion import (
    BLOCK_S,
    CHOICE_FOLD,
    FOLDS,
    V_CLEAR_TWIN,
    VALIDATION_FOLD,
    MeasuredMotion,
    Samples,
    samples_of,
    slides,
)

MOVED_S, COMPARED_MOVED_S = 10.0, 2.0
"""Shortest time of clear motion of a joint over all recordings of a fit, and in a recording that is compared [s]."""

SMOOTHED_HZ = 15.0
"""Corner of the filter without phase that smooths positions for the validation at every tick [Hz]."""

COMPARED_S = 1.0
"""Length of the blocks in which laws of friction are compared [s]."""

TICKS_APART = 5
"""Ticks between two ticks of the validation: their noise is independent at any distance."""

Joints = Float[np.ndarray, " joint"]
Progress = Callable[[str, float], None]
"""Callback with a sentence and the finished share [-]."""


@dataclass(frozen=True)
class Validation:
    """Residual torque on the held-out part of the recordings, by parameters that have not seen it."""

    seconds: float
    """Length of the held-out part [s]."""

    rms_Nm: Joints
    """Residual torque at every tick, noise included [N·m]."""

    noise_Nm: Joints
    """Noise of the measured torque at every tick [N·m]."""

    slow_rms_Nm: Joints
    """Residual torque below 7 Hz, where most of the noise is filtered away [N·m]."""

    @property
    def over_noise(self) -> Joints:
        """Residual torque over the noise, per tick [-]."""
        return self.rms_Nm / self.noise_Nm


@dataclass(frozen=True)
class MachineFit:
    """Twin of a machine from recordings."""

    fit: Fit
    """Parameters and covariance; links are physically possible."""

    laws: tuple[str, ...]
    """Law of friction of each joint, by its name in `friction_laws.LAWS`."""

    response: DriveResponse
    encoder_step: Joints
    """Quantisation step of the encoders [rad]."""

    noise_A: Joints
    """Standard deviation of the current's noise per tick [A]."""

    validation: Validation
    moved_s: Joints
    """Time of clear motion of each joint [s]."""

    fastest: Joints
    """Largest speed of each joint [rad/s]."""


def fit_machine(
    description: RigDescription,
    tree: Tree,
    motions: tuple[MeasuredMotion, ...],
    progress: Progress = lambda _text, _share: None,
) -> MachineFit:
    """Fit the twin to recordings of the empty machine, with the data sheet as prior.

    Raises:
        IdentificationError: A joint moved too little.
    """
    progress("Filtering the motion", 0.1)
    samples = samples_of(motions)
    moved_s = _moved_s(description, samples, MOVED_S)
    model = EmptyMachine(description, tree, TWIN_PER_JOINT)
    choosing = samples.only(samples.fold < CHOICE_FOLD)
    progress("Choosing the law of friction", 0.3)
    drawings = with_link_errors(model.prior, likely_link_errors(model, choosing))
    laws = _choose_laws(model, drawings, samples, choosing)
    prior = of_laws(drawings, laws)
    before = _fitted(model, samples.only(samples.fold != VALIDATION_FOLD), prior)
    progress("Fitting delay and bandwidth", 0.6)
    response = drive_response(motions)
    noise_A = np.where(np.isfinite(response.noise_A), response.noise_A, _rough_noise(motions))
    validation = _validated(model, motions, samples, before, noise_A)
    progress("Fitting the whole recording", 0.8)
    fit = _fitted(model, samples.sweeps, prior)
    links = prior.layout.links
    bodies = tuple(slice(start, start + 10) for start in range(links.start, links.stop, 10))
    fit = replace(fit, theta=PhysicalProjection(bodies, prior.mean)(fit.theta, fit.covariance))
    step = np.array([encoder_step(np.concatenate([m.q[:, joint] for m in motions])) for joint in range(len(laws))])
    fastest = np.abs(samples.sweeps.v).max(axis=0)
    return MachineFit(fit, laws, response, step, noise_A, validation, moved_s, fastest)


def _fitted(model: EmptyMachine, sweeps: Sweeps, prior: EmptyPrior) -> Fit:
    return model.fit(sweeps, prior, model.fit(sweeps, prior))


def _choose_laws(model: EmptyMachine, prior: EmptyPrior, samples: Samples, choosing: Sweeps) -> tuple[str, ...]:
    held = samples.only(samples.fold == CHOICE_FOLD)
    joints = held.q.shape[1]
    losses, noise = dict[str, np.ndarray](), np.full(joints, np.inf)
    for law in LAWS:
        fit = _fitted(model, choosing, of_laws(prior, (law,) * joints))
        noise = np.minimum(noise, fit.noise.sd)
        left = model.residual(held, fit.theta, float(choosing.t[-1]))
        losses[law] = np.where(held.clear, left, np.nan) ** 2
    return chosen_laws({law: loss / noise**2 for law, loss in losses.items()}, held.t // COMPARED_S)


def _moved_s(description: RigDescription, samples: Samples, least_s: float) -> Joints:
    moved_s = samples.sweeps.clear.sum(axis=0) * SAMPLE_PERIOD_S
    for joint, seconds in zip(description.joints, moved_s, strict=True):
        if seconds < least_s:
            raise IdentificationError(
                f"Joint '{joint}' moved for only {seconds:.1f} s in the recordings; {least_s:g} s are needed. Give a "
                "recording in which it moves, such as one of `exograv rig calibrate`."
            )
    return moved_s


def _rough_noise(motions: tuple[MeasuredMotion, ...]) -> Joints:
    """Noise of the current per tick [A] without knowledge of the command: what changes within three ticks."""
    thirds = np.concatenate([np.diff(m.current, 3, axis=0) for m in motions])
    return np.median(np.abs(thirds), axis=0) / (0.6745 * np.sqrt(20.0))


def _validated(
    model: EmptyMachine, motions: tuple[MeasuredMotion, ...], samples: Samples, fit: Fit, noise_A: Joints
) -> Validation:
    """Residuals on the part of the recordings that `fit` has not seen."""
    held, gain = samples.only(samples.fold == VALIDATION_FOLD), model.description.nominal_gain
    seen = samples.sweeps.t[samples.fold != VALIDATION_FOLD]
    t_end = float(seen[-1])
    slow = np.where(held.clear, model.residual(held, fit.theta, t_end), np.nan)
    parts, shift = list[np.ndarray](), 0.0
    for motion in motions:
        ticks = _smooth_ticks(motion, shift, VALIDATION_FOLD)
        left = _residual_at_ticks(model, fit.theta, ticks, t_end)
        parts.append(np.where(ticks.clear, left, np.nan))
        shift += float(motion.t[-1] - motion.t[0])
    inverse_gain = fit.theta[fit.prior.layout.of("inverse_gain")]
    rms, slow_rms = (np.sqrt(np.nanmean(left**2, axis=0)) / inverse_gain for left in (np.concatenate(parts), slow))
    seconds = sum(float(m.t[-1] - m.t[0]) for m in motions) / FOLDS
    return Validation(seconds, rms, noise_A * gain / inverse_gain, slow_rms)


def _smooth_ticks(motion: MeasuredMotion, shift: float, only_fold: int | None = None) -> Sweeps:
    """Return ticks, or those of one part, with the motion smoothed without delay, and the currents as measured."""
    q, dt = _smoothed(motion.q, motion.period_s), motion.period_s
    v = np.gradient(q, dt, axis=0)
    a = np.gradient(v, dt, axis=0)
    t = motion.t - motion.t[0]
    fold = (t // BLOCK_S).astype(int) % FOLDS
    is_known = np.isfinite(motion.hung).all(axis=1)
    is_of_part = np.ones(len(t), dtype=bool) if only_fold is None else fold == only_fold
    chosen = np.flatnonzero(is_of_part & is_known)[::TICKS_APART]
    rows = (t[chosen] + shift, q[chosen], v[chosen], a[chosen], motion.current[chosen], motion.hung[chosen])
    return Sweeps(*rows, np.zeros(len(chosen), dtype=bool), v_clear=V_CLEAR_TWIN, slides=slides(motion.q)[chosen])


def _residual_at_ticks(
    model: EmptyMachine, theta: Unknowns, ticks: Sweeps, t_end: float
) -> Float[np.ndarray, "tick joint"]:
    """Nominal torque that is left unexplained [N·m]; the ripple is whole, as no sample filter weakens it."""
    layout, theta = model.prior.layout, theta.copy()
    sine, cosine = theta[layout.of("ripple_sine")].copy(), theta[layout.of("ripple_cosine")].copy()
    theta[layout.of("ripple_sine")] = theta[layout.of("ripple_cosine")] = 0.0
    angle = model.description.per_actuator("gear_ratio") * ticks.q
    ripple = (sine * np.sin(angle) + cosine * np.cos(angle)) * np.sign(ticks.v)
    return model.residual(ticks, theta, t_end) - theta[layout.of("inverse_gain")] * ripple


def _smoothed(q: Float[np.ndarray, "tick joint"], period_s: float) -> Float[np.ndarray, "tick joint"]:
    sections = np.asarray(butter(4, 2.0 * SMOOTHED_HZ * period_s, output="sos"))
    return np.asarray(sosfiltfilt(sections, q, axis=0))


@dataclass(frozen=True)
class RecordingResidual:
    """RMS torque of a recording that the parameters of a twin leave unexplained in clear motion, at the joints."""

    per_tick_Nm: Joints
    """Residual at every tick, noise included [N·m]."""

    slow_Nm: Joints
    """Residual below 7 Hz [N·m]."""


def recording_residual(
    description: RigDescription, tree: Tree, theta: Unknowns, motions: tuple[MeasuredMotion, ...]
) -> RecordingResidual:
    """Compare a recording with the parameters of a twin.

    Raises:
        IdentificationError: A joint moved too little.
    """
    samples = samples_of(motions)
    _moved_s(description, samples, COMPARED_MOVED_S)
    model, sweeps = EmptyMachine(description, tree, TWIN_PER_JOINT), samples.sweeps
    t_end, gain = float(sweeps.t[-1]), theta[model.prior.layout.of("inverse_gain")]
    slow = np.where(sweeps.clear, model.residual(sweeps, theta, t_end), np.nan)
    parts = []
    for motion in motions:
        ticks = _smooth_ticks(motion, t_end - float(motion.t[-1] - motion.t[0]))
        parts.append(np.where(ticks.clear, _residual_at_ticks(model, theta, ticks, t_end), np.nan))
    per_tick, slow_rms = (np.sqrt(np.nanmean(left**2, axis=0)) / gain for left in (np.concatenate(parts), slow))
    return RecordingResidual(per_tick, slow_rms)
