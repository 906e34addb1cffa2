"""Result of one method on one wearer, and the checkpoint file to which each finished run is added at once."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from exograv import __version__
from exograv.storage.checkpoint import CheckpointRows

from .cases import Case

Setting = Literal["open_loop", "closed_loop"]


@dataclass(frozen=True)
class Intervals:
    """Counts of stated 95 % intervals that hold the truth, after some motion."""

    parameters: dict[str, bool]
    """True where the interval holds the truth, by name of the parameter."""

    torque: tuple[int, int]
    """Intervals of the arm's torque at the held-out postures, joint by joint: number that hold the truth, and total."""


@dataclass(frozen=True)
class MethodRun:
    """Run of one method on one wearer."""

    setting: Setting
    method: str
    case: Case
    places: list[str]
    """Places of the joints: shoulder, elbow or wrist."""

    failed: str | None = None
    """Reason why the run has no result; None if it has one. A run without a result counts as one that never reached a
    target."""

    offline: bool = False
    t: list[float] = field(default_factory=list)
    """Motion time used by each estimate [s]."""

    left_over_Nm: list[list[float | None]] = field(default_factory=list)
    """Total left over, RMS over the held-out postures, by estimate and joint [N·m]; None where it is not a number."""

    possible_share: float = 0.0
    """Share of physically possible estimates [-]."""

    intervals: dict[str, Intervals] = field(default_factory=dict)
    """Intervals by motion time [s]; empty if the method states none."""

    outcome: str = ""
    """Name of the stop rule's verdict."""

    stated_Nm: list[float] | None = None
    """Left over that the last estimate states for itself, by joint [N·m]; None without intervals."""

    check_p: list[float] | None = None
    """Probability of the residuals at unused postures if the estimate is right, by joint [-]; None without a check."""

    carried_share: list[float] | None = None
    """Share of the last estimate's change from the table that a machine would carry, by joint [-]; None if the run
    failed."""

    carried_Nm: list[float] | None = None
    """Left over of that arm, RMS over the held-out postures, by joint [N·m]."""

    table_Nm: list[float] | None = None
    """Left over of the arm of the body table, by joint [N·m]."""

    stop_s: float | None = None
    """Time at which the stop rule would have ended the motion [s]; None if it would not have ended it."""

    restless_s: float | None = None
    """Time at which the wearer was first found not to relax [s]."""

    rejected_share: float = 0.0
    noise_scale: float = 1.0
    update_us: dict[str, float] | None = None
    """Percentiles over the updates that did work [µs]; None if none did, or if time was not measured."""

    estimate_us: dict[str, float] | None = None
    """Percentiles over the estimates [µs]."""

    work_share: float = 0.0
    method_s: float = 0.0
    """Processor time of all updates and estimates [s]."""

    @property
    def key(self) -> tuple[str, str, Case]:
        """Key of the run; a repetition of it has the same key."""
        return self.setting, self.method, self.case


class RunFile(CheckpointRows[MethodRun]):
    """Checkpoint of finished runs."""

    def __init__(self, path: Path, seconds: float, resume: bool):
        """Open the file. A file that is not resumed is kept beside it as `.before`.

        Raises:
            RecordingError: The file cannot be written, or is of another version or length of motion.
        """
        super().__init__(path, {"exograv": __version__, "seconds": seconds}, resume, asdict, _run)


def _run(row: dict[str, Any]) -> MethodRun:
    intervals = {
        seconds: Intervals(one["parameters"], (one["torque"][0], one["torque"][1]))
        for seconds, one in row["intervals"].items()
    }
    return MethodRun(**{**row, "case": Case(**row["case"]), "intervals": intervals})
