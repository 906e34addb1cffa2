"""A request for a protocol states its run, a trial blocks no session, and a complete run ends without a machine."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from tests.console.of_process import short_training

from exograv.console.finished_run import ended_run
from exograv.console.run_checkpoint import RunContext
from exograv.console.trial_request import TrialRequest
from exograv.errors import ConfigError
from exograv.storage.session_checkpoint import SESSION_FILE
from exograv.study.importers.session_parts import diary_lines
from exograv.task.allocation import Group, draw_list
from exograv.task.events import Start, Tick
from exograv.task.run import TaskRun

CODE = "P-07"


def request_in(folder: Path, **more) -> TrialRequest:
    return TrialRequest(folder, str(short_training(folder)), CODE, **more)


def kept_until(request: TrialRequest, t: float) -> None:
    """Keep the checkpoint of a run that was interrupted at this time."""
    plan, stated, kept = request.plan(), request.stated(), request.checkpoint()
    assert plan is not None
    assert stated is not None
    assert kept is not None
    run = TaskRun(plan)
    run.feed(Start(t=0.0))
    run.feed(Tick(t=t))
    kept.keep(run.kept(), t, RunContext(run=stated.now().run))
    kept.close()


def test_a_resumed_run_keeps_its_name_and_states_the_windows_so_far(tmp_path: Path):
    request = request_in(tmp_path)
    first = request.stated()
    assert first is not None
    kept_until(request, 15.0)
    again = replace(request, resumes=True, launch="other").stated()
    assert again is not None
    assert (again.now().run, again.now().launch, again.now().complete) == (first.now().run, "other", (1,))


def test_a_trial_of_the_first_windows_has_a_protocol_and_a_checkpoint_of_its_own(tmp_path: Path):
    trial = request_in(tmp_path, windows=1)
    plan, stated = trial.plan(), trial.stated()
    assert plan is not None
    assert stated is not None
    assert plan.protocol.windows.count == 1
    assert stated.begun.protocol.endswith("-first-1")
    kept_until(trial, 15.0)
    assert [path.name for path in tmp_path.glob("*.run.json")] == ["P-07_short-first-1_01.run.json"]
    request_in(tmp_path).check()
    with pytest.raises(ConfigError, match="--windows is 3"):
        request_in(tmp_path, windows=3).plan()


def test_a_sealed_group_sets_the_mode_of_the_run_and_its_list_is_kept_by_its_hash(tmp_path: Path):
    groups = [Group(name="trained", exo="active"), Group(name="control", exo="sham")]
    listed = draw_list("S", ["P-07", "P-08"], groups, 1)
    path = tmp_path / "list.json"
    path.write_text(listed.model_dump_json(), encoding="utf-8")
    plans = [replace(request_in(tmp_path, allocation=path), participant=code).plan() for code in ("P-07", "P-08")]
    assert sorted(plan.exo for plan in plans if plan is not None) == ["active", "sham"]
    request = request_in(tmp_path, allocation=path)
    kept_until(request, 15.0)
    (kept,) = tmp_path.glob("*.run.json")
    assert SESSION_FILE.read(kept).options["allocation"] == request.allocation_sha256
    with pytest.raises(ConfigError, match="--allocation"):
        request_in(tmp_path, resumes=True).check()


def test_a_run_whose_windows_are_complete_ends_without_a_machine(tmp_path: Path):
    request = request_in(tmp_path)
    kept_until(request, 32.0)
    ended = ended_run(replace(request, resumes=True, launch="b"), tmp_path / "report.html")
    assert ended is not None
    assert (ended.is_finished, ended.totals.windows) == (True, 2)
    (kept,) = tmp_path.glob("*.run.json")
    assert json.loads(SESSION_FILE.read(kept).run)["status"] == "finished"
    (diary,) = tmp_path.glob("console-*.jsonl")
    kinds = [line.content["kind"] for line in diary_lines(diary) if isinstance(line.content, dict)]
    assert kinds[-1] == "run_ended"


def test_a_run_that_is_over_lacks_only_its_report_and_with_it_is_refused(tmp_path: Path):
    request = request_in(tmp_path)
    kept_until(request, 60.0)
    again, report = replace(request, resumes=True), tmp_path / "report.html"
    ended = ended_run(again, report)
    assert ended is not None
    assert ended.is_finished
    report.touch()
    with pytest.raises(ConfigError, match="is over and has its report"):
        ended_run(again, report)


def test_a_run_with_a_window_left_goes_on(tmp_path: Path):
    request = request_in(tmp_path)
    kept_until(request, 15.0)
    assert ended_run(replace(request, resumes=True), tmp_path / "report.html") is None
