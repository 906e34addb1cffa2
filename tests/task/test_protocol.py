"""The shipped protocols have the published values and mark all others. An invalid file is rejected."""

import json
from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.results import json_value
from exograv.task.levels import LEVELS
from exograv.task.protocol import FOLDER, load_protocol, protocol_names, refuse_levels
from exograv.task.published_values import PUBLISHED

SHIPPED = ("familiarisation", "flight", "parabola", "training")
TRAINING = (FOLDER / "training.toml").read_text(encoding="utf-8")


def changed(folder: Path, *changes: tuple[str, str], of: str = TRAINING) -> str:
    """Path of a copy of the training with these texts replaced."""
    for old, new in changes:
        assert old in of
        of = of.replace(old, new)
    path = folder / "own.toml"
    path.write_text(of, encoding="utf-8")
    return str(path)


def test_four_protocols_come_with_exograv():
    assert tuple(protocol_names()) == SHIPPED


@pytest.mark.parametrize("name", SHIPPED)
def test_a_window_has_22_seconds_for_8_touches_one_every_2_75_seconds(name: str):
    windows = load_protocol(name).settings.windows
    assert (windows.count, windows.duration_s, windows.touches) == (31, 22.0, 8)
    assert windows.interval_s == 2.75
    assert windows.count * windows.touches == 248


def test_there_are_16_active_trainings_and_4_passive_familiarisations_and_a_passive_flight():
    loaded = {name: load_protocol(name).settings for name in SHIPPED if name != "parabola"}
    assert {name: (one.sessions, one.exo) for name, one in loaded.items()} == {
        "training": (16, "active"),
        "familiarisation": (4, "passive"),
        "flight": (1, "passive"),
    }
    assert loaded["training"].windows.level_of(31).start == 0.0
    assert loaded["familiarisation"].windows.level_of(31).start == 1.0


def test_the_rests_of_a_training_differ_in_length():
    assert len(set(load_protocol("training").settings.rest_lengths_s)) > 1


@pytest.mark.parametrize("name", SHIPPED)
def test_every_value_is_either_published_or_marked_as_ours(name: str):
    settings = load_protocol(name).settings
    unmarked = {path for path in settings.leaves if not any(path.startswith(mark) for mark in settings.unpublished)}
    assert {path for path in unmarked if settings.leaves[path] is not None} <= set(PUBLISHED[settings.kind])


def test_the_marks_are_in_the_settings_that_go_into_a_recording():
    recorded = json_value(load_protocol("training").recorded)
    assert "pace.tolerance_s" in recorded["unpublished"]
    assert len(recorded["rest_lengths_s"]) == 30
    assert json.loads(json.dumps(recorded)) == recorded


def test_moon_and_mars_are_levels_by_name(tmp_path: Path):
    path = changed(
        tmp_path,
        ('levels = [{ window = 1, level = "weightless" }]',
         'levels = [{ window = 1, level = "moon" }, { window = 9, level = "mars", end_level = 0.5 }]'),
        ('"windows.first_number"', '"windows.levels", "windows.first_number"'),
    )  # fmt: skip
    windows = load_protocol(path).settings.windows
    assert [windows.level_of(k).start for k in (1, 8, 9, 31)] == [0.165, 0.165, 0.38, 0.38]
    assert windows.level_of(31).end == 0.5
    assert LEVELS["hyper"] == 1.8


REFUSED = {
    "negative rest": ("rest_s = 158.0", "rest_s = -3.0", "greater than 0"),
    "no number": ("rest_s = 158.0", "rest_s = nan", "finite"),
    "infinite": ("before_first_s = 35.0", "before_first_s = inf", "before_first_s"),
    "no room for ramps": ("rest_s = 158.0", "rest_s = 8.0", "is too short for"),
    "huge": ("count = 31", "count = 100000000", "windows.count"),
    "text": ("touches = 8", 'touches = "eight"', "windows.touches"),
    "unknown key": ("count = 31", "count = 31\nwindow_s = 3", "window_s"),
    "unknown table": ('rests = "sets_of_five"', 'rests = "mine"', "sets_of_five"),
    "rest after the last": ("after_window = 26", "after_window = 31", "comes after 1 to 30"),
    "two rests after one": ("after_window = 26", "after_window = 21", "same window"),
    "too fast a ramp": ("duration_s = 5.0", "duration_s = 1.0", "ramps.duration_s longer"),
    "value changed, still called published": ("count = 31", "count = 30", "the published value is 31"),
    "unmarked choice": ('"pace.tolerance_s", ', "", "pace.tolerance_s"),
    "mark of nothing": ('"target", ', '"target", "targte", ', "targte"),
    "active in an aircraft": ('opening = "clock"', 'opening = "aircraft"', "needs opening 'clock'"),
    "colours alone": ('{ shape = "up", colour = "green" }', '{ shape = "down", colour = "green" }', "three different"),
    "levels out of order": (
        'levels = [{ window = 1, level = "weightless" }]',
        'levels = [{ window = 1, level = 0.0 }, { window = 1, level = 1.0 }]',
        "rising",
    ),
    "tolerance of a whole interval": ("tolerance_s = 0.5", "tolerance_s = 2.75", "below 2.75"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_a_protocol_that_cannot_be_is_refused_with_place_and_next_step(case: str, tmp_path: Path):
    old, new, expected = REFUSED[case]
    with pytest.raises(ConfigError, match=r"own\.toml.*Correct it there") as refusal:
        load_protocol(changed(tmp_path, (old, new)))
    assert expected in str(refusal.value)


def test_a_file_of_each_rest_must_have_as_many_as_there_are(tmp_path: Path):
    each = "rest_s = 158.0\n\n# The same"
    path = changed(tmp_path, (each, "each_s = [20.0, 30.0]\n\n# The same"))
    with pytest.raises(ConfigError, match="31 windows need 30"):
        load_protocol(path)


@pytest.mark.parametrize("content", [b"\x00\xff\xfe" * 50, b"[windows", b"", b"a=" + b"[" * 5000])
def test_a_file_that_is_no_protocol_is_refused(content: bytes, tmp_path: Path):
    (tmp_path / "own.toml").write_bytes(content)
    with pytest.raises(ConfigError, match="Correct it there"):
        load_protocol(str(tmp_path / "own.toml"))


def test_a_huge_file_is_refused_unread(tmp_path: Path):
    (tmp_path / "own.toml").write_bytes(b"#" * 300_000)
    with pytest.raises(ConfigError, match="at most 200000"):
        load_protocol(str(tmp_path / "own.toml"))


def test_a_mistyped_name_is_told_which_there_are():
    with pytest.raises(ConfigError, match=r"Did you mean 'training'\? Known: familiarisation, flight, parabola, tr"):
        load_protocol("trainign")


def test_a_protocol_may_state_a_level_that_this_machine_refuses(tmp_path: Path):
    path = changed(
        tmp_path, ('level = "weightless"', 'level = "hyper"'), ('"target", ', '"target", "windows.levels", ')
    )
    settings = load_protocol(path).settings
    refuse_levels(settings, level_max=1.8)
    with pytest.raises(ConfigError, match=r"gravity level 1\.8 from window 1 on.*pushes the arm down"):
        refuse_levels(settings, level_max=1.0)
    refuse_levels(load_protocol("flight").settings, level_max=1.0)


def test_a_pull_up_on_the_ground_has_time_for_the_machine_s_ramps(tmp_path: Path):
    text = (FOLDER / "parabola.toml").read_text(encoding="utf-8")
    path = tmp_path / "own.toml"
    path.write_text(text.replace("duration_s = 20.0", "duration_s = 2.9"), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"\[hypergravity\] lasts 12\.9 s with its ramps.* take 13 s"):
        load_protocol(str(path))
    with pytest.raises(ConfigError, match=r"gravity level 1\.8 from window 1 on.*pushes the arm down"):
        refuse_levels(load_protocol("parabola").settings, level_max=1.0)
