"""Every method gets every sample, and finished runs survive an interruption."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from exograv.campaigns.benchmark_identification import benchmark
from exograv.campaigns.benchmark_identification.benchmark import run_benchmark
from exograv.campaigns.benchmark_identification.cases import Case
from exograv.campaigns.benchmark_identification.options import BenchmarkOptions
from exograv.campaigns.benchmark_identification.runs import Intervals, MethodRun, RunFile
from exograv.campaigns.benchmark_identification.stream_replay import replay
from exograv.campaigns.benchmark_identification.streams import Samples
from exograv.campaigns.benchmark_identification.work import WearerTask, run_machine
from exograv.errors import RecordingError
from exograv.identification.core.interface import Estimate, Sample
from exograv.runtime.processes.process_pool import results_of

CASE = Case("harmonic", 2, wearer_seed=0, machine_seed=0)


def done(method: str, seed: int, **more) -> MethodRun:
    """Run of one second."""
    case, places = replace(CASE, wearer_seed=seed), ["shoulder", "elbow"]
    return MethodRun("open_loop", method, case, places, t=[1.0], left_over_Nm=[[0.1, 0.1]], **more)


class Counting:
    """Method that counts its samples."""

    name = "counting"

    def __init__(self, offline: bool = False, rest_s: float = 0.0):
        self.offline, self.rest_s = offline, rest_s
        self.times: list[float] = []

    def update(self, sample: Sample) -> None:
        self.times.append(sample.t)

    def estimate(self) -> Estimate:
        return Estimate(self.times[-1], np.array([float(len(self.times))]), None, 0.0, 1.0)


def samples(seconds: float) -> Samples:
    t = np.arange(1, round(seconds * 100) + 1) / 100.0
    still = np.zeros((len(t), 4))
    return Samples(t, still, still, still, still, np.array([still] * 3))


def test_every_method_gets_every_sample_and_is_asked_once_a_second():
    method = Counting()
    trace = replay(method, samples(10.0))
    assert method.times == samples(10.0).t.tolist()
    assert [estimate.t for estimate in trace.estimates] == [float(k) for k in range(1, 11)]


def test_an_off_line_method_is_asked_at_the_stated_durations_only():
    trace = replay(Counting(offline=True), samples(120.0))
    assert [estimate.t for estimate in trace.estimates] == [20.0, 60.0, 120.0]


def test_rests_count_as_motion():
    assert replay(Counting(rest_s=12.0), samples(3.0)).estimates[0].t == 13.0


def test_a_resumed_file_gives_the_same_runs_even_if_its_last_line_was_cut(tmp_path: Path):
    path = tmp_path / "runs.jsonl"
    file = RunFile(path, 120.0, resume=False)
    runs = [done("recursive", 0, intervals={"20": Intervals({"a": True}, (1, 2))}), done("ekf", 0)]
    for one in runs:
        file.add(one)
    assert RunFile(path, 120.0, resume=True).rows == runs
    path.write_text(path.read_text()[:-40])
    cut = RunFile(path, 120.0, resume=True)
    assert cut.rows == runs[:1]
    cut.add(runs[1])
    assert RunFile(path, 120.0, resume=True).rows == runs


def test_runs_of_another_length_are_not_resumed(tmp_path: Path):
    RunFile(tmp_path / "runs.jsonl", 60.0, resume=False)
    with pytest.raises(RecordingError, match="now seconds 120"):
        RunFile(tmp_path / "runs.jsonl", 120.0, resume=True)


def test_a_new_start_keeps_the_old_runs_beside(tmp_path: Path):
    RunFile(tmp_path / "runs.jsonl", 120.0, resume=False).add(done("recursive", 0))
    assert RunFile(tmp_path / "runs.jsonl", 120.0, resume=False).rows == []
    assert len((tmp_path / "runs.before.jsonl").read_text().splitlines()) == 2


def test_the_keyboard_stops_it_and_what_is_done_is_kept(tmp_path: Path, monkeypatch):
    def two_then_stop(*_):
        yield 0, done("recursive", 0)
        yield 0, done("gradient", 0)
        raise KeyboardInterrupt

    monkeypatch.setattr(benchmark, "results_of", two_then_stop)
    options = BenchmarkOptions(wearers=0, streams=3, methods=("recursive", "gradient"))
    result = run_benchmark(options, tmp_path, lambda _text, _share: None)
    assert (result.interrupted, result.runs_done, result.runs_wanted) == (True, 2, 6)
    assert len(RunFile(tmp_path / benchmark.FILE, 120.0, resume=True).rows) == 2


@pytest.mark.long
def test_several_processes_bring_the_same_runs_as_one():
    # The level does not exist, so every process refuses it at once and counts the failure.
    tasks = [[WearerTask(replace(CASE, level=9, wearer_seed=k), ("recursive", "ekf"), ())] for k in range(2)]
    work = partial(run_machine, seconds=1.0)
    alone, together = (
        [run for _, run in results_of(work, tasks, processes, lambda _text: None, "lost")] for processes in (1, 2)
    )
    assert all("level 9 does not exist" in (one.failed or "") for one in alone)
    assert sorted(alone, key=repr) == sorted(together, key=repr)
    assert len(alone) == 4


@pytest.mark.slow
def test_a_short_run_on_the_twin_measures_every_kind_of_method(tmp_path: Path):
    methods = ("recursive", "gradient", "anthropometric", "equilibrium")
    options = BenchmarkOptions(wearers=1, streams=1, levels=(0,), methods=methods, seconds=20.0, seed_from=1000)
    result = run_benchmark(options, tmp_path, lambda _text, _share: None)
    assert all(one.failed is None for one in result.summary.wearers)
    opened = {one.method: one for one in result.summary.results if one.setting == "open_loop"}
    assert set(opened) == set(methods)
    table, ours = (opened[name].left_over_Nm["20"].shoulder for name in ("anthropometric", "recursive"))
    assert table is not None
    assert ours is not None
    assert ours < 0.5 * table
    assert opened["recursive"].coverage95.of > 10
    assert (opened["recursive"].update_us.p50 or 0.0) > 0.0
    assert opened["recursive"].consistent_share == 1.0
    assert {one.method for one in result.summary.results if one.setting == "closed_loop"} == {"recursive", "gradient"}
    again = run_benchmark(replace(options, resume=True), tmp_path, lambda _text, _share: None)
    assert again.wall_s < 5.0
    assert again.summary.results == result.summary.results
