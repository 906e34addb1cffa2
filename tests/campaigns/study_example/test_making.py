"""The example is a study like any other, and its seed gives the same study again."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.preloaded import exograv

from exograv.campaigns.study_example.example_study import make_example
from exograv.campaigns.study_example.options import ExampleOptions
from exograv.campaigns.study_example.session_file import STAY_S
from exograv.errors import ConfigError
from exograv.recording import Recording, read_recording
from exograv.study.dataset.tables import Tables, read_tables
from exograv.study.folder.study_folder import StudyFolder

SEED = 1001
OPTIONS = ExampleOptions((1, 0), (1, 0), SEED)


def told(_text: str, _share: float) -> None:
    pass


@pytest.fixture(scope="module")
def study(prepare_once: Callable[..., Path]) -> tuple[Path, Tables]:
    words = ("study", "example", "--participants", "1,0", "--sessions", "1,0", "--seed", str(SEED))

    def prepare(folder: Path) -> None:
        exograv(*words, "--out", str(folder / "study"), check=True)

    path = prepare_once(words, prepare) / "study"
    return path, read_tables(StudyFolder(path))


def recording_of(path: Path, tables: Tables, protocol: str) -> Recording:
    by_protocol = dict(zip(tables.sessions["protocol"], tables.sessions["source"], strict=True))
    return read_recording(path / by_protocol[protocol])


@pytest.mark.long
def test_every_session_is_whole_and_is_called_simulated(study: tuple[Path, Tables]):
    sessions = study[1].sessions
    assert len(sessions) == 2
    assert all(sessions["is_simulated"])
    assert all(sessions["is_complete"])
    assert set(sessions["windows_complete"]) == {31}
    assert sorted(sessions["protocol"]) == ["flight", "training"]
    assert set(sessions["ticks_lost"]) == set(sessions["clock_jumps"]) == {0}


@pytest.mark.long
def test_about_eight_touches_of_each_window_count_and_no_touch_is_lost(study: tuple[Path, Tables]):
    windows, touches = study[1].windows, study[1].touches
    assert np.median(windows["touches"]) in (7, 8)
    assert sum(windows["touches"]) == sum(touches["is_accepted"])
    keys = list(zip(*(touches[name] for name in ("participant", "protocol", "session", "sequence")), strict=True))
    assert len(set(keys)) == len(keys)


@pytest.mark.long
def test_the_arm_is_at_the_screen_when_it_is_touched_and_at_rest_between_windows(study: tuple[Path, Tables]):
    path, tables = study
    recording = recording_of(path, tables, "training")
    touched = [
        t for t, name in zip(tables.touches["t_s"], tables.touches["protocol"], strict=True) if name == "training"
    ]
    t, q = recording.ticks["t"], recording.ticks["q_measured"]
    at = q[np.searchsorted(t, touched)]
    apart = np.abs(at - q[0]).max(axis=1)
    assert apart.min() > 0.5
    assert np.abs(q[np.searchsorted(t, 20.0)] - q[0]).max() < 1e-3
    assert STAY_S > 0.08, "a touch is reported after 80 ms"


@pytest.mark.long
def test_the_machine_carries_the_arm_where_the_protocol_is_active_only(study: tuple[Path, Tables]):
    path, tables = study
    for protocol in ("training", "flight"):
        ticks = recording_of(path, tables, protocol).ticks
        assert (np.abs(ticks["tau_commanded"]).max() > 1.0) == (protocol == "training")


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
    [((0, 0), (1, 1), "at least one"), ((-1, 2), (1, 1), "--participants"), ((1, 1), (1, 100), "--sessions")],
)
def test_what_is_no_study_is_refused(people: tuple[int, int], sessions: tuple[int, int], said: str):
    with pytest.raises(ConfigError, match=said):
        ExampleOptions(people, sessions, SEED)


def test_a_folder_with_something_in_it_is_left_as_it_is(tmp_path: Path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(ConfigError):
        make_example(OPTIONS, tmp_path, told, workers=1)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
