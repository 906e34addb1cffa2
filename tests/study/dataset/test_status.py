"""The status names the sessions of each participant, missing sessions by study.toml, and problems."""

from pathlib import Path

import pytest
from tests.study.made_up_sessions import run_records, settings, study_with, write_session

from exograv.errors import ConfigError
from exograv.study.dataset.adding import add_files
from exograv.study.dataset.options import AddOptions
from exograv.study.dataset.status import in_words, study_status
from exograv.study.folder.settings import AS_PUBLISHED, read_settings


def test_what_is_missing_is_what_is_expected_of_the_group(tmp_path: Path):
    folder, codes = study_with(tmp_path / "study", "trained", "untrained", "sealed")
    add_files(folder, [write_session(tmp_path / "a.mcap", settings(codes[0], session=3))], AddOptions())
    trained, untrained, sealed = study_status(folder).participants
    assert trained.sessions == {"training": (3,)}
    assert trained.missing == {"training": (1, 2, *range(4, 17)), "flight": (1,)}
    assert untrained.missing == {"familiarisation": (1, 2, 3, 4), "flight": (1,)}
    assert sealed.missing == {"flight": (1,)}


def test_a_session_that_was_not_run_to_its_end_is_named(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    add_files(folder, [write_session(tmp_path / "a.mcap", settings(code), records=run_records()[:4])], AddOptions())
    assert study_status(folder).participants[0].incomplete == {"training": (1,)}


def test_a_refused_file_counts_once_and_until_it_comes_in(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = write_session(tmp_path / "a.mcap", settings("P-02"))
    for _ in range(2):
        add_files(folder, [path], AddOptions())
    assert study_status(folder).refused == 1
    add_files(folder, [path], AddOptions(new_code=(f"P-02={code}",)))
    assert study_status(folder).refused == 0


def test_numbers_are_told_as_runs():
    assert in_words((1, 2, 3, 5, 7, 8)) == "1–3, 5, 7–8"
    assert in_words(()) == ""


def test_settings_come_back_as_they_were_written(tmp_path: Path):
    folder, _ = study_with(tmp_path / "study")
    assert read_settings(folder) == AS_PUBLISHED


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('protocol = "flight"', 'protocl = "flight"', "protocl"),
        ('groups = ["trained"]', 'groups = ["drilled"]', "drilled"),
        ("schema_version = 1", "schema_version = 9", "schema_version"),
        ("[groups]", "[groups", "not valid TOML"),
    ],
)
def test_a_study_file_that_cannot_be_used_says_where(tmp_path: Path, old: str, new: str, said: str):
    folder, _ = study_with(tmp_path / "study")
    folder.settings.write_text(folder.settings.read_text().replace(old, new))
    with pytest.raises(ConfigError, match=said):
        read_settings(folder)
