"""Fit of a machine's twin: law of friction, parameters with their covariance, and validation on held-out motion."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, sosfiltfilt

from exograv.errors import IdentificationError
from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, EmptyMachine, Fit, Sweeps
from exograv.identification.calibration.empty_model import FILTER_DELAY_S
from exograv.identification.calibration.empty_prior import EmptyPrior, Unknowns
from exograv.identification.core.physical import PhysicalProjection
from exograv.identification.core.sample_filter import SampleFilter
from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .drawing_errors import likely_link_errors, with_link_errors
from .drive_response import DriveResponse, drive_response, encoder_step
from .friction_curve import FrictionCurve, friction_curve
from .friction_laws import LAWS, TWIN_PER_JOINT, LawChoice, chosen_laws, of_laws
from .gain_temperature import GainByTemperature, gain_by_temperature
from .gear_elasticity import GearElasticity, gear_elasticity, with_wind_up
from .measured_motion import (
    BLOCK_S,
    CHOICE_FOLD,
    FOLDS,
    V_CLEAR_TWIN,
    VALIDATION_FOLD,
    MeasuredMotion,
    Samples,
    has_motor_encoders,
    samples_of,
    slides,
)
from .model_discrepancy import Considered, DiscrepancySize

MOVED_S, COMPARED_MOVED_S = 10.0, 2.0
"""Shortest time of clear motion of a joint over all recordings of a fit, and in a recording that is compared [s]."""

SMOOTHED_HZ = 15.0
"""Corner of the filter without phase that smooths positions for the validation at every tick [Hz]."""

DRIVEN_OVER_NOISE = 5.0
"""Least RMS torque of a motor in clear motion over the noise of its samples [-]. Without torque, links and friction of
any common size explain a motion."""

COMPARED_S = 1.0
"""Length of the blocks in which laws of friction are compared [s]."""

TICKS_APART = 5
"""Ticks between two ticks of the validation: their noise is independent at any distance."""

PULSE_AT, PULSE_S = 1000, 1.0
"""Tick of the pulse that measures how the filter of the samples passes noise, and time until its answer is over [s]."""

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

    fitted_rms_Nm: Joints
    """Residual torque at every tick of the part to which these parameters were fitted [N·m]."""

    @property
    def over_noise(self) -> Joints:
        """Residual torque over the noise, per tick [-]."""
        return self.rms_Nm / self.noise_Nm


@dataclass(frozen=True)
class MachineFit:
    """Twin of a machine from recordings."""

    fit: Fit
    """Parameters and covariance; links are physically possible."""

    noise_covariance: Float[np.ndarray, "unknown unknown"]
    """Covariance by the noise of the residuals alone, without the discrepancy of the model."""

    discrepancy: DiscrepancySize
    model: EmptyMachine
    """Model of the fit."""

    choices: tuple[LawChoice, ...]
    """Law of friction of each joint, by its name in `friction_laws.LAWS`, and the laws that were compared."""

    curve: FrictionCurve
    response: DriveResponse
    gears: GearElasticity
    warmth: GainByTemperature
    has_motor_encoders: bool
    """True if the recordings hold positions of all motors that are no copies of the joints' positions."""

    encoder_step: Joints
    """Quantisation step of the encoders [rad]."""

    noise_A: Joints
    """Standard deviation of the current's noise per tick [A]."""

    validation: Validation
    moved_s: Joints
    """Time of clear motion of each joint [s]."""

    fastest: Joints
    """Largest speed of each joint [rad/s]."""

    sweeps: Sweeps
    """Samples of all recordings."""

    @property
    def laws(self) -> tuple[str, ...]:
        """Law of friction of each joint."""
        return tuple(choice.law for choice in self.choices)


def fit_machine(
    description: RigDescription,
    tree: Tree,
    motions: tuple[MeasuredMotion, ...],
    progress: Progress = lambda _text, _share: None,
    force_frame: str | None = None,
) -> MachineFit:
    """Fit the twin to recordings of the empty machine, with the data sheet as prior.

    A force sensor in a recording measures at `force_frame`; None if no recording has one.

    Raises:
        IdentificationError: A joint moved too little, or only without torque.
    """
    progress("Filtering the motion", 0.1)
    samples = samples_of(motions)
    moved_s = _moved_s(description, samples, MOVED_S)
    _refuse_undriven(description, samples, motions)
    model = EmptyMachine(description, tree, TWIN_PER_JOINT, force_frame)
    choosing = samples.only(samples.fold < CHOICE_FOLD)
    progress("Choosing the law of friction", 0.3)
    drawings = with_link_errors(model.prior, likely_link_errors(model, choosing))
    choices = _choose_laws(model, drawings, samples, choosing)
    prior = of_laws(drawings, tuple(choice.law for choice in choices))
    before = _fitted(model, samples.only(samples.fold != VALIDATION_FOLD), prior)
    progress("Fitting delay and bandwidth", 0.6)
    response = drive_response(motions)
    noise_A = np.where(np.isfinite(response.noise_A), response.noise_A, _rough_noise(motions))
    validation = _validated(model, motions, samples, before, noise_A)
    progress("Fitting the whole recording", 0.8)
    fit = _fitted(model, samples.sweeps, prior)
    links = prior.layout.links
    bodies = tuple(slice(start, start + 10) for start in range(links.start, links.stop, 10))
    of_noise, held = fit.covariance, samples.only(samples.fold == VALIDATION_FOLD)
    considered, seen = Considered(model, samples.sweeps), samples.fold != VALIDATION_FOLD
    t_seen = float(samples.sweeps.t[seen][-1])
    size = considered.size(before, seen, sample_noise(motions[0].period_s, noise_A * description.nominal_gain), t_seen)
    fit = with_wind_up(model, replace(fit, covariance=considered.covariance(fit, size)), samples)
    theta = PhysicalProjection(bodies, prior.mean)(fit.theta, fit.covariance)
    fit = replace(fit, theta=theta)
    gears, warmth = gear_elasticity(model, fit, samples), gain_by_temperature(model, fit, samples)
    step = np.array([encoder_step(np.concatenate([m.q[:, joint] for m in motions])) for joint in range(len(choices))])
    fastest = np.abs(samples.sweeps.v).max(axis=0)
    curve = friction_curve(model, fit, held, float(samples.sweeps.t[-1]))
    return MachineFit(
        fit, of_noise, size, model, choices, curve, response, gears, warmth, has_motor_encoders(motions), step,
        noise_A, validation, moved_s, fastest, samples.sweeps,
    )  # fmt: skip


def _fitted(model: EmptyMachine, sweeps: Sweeps, prior: EmptyPrior) -> Fit:
    return model.fit(sweeps, prior, model.fit(sweeps, prior))


def _choose_laws(model: EmptyMachine, prior: EmptyPrior, samples: Samples, choosing: Sweeps) -> tuple[LawChoice, ...]:
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


def _refuse_undriven(description: RigDescription, samples: Samples, motions: tuple[MeasuredMotion, ...]) -> None:
    noise = sample_noise(motions[0].period_s, _rough_noise(motions))
    driven = _rms(np.where(samples.sweeps.clear, samples.sweeps.current, np.nan))
    for joint, torque, least in zip(description.joints, driven, DRIVEN_OVER_NOISE * noise, strict=True):
        if torque < least:
            raise IdentificationError(
                f"Joint '{joint}' moves in the recordings, but its motor gives no torque above its noise. A free decay "
                "tells friction and rotor only beside motion by the motors. Give also a recording of a calibration."
            )


def _rough_noise(motions: tuple[MeasuredMotion, ...]) -> Joints:
    """Noise of the current per tick [A] without knowledge of the command: what changes within three ticks."""
    thirds = np.concatenate([np.diff(m.current, 3, axis=0) for m in motions])
    return np.median(np.abs(thirds), axis=0) / (0.6745 * np.sqrt(20.0))


def sample_noise(period_s: float, noise: Joints) -> Joints:
    """Return the standard deviation that white noise per tick has behind the filter of the samples (joint,)."""
    pulse_filter = SampleFilter(1, period_s, FILTER_DELAY_S)
    zero, one = np.zeros(1), np.ones(1)
    answer = [
        float(pulse_filter.update(zero, one if tick == PULSE_AT else zero).tau[0])
        for tick in range(PULSE_AT + round(PULSE_S / period_s))
    ]
    return noise * float(np.sqrt(np.sum(np.square(answer))))


def _validated(
    model: EmptyMachine, motions: tuple[MeasuredMotion, ...], samples: Samples, fit: Fit, noise_A: Joints
) -> Validation:
    """Residuals on the part of the recordings that `fit` has not seen."""
    held, gain = samples.only(samples.fold == VALIDATION_FOLD), model.description.nominal_gain
    seen = samples.sweeps.t[samples.fold != VALIDATION_FOLD]
    t_end = float(seen[-1])
    slow = np.where(held.clear, model.residual(held, fit.theta, t_end), np.nan)
    inverse_gain = fit.theta[fit.prior.layout.of("inverse_gain")]

    def per_tick(folds: tuple[int, ...]) -> Joints:
        """RMS residual at the ticks of some parts of the recordings [N·m]."""
        parts, shift = list[np.ndarray](), 0.0
        for motion in motions:
            ticks = _smooth_ticks(motion, shift, folds)
            if len(ticks.t):  # A short recording may have no tick of a part.
                parts.append(np.where(ticks.clear, _residual_at_ticks(model, fit.theta, ticks, t_end), np.nan))
            shift += float(motion.t[-1] - motion.t[0])
        return _rms(np.concatenate(parts)) / inverse_gain

    seconds = sum(float(m.t[-1] - m.t[0]) for m in motions) / FOLDS
    fitted = tuple(range(FOLDS - 1))
    noise = noise_A * gain / inverse_gain
    return Validation(seconds, per_tick((VALIDATION_FOLD,)), noise, _rms(slow) / inverse_gain, per_tick(fitted))


def _rms(residual: Float[np.ndarray, "tick joint"]) -> Joints:
    """RMS over the rows that are no NaN (joint,)."""
    return np.sqrt(np.nanmean(residual**2, axis=0))


def _smooth_ticks(motion: MeasuredMotion, shift: float, folds: tuple[int, ...] = tuple(range(FOLDS))) -> Sweeps:
    """Return ticks of all parts, or of some, with the motion smoothed without delay, and the currents as measured."""
    q, dt = _smoothed(motion.q, motion.period_s), motion.period_s
    v = np.gradient(q, dt, axis=0)
    a = np.gradient(v, dt, axis=0)
    t = motion.t - motion.t[0]
    fold = ((t + shift) // BLOCK_S).astype(int) % FOLDS
    is_known = np.isfinite(motion.hung).all(axis=1)
    chosen = np.flatnonzero(np.isin(fold, folds) & is_known)[::TICKS_APART]
    rows = (t[chosen] + shift, q[chosen], v[chosen], a[chosen], motion.current[chosen], motion.hung[chosen])
    wrench = None if motion.wrench is None else motion.wrench[chosen]
    still, far = np.zeros(len(chosen), dtype=bool), slides(motion.q)[chosen]
    return Sweeps(*rows, still, v_clear=V_CLEAR_TWIN, slides=far, wrench=wrench)


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
    return RecordingResidual(_rms(np.concatenate(parts)) / gain, _rms(slow) / gain)
