"""A study becomes a data set that the BIDS validator accepts: completely or not at all, reproducible, without names."""

import errno
import gzip
import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from exograv.cli.study.export import Export, run_export
from exograv.errors import ConfigError, RecordingError
from exograv.files import PARTIAL
from exograv.study.bids.checking import problems_of
from exograv.study.bids.export import _in_place_of, export_bids
from exograv.study.bids.manifest import MANIFEST, files_of, read_manifest
from exograv.study.dataset.adding import add_files
from exograv.study.dataset.beginning import begin_study
from exograv.study.dataset.options import AddOptions
from exograv.study.dataset.tables import Tables, read_tables, write_tables
from exograv.study.folder.journal import alone
from exograv.study.folder.settings import AS_PUBLISHED
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.register import new_participant

from .made_up_biosignal import MadeUpDevice
from .small_study import (
    CODES,
    MADE,
    copied,
    cut,
    export,
    ticks,
    write_recording,
    write_study,
)


def issues_of(root: Path) -> list[dict]:
    """Return the report of the official validator. The schema is in its own file, so no network is needed."""
    validator = Path(sys.executable).with_name("bids-validator-deno")
    command = [validator, root, "--format", "json", "--max-rows", "-1"]
    return json.loads(subprocess.run(command, capture_output=True, check=False).stdout)["issues"]["issues"]


def test_the_validator_finds_no_error(exported: Path):
    issues = issues_of(exported)
    assert [issue for issue in issues if issue["severity"] == "error"] == []
    # The circumference is a number: BIDS has no word for an unknown one.
    assert {issue.get("subCode") for issue in issues} <= {"HEDVersion", "CogAtlasID", "CogPOID", "HeadCircumference"}


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


def test_several_biosignals_with_places_triggers_and_without_units_are_valid_too(tmp_path: Path):
    place = "uV</unit><location><X>1.5</X><Y>-20</Y><Z>90</Z></location><unit>"
    labels = ("Cz", "Trigger</label><type>TRIG</type><label>")
    devices = [
        MadeUpDevice(kind, f"/lsl/{k}", seconds=9.0, rig_drift=0.0, unit=unit, labels=names)
        for k, (kind, unit, names) in enumerate(
            [
                ("EEG", place, ("Cz", "Pz")),
                ("EEG", "uV", labels),
                ("EMG", "uV", ("", "")),
                ("EMG", "V", ("", "")),
                ("EEG", "", ()),
            ]
        )
    ]
    made = lambda path: write_recording(path, "flight", with_devices=True, biosignals=devices)  # noqa: E731
    result = export(write_study(tmp_path / "study", ((CODES[0], "flight", 1, made),)), tmp_path / "bids")
    assert [issue for issue in issues_of(tmp_path / "bids") if issue["severity"] == "error"] == []
    assert problems_of(tmp_path / "bids") == []
    names = {path.name.partition("pointing_")[2] for path in (tmp_path / "bids").rglob("*.bdf")}
    assert names == {f"acq-EEG{k}_eeg.bdf" for k in (1, 2)} | {f"recording-EMG{k}_emg.bdf" for k in (1, 2)}
    said = [sentence for sentence in result.not_exported if "physio only" in sentence]
    assert len(said) == 1
    assert "unit_uV" in said[0]


def test_our_own_checks_find_nothing(exported: Path):
    assert problems_of(exported) == []


def test_the_same_study_gives_the_same_bytes(small_study: StudyFolder, exported: Path, tmp_path: Path):
    export(copied(small_study, tmp_path / "elsewhere"), tmp_path / "again")
    assert read_manifest(tmp_path / "again") == read_manifest(exported)


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
    with pytest.raises(ConfigError, match="separate folder"):
        export(study, study.path / place)


def test_what_fails_leaves_what_was_there(small_study: StudyFolder, tmp_path: Path):
    study = copied(small_study, tmp_path / "study")
    out = tmp_path / "bids"
    export(study, out)
    before = read_manifest(out)
    source = next(study.sources.rglob("*.mcap"))
    source.write_bytes(source.read_bytes() + b"0")
    with pytest.raises(RecordingError, match="was changed after it was added"):
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
    folder = begin_study(tmp_path / "study", AS_PUBLISHED.model_copy(update={"is_simulated": True}))
    people = [new_participant(folder, group).code for group in ("trained", "untrained")]
    paths = [write_recording(tmp_path / f"{k}.mcap", with_devices=k == 0, seed=k) for k in range(2)]
    for code, path in zip(people, paths, strict=True):
        add_files(folder, [path], AddOptions(participant=code, protocol="training", session=1))
    folder.table("touches").unlink()  # made again from the sources
    result = run_export(Export(study=folder.path, bids=tmp_path / "bids"))
    assert (result.sessions, result.participants, result.touches) == (2, 2, 6)
    shown = capsys.readouterr().out
    assert "Markers" in shown
    assert "README.md describes the data set." in shown
    assert "--no-raw" in shown
    assert problems_of(tmp_path / "bids") == []
    assert {path.name for path in (tmp_path / "bids").glob("sub-*")} == {f"sub-{code}" for code in people}
    with pytest.raises(ConfigError, match="--rate"):
        run_export(Export(study=folder.path, bids=tmp_path / "bids", rate=0.0))
    capsys.readouterr()
    run_export(Export(study=folder.path, bids=tmp_path / "bids", raw=False))
    assert "--no-raw" not in capsys.readouterr().out


@pytest.mark.parametrize("is_swapped", [False, True], ids=["while writing", "while swapping"])
def test_what_a_killed_export_left_is_removed_and_the_previous_content_is_there(
    small_study: StudyFolder, tmp_path: Path, is_swapped: bool
):
    study, out = copied(small_study, tmp_path / "study"), tmp_path / "bids"
    export(study, out)
    (tmp_path / f"{PARTIAL}12345678-bids").mkdir()
    if is_swapped:
        out.rename(tmp_path / f"{PARTIAL}12345678-bids-old")
    with pytest.raises(ConfigError, match="--rate"):
        export_bids(study.path, out, rate_Hz=-1.0)
    with pytest.raises(RecordingError), _in_place_of(out, study):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["bids", "study"]
    assert (out / "dataset_description.json").is_file()


def test_a_study_that_somebody_changes_is_not_exported(small_study: StudyFolder, tmp_path: Path):
    study = copied(small_study, tmp_path / "study")
    with alone(study), pytest.raises(ConfigError, match="Another exograv command"):
        export_bids(study.path, tmp_path / "bids")
