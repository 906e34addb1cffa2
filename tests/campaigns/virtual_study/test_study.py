"""The folder of a study has the expected sessions, and unusable folders are refused in a sentence."""

import json
from dataclasses import asdict
from pathlib import Path

import pytest
from tests.campaigns.virtual_study.made_up_flights import flight

from exograv.campaigns.virtual_study.careers import careers
from exograv.campaigns.virtual_study.checkpoint import CAREER_FILE, CareerJob, lived_of
from exograv.campaigns.virtual_study.options import StudyOptions
from exograv.campaigns.virtual_study.out_folder import CAREERS, SETTINGS, out_folder, settings_of_study
from exograv.campaigns.virtual_study.participants import ParticipantResult
from exograv.campaigns.virtual_study.study import StudyComputation, simulate_study
from exograv.errors import ConfigError, RecordingError


def begin(folder: Path, resume: bool = False) -> None:
    simulate_study(StudyOptions(), StudyComputation(1, resume, folder=folder), lambda _text, _share: None)


def test_a_file_in_place_of_the_folder_is_refused(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="a file"):
        begin(tmp_path / "file")


def test_a_folder_of_something_else_is_not_offered_for_resuming(tmp_path: Path):
    (tmp_path / CAREERS).mkdir()
    with pytest.raises(ConfigError, match=r"not empty\. Give another --out"):
        begin(tmp_path)
    with pytest.raises(ConfigError, match=r"nothing to resume.*another --out"):
        begin(tmp_path, resume=True)


def test_two_commands_at_once_in_one_folder_are_one_too_many(tmp_path: Path):
    options = StudyOptions()
    is_refused = pytest.raises(ConfigError, match="Another exograv study simulate")
    with out_folder(tmp_path / "s", options, (), resume=False), is_refused:
        begin(tmp_path / "s", resume=True)
    with out_folder(tmp_path / "s", options, (), resume=True) as study:
        assert study.path.is_dir()


def test_settings_that_are_no_text_are_those_of_another_study(tmp_path: Path):
    (tmp_path / SETTINGS).write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match="other options"):
        begin(tmp_path, resume=True)


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match=r"file.*Give another --out"):
        begin(tmp_path / "file" / "s")


def test_a_career_in_whose_place_a_folder_is_is_named(tmp_path: Path):
    with pytest.raises(RecordingError, match=r"cannot be read"):
        CAREER_FILE.find(tmp_path)


def test_nothing_is_flown_that_is_kept(tmp_path: Path):
    files = [tmp_path / "V00-ideal.json", tmp_path / "V00-familiarised.json"]
    one = ParticipantResult((flight(1, "ideal"),), (), {"flights": 1.0}, 2.0)
    for file in files:
        file.write_text(json.dumps(asdict(one)), encoding="utf-8")
    everybody = careers(StudyOptions((1, 0), conditions=("ideal",)), ("V",))
    jobs = [CareerJob(career, StudyOptions(), file) for career, file in zip(everybody, files, strict=False)]
    # A simulation of either career would take minutes, and would need a folder that does not exist.
    assert lived_of(jobs, tmp_path / "nowhere", 1, lambda _share: None) == [one, one]


@pytest.mark.parametrize("text", ["", "{", "{}", "[]", '{"flights": [{}]}'])
def test_a_career_that_cannot_be_read_is_named(tmp_path: Path, text: str):
    path = tmp_path / "V00-dam.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"V00-dam\.json.*Delete this file"):
        CAREER_FILE.find(path)


def test_without_sessions_flights_are_all_that_is_expected():
    expected = settings_of_study(StudyOptions(sessions=(0, 0))).expected
    assert [(one.protocol, one.groups) for one in expected] == [("flight", [])]
