"""A study's folder: what is expected in it, and what of it is refused in a sentence."""

from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.session.virtual_study.options import StudyOptions
from exograv.session.virtual_study.study import CAREERS, Work, _read, _settings_of_study, simulate_study


def begin(folder: Path, resume: bool = False) -> None:
    simulate_study(StudyOptions(), Work(folder, 1, resume), lambda _text, _share: None)


def test_a_file_in_place_of_the_folder_is_refused(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="a file"):
        begin(tmp_path / "file")


def test_a_folder_of_something_else_is_not_offered_for_resuming(tmp_path: Path):
    (tmp_path / CAREERS).mkdir()
    with pytest.raises(ConfigError, match=r"not empty\. Give another --out"):
        begin(tmp_path)
    with pytest.raises(ConfigError, match=r"nothing to go on with.*another --out"):
        begin(tmp_path, resume=True)


@pytest.mark.parametrize("text", ["", "{", "{}", "[]", '{"flights": [{}]}'])
def test_a_career_that_cannot_be_read_is_named(tmp_path: Path, text: str):
    path = tmp_path / "V00-dam.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"V00-dam\.json.*Delete this file"):
        _read(path)


def test_without_sessions_flights_are_all_that_is_expected():
    expected = _settings_of_study(StudyOptions(sessions=(0, 0))).expected
    assert [(one.protocol, one.groups) for one in expected] == [("flight", [])]
