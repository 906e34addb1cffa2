"""The example is a study like any other, and the same again from its seed."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.recording import read_recording
from exograv.session.study_example.making import ExampleOptions, make_example
from exograv.session.study_example.session_file import STAY_S
from exograv.study.dataset.folder import StudyFolder
from exograv.study.dataset.tables import Tables, read_tables

SEED = 1001
OPTIONS = ExampleOptions((1, 0), (1, 0), SEED)


def told(_text: str, _share: float) -> None:
    pass


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Tables]:
    # A process of its own: checked shapes would make it many times slower.
    path = tmp_path_factory.mktemp("example") / "study"
    words = ["--participants", "1,0", "--sessions", "1,0", "--seed", str(SEED), "--out", str(path)]
    subprocess.run([sys.executable, "-m", "exograv.cli", "study", "example", *words], check=True, capture_output=True)
    return path, read_tables(StudyFolder(path))


def test_every_session_is_whole_and_is_called_simulated(study: tuple[Path, Tables]):
    sessions = study[1].sessions
    assert len(sessions) == 2
    assert sessions["is_simulated"].all()
    assert sessions["is_complete"].all()
    assert set(sessions["windows_complete"]) == {31}
    assert sorted(sessions["protocol"]) == ["flight", "training"]
    assert (sessions["ticks_lost"].fillna(0) == 0).all()
    assert (sessions["clock_jumps"] == 0).all()


def test_about_eight_touches_of_each_window_count_and_no_touch_is_lost(study: tuple[Path, Tables]):
    windows, touches = study[1].windows, study[1].touches
    assert windows["touches"].median() in (7, 8)
    assert windows["touches"].sum() == touches["is_accepted"].sum()
    assert not touches.duplicated(["participant", "protocol", "session", "page", "sequence"]).any()


def test_the_arm_is_at_the_screen_when_it_is_touched_and_at_rest_between_windows(study: tuple[Path, Tables]):
    path, tables = study
    source = tables.sessions[tables.sessions["protocol"] == "training"].iloc[0]
    recording = read_recording(path / source["source"])
    touches = tables.touches[tables.touches["protocol"] == "training"]
    t, q = recording.ticks["t"], recording.ticks["q_measured"]
    at = q[np.searchsorted(t, touches["t_s"].to_numpy(float))]
    apart = np.abs(at - q[0]).max(axis=1)
    assert apart.min() > 0.5
    assert np.abs(q[np.searchsorted(t, 20.0)] - q[0]).max() < 1e-3
    assert STAY_S > 0.08, "a touch is reported that late"


def test_the_machine_carries_the_arm_where_the_protocol_is_active_only(study: tuple[Path, Tables]):
    path, tables = study
    for _, source in tables.sessions.iterrows():
        ticks = read_recording(path / source["source"]).ticks
        is_active = source["protocol"] == "training"
        assert (np.abs(ticks["tau_commanded"]).max() > 1.0) == is_active


@pytest.mark.slow
def test_the_same_seed_gives_the_same_study_on_any_number_of_processors(tmp_path: Path):
    one, two = (
        read_tables(make_example(ExampleOptions((1, 1), (1, 1), SEED), tmp_path / str(n), told, workers=n))
        for n in (1, 2)
    )
    for name in ("touches", "windows", "participants", "sessions"):
        assert getattr(one, name).equals(getattr(two, name)), name


@pytest.mark.parametrize(
    ("people", "sessions", "said"),
    [((0, 0), (1, 1), "somebody"), ((-1, 2), (1, 1), "--participants"), ((1, 1), (1, 100), "--sessions")],
)
def test_what_is_no_study_is_refused(people: tuple[int, int], sessions: tuple[int, int], said: str):
    with pytest.raises(ConfigError, match=said):
        ExampleOptions(people, sessions, SEED)


def test_a_folder_with_something_in_it_is_left_as_it_is(tmp_path: Path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(ConfigError):
        make_example(OPTIONS, tmp_path, told, workers=1)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
