"""Study of two people with two sessions each, including truncated, uncalibrated and flight data and devices."""

import hashlib
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from exograv.recording import RecordingWriter
from exograv.recording.encoding import empty_ticks
from exograv.recording.stream_block import StreamBlock, StreamFormat, packed
from exograv.study.bids.export import ExportResult, write_dataset
from exograv.study.dataset.tables import Tables, frame, read_tables, write_tables
from exograv.study.folder.columns import PARTICIPANTS, SESSIONS, TOUCHES, WINDOWS
from exograv.study.folder.settings import AS_PUBLISHED, read_settings, write_settings
from exograv.study.folder.stream_settings import StreamSettings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.importers.recording import import_recording

from .made_up_biosignal import AHEAD_S, BEGINS_S, MadeUpDevice

JOINTS = ("shoulder_flexion", "elbow_flexion")
RATE_HZ = 1000.0
SECONDS = 12.0
BIOSIGNALS = (
    MadeUpDevice("EEG", "/lsl/eeg", seconds=11.0, rig_drift=0.0, lost=((8.0, 8.2),), extra="<cap><name>C</name></cap>"),
    MadeUpDevice("EMG", "/lsl/emg", 1000.0, 11.0, rig_drift=0.0, unit="mV", labels=("BB of Erika", "TB")),
)
STREAMS = {"EMG": StreamSettings(reference="bipolar", placement="SENIAM", power_line_Hz=50.0, labels=["BB", "TB"])}

ECG_HZ = 250.0
XML = (
    "<info><name>{name}</name><type>{kind}</type><channel_count>1</channel_count><nominal_srate>{rate}</nominal_srate>"
    "<channel_format>{form}</channel_format>"
    "<desc><channels><channel><label>lead II</label><unit>uV</unit></channel></channels></desc></info>"
)

CODES = ("K7MR4XP", "A3CD4EF")


def ticks(seconds: float = SECONDS, lost: slice = slice(0, 0)) -> np.ndarray:
    """Return the ticks of a slow swing without the `lost` ones."""
    t = BEGINS_S + np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    rows = empty_ticks(len(t), len(JOINTS))
    rows["t"] = rows["now"] = t
    rows["monotonic"] = t + AHEAD_S
    rows["sequence"] = np.arange(1, len(t) + 1)
    rows["gravity_level"], rows["phase"] = 0.0, 1
    rows["q_measured"] = swing(t)[:, None] * [1.0, 0.5]
    rows["v"] = np.gradient(rows["q_measured"], 1.0 / RATE_HZ, axis=0)
    rows["tau_measured"] = rows["tau_commanded"] = 3.0
    return np.delete(rows, lost)


def swing(t: np.ndarray) -> np.ndarray:
    """Joint positions [rad]."""
    return 0.4 * np.sin(2.0 * np.pi * 0.5 * t)


def write_recording(
    path: Path,
    protocol: str = "training",
    pitch_mm: tuple[float, float] | None = (0.277, 0.277),
    with_aircraft: bool = False,
    with_devices: bool = False,
    rows: np.ndarray | None = None,
    seed: int = 0,
    biosignals: Sequence[MadeUpDevice] = BIOSIGNALS,
) -> Path:
    """Return the records of one session with one window."""
    settings = {
        "rig": "recupera_like",
        "title": "Made up",
        "side": "right",
        "seed": seed,
        "command": "exograv run train --simulate",
        "versions": {"exograv": "0.1.0"},
        "settings": {"protocol": {"name": protocol, "exo": "active", "windows": {"count": 1}}},
    }
    kinds = {"/lsl/ecg": "float32", "/lsl/keys": "string", **{one.topic: "float32" for one in biosignals}}
    streams = [StreamFormat(*one) for one in kinds.items()] if with_devices else []
    path.parent.mkdir(parents=True, exist_ok=True)
    with RecordingWriter(path, JOINTS, settings, streams) as recording:
        recording.phase(BEGINS_S, "task")
        for record in _records(protocol, pitch_mm):
            recording.write("/task", record["t"], {"kind": record["kind"], "record": record})
        recording.write("/event", BEGINS_S + 11.0, {"kind": "stop", "text": "Somebody pressed Stop."})
        recording.write("/event", BEGINS_S + 11.0, {"kind": "note", "text": "Erika Mustermann is tired."})
        if with_aircraft:
            for k in range(100):
                message = {"g": [0.18, -0.01, 0.02], "parabola": 1, "announcement": "EMULATED"}
                recording.write("/aircraft", BEGINS_S + 0.5 + 0.1 * k, message)
        recording.ticks(ticks() if rows is None else rows)
        for k in range(0, 200, 2):
            points = {"exo": [[0.0, 0.0, 0.0]], "arm": [[0.0, -0.2, 0.5], [0.3, -0.2, 0.001 * k]]}
            recording.write("/skeleton", BEGINS_S + 0.025 * k, points)
        if with_devices:
            _write_devices(recording, biosignals)
    return path


def _records(protocol: str, pitch_mm: tuple[float, float] | None) -> list[dict[str, Any]]:
    def touch(t: float, sequence: int, x_px: float, is_accepted: bool, reason: str | None) -> dict[str, Any]:
        off_mm = (None, None) if pitch_mm is None else (x_px * pitch_mm[0], 0.0)
        return {
            "kind": "touch", "t": t, "received": t + 0.06, "page": "a", "sequence": sequence, "window": 1, "attempt": 1,
            "is_accepted": is_accepted, "reason": reason, "x_px": 960.0 + x_px, "y_px": 540.0,
            "deviation_x_px": x_px, "deviation_y_px": 0.0, "deviation_px": abs(x_px), "deviation_x_mm": off_mm[0],
            "deviation_y_mm": off_mm[1], "deviation_mm": None if off_mm[0] is None else abs(off_mm[0]),
            "contact_px": 30.0, "interval_s": 2.0, "pace": "right",
        }  # fmt: skip

    level = {"gravity_level": 1.0, "gravity_level_end": 0.0}
    begin = BEGINS_S
    return [
        {"kind": "run_began", "t": begin, "protocol": protocol, "protocol_sha256": "0" * 64, "pitch_mm": pitch_mm},
        {"kind": "phase_began", "t": begin + 0.5, "phase": "ramp", "window": 1, "duration_s": 1.0, **level},
        {"kind": "window_opened", "t": begin + 1.5, "window": 1, "attempt": 1, "by": "clock", "gravity_level": 0.0},
        touch(begin + 3.5, 0, 12.0, True, None),
        touch(begin + 5.5, 1, -30.0, True, None),
        touch(begin + 5.6, 2, -31.0, False, "bounce"),
        {"kind": "window_closed", "t": begin + 10.5, "window": 1, "attempt": 1, "by": "clock", "is_complete": True,
         "marks": []},
        {"kind": "run_ended", "t": begin + 11.0, "is_complete": True, "why": "all windows are complete"},
    ]  # fmt: skip


def ecg_stamps() -> np.ndarray:
    """Write samples on the robot's clock; half a second is missing."""
    t = BEGINS_S + 1.0 + np.arange(int(8.0 * ECG_HZ)) / ECG_HZ
    return np.delete(t, slice(1000, 1125))


def _write_devices(recording: RecordingWriter, biosignals: Sequence[MadeUpDevice]) -> None:
    for name, kind, rate, form in (("ecg", "ECG", ECG_HZ, "float32"), ("keys", "Markers", 0.0, "string")):
        head = {"topic": f"/lsl/{name}", "connection": 1}
        xml = XML.format(name=f"{name} of Mustermann", kind=kind, rate=rate, form=form)
        note = {"monotonic": AHEAD_S, "kind": "connected", "text": "It is recorded.", "xml": xml}
        recording.write("/stream", BEGINS_S, {**head, **note})
        for asked in AHEAD_S + BEGINS_S + np.arange(0.0, 12.0, 2.0):
            times = {"asked": asked, "answered": asked + 1e-3, "remote": asked, "offset": 0.0, "uncertainty": 2e-4}
            recording.write("/correction", BEGINS_S, {**head, **times})
    stamps = ecg_stamps() + AHEAD_S
    for first in range(0, len(stamps), 25):
        some = stamps[first : first + 25]
        values = np.arange(first, first + len(some), dtype=np.float32)[:, None]
        recording.write_block("/lsl/ecg", BEGINS_S, packed(StreamBlock(some[-1] + 0.01, 1, some, values), 1))
    for device in biosignals:
        for message in [*device.notes()[:1], *device.corrections()]:
            kind = "/correction" if "offset" in message else "/stream"
            recording.write(kind, message["t"], {name: value for name, value in message.items() if name != "t"})
        for block in device.blocks():
            recording.write_block(device.topic, BEGINS_S, packed(block, device.channels))
    recording.write_block("/lsl/keys", BEGINS_S, packed(StreamBlock(stamps[0], 1, stamps[:1], [["Erika"]]), 1))


def cut(path: Path, share: float = 0.6) -> Path:
    """Truncate a recording as a power failure does."""
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    return path


def _flown(path: Path) -> Path:
    return write_recording(path, "flight", with_aircraft=True, with_devices=True, rows=ticks(lost=slice(4000, 4150)))


def _uncalibrated(path: Path) -> Path:
    return write_recording(path, "familiarisation", pitch_mm=None)


MADE: tuple[tuple[str, str, int, Callable[[Path], Path]], ...] = (
    (CODES[0], "training", 1, write_recording),
    (CODES[0], "flight", 1, _flown),
    (CODES[1], "familiarisation", 1, _uncalibrated),
    (CODES[1], "familiarisation", 2, lambda path: cut(write_recording(path, "familiarisation"), 0.4)),
)


def write_study(path: Path, made: tuple[tuple[str, str, int, Callable[[Path], Path]], ...] = MADE) -> StudyFolder:
    """Create the whole study."""
    folder = StudyFolder(path)
    path.mkdir(parents=True)
    write_settings(
        folder,
        AS_PUBLISHED.model_copy(
            update={"authors": ["A. Author", "B. Author"], "licence": "CC-BY-4.0", "streams": STREAMS}
        ),
    )
    sessions, windows, touches = list[Any](), list[Any](), list[Any]()
    for code, protocol, number, make in made:
        source = make(folder.session(code, protocol, number) / "run.mcap")
        imported = import_recording(source)
        key = {"participant": code, "protocol": protocol, "session": number}
        where = source.relative_to(path).as_posix()
        sha256 = hashlib.sha256(source.read_bytes()).hexdigest()
        acquired = "2026-03-02T09:30:00" if protocol == "flight" else None
        sessions.append({**key, **imported.session, "source": where, "sha256": sha256, "acquired": acquired})
        windows += [{**key, **row} for row in imported.windows]
        touches += [{**key, **row} for row in imported.touches]
    people = [
        {"participant": CODES[0], "group": "trained", "age_band": "30-39", "sex": "f"},
        {"participant": CODES[1], "group": None},
    ]
    tables = Tables(
        frame(TOUCHES, touches), frame(WINDOWS, windows), frame(SESSIONS, sessions), frame(PARTICIPANTS, people)
    )
    write_tables(folder, tables)
    return folder


def export(folder: StudyFolder, out: Path, rate_Hz: float = 100.0, with_raw: bool = True) -> ExportResult:
    """Export with the present tables, independent of the sources."""
    return write_dataset(folder, read_settings(folder), read_tables(folder), out, (rate_Hz, with_raw))


def copied(folder: StudyFolder, to: Path) -> StudyFolder:
    """Return a copy of the study that a test may change."""
    return StudyFolder(Path(shutil.copytree(folder.path, to)))
