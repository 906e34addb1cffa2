"""Result of a demonstration: classes that are printed, recorded and written as JSON."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from exograv.identification.core.interface import Outcome
from exograv.options import WorldName
from exograv.procedures.identification.carried_figures import CarriedFigures
from exograv.procedures.identification.participant_session import KeptParticipant, NotKept
from exograv.procedures.identification.warm_start import WarmStartFigures
from exograv.results import MERGED, OPTIONAL
from exograv.storage.calibration_file import CalibrationUsed

from .reference_wearers import WearerComparison
from .result_rows import CalibrationRow, IdentifiabilityResult, ScoredParameter, WeightRow


@dataclass(frozen=True)
class MeasuredCalibration:
    """Source of a calibration that this run measured at its start, because no stored one was given."""

    source: Literal["measured at the start of this run"] = "measured at the start of this run"


@dataclass(frozen=True)
class ControllerLeftOver:
    """Residual torque for three controllers, RMS per joint [N·m].

    The first carries the machine only, the second also the arm of the body table, the third also the identified arm.
    """

    exo_only: list[float] | None = field(metadata=OPTIONAL)
    table: list[float]
    identified: list[float]


@dataclass(frozen=True)
class LeftOverTable:
    """Residual torque of everything, and of the arm alone."""

    total: ControllerLeftOver
    arm: ControllerLeftOver


@dataclass(frozen=True)
class IdentificationFigures:
    """Course of the identification: durations [s], cause of the stop, outcome and its reason."""

    rest_s: float | None = field(metadata=OPTIONAL)
    motion_s: float
    time_to_target_s: float | None
    stop: str
    outcome: Outcome
    why: str
    restless_s: float | None
    carried: CarriedFigures
    """Decision to float: part of the estimate that the machine carries."""


@dataclass(frozen=True)
class PossibleLeftOver:
    """Residual torque that the uncertainty of the estimate allows, RMS per joint [N·m]."""

    median: list[float]
    p95: list[float]


@dataclass(frozen=True)
class IdentifiedArm:
    """Result of the identification of the arm."""

    left_over_rms_Nm: LeftOverTable
    identification: IdentificationFigures
    identifiability: IdentifiabilityResult | None
    possible_left_over_Nm: PossibleLeftOver | None
    parameters: list[ScoredParameter]


@dataclass(frozen=True)
class FloatFigures:
    """Drift of the floating arm."""

    gravity_level: float
    drift_deg: list[float]
    window_s: float


@dataclass(frozen=True)
class PayloadLeftOver:
    """Residual torque with the weight in the hand, RMS per joint [N·m]."""

    ignored: list[float]
    compensated: list[float]


@dataclass(frozen=True)
class HandWeight:
    """Weight that the wearer took into the hand."""

    weight: WeightRow = field(metadata=MERGED)
    left_over_Nm: PayloadLeftOver


@dataclass(frozen=True)
class FloatedArm:
    """Result of floating the identified arm."""

    float: FloatFigures
    known_weight: HandWeight


@dataclass(frozen=True)
class DemoFindings:
    """Findings of a demonstration, as the recording stores them."""

    rig: str
    method: str
    motion: str
    disturbance_level: int
    world: WorldName
    seed: int
    joints: tuple[str, ...]
    calibration_used: CalibrationUsed | MeasuredCalibration
    calibration: list[CalibrationRow]
    comparison: WearerComparison
    arm: IdentifiedArm = field(metadata=MERGED)
    floated: FloatedArm | None = field(metadata=MERGED)


@dataclass(frozen=True)
class ExaminedTimes:
    """Time of motion until the residual torque stayed within the target, according to the twin's truth."""

    from_file_s: float | None
    cold_s: float | None


@dataclass(frozen=True)
class ReturningParticipant:
    """Effect of the participant's file."""

    by_prediction: WarmStartFigures = field(metadata=MERGED)
    examiner: ExaminedTimes


@dataclass(frozen=True)
class ParticipantFigures:
    """Figures of the participant's file. They are shown, but not written to the recording."""

    participant_kept: KeptParticipant | NotKept | None = field(metadata=OPTIONAL)
    participant: ReturningParticipant | None = field(metadata=OPTIONAL)
    participant_warning: str | None = field(default=None, metadata=OPTIONAL)
    """Sentence on a file whose estimate disagreed with its check, and is not used."""


@dataclass(frozen=True)
class ModelNotes:
    """Third party's model that served as the truth, and notes on its unused parts."""

    title: str
    notes: tuple[str, ...]


@dataclass(frozen=True)
class DemoResult:
    """Result of `exograv demo` and `exograv arm identify`."""

    findings: DemoFindings = field(metadata=MERGED)
    person: ParticipantFigures = field(metadata=MERGED)
    donning: int
    wearer_model: ModelNotes | None = field(metadata=OPTIONAL)
    tick_us: dict[str, float]
    """Duration of the ticks, by percentile."""
    wall_s: float
    simulated_s: float
    report: Path
    recording: Path
