"""The commands of `exograv study` work as described, and report their figures for scripts."""

import contextlib
import shutil
from pathlib import Path

import pytest
from tests.study.made_up_sessions import settings, write_session

from exograv.cli.study.add import Files, run_add
from exograv.cli.study.identity import Identity, run_identity
from exograv.cli.study.init import Init, run_init
from exograv.cli.study.participant import Participant, run_participant
from exograv.cli.study.showing import show_status
from exograv.cli.study.status import Status, run_status
from exograv.errors import ConfigError
from exograv.study.dataset.options import AddOptions
from exograv.study.dataset.status import PersonStatus, StudyStatus
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.codes import is_code
from exograv.study.participants.identities import changed_identities, write_identities
from exograv.study.participants.register import read_register


@pytest.fixture(autouse=True)
def cheap_guesses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Derive keys in milliseconds; test_identities.py has a file with the cost of the product."""
    monkeypatch.setattr(write_identities, "__defaults__", (2**10,))


@pytest.fixture
def study(tmp_path: Path) -> Path:
    run_init(Init(study=tmp_path / "study", name="Trial"))
    return tmp_path / "study"


def new(study: Path, **told) -> str:
    return run_participant(Participant(study=study, action="new", group="trained", **told))["participant"]


def test_a_study_begins_where_nothing_is(study: Path):
    assert run_status(Status(study=study)).name == "Trial"
    with pytest.raises(ConfigError, match="not an empty folder"):
        run_init(Init(study=study))


def test_a_new_participant_is_a_code_and_bands(study: Path):
    code = new(study, age=34.0, height=178.0, mass=74.4, sex="f", hand="left")
    (row,) = read_register(StudyFolder(study))
    assert is_code(code)
    assert (row.age_band, row.height_band_cm, row.mass_band_kg) == ("30-39", "170-179", "70-79")
    assert run_participant(Participant(study=study))["participants"][0]["code"] == code


def test_adding_says_what_became_of_each_file(study: Path, tmp_path: Path):
    code = new(study)
    write_session(tmp_path / "in" / "a.mcap", settings(code))
    write_session(tmp_path / "in" / "b.mcap", settings("P-02"))
    found = run_add(Files(study=study, files=(tmp_path / "in",)), AddOptions())
    assert found["counts"] == {"added": 1, "refused": 1}
    assert not found["ok"]
    again = run_add(Files(study=study, files=(tmp_path / "in",)), AddOptions(session=2, new_code=(f"P-02={code}",)))
    assert again["counts"] == {"already there": 1, "added": 1}
    assert again["ok"]
    (person,) = run_status(Status(study=study)).participants
    assert person.sessions == {"training": (1, 2)}
    assert person.touches == 6


def test_a_file_of_another_kind_alone_is_ignored_with_the_kinds_that_can_be_added(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "notes.md").write_text("notes")
    assert run_add(Files(study=study, files=(tmp_path / "notes.md",)), AddOptions())["counts"] == {"ignored": 1}
    assert "Only .mcap" in capsys.readouterr().out


def test_nothing_to_add_and_a_mapping_of_nothing_are_refused(study: Path, tmp_path: Path):
    with pytest.raises(ConfigError, match="No file was named"):
        run_add(Files(study=study), AddOptions())
    with pytest.raises(ConfigError, match="OLD=CODE"):
        run_add(Files(study=study, files=(tmp_path,)), AddOptions(new_code=("P-02",)))
    with pytest.raises(ConfigError, match="cannot be read"):
        run_add(Files(study=study, files=(tmp_path,)), AddOptions(mapping=tmp_path / "none.toml"))


def test_nobody_is_erased_without_the_code_typed_twice(study: Path, monkeypatch: pytest.MonkeyPatch):
    code = new(study)
    with pytest.raises(ConfigError, match="--confirm CODE"):
        run_participant(Participant(study=study, action="erase", code=code))
    with pytest.raises(ConfigError, match="Nothing was erased"):
        run_participant(Participant(study=study, action="erase", code=code, confirm="yes"))
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("builtins.input", lambda _: code.lower())
    assert run_participant(Participant(study=study, action="erase", code=code))["ok"]
    assert read_register(StudyFolder(study)) == ()


def test_identities_need_a_passphrase_and_stand_beside_the_study(study: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("EXOGRAV_IDENTITIES_PASSPHRASE", raising=False)
    with pytest.raises(ConfigError, match="No passphrase"):
        run_identity(Identity(study=study))
    key = study.with_name("key")
    key.write_text("a long enough passphrase\n")
    with pytest.raises(ConfigError, match="cannot be read"):
        run_identity(Identity(study=study, key_file=key))
    code = new(study)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("builtins.input", lambda prompt: "Somebody" if prompt == "name: " else "")
    run_identity(Identity(study=study, action="add", code=code, key_file=key))
    assert study.with_suffix(".identities").is_file()
    assert run_identity(Identity(study=study, key_file=key))["codes"] == [code]
    run_identity(Identity(study=study, action="remove", code=code, key_file=key))
    assert run_identity(Identity(study=study, key_file=key))["codes"] == []


def test_the_status_of_an_empty_study_says_how_to_add_a_participant(capsys: pytest.CaptureFixture[str]):
    show_status(StudyStatus("Trial", False, False, (), 0, 0, {}, {}, 0))
    assert "no participant yet. Add one: exograv study participant STUDY new" in capsys.readouterr().out


@pytest.mark.parametrize("columns", [80, 40])
def test_no_heading_and_no_code_of_the_status_is_cut_off(columns: int, monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.setenv("COLUMNS", str(columns))
    done, missing = {"familiarisation": (1, 2), "training": (1, 2), "flight": (1,)}, {"training": tuple(range(3, 17))}
    people = [PersonStatus(code, "untrained", 741, done, missing, {}) for code in ("R7CL9WT", "X4MF3LH")]
    show_status(StudyStatus("Trial", True, False, tuple(people), 10, 28, {}, {}, 0))
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= columns
    assert "…" not in shown
    if columns == 80:
        for word in ("participant", "familiarisation", "training", "flight", "missing", "touches", "R7CL9WT", "3–16"):
            assert word in shown


@pytest.fixture
def key(study: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("builtins.input", lambda prompt: "Somebody" if prompt == "name: " else "")
    path = study.with_name("key")
    path.write_text("a long enough passphrase\n")
    return path


def test_an_identity_that_is_added_while_another_is_typed_is_not_lost(
    study: Path, key: Path, monkeypatch: pytest.MonkeyPatch
):
    slow, fast = new(study), new(study)
    asked: list[str] = []

    def typed(prompt: str) -> str:
        asked.append(prompt)
        if len(asked) == 1:
            run_identity(Identity(study=study, action="add", code=fast, key_file=key))
        return "Somebody" if prompt == "name: " else ""

    monkeypatch.setattr("builtins.input", typed)
    run_identity(Identity(study=study, action="add", code=slow, key_file=key))
    assert run_identity(Identity(study=study, key_file=key))["codes"] == sorted([slow, fast])


def test_two_changes_of_the_identities_at_once_are_refused(tmp_path: Path):
    path, passphrase = tmp_path / "study.identities", "a long enough passphrase"
    with contextlib.ExitStack() as stack:
        stack.enter_context(changed_identities(path, passphrase))
        with pytest.raises(ConfigError, match="Another exograv command"):
            stack.enter_context(changed_identities(path, passphrase))


def test_studies_whose_names_differ_after_a_point_have_identities_of_their_own(study: Path, key: Path):
    for name in ("flight.2026", "flight.2027"):
        shutil.copytree(study, study.with_name(name))
        code = new(study.with_name(name))
        run_identity(Identity(study=study.with_name(name), action="add", code=code, key_file=key))
        assert run_identity(Identity(study=study.with_name(name), key_file=key))["codes"] == [code]
