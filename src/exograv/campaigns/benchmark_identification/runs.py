"""One method on one wearer: what is kept of it, and its file, to which each finished run is added at once."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from exograv import __version__
from exograv.storage.checkpoint import CheckpointRows

from .cases import Case

Setting = Literal["open_loop", "closed_loop"]


@dataclass(frozen=True)
class Intervals:
    """How many stated 95 % intervals hold the truth, after some motion."""

    parameters: dict[str, bool]
    """By name of the parameter."""

    torque: tuple[int, int]
    """Of the arm's torque at the held-out postures, joint by joint: held, of."""


@dataclass(frozen=True)
class MethodRun:
    """One method on one wearer."""

    setting: Setting
    method: str
    case: Case
    places: list[str]
    """Of the joints: shoulder, elbow or wrist."""

    failed: str | None = None
    """Why there is no result; such a run counts as one that never reached a target."""

    offline: bool = False
    t: list[float] = field(default_factory=list)
    """Seconds of motion used by each estimate [s]."""

    left_over_Nm: list[list[float | None]] = field(default_factory=list)
    """Total, RMS over the held-out postures, by estimate and joint; None where it is no number."""

    possible_share: float = 0.0
    """Of the estimates [-]."""

    intervals: dict[str, Intervals] = field(default_factory=dict)
    """By seconds of motion; empty where the method states none."""

    outcome: str = ""
    """Name of the stop rule's verdict."""

    stop_s: float | None = None
    """When the stop rule would have ended the motion [s]."""

    restless_s: float | None = None
    """When the wearer was first seen not to relax [s]."""

    rejected_share: float = 0.0
    noise_scale: float = 1.0
    update_us: dict[str, float] | None = None
    """Percentiles over the updates that did work; None where none did, or where time was not taken."""

    estimate_us: dict[str, float] | None = None
    """The same of the estimates."""

    work_share: float = 0.0
    method_s: float = 0.0
    """Processor time of all updates and estimates [s]."""

    @property
    def key(self) -> tuple[str, str, Case]:
        """What a repetition of this run would have too."""
        return self.setting, self.method, self.case


class RunFile(CheckpointRows[MethodRun]):
    """Finished runs, kept as they are done."""

    def __init__(self, path: Path, seconds: float, resume: bool):
        """Open; a file that is not resumed is kept beside as `.before`.

        Raises:
            RecordingError: It cannot be written, or another version or length of motion made it.
        """
        super().__init__(path, {"exograv": __version__, "seconds": seconds}, resume, asdict, _run)


def _run(row: dict[str, Any]) -> MethodRun:
    intervals = {
        seconds: Intervals(one["parameters"], (one["torque"][0], one["torque"][1]))
        for seconds, one in row["intervals"].items()
    }
    return MethodRun(**{**row, "case": Case(**row["case"]), "intervals": intervals})
