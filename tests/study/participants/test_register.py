"""A study stores a code and bands of each participant, and no code twice."""

from pathlib import Path

import pytest
from tests.study.made_up_sessions import study_with

from exograv.errors import ConfigError
from exograv.study.dataset.making import current_tables
from exograv.study.dataset.unsealing import unseal
from exograv.study.participants.participant_record import band
from exograv.study.participants.register import new_participant, read_register
from exograv.task.allocation import Group, draw_list


def test_a_value_becomes_the_ten_that_it_lies_in():
    assert band("height", 178.4) == "170-179"
    assert band("age", 30.0) == "30-39"
    assert band("mass", None) is None


def test_what_no_person_has_is_refused_and_not_repeated():
    with pytest.raises(ConfigError, match=r"--mass is .* allowed: 15 to 250 kg, such as --mass 74") as refused:
        band("mass", 1234.5)
    assert "1234" not in str(refused.value)


def test_a_participant_comes_back_as_told(tmp_path: Path):
    folder, _ = study_with(tmp_path / "study")
    row = new_participant(folder, "trained", consent="v2", age_band="30-39", sex="f")
    assert read_register(folder) == (row,)
    assert current_tables(folder).participants["group"].tolist() == ["trained"]


def test_a_group_that_the_study_does_not_have_is_refused(tmp_path: Path):
    folder, _ = study_with(tmp_path / "study")
    with pytest.raises(ConfigError, match="trained, untrained"):
        new_participant(folder, "placebo")


def test_a_code_that_is_there_is_refused(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    with pytest.raises(ConfigError, match="two people with the same code"):
        new_participant(folder, "trained", code)


def test_two_of_one_code_in_the_file_are_refused(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    text = folder.participants.read_text()
    folder.participants.write_text(text + text[text.index("[[") :])
    with pytest.raises(ConfigError, match=f"two participants have the same code: {code}"):
        read_register(folder)


def test_a_sealed_group_is_na_until_the_list_opens_it(tmp_path: Path):
    folder, codes = study_with(tmp_path / "study", "sealed", "sealed")
    assert current_tables(folder).participants["group"].dropna().tolist() == []
    groups = [Group(name="trained", exo="active"), Group(name="untrained", exo="passive")]
    path = tmp_path / "list.json"
    path.write_text(draw_list("study", codes, groups, seed=1000).model_dump_json())
    assert sorted(unseal(folder, path)) == sorted(codes)
    assert sorted(current_tables(folder).participants["group"]) == ["trained", "untrained"]


def test_a_list_without_somebody_opens_nothing(tmp_path: Path):
    folder, codes = study_with(tmp_path / "study", "sealed", "sealed")
    path = tmp_path / "list.json"
    path.write_text(draw_list("study", codes[:1], [Group(name="trained", exo="active")], seed=1000).model_dump_json())
    with pytest.raises(ConfigError, match="no place"):
        unseal(folder, path)
    assert current_tables(folder).participants["group"].dropna().tolist() == []
