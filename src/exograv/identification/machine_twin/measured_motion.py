"""Motion of an empty machine as it was recorded, and the samples that the model of the empty machine is fitted to."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, Sweeps
from exograv.identification.calibration.empty_model import FILTER_DELAY_S, WRENCH
from exograv.identification.core.sample_filter import SampleFilter

V_CLEAR_TWIN = 0.02
"""Speed below which samples are left out [rad/s]: half of the calibration's, because slow friction matters here."""

SLIDE_RAD = 0.015
"""Way from a reversal after which friction is whole [rad]. Gears wind up and bristles bend over some milliradians."""

TURN_RAD = 5e-4
"""Way back that is a reversal, and no noise of the encoder [rad]."""

BLOCK_S = 5.0
"""Length of the blocks into which a recording is divided for the validation [s]."""

FOLDS = 5
"""Number of parts of a recording; the last two are held out."""

CHOICE_FOLD, VALIDATION_FOLD = FOLDS - 2, FOLDS - 1
"""Held-out parts: one chooses the law of friction, the other validates the result."""


LEAD_LEAST_RAD = 1e-9
"""Least range of a motor's lead over its joint [rad]: a copy of the joint's position has a smaller one by rounding."""


@dataclass(frozen=True)
class MeasuredMotion:
    """Recording of the empty machine, one row per tick, without a gap."""

    name: str
    """Name of the recording, for messages."""

    t: Float[np.ndarray, " tick"]
    """Time, evenly spaced and rising [s]."""

    q: Float[np.ndarray, "tick joint"]
    """Positions by the encoders [rad]."""

    current: Float[np.ndarray, "tick joint"]
    """Measured motor currents [A]."""

    current_asked: Float[np.ndarray, "tick joint"]
    """Commanded motor currents [A]; NaN where the recording does not have them."""

    hung: Float[np.ndarray, "tick hanging"]
    """Known weights as in `Sweeps.hung`; NaN while one is lowered or lifted [-]."""

    q_motor: Float[np.ndarray, "tick joint"] | None = None
    """Positions by the encoders on the motors [rad], NaN where a joint has none; None without any."""

    temperature: Float[np.ndarray, "tick joint"] | None = None
    """Temperatures of the windings [°C], NaN where a drive does not measure it; None without any."""

    wrench: Float[np.ndarray, "tick 6"] | None = None
    """Wrench on the machine by a force sensor: force [N], moment [N·m] at its frame, in its axes; None without one."""

    has_all_commands: bool = True
    """True if each command has a row; a log of another program may be slower than the loop."""

    @property
    def period_s(self) -> float:
        """Time between two ticks [s]."""
        return float(np.median(np.diff(self.t)))


def has_motor_encoders(motions: Sequence[MeasuredMotion]) -> bool:
    """Return True if the motions hold a position of each motor that is no copy of the joint's position."""
    leads = np.nan_to_num([np.ptp(one.q_motor - one.q, axis=0) for one in motions if one.q_motor is not None])
    return bool((leads.max(axis=0, initial=0.0) > LEAD_LEAST_RAD).all())


@dataclass(frozen=True)
class Samples:
    """Filtered samples of all recordings, and the part of the recording to which each belongs."""

    sweeps: Sweeps
    fold: Int[np.ndarray, " sample"]
    wound_up: Float[np.ndarray, "sample joint"]
    """Angle by which the motor's encoder leads that of the joint, filtered like all else [rad]; NaN without one."""
    temperature: Float[np.ndarray, "sample joint"]
    """Temperature of the motor's winding [°C]; NaN where it is not known."""

    def only(self, chosen: Bool[np.ndarray, " sample"]) -> Sweeps:
        """Return the chosen samples."""
        s = self.sweeps
        rows = (s.t[chosen], s.q[chosen], s.v[chosen], s.a[chosen], s.current[chosen], s.hung[chosen], s.start[chosen])
        slides, wrench = (None if one is None else one[chosen] for one in (s.slides, s.wrench))
        return Sweeps(*rows, v_clear=s.v_clear, slides=slides, wrench=wrench)


def samples_of(motions: tuple[MeasuredMotion, ...]) -> Samples:
    """Filter the recordings, and keep a sample every `SAMPLE_PERIOD_S` while a joint moves."""
    parts, folds, shift = list[tuple[np.ndarray, ...]](), list[np.ndarray](), 0.0
    for motion in motions:
        t, *columns = _filtered(motion)
        parts.append((t - motion.t[0] + shift, *columns))
        # Blocks go on over all recordings: many short ones have to fill each part, too.
        folds.append(((t - motion.t[0] + shift) // BLOCK_S).astype(int) % FOLDS)
        # The model counts the age of friction: recordings follow each other as if nothing happened between them.
        shift += float(motion.t[-1] - motion.t[0])
    t, q, v, a, current, hung, slides, wound_up, temperature, pulled = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    wrench = None if all(motion.wrench is None for motion in motions) else pulled
    moved = (t, q, v, a, current, hung, np.zeros(len(t), dtype=bool))
    sweeps = Sweeps(*moved, v_clear=V_CLEAR_TWIN, slides=slides, wrench=wrench)
    return Samples(sweeps, np.concatenate(folds), wound_up, temperature)


def _filtered(motion: MeasuredMotion) -> tuple[np.ndarray, ...]:
    """Return time, q, v, a, current, weights, sliding, wind-up, temperature, wrench of samples where a joint moves."""
    period_s = motion.period_s
    sample_filter, every = SampleFilter(motion.q.shape[1], period_s, FILTER_DELAY_S), round(SAMPLE_PERIOD_S / period_s)
    is_known = np.atleast_1d(np.isfinite(motion.hung).all(axis=1)).tolist()
    rows = list[tuple[int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]]()
    for tick, (q, current) in enumerate(zip(motion.q, motion.current, strict=True)):
        sample = sample_filter.update(q, current)
        if tick % every == 0 and is_known[tick] and sample_filter.settled and np.abs(sample.v).max() > V_CLEAR_TWIN:
            rows.append((tick, sample.q.copy(), sample.v.copy(), sample.a.copy(), sample.tau.copy()))
    joints = motion.q.shape[1]
    ticks = np.array([row[0] for row in rows], dtype=int)
    columns = [np.array([row[k] for row in rows]).reshape(-1, joints) for k in range(1, 5)]
    # The filter is as late as its delay, and a sample contains the friction of some time before.
    before = np.maximum(ticks - round(2.0 * FILTER_DELAY_S / period_s), 0)
    warmth = np.full_like(motion.q, np.nan) if motion.temperature is None else motion.temperature
    told = motion.hung[ticks], slides(motion.q)[before], _wound_up(motion)[ticks], warmth[ticks], _wrench(motion)[ticks]
    return (motion.t[ticks], *columns, *told)


def _wound_up(motion: MeasuredMotion) -> Float[np.ndarray, "tick joint"]:
    """Lead of the motors' encoders behind the filter of the samples [rad]; NaN without such encoders."""
    if motion.q_motor is None:
        return np.full_like(motion.q, np.nan)
    lead = motion.q_motor - motion.q
    return np.where(np.isfinite(lead).all(axis=0), _like_samples(np.nan_to_num(lead), motion.period_s), np.nan)


def _wrench(motion: MeasuredMotion) -> Float[np.ndarray, "tick 6"]:
    """Measured wrench behind the filter of the samples [N, N·m]; zero without a sensor."""
    if motion.wrench is None:
        return np.zeros((len(motion.t), WRENCH))
    return _like_samples(motion.wrench, motion.period_s)


def _like_samples(values: Float[np.ndarray, "tick column"], period_s: float) -> Float[np.ndarray, "tick column"]:
    """Filter columns as the samples are filtered."""
    sample_filter = SampleFilter(values.shape[1], period_s, FILTER_DELAY_S)
    none = np.zeros(values.shape[1])
    return np.array([sample_filter.update(none, row).tau.copy() for row in values])


def slides(q: Float[np.ndarray, "tick joint"]) -> np.ndarray:
    """Return where (tick, joint) a joint is `SLIDE_RAD` away from its last reversal; before, friction builds up."""
    far = np.zeros(q.shape, dtype=bool)
    for joint, path in enumerate(q.T.tolist()):
        far[:, joint] = list(_far_from_reversal(path))
    return far


def _far_from_reversal(path: list[float]) -> Iterator[bool]:
    """Yield for each position whether the last reversal is far; a way back of `TURN_RAD` is a reversal."""
    start = end = path[0]
    for q in path:
        if abs(q - start) >= abs(end - start) and (q - start) * (end - start) >= 0.0:
            end = q
        elif abs(q - end) > TURN_RAD:
            start, end = end, q
        yield abs(end - start) > SLIDE_RAD
