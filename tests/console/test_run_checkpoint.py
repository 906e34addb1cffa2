"""A new console resumes the run of a killed one at the window that was open, without loss of earlier touches."""

import json
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest
from tests.task.of_run import SCREEN, short_plan, touch

from exograv.cli.person.console import TrialOptions, run_console_command
from exograv.cli.shell.base_options import OutFolder
from exograv.console.event_log import EventLog
from exograv.console.options import Address
from exograv.console.page_clocks import PageClocks
from exograv.console.run import ConsoleResult
from exograv.console.run_checkpoint import RunCheckpoint, RunContext, kept_run
from exograv.console.trial import ProtocolTrial
from exograv.console.trial_request import TrialRequest
from exograv.errors import ConfigError, RecordingError, RigError
from exograv.experiment.steered.options import SteeredOptions
from exograv.experiment.steered.view_models import RestLearning
from exograv.live.options import PersonForm
from exograv.storage.rests_so_far import RestsSoFar
from exograv.storage.session_checkpoint import checkpoint_path
from exograv.task.events import Resume, Start, Stop, Tick
from exograv.task.run import TaskRun

from .fake_desk import FakeDesk
from .of_process import Page, console, short_file

Begun = Callable[..., ProtocolTrial]


def kept(folder: Path, resumes: bool = False, session: int = 1, participant: str | None = "P-07"):
    return kept_run(folder, "training", participant, session, "recupera_like", resumes)


@pytest.fixture
def trial() -> Iterator[Begun]:
    """Function that builds a trial as a console does; the checkpoint is closed at the end."""
    with ExitStack() as stack:

        def begun(folder: Path, number: int, resumes: bool = False) -> ProtocolTrial:
            diary = stack.enter_context(closing(EventLog(folder / f"{number}.jsonl", lambda *_: None)))
            file = kept(folder, resumes)
            assert file is not None
            stack.callback(file.close)
            return ProtocolTrial(short_plan(screen=SCREEN), PageClocks(), diary, file)

        yield begun


def closed(trial: ProtocolTrial) -> None:
    assert trial._kept is not None
    trial._kept.close()


def test_no_state_is_stored_before_its_records_are_on_the_disk(tmp_path: Path):
    file = kept(tmp_path)
    assert file is not None

    def refuse() -> None:
        raise RecordingError("The diary is full.")

    file.sync_before = refuse
    file.keep("{}", 1.0, RunContext())
    file.close()
    assert not file.path.exists()
    assert file.why == "The diary is full."


def test_what_was_kept_comes_back_with_its_touches_side_and_screen(tmp_path: Path, trial: Begun):
    first = trial(tmp_path, 1)
    first.side = "left"
    first.run.feed(Start(t=100.0))
    first.run.feed(Tick(t=140.0))
    first.run.feed(touch(140.0, 0))
    first.run.feed(Tick(t=151.0))
    closed(first)
    again = trial(tmp_path, 2, resumes=True)
    assert again.run.state == first.run.state
    assert again.run.state.touches == 1
    assert (again.side, again.plan.screen) == ("left", SCREEN)


def test_a_resumed_run_knows_its_rests_before_the_machine_shows_any(tmp_path: Path, trial: Begun):
    first, desk = trial(tmp_path, 1), FakeDesk(lambda: 100.0)
    first.run.feed(Start(t=100.0))
    desk.rests = RestLearning(is_active=False, rests=2, left_out=1, motion_s=10.0)
    first.tick(101.0, desk.shown())
    desk.rests = None
    first.tick(112.0, desk.shown())
    closed(first)
    before = RestsSoFar(rests=2, left_out=1, motion_s=10.0)
    again = trial(tmp_path, 2, resumes=True)
    again.tick(113.0, desk.shown())
    again.run.feed(Resume(t=114.0))
    closed(again)
    last = kept(tmp_path, resumes=True)
    assert last is not None
    last.close()
    assert last.circumstances.rests == before


def test_a_console_that_resumes_a_run_gives_its_rests_to_the_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    file, given = kept(tmp_path), list[RestsSoFar]()
    assert file is not None
    file.keep(TaskRun(short_plan(screen=SCREEN)).kept(), 1.0, RunContext(rests=RestsSoFar(3)))
    file.close()

    def flight(options: SteeredOptions, *_: object) -> None:
        given.append(options.rests)
        raise RigError("There is no machine here.")

    monkeypatch.setattr("exograv.api.rig_factory.steered_flight", flight)
    options, trial = SteeredOptions(participant="P-07"), TrialOptions(protocol="training", resume=True)
    with pytest.raises(RigError):
        run_console_command(options, PersonForm(), trial, Address(), OutFolder(out=tmp_path))
    assert given == [RestsSoFar(3)]


def test_a_simulated_session_or_rehearsal_of_the_same_name_does_not_block_a_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    checkpoint_path(tmp_path, "P-07_training_01", is_simulated=True).write_text("{}")
    begun = list[tuple[Path, RunCheckpoint]]()

    def noted(_address: Address, folder: Path, _desk: object, request: TrialRequest, _say: object):
        kept = request.checkpoint()
        assert kept is not None
        kept.path.write_text("{}")
        begun.append((folder, kept))
        return ConsoleResult(folder / "diary", {}, None)

    monkeypatch.setattr("exograv.console.run.run_console", noted)
    trial = TrialOptions(protocol="training", rehearse=True)
    run_console_command(SteeredOptions(participant="P-07"), PersonForm(), trial, Address(), OutFolder(out=tmp_path))
    assert begun[0][0] == tmp_path / "rehearsal"
    session = kept(tmp_path)
    assert session is not None
    for one in (begun[0][1], session):
        one.close()


def test_a_run_that_has_not_begun_leaves_no_file_and_one_that_has_is_not_written_over(tmp_path: Path, trial: Begun):
    first = trial(tmp_path, 1)
    first.run.feed(Tick(t=100.0))
    closed(first)
    assert not list(tmp_path.glob("*.run.json"))
    again = trial(tmp_path, 2)
    again.run.feed(Start(t=100.0))
    closed(again)
    with pytest.raises(ConfigError, match="--resume"):
        kept(tmp_path)
    assert kept(tmp_path, session=2) is not None


def test_it_is_kept_every_ten_seconds_whatever_happens(tmp_path: Path, trial: Begun, monkeypatch: pytest.MonkeyPatch):
    begun, times = trial(tmp_path, 1), list[float]()
    assert begun._kept is not None
    monkeypatch.setattr(begun._kept, "keep", lambda _run, t, _circumstances: times.append(t))
    begun.run.feed(Start(t=100.0))
    begun.run.feed(Tick(t=109.9))
    assert times == [100.0]
    begun.run.feed(Tick(t=110.1))
    assert times == [100.0, 110.1]
    closed(begun)


def test_a_run_that_is_over_or_of_somebody_else_is_not_gone_on_with(tmp_path: Path, trial: Begun):
    first = trial(tmp_path, 1)
    first.run.feed(Start(t=100.0))
    first.run.feed(Stop(t=101.0))
    closed(first)
    with pytest.raises(ConfigError, match="is over"):
        trial(tmp_path, 2, resumes=True)
    with pytest.raises(ConfigError, match="no run to go on with"):
        kept(tmp_path, resumes=True, participant="P-08")
    with pytest.raises(ConfigError, match="needs --protocol"):
        kept_run(tmp_path, None, None, 1, "recupera_like", resumes=True)


def test_a_place_that_cannot_be_written_is_an_alarm_and_no_end(tmp_path: Path, trial: Begun):
    folder = tmp_path / "out"
    folder.mkdir()
    begun = trial(folder, 1)
    assert begun._kept is not None
    begun._kept.path = folder / "missing" / "x.run.json"
    begun.run.feed(Start(t=100.0))
    closed(begun)
    assert "cannot be written" in begun.why_not_kept


@pytest.mark.slow
def test_a_console_that_was_killed_in_a_window_goes_on_there(tmp_path: Path):
    options = ("--rehearse", "--protocol", short_file(tmp_path), "--out", tmp_path)
    with (
        console(*options) as (process, link),
        Page(link) as operator,
        Page(operator.ask_link("participant")) as participant,
    ):
        assert operator.run("start")["taken"]
        for window in (1, 2):
            operator.until(lambda w=window: operator.window == w)
            participant.touch(window)
            operator.until(lambda w=window: operator.run_shown["totals"]["accepted"] == w)
        os.kill(process.pid, signal.SIGKILL)
    with console(*options, "--resume") as (_, link), Page(link) as operator:
        operator.until(lambda: operator.run_shown["status"] == "paused")
        assert operator.run_shown["totals"]["accepted"] == 2
        assert [window["is_complete"] for window in operator.run_shown["windows"]] == [True, False]
        assert operator.run("resume")["taken"]
        operator.until(lambda: operator.window == 2)
        attempts = [(window["number"], window["attempt"]) for window in operator.run_shown["windows"]]
        assert attempts == [(1, 1), (2, 1), (2, 2)]
    diaries = sorted((tmp_path / "rehearsal").glob("console-*.jsonl"))
    assert len(diaries) == 2
    assert all(json.loads(line) for line in diaries[0].read_text().splitlines())
