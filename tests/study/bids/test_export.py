"""A study becomes a data set that the BIDS validator accepts: whole or not at all, always the same, without names."""

import errno
import gzip
import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from exograv.cli.study.export import Export, run_export
from exograv.errors import ConfigError, RecordingError
from exograv.recording import read_recording
from exograv.study.bids.checking import problems_of, read_rows
from exograv.study.bids.export import export_bids
from exograv.study.bids.manifest import MANIFEST, files_of, read_manifest
from exograv.study.dataset.adding import AddOptions, add_files
from exograv.study.dataset.beginning import begin_study
from exograv.study.dataset.folder import StudyFolder
from exograv.study.dataset.journal import alone
from exograv.study.dataset.settings import AS_PUBLISHED
from exograv.study.dataset.tables import Tables, read_tables, write_tables
from exograv.study.importers.imported import Said
from exograv.study.participants.register import new_participant

from .small_study import (
    BEGINS_S,
    CODES,
    JOINTS,
    MADE,
    cut,
    ecg_stamps,
    export,
    swing,
    ticks,
    write_recording,
    write_study,
)

FLIGHT = f"sub-{CODES[0]}/ses-flight01"
FLIGHT_STEM = f"sub-{CODES[0]}_ses-flight01"
CUT = f"sub-{CODES[1]}/ses-familiarisation02"
HALF_DECIMAL = 0.6e-5


def motion_of(root: Path, system: str) -> dict[str, np.ndarray]:
    """Columns by name."""
    stem = root / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_tracksys-{system}"
    _, channels = read_rows(stem.with_name(stem.name + "_channels.tsv"))
    return columns_of(stem.with_name(stem.name + "_motion.tsv"), [channel["name"] for channel in channels])


def columns_of(path: Path, names: list[str]) -> dict[str, np.ndarray]:
    table = np.genfromtxt(path, delimiter="\t", missing_values="n/a")
    return dict(zip(names, table.T, strict=True))


def sidecar(root: Path, name: str) -> dict:
    return json.loads((root / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_{name}.json").read_text())


def copied(study: StudyFolder, to: Path) -> StudyFolder:
    return StudyFolder(Path(shutil.copytree(study.path, to)))


def issues_of(root: Path) -> list[dict]:
    """What the official validator says. The schema is in its own file; it asks no network."""
    validator = Path(sys.executable).with_name("bids-validator-deno")
    command = [validator, root, "--format", "json", "--max-rows", "-1"]
    return json.loads(subprocess.run(command, capture_output=True, check=False).stdout)["issues"]["issues"]


def test_the_validator_finds_no_error(exported: Path):
    issues = issues_of(exported)
    assert [issue for issue in issues if issue["severity"] == "error"] == []
    assert {issue.get("subCode") for issue in issues} <= {"HEDVersion", "CogAtlasID", "CogPOID"}


def test_sessions_with_hardly_anything_in_them_are_valid_too(tmp_path: Path):
    made = [
        (CODES[k], "training", number, lambda path, n=n: write_recording(path, rows=ticks()[:n]))
        for k, number, n in ((0, 1, 0), (0, 2, 1), (1, 1, 7))
    ]
    study = write_study(
        tmp_path / "study", (*made, (CODES[1], "training", 2, lambda path: cut(write_recording(path), 0.13)))
    )
    tables = read_tables(study)
    is_kept = (tables.touches["participant"] != CODES[0]).tolist()
    write_tables(
        study, Tables(tables.touches.loc[is_kept], tables.windows.head(0), tables.sessions, tables.participants)
    )
    export(study, tmp_path / "bids")
    assert problems_of(tmp_path / "bids") == []
    assert [issue for issue in issues_of(tmp_path / "bids") if issue["severity"] == "error"] == []


def test_our_own_checks_find_nothing(exported: Path):
    assert problems_of(exported) == []


def test_the_same_study_gives_the_same_bytes(small_study: StudyFolder, exported: Path, tmp_path: Path):
    export(copied(small_study, tmp_path / "elsewhere"), tmp_path / "again")
    assert read_manifest(tmp_path / "again") == read_manifest(exported)


def test_the_motion_is_that_of_the_ticks(exported: Path):
    motion = motion_of(exported, "exo")
    is_there = np.isfinite(motion["shoulder_flexion_angle"])
    expected = np.rad2deg(swing(BEGINS_S + motion["latency"]))
    inside = is_there & (motion["latency"] > 0.1) & (motion["latency"] < 11.8)
    assert np.allclose(motion["shoulder_flexion_angle"][inside], expected[inside], atol=0.02)  # the filter's error, deg
    assert np.allclose(motion["elbow_flexion_torque_commanded"][is_there], 3.0, atol=HALF_DECIMAL)
    assert np.array_equal(~is_there, (motion["latency"] > 3.9995) & (motion["latency"] < 4.1495))


def test_torque_latency_and_angles_have_the_words_of_bids(exported: Path):
    _, channels = read_rows(exported / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_tracksys-exo_channels.tsv")
    kinds = {channel["name"]: (channel["type"], channel["units"]) for channel in channels}
    assert kinds["latency"] == ("LATENCY", "s")
    for joint in JOINTS:
        assert kinds[f"{joint}_angle"] == ("JNTANG", "deg")
        assert kinds[f"{joint}_velocity"] == ("MISC", "deg/s")
        assert kinds[f"{joint}_torque_measured"] == ("MISC", "N m")


@pytest.mark.parametrize(("system", "starts", "last"), [("hand", 0.0, 0.198), ("aircraft", 0.5, 0.196133)])
def test_other_points_have_their_own_beginning(exported: Path, system: str, starts: float, last: float):
    motion = motion_of(exported, system)
    assert motion["latency"][0] == 0.0
    assert sidecar(exported, f"tracksys-{system}_motion")["StartTime"] == pytest.approx(starts)
    assert list(motion.values())[-1][-1] == pytest.approx(last, abs=HALF_DECIMAL)
    onsets = {
        name: read_rows(exported / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_tracksys-{name}_events.tsv")[1]
        for name in ("exo", system)
    }
    for own, other in zip(onsets["exo"], onsets[system], strict=True):
        assert float(other["onset"]) == pytest.approx(float(own["onset"]) - starts)


def test_a_device_is_on_the_robots_clock_with_its_gap(exported: Path):
    path = exported / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_tracksys-exo_recording-ECG_physio.tsv.gz"
    latency, lead = columns_of(path, ["latency", "lead"]).values()
    is_there = np.isfinite(lead)
    about = sidecar(exported, "tracksys-exo_recording-ECG_physio")
    assert about["Columns"] == ["latency", "leadII"]
    assert about["StartTime"] == pytest.approx(1.0, abs=1e-6)
    assert about["RowsWithoutSample"] == np.count_nonzero(~is_there) == 125
    assert np.allclose(latency[is_there] + BEGINS_S + 1.0, ecg_stamps(), atol=2e-6)
    assert np.array_equal(lead[is_there], np.arange(np.count_nonzero(is_there)))
    assert np.allclose(np.diff(latency), 1 / 250.0, atol=2e-6)
    assert gzip.decompress(path.read_bytes())[:2] == b"0\t"
    assert path.read_bytes()[3:8] == bytes(5)  # neither name nor time


def test_every_touch_has_its_row_and_its_reason(exported: Path, small_study: StudyFolder):
    touches = read_tables(small_study).touches
    rows = [row for path in sorted(exported.glob("sub-*/ses-*/beh/*_beh.tsv")) for row in read_rows(path)[1]]
    assert len(rows) == len(touches)
    rejected = touches["is_accepted"].tolist().count(False)
    assert [row["reason"] for row in rows if row["accepted"] == "false"] == ["bounce"] * rejected
    uncalibrated = read_rows(next(exported.glob("sub-*/ses-familiarisation01/beh/*_beh.tsv")))[1]
    assert {row["deviation_mm"] for row in uncalibrated} == {"n/a"}
    assert {row["deviation_px"] for row in uncalibrated} == {"12", "30", "31"}


def test_a_recording_that_was_cut_gives_what_is_left_and_says_so(exported: Path, small_study: StudyFolder):
    stem = exported / CUT / "motion" / f"{CUT.replace('/', '_')}_task-pointing_tracksys-exo"
    about = json.loads(stem.with_name(stem.name + "_motion.json").read_text())
    source = small_study.session(CODES[1], "familiarisation", 2) / "run.mcap"
    assert about["TickCount"] == len(read_recording(source).ticks) < 12_000
    assert "ends abruptly" in about["SourceRemark"]


def test_what_is_simulated_is_called_so_everywhere(exported: Path):
    assert "SIMULATED" in json.loads((exported / "dataset_description.json").read_text())["Name"]
    assert "nobody took part" in (exported / "README.md").read_text()
    for path in exported.glob("sub-*/ses-*/*/*.json"):
        if not path.name.endswith("_channels.json"):
            assert json.loads(path.read_text())["Simulated"] is True
    for path in exported.glob("sub-*/ses-*/*_scans.tsv"):
        assert {row["simulated"] for row in read_rows(path)[1]} == {"true"}


def test_what_somebody_typed_is_not_given_on(exported: Path):
    for name in files_of(exported):
        if not name.startswith("sourcedata/"):
            content = (exported / name).read_bytes()
            content = gzip.decompress(content) if name.endswith(".gz") else content
            assert b"Erika" not in content
            assert b"Mustermann" not in content


def test_raw_files_are_given_along_byte_for_byte_or_not_at_all(
    small_study: StudyFolder, exported: Path, tmp_path: Path
):
    for path in small_study.sources.rglob("*.mcap"):
        assert (exported / path.relative_to(small_study.path)).read_bytes() == path.read_bytes()
    export(small_study, tmp_path / "bids", with_raw=False)
    assert not (tmp_path / "bids" / "sourcedata").exists()
    assert problems_of(tmp_path / "bids") == []


def test_the_manifest_is_one_that_sha256sum_reads(exported: Path):
    for line in (exported / MANIFEST).read_text().splitlines():
        sha256, name = line.split("  ")
        assert hashlib.sha256((exported / name).read_bytes()).hexdigest() == sha256


def test_acquisition_is_told_where_somebody_told_it(exported: Path):
    rows = read_rows(exported / FLIGHT / f"{FLIGHT_STEM}_scans.tsv")[1]
    times = {row["filename"].rpartition("tracksys-")[2]: row["acq_time"] for row in rows}
    assert times["exo_motion.tsv"] == "2026-03-02T09:30:00.000000"
    assert times["aircraft_motion.tsv"] == "2026-03-02T09:30:00.500000"
    assert {row["acq_time"] for row in read_rows(exported / CUT / f"{CUT.replace('/', '_')}_scans.tsv")[1]} == {"n/a"}


@pytest.mark.parametrize(("rate", "rows"), [(1000.0, 12_000), (128.0, 1500), (50.0, 600), (5000.0, 12_000)])
def test_the_rate_that_is_wanted_is_met_by_whole_ticks(tmp_path: Path, rate: float, rows: int):
    study = write_study(tmp_path / "study", MADE[:1])
    assert export(study, tmp_path / "bids", rate_Hz=rate)["motion_rows"] == rows
    assert problems_of(tmp_path / "bids") == []


def test_an_earlier_export_is_replaced_and_anything_else_refused(small_study: StudyFolder, tmp_path: Path):
    out = tmp_path / "bids"
    export(small_study, out)
    export(small_study, out, with_raw=False)
    assert not (out / "sourcedata").exists()
    (out / "my_notes.txt").write_text("mine")
    with pytest.raises(ConfigError, match=r"my_notes\.txt"):
        export(small_study, out)
    assert (out / "my_notes.txt").read_text() == "mine"


@pytest.mark.parametrize("place", [".", "..", "sourcedata/bids"])
def test_nothing_is_exported_into_the_study_itself(tmp_path: Path, place: str):
    study = write_study(tmp_path / "in" / "study", MADE[:1])
    with pytest.raises(ConfigError, match="folder of its own"):
        export(study, study.path / place)


def test_what_fails_leaves_what_was_there(small_study: StudyFolder, tmp_path: Path):
    study = copied(small_study, tmp_path / "study")
    out = tmp_path / "bids"
    export(study, out)
    before = read_manifest(out)
    source = next(study.sources.rglob("*.mcap"))
    source.write_bytes(source.read_bytes() + b"0")
    with pytest.raises(RecordingError, match="not what was added"):
        export(study, out)
    assert read_manifest(out) == before
    assert {path.name for path in tmp_path.iterdir()} == {"study", "bids"}


@pytest.mark.parametrize("where", ["session.write_behaviour", "export.os.sync", "export._swap"])
def test_a_full_disk_leaves_what_was_there(
    small_study: StudyFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: str
):
    out = tmp_path / "bids"
    export(small_study, out)
    before = read_manifest(out)

    def fails(*_args: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(f"exograv.study.bids.{where}", fails)
    with pytest.raises(RecordingError, match=r"No space left.*unchanged"):
        export(small_study, out)
    assert read_manifest(out) == before
    assert [path.name for path in tmp_path.iterdir()] == ["bids"]


def test_what_cannot_take_its_place_gives_it_back(
    small_study: StudyFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    out, renamed = tmp_path / "bids", Path.rename
    export(small_study, out)

    def fails_once(path: Path, target: Path) -> Path:
        if target == out and path.name.endswith("-bids"):
            raise OSError(errno.EACCES, "Permission denied")
        return renamed(path, target)

    monkeypatch.setattr(Path, "rename", fails_once)
    with pytest.raises(RecordingError, match="Permission denied"):
        export(small_study, out)
    assert problems_of(out) == []


def test_a_session_without_a_recording_has_touches_and_events(small_study: StudyFolder, tmp_path: Path):
    study = copied(small_study, tmp_path / "study")
    tables = read_tables(study)
    sessions = tables.sessions.assign(kind="csv", rate_Hz=np.nan, is_simulated=False)
    write_tables(study, Tables(tables.touches, tables.windows, sessions, tables.participants))
    export(study, tmp_path / "bids")
    assert not list((tmp_path / "bids").rglob("*_motion.tsv"))
    assert len(list((tmp_path / "bids").rglob("beh/*_events.tsv"))) == 4
    assert problems_of(tmp_path / "bids") == []


@pytest.mark.parametrize("column", ["sessions", "participants"])
def test_two_names_with_one_label_are_refused(small_study: StudyFolder, tmp_path: Path, column: str):
    study = copied(small_study, tmp_path / "study")
    tables = read_tables(study)
    protocols = tables.sessions["protocol"].replace({"flight": "a-1", "training": "a_1"})
    sessions = tables.sessions.assign(protocol=protocols) if column == "sessions" else tables.sessions
    people = pd.concat([tables.participants, tables.participants.assign(participant="K7MR4X-P")])
    people = tables.participants if column == "sessions" else people
    write_tables(study, Tables(tables.touches, tables.windows, sessions, people))
    with pytest.raises(ConfigError, match="letters and digits only"):
        export(study, tmp_path / "bids")


def test_a_session_of_nobody_is_refused(small_study: StudyFolder, tmp_path: Path):
    study = copied(small_study, tmp_path / "study")
    tables = read_tables(study)
    write_tables(study, Tables(tables.touches, tables.windows, tables.sessions, tables.participants.head(1)))
    with pytest.raises(ConfigError, match=CODES[1]):
        export(study, tmp_path / "bids")


def test_a_study_without_sessions_is_refused(small_study: StudyFolder, tmp_path: Path):
    study = copied(small_study, tmp_path / "study")
    tables = read_tables(study)
    write_tables(
        study, Tables(tables.touches.head(0), tables.windows.head(0), tables.sessions.head(0), tables.participants)
    )
    with pytest.raises(ConfigError, match="holds no session"):
        export(study, tmp_path / "bids")


def test_authors_and_licence_are_the_studys(exported: Path):
    about = json.loads((exported / "dataset_description.json").read_text())
    assert (about["License"], about["Authors"]) == ("CC-BY-4.0", ["A. Author", "B. Author"])
    assert about["DatasetType"] == "raw"


def test_a_study_is_added_to_and_exported_by_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    folder = begin_study(tmp_path / "study", AS_PUBLISHED)
    people = [new_participant(folder, group).code for group in ("trained", "untrained")]
    paths = [write_recording(tmp_path / f"{k}.mcap", with_devices=k == 0, seed=k) for k in range(2)]
    for code, path in zip(people, paths, strict=True):
        add_files(folder, [path], AddOptions(said=Said(code, "training", 1)))
    folder.table("touches").unlink()  # made anew from the sources
    result = run_export(Export(study=folder.path, bids=tmp_path / "bids"))
    assert (result["sessions"], result["participants"], result["touches"]) == (2, 2, 6)
    assert "Markers" in capsys.readouterr().out
    assert problems_of(tmp_path / "bids") == []
    assert {path.name for path in (tmp_path / "bids").glob("sub-*")} == {f"sub-{code}" for code in people}
    with pytest.raises(ConfigError, match="--rate"):
        run_export(Export(study=folder.path, bids=tmp_path / "bids", rate=0.0))


def test_a_study_that_somebody_changes_is_not_exported(small_study: StudyFolder, tmp_path: Path):
    study = copied(small_study, tmp_path / "study")
    with alone(study), pytest.raises(ConfigError, match="Another exograv command"):
        export_bids(study.path, tmp_path / "bids")


def test_devices_keep_their_time_where_the_robots_clock_stood_still(tmp_path: Path):
    rows = ticks()
    rows["monotonic"][5055:] += 0.040  # forty periods that the twin missed
    study = write_study(
        tmp_path / "study",
        ((CODES[0], "flight", 1, lambda path: write_recording(path, "flight", with_devices=True, rows=rows)),),
    )
    export(study, tmp_path / "bids")
    path = next((tmp_path / "bids").rglob("*_physio.tsv.gz"))
    latency, lead = columns_of(path, ["latency", "lead"]).values()
    (stream,) = (one for one in read_recording(next(study.sources.rglob("*.mcap"))).streams if one.kind == "ECG")
    t = stream.t[np.concatenate([[True], np.diff(np.maximum.accumulate(stream.t)) > 0.0])]
    assert np.allclose(latency[np.isfinite(lead)], t - t[0], atol=2e-6)
