"""Options of the person: a file may describe the person, and invalid values are refused with the allowed ones."""

from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.laboratory.support_level.person_file import weakness_of
from exograv.procedures.rehabilitation.support_level.options import SupportOptions


def person(tmp_path: Path, text: str) -> SupportOptions:
    path = tmp_path / "person.toml"
    path.write_text(text, encoding="utf-8")
    return SupportOptions(person_file=path)


def test_a_file_says_strength_by_freedom_and_synergy(tmp_path: Path):
    found = weakness_of(person(tmp_path, "strength = [0.1, 0.2, 0.3, 0.4]\nsynergy = 0.25\n"), 4)
    assert found.strength.tolist() == [0.1, 0.2, 0.3, 0.4]
    assert found.synergy == 0.25


def test_one_number_is_a_person_whose_freedoms_differ(tmp_path: Path):
    options = person(tmp_path, "strength = 0.1\n")
    assert len(set(weakness_of(options, 4).strength.tolist())) == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("strength = [0.1, 0.2]\n", "or 4 of them"),
        ("strength = 0.1\nheight = 1.7\n", "height"),
        ("synergy = 0.1\n", "strength"),
        ("strength = \n", "is not a valid TOML file"),
    ],
)
def test_files_that_describe_nobody_are_refused(tmp_path: Path, text: str, message: str):
    with pytest.raises(ConfigError, match=message):
        weakness_of(person(tmp_path, text), 4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"strength": 0.0}, "--strength is 0; allowed"),
        ({"synergy": 2.0}, "--synergy is 2"),
        ({"seed": -1}, "--seed is -1"),
        ({"level": 7}, "--level is 7"),
        ({"person_file": Path("p.toml"), "strength": 0.1}, "--person-file describes the whole person"),
    ],
)
def test_options_that_mean_nothing_are_refused(change: dict, message: str):
    with pytest.raises(ConfigError, match=message):
        SupportOptions(**change)
