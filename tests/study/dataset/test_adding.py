"""A file is added once, completely, under the right code. A refusal is named and counted, and changes nothing."""

import errno
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import MCAP0_MAGIC
from tests.study.importers.test_joined_recording import CODE, interrupted
from tests.study.made_up_sessions import BEGUN_S, settings, study_with, write_session

from exograv.errors import ConfigError, RecordingError
from exograv.study.dataset import sources
from exograv.study.dataset.adding import AddingOutcome, add_files
from exograv.study.dataset.making import current_tables
from exograv.study.dataset.options import AddOptions
from exograv.study.dataset.quarantine import quarantined
from exograv.study.dataset.status import study_status
from exograv.study.dataset.tables import read_tables
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.register import read_register


def add(folder: StudyFolder, *paths: Path, **options) -> list[AddingOutcome]:
    return add_files(folder, paths, AddOptions(**options))


def code_of(folder: StudyFolder) -> str:
    return read_register(folder)[0].code


def whats(outcomes: list[AddingOutcome]) -> list[str]:
    return [one.what for one in outcomes]


def everything(folder: StudyFolder) -> dict[str, bytes]:
    """Return all files except the log, which lists the attempts."""
    return {str(p): p.read_bytes() for p in folder.path.rglob("*") if p.is_file() and p != folder.log}


def test_a_recording_stands_in_the_sources_byte_for_byte_and_in_the_tables(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_session(tmp_path / "run.mcap", settings(code))
    assert whats(add(folder, path)) == ["added"]
    tables = read_tables(folder)
    (session,) = tables.sessions.to_dict("records")
    assert folder.source(session["source"]).read_bytes() == path.read_bytes()
    assert session["source"] == f"sourcedata/{code}/training-01/{code}_training_01.mcap"
    assert tables.touches["participant"].tolist() == [code] * 5
    assert len(tables.windows) == 2


def test_a_folder_of_an_interrupted_session_is_one_session_in_the_study(tmp_path: Path):
    folder, _ = study_with(tmp_path / "study", "trained")
    place = tmp_path / "out"
    place.mkdir()
    interrupted(place)
    (place / "steered-3.mcap").unlink()
    assert whats(add(folder, place, new_code=(f"{CODE}={code_of(folder)}",))) == [
        "ignored",
        "ignored",
        "added",
        "already there",
    ]
    tables = read_tables(folder)
    assert tables.windows["is_complete"].tolist() == [True, False, True]
    assert len(tables.touches) == 4
    assert not list(folder.path.rglob(".partial-*"))


def test_a_session_that_was_resumed_after_it_was_added_replaces_its_first_part(tmp_path: Path):
    folder, _ = study_with(tmp_path / "study", "trained")
    codes = {"new_code": (f"{CODE}={code_of(folder)}",)}
    place = tmp_path / "out"
    place.mkdir()
    first = interrupted(place)
    later = [place / "steered-2.mcap", place / "console-2.jsonl"]
    for path in later:
        path.rename(tmp_path / path.name)
    assert whats(add(folder, first, **codes)) == ["added"]
    for path in later:
        (tmp_path / path.name).rename(path)
    assert whats(add(folder, first, **codes)) == ["replaced"]
    assert whats(add(folder, first, **codes)) == ["already there"]
    assert len(read_tables(folder).touches) == 4


def test_the_same_file_again_changes_nothing_under_any_name(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_session(tmp_path / "run.mcap", settings(code))
    add(folder, path)
    before = everything(folder)
    assert whats(add(folder, path.rename(tmp_path / "other.mcap"))) == ["already there"]
    assert everything(folder) == before


def test_a_second_file_for_a_session_is_refused_and_named(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    add(folder, write_session(tmp_path / "one.mcap", settings(code)))
    before = everything(folder)
    (outcome,) = add(folder, write_session(tmp_path / "two.mcap", settings(code, seed=7)))
    assert outcome.what == "refused"
    assert f"training 1 of {code} exists already" in outcome.sentence
    assert everything(folder) == before
    assert study_status(folder).refused == 1


def test_replacing_puts_the_old_file_aside_and_its_rows_away(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    one = write_session(tmp_path / "one.mcap", settings(code))
    two = write_session(tmp_path / "two.mcap", settings(code, seed=7))
    add(folder, one)
    assert whats(add(folder, two, replace=True)) == ["replaced"]
    tables = read_tables(folder)
    assert folder.source(tables.sessions["source"].tolist()[0]).read_bytes() == two.read_bytes()
    assert len(tables.touches) == 5
    (aside,) = folder.quarantine.glob("*/*.mcap")
    assert aside.read_bytes() == one.read_bytes()


def test_a_code_that_the_study_does_not_have_is_refused_until_it_is_told(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_session(tmp_path / "run.mcap", settings("P-02"))
    (outcome,) = add(folder, path)
    assert outcome.what == "refused"
    assert "'P-02'" in outcome.sentence
    assert whats(add(folder, path, new_code=(f"P-02={code}",))) == ["added"]
    assert read_tables(folder).sessions["participant"].tolist() == [code]


def test_what_is_told_against_the_file_is_followed_and_remarked(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_session(tmp_path / "run.mcap", settings(code))
    (outcome,) = add(folder, path, session=4)
    assert outcome.key == (code, "training", 4)
    assert "states session 1" in str(outcome.remark)
    assert "states session 1" in read_tables(folder).sessions["remark"][0]


def test_a_recording_under_the_code_of_another_person_is_remarked(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    add(folder, write_session(tmp_path / "one.mcap", settings(code)))
    other = settings(code, session=2) | {"wearer": {"height_m": 1.60, "mass_kg": 55.0, "sex": "female"}}
    (outcome,) = add(folder, write_session(tmp_path / "two.mcap", other))
    assert "check if two people have the same code" in str(outcome.remark)


def test_a_bad_file_goes_into_quarantine_and_the_rest_goes_on(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.mcap").write_bytes(MCAP0_MAGIC + b"and then nothing of the kind")
    (tmp_path / "in" / "notes.txt").write_text("left alone")
    write_session(tmp_path / "in" / "b.mcap", settings(code))
    assert whats(add(folder, tmp_path / "in")) == ["quarantined", "added", "ignored"]
    assert "holds no /settings" in next(iter(quarantined(folder).values())).reason
    assert len(read_tables(folder).sessions) == 1
    assert whats(add(folder, tmp_path / "in")) == ["already there", "already there", "ignored"]


def test_what_only_has_the_suffix_is_refused_and_not_kept(tmp_path: Path):
    folder, _ = study_with(tmp_path / "study", "trained")
    (tmp_path / "a.mcap").write_text("Dear Mr Hannesen")
    assert whats(add(folder, tmp_path / "a.mcap")) == ["refused"]
    assert not any(b"Hannesen" in content for content in everything(folder).values())


def test_a_protocol_that_the_study_does_not_expect_is_refused(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_session(tmp_path / "run.mcap", settings(code, "trainning"))
    (outcome,) = add(folder, path)
    assert outcome.what == "refused"
    assert "familiarisation, flight, training" in outcome.sentence
    assert whats(add(folder, write_session(path, settings(code, "training-first-2")))) == ["added"]


def test_a_half_written_recording_is_taken_with_its_remark(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_session(tmp_path / "run.mcap", settings(code), times=BEGUN_S + 0.001 * np.arange(20_000))
    path.write_bytes(path.read_bytes()[:-3000])
    (outcome,) = add(folder, path)
    assert outcome.what == "added"
    assert "ends abruptly" in read_tables(folder).sessions["remark"][0]
    assert next(iter(study_status(folder).remarks)) == f"training 1 of {code}"


def test_a_full_disk_is_one_line_and_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    add(folder, write_session(tmp_path / "one.mcap", settings(code)))
    before = everything(folder)

    def full(_path: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(sources, "sync", full)
        with pytest.raises(RecordingError, match="No space left") as refused:
            add(folder, write_session(tmp_path / "two.mcap", settings(code, session=2)))
    assert "\n" not in str(refused.value)
    assert everything(folder) == before
    assert whats(add(folder, tmp_path / "two.mcap")) == ["added"]


@pytest.mark.parametrize(
    "mark", [{"disturbance_level": 2}, {"command": "exograv run train --simulate"}], ids=["twin", "simulate"]
)
def test_a_rehearsal_is_never_a_session_of_a_study_of_people(tmp_path: Path, mark: dict):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    (outcome,) = add(folder, write_session(tmp_path / "rehearsal.mcap", settings(code, **mark)))
    assert outcome.what == "refused"
    assert "a rehearsal is no session" in outcome.sentence
    assert len(current_tables(folder).sessions) == 0
    assert whats(add(folder, write_session(tmp_path / "run.mcap", settings(code)))) == ["added"]


def test_a_file_that_is_still_being_written_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_session(tmp_path / "run.mcap", settings(code))
    monkeypatch.setattr("exograv.study.dataset.adding.sha256_of", lambda _: "ab" * 32)
    (outcome,) = add(folder, path)
    assert outcome.what == "refused"
    assert "still writing it" in outcome.sentence
    assert not list(folder.sources.rglob("*.mcap"))


def test_tables_that_were_lost_or_are_behind_are_made_again(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    add(folder, *(write_session(tmp_path / f"{k}.mcap", settings(code, session=k)) for k in (1, 2)))
    before = read_tables(folder)
    for name in ("touches", "sessions"):
        folder.table(name).unlink()
    assert current_tables(folder).touches.equals(before.touches)
    again = study_status(folder, everything=True)
    assert again.participants[0].sessions == {"training": (1, 2)}
    assert read_tables(folder).touches.equals(before.touches)


def test_a_source_that_was_changed_by_hand_is_remarked_when_all_is_made_anew(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    add(folder, write_session(tmp_path / "run.mcap", settings(code)))
    (placed,) = folder.sources.rglob("*.mcap")
    placed.write_bytes(placed.read_bytes()[:-20])
    assert "its hash differs" in str(study_status(folder, everything=True).remarks)


def test_two_commands_at_once_are_refused(tmp_path: Path):
    from exograv.study.folder.journal import alone

    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_session(tmp_path / "run.mcap", settings(code))
    with alone(folder), pytest.raises(ConfigError, match="Another exograv command"):
        add(folder, path)


def test_a_folder_that_is_no_study_says_how_to_begin_one(tmp_path: Path):
    with pytest.raises(ConfigError, match="study init"):
        add(StudyFolder(tmp_path), tmp_path / "run.mcap")
