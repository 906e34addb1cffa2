"""Samples of other devices keep their values and get their time; a stream without a time is left out with a reason."""

import gzip
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.recording import Recording
from exograv.recording.stream_block import StreamBlock
from exograv.study.bids.devices import FILL_MAX_S, Devices, device_streams
from exograv.study.bids.names import SessionPlace

from .made_up_biosignal import AHEAD_S, BEGINS_S
from .small_study import ticks

PLACE = SessionPlace("K7MR4XP", "training01")
RATE_HZ = 500.0
CLOCK_S = 1e-6
"""Resolution of times in the file [s]."""


def stream(
    topic: str, kind: str = "ECG", rate: float = RATE_HZ, form: str = "int16", labels: tuple[str, ...] = ("biceps", "")
) -> dict[str, Any]:
    channels = "".join(f"<channel><label>{label}</label><unit>uV</unit></channel>" for label in labels)
    xml = (
        f"<info><name>of somebody</name><type>{kind}</type><channel_count>{len(labels)}</channel_count>"
        f"<nominal_srate>{rate}</nominal_srate><channel_format>{form}</channel_format>"
        f"<desc><channels>{channels}</channels></desc></info>"
    )
    return {"t": 0.0, "monotonic": 0.0, "topic": topic, "kind": "connected", "text": "", "connection": 1, "xml": xml}


def corrections(topic: str, connection: int = 1, offset: float = 0.0) -> list[dict[str, Any]]:
    return [
        {
            "t": 0.0, "topic": topic, "connection": connection, "asked": at, "answered": at, "remote": at - offset,
            "offset": offset, "uncertainty": 1e-4,
        }
        for at in AHEAD_S + BEGINS_S + np.arange(0.0, 30.0, 2.0)
    ]  # fmt: skip


def recording(notes: list[dict[str, Any]], measured: list[dict[str, Any]], is_tied: bool = True) -> Recording:
    some = ticks()[::100].copy()
    if not is_tied:
        some["monotonic"] = np.nan
    return Recording(Path("run.mcap"), {"joints": []}, some, None, {"/stream": notes, "/correction": measured})


def block(seconds: np.ndarray, connection: int = 1, offset: float = 0.0, channels: int = 2) -> StreamBlock:
    """Return samples measured at these times after the beginning of the motion [s]; their values are numbered."""
    stamps = AHEAD_S + BEGINS_S + seconds - offset
    values = np.round(seconds * RATE_HZ).astype(np.int16)[:, None] * np.ones(channels, np.int16)
    return StreamBlock(float(stamps[-1]), connection, stamps, values)


def written(root: Path, source: Recording, blocks: list[StreamBlock], topic: str = "/lsl/a") -> tuple[np.ndarray, dict]:
    with Devices(root, PLACE, source, BEGINS_S) as devices:
        for one in blocks:
            devices.take(topic, one)
        (table,) = devices.finish({}).physio
    rows = np.genfromtxt(gzip.decompress((root / table).read_bytes()).decode().splitlines(), missing_values="n/a")
    return rows, json.loads((root / str(table).replace(".tsv.gz", ".json")).read_text())


def test_values_are_those_received_at_their_time(tmp_path: Path):
    seconds = 0.5 + np.arange(1000) / RATE_HZ
    source = recording([stream("/lsl/a")], corrections("/lsl/a", offset=3.0))
    rows, about = written(tmp_path, source, [block(part, offset=3.0) for part in np.split(seconds, 10)])
    assert np.array_equal(rows[:, 1], np.arange(250, 1250))
    assert np.allclose(rows[:, 0] + about["StartTime"], seconds, atol=2 * CLOCK_S)
    assert about["Columns"] == ["latency", "biceps", "channel"]
    assert (about["SamplingFrequency"], about["RowsWithoutSample"]) == (RATE_HZ, 0)
    assert about["SamplingFrequencyEffective"] == pytest.approx(RATE_HZ, rel=1e-6)


def test_another_connection_has_another_clock(tmp_path: Path):
    source = recording([stream("/lsl/a")], corrections("/lsl/a") + corrections("/lsl/a", 2, offset=-40.0))
    first, second = np.arange(500) / RATE_HZ, 2.0 + np.arange(500) / RATE_HZ
    rows, about = written(tmp_path, source, [block(first), block(second, 2, offset=-40.0)])
    there = np.isfinite(rows[:, 1])
    assert np.allclose(rows[there, 0], np.concatenate([first, second]), atol=2 * CLOCK_S)
    assert about["RowsWithoutSample"] == 500
    assert about["Connections"] == 2


def test_samples_of_a_connection_without_a_clock_are_counted_and_left_out(tmp_path: Path):
    source = recording([stream("/lsl/a")], corrections("/lsl/a"))
    rows, about = written(tmp_path, source, [block(np.arange(10) / RATE_HZ), block(0.1 + np.arange(7) / RATE_HZ, 2)])
    assert len(rows) == 10
    assert about["SamplesLeftOut"] == 7


def test_a_stamp_that_goes_back_is_left_out(tmp_path: Path):
    seconds = np.arange(100) / RATE_HZ
    seconds[50:53] -= 0.05
    rows, about = written(tmp_path, recording([stream("/lsl/a")], corrections("/lsl/a")), [block(seconds)])
    assert about["SamplesLeftOut"] == 3
    assert (np.diff(rows[:, 0]) > 0.0).all()


def test_a_clock_that_leapt_does_not_fill_the_disk(tmp_path: Path):
    seconds = np.arange(100) / RATE_HZ
    seconds[50:] += 2 * FILL_MAX_S
    rows, _ = written(tmp_path, recording([stream("/lsl/a")], corrections("/lsl/a")), [block(seconds)])
    assert len(rows) == 100


def test_two_of_a_type_and_two_channels_of_a_name_stay_apart(tmp_path: Path):
    notes = [stream("/lsl/a", labels=("left", "left")), stream("/lsl/b")]
    with Devices(tmp_path, PLACE, recording(notes, corrections("/lsl/a") + corrections("/lsl/b")), 0.0) as devices:
        for topic in ("/lsl/a", "/lsl/b"):
            devices.take(topic, block(np.arange(10) / RATE_HZ))
        tables = [str(table) for table in devices.finish({}).physio]
    assert [table.rpartition("recording-")[2] for table in tables] == ["ECG_physio.tsv.gz", "ECG2_physio.tsv.gz"]
    about = json.loads((tmp_path / tables[0].replace(".tsv.gz", ".json")).read_text())
    assert about["Columns"] == ["latency", "left", "left2"]
    assert "somebody" not in json.dumps(about)


@pytest.mark.parametrize(
    ("note", "measured", "is_tied", "why"),
    [
        (stream("/lsl/a", form="string"), True, True, "text"),
        (stream("/lsl/a", rate=0.0), True, True, "no rate"),
        (stream("/lsl/a"), False, True, "its clock was never measured"),
        (stream("/lsl/a"), True, False, "relation of the robot's clock"),
    ],
)
def test_what_is_not_exported_says_why(note: dict[str, Any], measured: bool, is_tied: bool, why: str):
    source = recording([note], corrections("/lsl/a") if measured else [], is_tied)
    streams, left = device_streams(source)
    assert streams == []
    assert why in left[0].why


def test_a_device_that_sent_nothing_leaves_no_file(tmp_path: Path):
    with Devices(tmp_path, PLACE, recording([stream("/lsl/a")], corrections("/lsl/a")), BEGINS_S) as devices:
        files = devices.finish({})
    assert files.physio == {}
    assert "sent nothing" in files.left[0].why
    assert not list(tmp_path.rglob("*.gz"))
