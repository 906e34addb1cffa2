"""What pages show of a steered session: one snapshot, samples to plot, and lines to draw."""

from typing import Annotated, Literal

from pydantic import Field

from exograv.model.rig_settings import Settings
from exograv.options import Side
from exograv.sentence import SentenceText

ModeName = Literal[
    "off", "self_test", "exo_only", "ramp_in", "floating", "moving", "weighing", "ramp_out", "safe", "starting"
]
"""Of `safety.modes`, by their names in lower case; `starting` while no guard runs yet."""

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
    "note",
    "acknowledge",
]

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class MachineAlarm(Settings):
    """Stays until somebody has seen it and what raised it is over."""

    number: int
    text: SentenceText
    priority: Literal["high", "medium", "low"]
    since_s: float
    """On the desk's clock [s]."""
    is_over: bool
    acknowledged_by: str | None = None


class LearnedParameter(Settings):
    """One parameter of the arm, and how sure it is."""

    name: str
    unit: str
    prior: float
    prior_half_width: float
    """Of the 95 % interval, like the next one."""
    mean: float
    half_width: float


class Learning(Settings):
    """An identification, while it runs and after it."""

    share_done: Share
    """Of its motion."""
    parameters: tuple[LearnedParameter, ...]
    left_over_Nm: tuple[float, ...]
    """What is predicted to be left over, per joint over the workspace, RMS."""
    left_over_prior_Nm: tuple[float, ...]
    """The same before anything moved: by the table, or by the person's file."""
    outcome: SentenceText
    """A sentence; what to do where it failed."""
    is_over: bool


class Lateness(Settings):
    """How late ticks began in the last second [µs]."""

    p50_us: float
    p99_us: float
    max_us: float


class RecordingStatus(Settings):
    """The recording that is being written."""

    path: str
    samples: int
    """On the disk."""
    lost: int
    is_ok: bool
    why: str
    """What is wrong, and what to do; empty where nothing is."""


class MachineSnapshot(Settings):
    """State of the machine and of the person in it; per-joint values in the order of `joints`."""

    rig: str
    title: str
    side: Side
    sides: tuple[Side, ...]
    """Sides that this machine can be made for: one arm or the other, or both at once."""
    is_twin: bool
    participant: str | None
    """Code of the person whose file is in force; absent where none is."""
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

    gravity_level_asked: Share
    gravity_level: Share
    """Level in force."""
    arm_share: Share
    """Share of the arm that is carried."""

    lateness: Lateness | None = None
    recorded: RecordingStatus | None = None
    learning: Learning | None = None


class SessionSnapshot(MachineSnapshot):
    """One moment of a session, as the pages show it."""

    version: int
    """Another one whenever mode, latch, readiness or person has changed."""
    t: float
    """The desk's clock [s]."""

    mode: ModeName
    mode_text: SentenceText
    """A sentence."""
    latch: SentenceText | None
    """Why it was stopped; absent where no latch is in force."""
    take_within_s: float | None
    """Left for step two [s]; absent where step one has not been done, or too long ago."""
    possible: tuple[ActKind, ...]
    """What would not be refused now; for buttons."""
    lease_left_s: float | None
    """Until nobody steers any more [s]; absent where nobody does."""
    alarms: tuple[MachineAlarm, ...]
    """Not yet seen or not yet over, the newest last."""


class PlotTrace(Settings):
    """Samples at 50 Hz, one list each a sample; per-joint lists in the order of `SessionSnapshot.joints`."""

    first: int
    """Number of the first sample in here."""
    next: int
    """To ask for the next time."""
    t: tuple[float, ...]
    """The desk's clock [s]."""
    q_rad: tuple[tuple[float, ...], ...]
    tau_desired_Nm: tuple[tuple[float, ...], ...]
    tau_commanded_Nm: tuple[tuple[float, ...], ...]
    tau_measured_Nm: tuple[tuple[float, ...], ...]


Point = tuple[float, float, float]
"""In the base frame of the machine: x forward, y left, z up [m]."""


class SkeletonLines(Settings):
    """Lines through points."""

    exo: tuple[tuple[Point, ...], ...]
    arm: tuple[tuple[Point, ...], ...]
    """As control's model has it; empty before there is one."""
