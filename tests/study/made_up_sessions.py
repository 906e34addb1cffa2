"""Small recordings of a task with known content, and studies for them: a few ticks, two windows, some touches."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from exograv.recording import RecordingWriter
from exograv.study.dataset.beginning import begin_study
from exograv.study.folder.settings import AS_PUBLISHED
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.register import new_participant

JOINTS = ("shoulder", "elbow")
ZEROS = {
    name: np.zeros(2)
    for name in (
        "q_measured", "q_reference", "v", "current", "tau_measured", "tau_feedforward", "tau_desired", "tau_commanded",
    )
}  # fmt: skip
BEGUN_S = 100.0
"""Beginning on the rig's clock [s]; a recording need not begin at 0."""


def settings(participant: str, protocol: str = "training", session: int = 1, **more: Any) -> dict[str, Any]:
    """Return the settings of a session whose protocol has two windows."""
    options = {"participant": participant, "protocol": protocol, "session": session}
    said = {"name": protocol, "exo": "active", "windows": {"count": 2}}
    return {
        "rig": "recupera_like",
        "side": "right",
        "command": "exograv run train",
        "wearer": {"height_m": 1.78, "mass_kg": 80.0, "sex": "male"},
        "hashes": {"protocol": "ab" * 32},
        "versions": {"exograv": "0.1.0", "code": "cd" * 32},
        "settings": {"options": options, "protocol": said},
        **more,
    }


def touch(t: float, sequence: int, window: int | None, **more: Any) -> dict[str, Any]:
    """Return the record of an accepted touch, 30 px right and 40 px above the target."""
    return {
        "kind": "touch", "t": t, "received": t, "page": "page1", "sequence": sequence, "window": window,
        "attempt": None if window is None else 1, "is_accepted": True, "reason": None, "x_px": 990.0, "y_px": 500.0,
        "deviation_x_px": 30.0, "deviation_y_px": -40.0, "deviation_px": 50.0, "deviation_x_mm": 9.0,
        "deviation_y_mm": -12.0, "deviation_mm": 15.0, "contact_px": 20.0, "interval_s": 2.0, "pace": "right", **more,
    }  # fmt: skip


def run_records(pitch_mm: Sequence[float] | None = (0.3, 0.3)) -> list[dict[str, Any]]:
    """Return the records of two windows with two touches each, one of them rejected, and one touch outside."""
    began = {"kind": "run_began", "t": BEGUN_S + 1.0, "protocol": "training", "protocol_sha256": "ab" * 32}
    records = [{**began, "pitch_mm": pitch_mm}]
    for window in (1, 2):
        t = BEGUN_S + 10.0 * window
        said = {"window": window, "attempt": 1}
        records.append({"kind": "window_opened", "t": t, **said, "by": "clock", "gravity_level": 0.0})
        records.append(touch(t + 2.0, 2 * window, window))
        records.append(
            touch(t + 4.0, 2 * window + 1, window, is_accepted=window == 1, reason=None if window == 1 else "palm")
        )
        records.append(
            {"kind": "window_closed", "t": t + 5.0, **said, "by": "clock", "is_complete": True, "marks": []}
        )  # fmt: skip
    records.append(touch(BEGUN_S + 26.0, 99, None, is_accepted=False, reason="outside", interval_s=None, pace=None))
    records.append({"kind": "run_ended", "t": BEGUN_S + 30.0, "is_complete": True, "why": ""})
    return records


def write_session(
    path: Path,
    said: dict[str, Any],
    records: Sequence[dict[str, Any]] | None = None,
    times: np.ndarray | None = None,
    shift: float = 0.0,
) -> Path:
    """Write a recording.

    Args:
        path: Path of the file.
        said: Settings of the recording.
        records: Records of the task; two windows by default.
        times: Times of the ticks [s].
        shift: Delay of the records' own clock behind the rig's clock, as at a console [s].
    """
    records = run_records() if records is None else records
    times = BEGUN_S + 0.1 * np.arange(310) if times is None else times
    with RecordingWriter(path, JOINTS, said) as recording:
        for k, t in enumerate(times):
            recording.tick(float(t), closure_slope=0.0, tick_us=1.0, sequence=k + 1, **ZEROS)
        for record in records:
            own = {**record, "t": record["t"] - shift}
            recording.write("/task", record["t"], {"kind": record["kind"], "record": own})
    return path


def study_with(path: Path, *groups: str) -> tuple[StudyFolder, list[str]]:
    """Create a study, and return its folder and the codes of one person for each of these groups."""
    folder = begin_study(path, AS_PUBLISHED)
    return folder, [new_participant(folder, group).code for group in groups]
