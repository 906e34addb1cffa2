"""Data that pages show of a steered session: snapshot, samples to plot, and lines to draw."""

from typing import Annotated, Literal

from pydantic import Field

from exograv.model.rig_settings import Settings
from exograv.options import Side
from exograv.safety.guard import GRAVITY_LEVEL_MAX
from exograv.sentence import SentenceText

ModeName = Literal[
    "off", "self_test", "exo_only", "ramp_in", "floating", "moving", "weighing", "ramp_out", "safe", "starting"
]
"""Names of `safety.modes` in lower case; `starting` before a guard runs."""

SafeStateName = Literal["none", "bridge", "descent", "damping", "isolation"]

ActKind = Literal[
    "don",
    "make_ready",
    "take_arm",
    "identify",
    "give_back",
    "stop",
    "reset",
    "switch_off",
    "set_level",
    "learn_rest",
    "agree",
    "note",
    "acknowledge",
]

Share = Annotated[float, Field(ge=0.0, le=1.0)]
FeltShare = Annotated[float, Field(ge=0.0, le=GRAVITY_LEVEL_MAX)]


class MachineAlarm(Settings):
    """Alarm on the page. It stays until a person has acknowledged it and its cause is over."""

    number: int
    text: SentenceText
    priority: Literal["high", "medium", "low"]
    since_s: float
    """Time of the alarm on the desk's clock [s]."""
    is_over: bool
    acknowledged_by: str | None = None


class LearnedParameter(Settings):
    """Parameter of the arm with its 95 % intervals."""

    name: str
    unit: str
    prior: float
    prior_half_width: float
    """Half width of the 95 % interval of `prior`. `half_width` is that of `mean`."""
    mean: float
    half_width: float


class Learning(Settings):
    """Progress and result of an identification."""

    share_done: Share
    """Share of the motion that is done."""
    parameters: tuple[LearnedParameter, ...]
    left_over_Nm: tuple[float, ...]
    """Predicted residual torque per joint, RMS over the workspace."""
    left_over_prior_Nm: tuple[float, ...]
    """Predicted residual torque before any motion, from the table or from the person's file."""
    outcome: SentenceText
    """Sentence about the result, with advice after a failure."""
    is_over: bool
    farthest: str | None = None
    """Joint whose predicted residual torque is farthest above its target; None if all are within their targets."""
    help: SentenceText = ""
    """Sentence about what the operator may do for a better estimate."""


class RestLearning(Settings):
    """Learning in the rests: what the machine has learned by moving the relaxed arm between two windows."""

    is_active: bool
    """True from the request until the arm floats again."""
    why_not: SentenceText = ""
    """Reason why the machine cannot learn in a rest now; empty if it can, as far as the machine knows."""
    rests: int = 0
    """Number of motions in this session."""
    left_out: int = 0
    """Number of restless motions that the estimate does not use."""
    motion_s: float = 0.0
    """Motion that the estimate uses [s]."""
    before_Nm: tuple[float, ...] = ()
    """Residual torque per joint that the arm stated before the first rest; empty before it is known."""
    stated_Nm: tuple[float, ...] = ()
    """Residual torque per joint that the carried arm states now."""
    target_Nm: tuple[float, ...] = ()
    sentences: tuple[SentenceText, ...] = ()
    """Decision after the last rest, its certainty, and what the operator may do."""
    stage: Literal["soon", "moves", "holds"] | None = None
    """Stage of a rest for the participant: before the motion, during it, or the arm is held; absent without a rest."""
    moves_s: float = 0.0
    """Duration of the motion that teaches in a rest [s], without the way to its start and back."""


class WorkProgress(Settings):
    """Progress of work that takes longer than a person waits without a reason."""

    kind: Literal["calibration", "identification", "rest"]
    phase: SentenceText
    """Sentence about the present phase."""
    joint: str | None
    """Joint that moves; the fastest one if several move; absent while none moves."""
    share_done: Share
    left_s: float | None
    """Estimated remaining time [s]; absent while too little is done for an estimate."""
    why: SentenceText
    """Reason for the duration."""


class Lateness(Settings):
    """Lateness of the ticks' start in the last second [µs]."""

    p50_us: float
    p99_us: float
    max_us: float


class RecordingStatus(Settings):
    """Status of the recording."""

    path: str
    samples: int
    """Number of samples on the disk."""
    lost: int
    is_ok: bool
    why: str
    """Description of a fault, with advice; empty without a fault."""


class StreamView(Settings):
    """Stream of another device that the session records."""

    name: str
    type: str
    condition: Literal["awaited", "recorded", "silent", "lost"]
    nominal_rate_Hz: float
    """Rate in the stream's own description; 0 without one."""
    rate_Hz: float | None
    """Measured rate of the last seconds; absent before there are enough samples."""
    gaps: int
    """Number of gaps since the stream was connected."""
    offset_s: float | None
    """Correction of the stream's clock [s]; absent before the first one."""
    uncertainty_s: float | None
    """Uncertainty of the correction [s]."""


class MachineSnapshot(Settings):
    """State of the machine and of the person in it. Per-joint values have the order of `joints`."""

    rig: str
    title: str
    side: Side
    sides: tuple[Side, ...]
    """Arm sides that this machine supports: right, left, or both at once."""
    is_twin: bool
    participant: str | None
    """Code of the person whose file is in force; absent without a file."""
    participants: tuple[str, ...]
    """Codes whose files fit this machine."""
    is_known: bool
    """True if the arm in the machine may be taken without an identification."""
    safe_state: SafeStateName

    joints: tuple[str, ...]
    q_rad: tuple[float, ...]
    v_rad_s: tuple[float, ...]
    tau_desired_Nm: tuple[float, ...]
    """Torque that control asks for."""
    tau_commanded_Nm: tuple[float, ...]
    """Torque that the guard let out."""
    tau_limit_Nm: tuple[float, ...]
    """Limits of the drives."""

    gravity_level_asked: FeltShare
    gravity_level: FeltShare
    """Felt share of the weight in force now [-]: 0 weightless, 1 full weight."""
    arm_share: Share
    """Share of the arm that is carried."""

    lateness: Lateness | None = None
    recorded: RecordingStatus | None = None
    streams: tuple[StreamView, ...] = ()
    learning: Learning | None = None
    rests: RestLearning | None = None
    """Learning in the rests; absent where the machine cannot."""
    work: WorkProgress | None = None
    """Calibration, identification or motion in a rest in progress."""
    age_s: float = 0.0
    """Age of the machine's newest report [s]. Old values must not pose as the present state."""


class SessionSnapshot(MachineSnapshot):
    """State of a session at one moment, for the pages."""

    version: int
    """Version of the state. It changes with mode, latch, readiness or person."""
    t: float
    """The desk's clock [s]."""

    mode: ModeName
    mode_text: SentenceText
    """Sentence about the mode."""
    latch: SentenceText | None
    """Reason of the stop; absent without a latch."""
    take_within_s: float | None
    """Remaining time for step two [s]; absent if step one was not done, or too long ago."""
    possible: tuple[ActKind, ...]
    """Acts that are allowed now, for the buttons."""
    lease_left_s: float | None
    """Remaining time of the lease [s]; absent without a lease."""
    alarms: tuple[MachineAlarm, ...]
    """Alarms that are not acknowledged or not over, the newest last."""


class PlotTrace(Settings):
    """Samples at 50 Hz, one entry per sample. Per-joint lists have the order of `SessionSnapshot.joints`."""

    first: int
    """Number of the first sample in this trace."""
    next: int
    """Number for the next request."""
    t: tuple[float, ...]
    """The desk's clock [s]."""
    q_rad: tuple[tuple[float, ...], ...]
    tau_desired_Nm: tuple[tuple[float, ...], ...]
    tau_commanded_Nm: tuple[tuple[float, ...], ...]
    tau_measured_Nm: tuple[tuple[float, ...], ...]


Point = tuple[float, float, float]
"""Point in the base frame of the machine: x forward, y left, z up [m]."""


class SkeletonLines(Settings):
    """Lines that draw the machine and the arm, and the joint positions for which they were computed."""

    q_rad: tuple[float, ...] = ()
    """Positions of the joints, in the order of `SessionSnapshot.joints`; empty before they are known."""

    exo: tuple[tuple[Point, ...], ...]
    arm: tuple[tuple[Point, ...], ...]
    """Lines of the controller's model of the arm; empty before there is one."""
