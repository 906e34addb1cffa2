"""Comparison of a run with other simulated wearers, whose results ship with the package.

The examiner of a simulation knows the true left over of a run. A single value says little without the range that other
wearers and machines have at the same disturbance level. `benchmarks/reference_wearers.py` makes the files.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from exograv.results import OPTIONAL

from .options import DemoOptions

FOLDER = Path(__file__).parent / "reference"


@dataclass(frozen=True)
class ReferenceKey:
    """Settings that a run and its reference share."""

    rig: str
    level: int
    method: str
    motion: str
    seconds: float
    torque_source: str

    @classmethod
    def of(cls, options: DemoOptions) -> "ReferenceKey":
        """Take the settings from the options of a demo."""
        return cls(options.rig, options.level, options.method, options.motion, options.seconds, options.torque_source)


@dataclass(frozen=True)
class WearerComparison:
    """Place of a run among the wearers of the reference, by true left over."""

    text: str
    """Sentence for the reader."""
    others_Nm: list[list[float]] | None = field(default=None, metadata=OPTIONAL)
    """True left over of each other wearer, per joint [N·m]."""
    lower: list[int] | None = field(default=None, metadata=OPTIONAL)
    """Number of other wearers with a lower left over, per joint."""
    reached: int | None = field(default=None, metadata=OPTIONAL)
    """Number of other wearers whose left over stayed within the targets to the end."""
    date: str | None = field(default=None, metadata=OPTIONAL)
    """Day on which the reference was made."""


def reference_path(key: ReferenceKey) -> Path:
    """Path of the file of a reference, whether the file exists or not."""
    return FOLDER / f"{key.rig}_level{key.level}.json"


def compare(options: DemoOptions, is_fresh: bool, joints: Sequence[str], left_over: list[float]) -> WearerComparison:
    """Compare the true left over of a run with that of other wearers.

    Args:
        options: Options of the run.
        is_fresh: True if the run started from the body table, and calibrated its own machine.
        joints: Names of the joints.
        left_over: True left over after identification, per joint [N·m].
    """
    key = ReferenceKey.of(options)
    reference = _reference(key)
    if reference is None:
        return WearerComparison(
            f"No other simulated wearers were run on {key.rig} at level {key.level} with these settings, so this run "
            "has no comparison."
        )
    is_usual = options.side is None and options.wearer_model is None and options.donning == 0
    if not (is_fresh and is_usual and options.world == "home" and options.twin == "drawn"):
        return WearerComparison(
            "This run has no comparison. The runs to compare with use the machine's first side, its own calibration, "
            "the usual arm model and laws, and an arm that is not known yet. This run differs in one of these."
        )
    rows = [row for row in reference["wearers"] if "left_over_Nm" in row and row["seed"] != options.seed]
    others = [row["left_over_Nm"] for row in rows]
    lower = [sum(other[k] < value for other in others) for k, value in enumerate(left_over)]
    reached = sum(row["time_to_target_s"] is not None for row in rows)
    places = ", ".join(
        f"{joint.replace('_', ' ')} {value:.2f} N·m ({count} {'was' if count == 1 else 'were'} lower)"
        for joint, value, count in zip(joints, left_over, lower, strict=True)
    )
    return WearerComparison(
        f"This run against {len(others)} other simulated wearers at level {key.level}, by true left over: {places}. "
        f"{reached} of the {len(others)} stayed within all targets.",
        others,
        lower,
        reached,
        reference["date"],
    )


def _reference(key: ReferenceKey) -> dict[str, Any] | None:
    path = reference_path(key)
    if not path.is_file():
        return None
    content = json.loads(path.read_text(encoding="utf-8"))
    return content if content["key"] == asdict(key) else None
