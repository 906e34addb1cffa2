"""Invalid options of a session are rejected before any motion. A part of a protocol is never mistaken for the whole."""

import json
from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.experiment.train.options import TrainOptions
from exograv.experiment.train.request import asked_for, read_allocation
from exograv.task.allocation import Group, draw_list
from exograv.task.protocol import first_windows, load_protocol
from exograv.task.schedule import timeline

GROUPS = (Group(name="trained", exo="active"), Group(name="untrained", exo="sham"))
CODES = ("P-01", "P-02", "P-03", "P-04")


@pytest.fixture
def allocation(tmp_path: Path) -> Path:
    path = tmp_path / "list.json"
    path.write_text(draw_list("study", CODES, GROUPS, seed=1).model_dump_json(), encoding="utf-8")
    return path


@pytest.mark.parametrize("code", ["anna", "Anna K 1", "", "P_01", "P-01/..", "x1", "P" * 17])
def test_what_may_be_a_name_or_no_file_name_is_no_code(code: str):
    with pytest.raises(ConfigError, match="--participant is"):
        TrainOptions(protocol="training", participant=code)


@pytest.mark.parametrize("code", ["P-01", "p7a", "12345", "a+1"])
def test_a_code_is_taken(code: str):
    assert code in TrainOptions(protocol="training", participant=code).name


def test_a_trial_of_some_windows_has_other_files_than_the_session_and_than_another_trial():
    names = {TrainOptions(protocol="training", participant="P-01", windows=windows).name for windows in (None, 1, 2)}
    assert names == {"P-01_training_01", "P-01_training-first-1_01", "P-01_training-first-2_01"}


@pytest.mark.parametrize(
    ("changes", "said"),
    [({"level": 5}, "--level is 5"), ({"session": 0}, "--session is 0"), ({"seed": -1}, "--seed is -1"),
     ({"verify_every": -1}, "--verify-every is -1"), ({"donning": 5000}, "--donning is 5000")],
)  # fmt: skip
def test_numbers_out_of_range_are_named_with_what_is_allowed(changes: dict, said: str):
    with pytest.raises(ConfigError, match=rf"{said}; allowed: \d"):
        TrainOptions(protocol="training", participant="P-01", **changes)


def test_an_unknown_protocol_is_answered_with_the_known_ones():
    with pytest.raises(ConfigError, match="familiarisation, flight, parabola, training"):
        asked_for(TrainOptions(protocol="trainings", participant="P-01"))


@pytest.mark.parametrize("count", [0, 32, -1])
def test_windows_that_a_protocol_has_not_are_refused(count: int):
    with pytest.raises(ConfigError, match="has 1 to 31"):
        asked_for(TrainOptions(protocol="training", participant="P-01", windows=count))


@pytest.mark.parametrize("count", [1, 2, 7, 30])
def test_the_first_windows_are_those_of_the_protocol_under_another_name(count: int):
    whole = load_protocol("training")
    part = first_windows(whole, count)
    assert part.settings.name != whole.settings.name
    assert "windows.count" in part.settings.unpublished
    assert part.sha256 == whole.sha256
    for number, window in timeline(part.settings).windows.items():
        assert window.start_s == pytest.approx(timeline(whole.settings).windows[number].start_s)


def test_all_windows_are_the_protocol_itself():
    whole = load_protocol("flight")
    assert first_windows(whole, 31) is whole


def test_a_group_says_what_the_machine_does_and_nothing_else_tells_it(allocation: Path):
    asked = [asked_for(TrainOptions(protocol="training", participant=code, allocation=allocation)) for code in CODES]
    assert sorted(one.exo for one in asked) == ["active", "active", "sham", "sham"]
    kept = [TrainOptions(protocol="training", participant=code, allocation=allocation).kept for code in CODES]
    assert not any(word in json.dumps(kept) for word in ("active", "sham", "trained", "untrained"))


def test_a_passive_protocol_stays_passive_in_every_group(allocation: Path):
    assert {
        asked_for(TrainOptions(protocol="flight", participant=code, allocation=allocation)).exo for code in CODES
    } == {"passive"}


def test_somebody_without_a_place_is_refused(allocation: Path):
    with pytest.raises(ConfigError, match="'P-09' has no place"):
        asked_for(TrainOptions(protocol="training", participant="P-09", allocation=allocation))


@pytest.mark.parametrize("content", ["", "{", "[]", '{"study": 3}', "\xff"])
def test_a_list_that_is_none_is_refused(tmp_path: Path, content: str):
    path = tmp_path / "list.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(ConfigError, match="is not an allocation list"):
        read_allocation(path)


def test_a_list_that_is_not_there_is_refused(tmp_path: Path):
    with pytest.raises(ConfigError, match="cannot be read"):
        read_allocation(tmp_path / "none.json")


def test_in_flight_the_passive_machine_is_taken_unless_another_is_named():
    assert asked_for(TrainOptions(protocol="flight", participant="P-01")).rig == "recupera_like_passive"
    assert asked_for(TrainOptions(protocol="flight", participant="P-01", rig="recupera_like")).rig == "recupera_like"
    assert asked_for(TrainOptions(protocol="training", participant="P-01")).rig == "recupera_like"
