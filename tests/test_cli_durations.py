"""Long commands state their usual duration from their options, and are never silent for long without a terminal."""

import ast
import inspect
import sys

import pytest
from tests.test_cli import exograv

from exograv.cli import ACTIONS, parsed
from exograv.cli.shell.durations import DURATIONS, duration_sentence, in_words
from exograv.cli.shell.progress import SILENT_MAX_S, Lines

OPEN_ENDED = {
    "run console", "data aircraft", "data view", "dev amplifier", "dev drive-sim", "dev stimulus", "dev sweep",
}  # fmt: skip
"""Commands that run until they are ended, or whose own plan states the costs."""

SHORT = {"next", "rigs", "rig new", "rig export", "study init", "study participant", "study identity"}

LONGER = {
    "demo": (["--seconds", "10"], ["--seconds", "600"]),
    "arm identify": (["--seconds", "60"], ["--seconds", "60", "--realtime"]),
    "doctor": ([], ["--loop", "30"]),
    "rig calibrate": (["--recheck"], []),
    "rig test": (["recupera_like", "--simulate"], ["recupera_like_7", "--simulate"]),
    "rig motion": (["--seconds", "10"], ["--seconds", "60"]),
    "run live": (["--seconds", "10"], ["--seconds", "10", "--identify", "60"]),
    "run train": (["--windows", "1"], ["--windows", "2"]),
    "run repeat": (["--repetitions", "1"], ["--repetitions", "9"]),
    "run mirror": (["--seconds", "10"], ["--seconds", "100"]),
    "study example": (["--participants", "1,1"], ["--participants", "9,9"]),
    "study power": (["--sd", "0.3", "--studies", "100"], ["--sd", "0.3", "--studies", "1000000"]),
    "study simulate": (["--processes", "4"], ["--processes", "1"]),
    "data streams": (["--record", "EEG", "--seconds", "5"], ["--record", "EEG", "--seconds", "9"]),
    "dev benchmark-identification": (["--levels", "2"], ["--levels", "1,2,3"]),
    "dev process-faults": (["--only", "control:kill:floating"], ["--cells", "all"]),
    "dev faults": (["--scenarios", "10"], ["--scenarios", "1000"]),
    "dev transparency": (["--machines", "1"], ["--machines", "5"]),
    "dev validate-participant": (["--people", "1"], ["--people", "6"]),
}


class FakeClock:
    """Clock that the test sets."""

    t = 0.0

    def __call__(self) -> float:
        return self.t


def test_every_command_is_short_or_open_ended_or_states_its_duration():
    assert set(DURATIONS) | OPEN_ENDED | SHORT == set(ACTIONS)
    assert not set(DURATIONS) & (OPEN_ENDED | SHORT)


@pytest.mark.parametrize("path", sorted(DURATIONS))
def test_every_command_with_a_duration_shows_its_progress(path: str):
    module = sys.modules[ACTIONS[path].__module__]
    calls = {one.func.id for one in ast.walk(ast.parse(inspect.getsource(module)))
             if isinstance(one, ast.Call) and isinstance(one.func, ast.Name)}  # fmt: skip
    assert "bars" in calls


@pytest.mark.parametrize("path", sorted(LONGER))
def test_more_work_is_expected_to_take_longer(path: str):
    less, more = (DURATIONS[path](parsed(path, words)) for words in LONGER[path])
    assert less is not None
    assert more is not None
    assert 0.0 < less < more


def test_a_larger_recording_is_expected_to_take_longer(tmp_path):
    (tmp_path / "a.mcap").write_bytes(bytes(1_000))
    (tmp_path / "b.mcap").write_bytes(bytes(30_000_000))
    sentences = [duration_sentence(path, parsed(path, [str(tmp_path / name)]))
                 for path in ("report", "data replay", "data sync") for name in ("a.mcap", "b.mcap")]  # fmt: skip
    assert [bool(sentence) for sentence in sentences] == [False, True] * 3


def test_the_example_study_is_expected_to_take_as_long_as_it_was_measured(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    measured_s = 120.0  # docs/howto/study.md, two cores
    expected_s = DURATIONS["study example"](parsed("study example", ["--participants", "6,0"]))
    assert expected_s is not None
    assert measured_s / 1.5 < expected_s < 1.5 * measured_s


@pytest.mark.parametrize(
    ("path", "words", "measured_s"),
    [
        ("rig test", ["recupera_like_7", "--simulate"], 85.0),
        ("rig calibrate", ["recupera_like_7", "--simulate"], 92.0),
        ("run live", ["recupera_like_7", "--simulate", "--identify", "20"], 107.0),
        ("run live", ["recupera_like", "--simulate", "--identify", "20"], 53.0),
        ("run support-level", [], 30.0),
    ],
)
def test_durations_on_simulated_drives_are_those_that_were_measured(path: str, words: list[str], measured_s: float):
    expected_s = DURATIONS[path](parsed(path, words))
    assert expected_s is not None
    assert measured_s / 1.2 < expected_s < 1.2 * measured_s


def test_a_machine_that_cannot_be_read_is_refused_by_the_command_and_not_by_its_duration(tmp_path):
    assert DURATIONS["rig test"](parsed("rig test", [str(tmp_path / "nothing"), "--simulate"]))


def test_a_file_that_vanishes_while_the_duration_is_estimated_ends_no_command(tmp_path, monkeypatch):
    monkeypatch.setattr("os.getloadavg", lambda: (0.0, 0.0, 0.0))
    (tmp_path / "a.mcap").write_bytes(bytes(30_000_000))
    alone = duration_sentence("report", parsed("report", [str(tmp_path)]))
    (tmp_path / "vanished.mcap").symlink_to(tmp_path / "nothing")  # listed, but without a size
    assert duration_sentence("report", parsed("report", [str(tmp_path)])) == alone != ""


def test_a_real_machine_sets_its_own_pace():
    assert duration_sentence("rig calibrate", parsed("rig calibrate", ["--drives", "d.toml"])) == ""
    assert "about" in duration_sentence("rig calibrate", parsed("rig calibrate", ["--drives", "d.toml", "--simulate"]))


@pytest.mark.parametrize(("load", "sentence"), [(0.2, ""), (1.9, ""), (7.0, "7.0): it may take 4 times as long.")])
def test_a_busy_computer_is_expected_to_take_longer(load: float, sentence: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr("os.getloadavg", lambda: (load, load, load))
    told = duration_sentence("demo", parsed("demo", []))
    assert told.partition("these options.")[2].endswith(sentence)
    assert ("busy" in told) is bool(sentence)


def test_durations_are_shown_in_a_unit_that_suits_them():
    assert [in_words(s) for s in (2.4, 90.0, 120.0, 600.0, 7200.0, 1e6)] == [
        "2 s", "90 s", "2.0 min", "10 min", "2.0 h", "12 days",
    ]  # fmt: skip


def test_a_long_phase_has_a_line_every_quarter_of_a_minute(capsys: pytest.CaptureFixture[str]):
    clock = FakeClock()
    lines = Lines("It takes long.", 0.0, clock)
    lines.show("Calibrating", 0.0)
    for clock.t in range(1, 61):
        lines.show("Calibrating", clock.t / 100)
        lines.look()
    shown = capsys.readouterr().err.splitlines()
    assert shown[:2] == ["It takes long.", "[    0 s] Calibrating"]
    assert shown[2:] == [f"[{t:5d} s] Calibrating, {t} %" for t in range(int(SILENT_MAX_S), 61, int(SILENT_MAX_S))]


def test_a_phase_that_follows_at_once_is_shown_when_it_lasts(capsys: pytest.CaptureFixture[str]):
    clock = FakeClock()
    lines = Lines("", 0.0, clock)
    lines.show("Reading", 0.0)
    lines.show("Drawing", 0.0)
    clock.t = 3.0
    lines.look()
    assert capsys.readouterr().err == "[    0 s] Reading\n[    3 s] Drawing\n"


def test_a_command_that_fails_at_once_shows_no_progress(capsys: pytest.CaptureFixture[str]):
    clock = FakeClock()
    lines = Lines("It takes long.", 2.0, clock)
    lines.show("Reading", 0.0)
    lines.look()
    assert capsys.readouterr().err == ""
    clock.t = 2.5
    lines.look()
    assert capsys.readouterr().err == "It takes long.\n[    2 s] Reading\n"


def test_a_flown_command_states_duration_and_phases_in_a_pipe(tmp_path):
    result = exograv("study", "power", "--sd", "0.35", "--n-max", "4", folder=tmp_path)
    assert result.returncode == 0
    assert "exograv study power usually takes about" in result.stderr
    assert "[    0 s] " in result.stderr
