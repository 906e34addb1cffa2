"""The benchmark treats all methods alike, counts failures, and lets another method win."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import ConfigError, RecordingError
from exograv.identification.interface import Estimate, Sample
from exograv.rig.twin.levels import MACHINE, WEARER
from exograv.session.benchmark_identification import benchmark, bootstrap
from exograv.session.benchmark_identification.benchmark import run_benchmark, summary
from exograv.session.benchmark_identification.cases import Case, by_machine, population
from exograv.session.benchmark_identification.compared import paired, ratios, winner
from exograv.session.benchmark_identification.crew import run_all
from exograv.session.benchmark_identification.measures import left_over, row, time_to
from exograv.session.benchmark_identification.options import (
    BenchmarkOptions,
    levels_of,
    machines,
    methods_of,
    profiles_of,
)
from exograv.session.benchmark_identification.replay import replay
from exograv.session.benchmark_identification.runs import Intervals, Run, RunFile
from exograv.session.benchmark_identification.streams import Samples
from exograv.session.benchmark_identification.work import Task

PLACES = ["shoulder", "shoulder", "shoulder", "elbow"]
CASE = Case("harmonic", 2, wearer_seed=0, machine_seed=0)
NEVER = 9.0
"""Left over that meets no target [N·m]."""


def run(method: str, seed: int, shoulder: Sequence[float], **more) -> Run:
    """A run whose worst shoulder axis is left over as said, one estimate a second; the elbow half of it."""
    rows: list[list[float | None]] = [[0.0, value, 0.0, 0.5 * value] for value in shoulder]
    case = replace(CASE, wearer_seed=seed)
    return Run("open_loop", method, case, PLACES, t=[k + 1.0 for k in range(len(rows))], left_over_Nm=rows, **more)


def reached_at(method: str, seed: int, t: int, **more) -> Run:
    """A run of two minutes that reaches the target after `t` seconds."""
    return run(method, seed, [NEVER] * (t - 1) + [0.1] * (121 - t), **more)


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30), st.floats(0.1, 5.0), st.floats(1.0, 5.0))
def test_a_coarser_target_is_never_reached_later(values: list[float], factor: float, looser: float):
    one = run("recursive", 0, values)
    assert time_to(one, factor * looser) <= time_to(one, factor)


def test_a_target_that_is_left_again_counts_from_the_return():
    assert time_to(run("recursive", 0, [NEVER, 0.1, NEVER, 0.1, 0.1])) == 4.0
    assert time_to(run("recursive", 0, [0.1, 0.1, NEVER])) == np.inf


def test_a_failed_run_is_counted_and_never_reaches():
    failed = Run("open_loop", "recursive", CASE, PLACES, failed="It fell.")
    figures = row([reached_at("recursive", 1, 5), failed, failed])
    assert (figures["wearers"], figures["failed"]) == (3, 2)
    assert figures["reached_share"] == pytest.approx(1 / 3, abs=1e-4)
    assert figures["time_to_target_s"]["median"] is None
    assert figures["left_over_Nm"]["60"]["shoulder"] is None
    assert figures["outcomes"]["FAILED"] == 2


def test_left_over_after_some_motion_asks_nothing_later():
    one = run("recursive", 0, [0.5, 0.4, 0.3])
    assert left_over(one, 2.0, "shoulder") == 0.4
    assert left_over(one, 0.5, "shoulder") == np.inf


def test_half_of_the_wearers_unreached_makes_the_median_infinite():
    assert bootstrap.median(np.array([5.0, np.inf])) == np.inf
    assert bootstrap.median(np.array([5.0, 6.0, np.inf])) == 6.0


def test_a_method_against_itself_has_a_ratio_of_one():
    times = np.array([3.0, 10.0, 40.0, 80.0])
    assert bootstrap.ratio(times, times) == (1.0, (1.0, 1.0))


def test_the_same_wearers_are_drawn_for_every_method():
    a = np.array([3.0, 10.0, 40.0, 80.0])
    assert (bootstrap.medians(2.0 * a) == 2.0 * bootstrap.medians(a)).all()


def test_a_rival_that_never_reaches_gives_a_ratio_of_zero_and_both_never_gives_none():
    ours = [reached_at("recursive", k, 10) for k in range(3)]
    never = [run("gradient", k, [NEVER] * 5) for k in range(3)]
    assert ratios({"recursive": ours, "gradient": never})[0]["ratio_of_medians"] == 0.0
    also = [replace(one, method="recursive") for one in never]
    told = ratios({"recursive": also, "gradient": never})[0]
    assert told["ratio_of_medians"] is None
    assert told["neither_reached"] == 3


def test_wearers_that_one_method_has_not_met_yet_are_left_out_of_pairs():
    met = paired([reached_at("recursive", 0, 5), reached_at("recursive", 1, 5), reached_at("gradient", 1, 9)])
    assert [one.case.wearer_seed for one in met["recursive"]] == [1]


def test_another_method_may_win():
    ours, theirs = ([reached_at(name, k, t + k) for k in range(9)] for name, t in (("recursive", 30), ("nlms", 5)))
    assert winner({"recursive": ours, "nlms": theirs})["method"] == "nlms"


def test_equal_methods_are_tied():
    ours, theirs = ([reached_at(name, k, 10 + k) for k in range(9)] for name in ("recursive", "nlms"))
    assert winner({"recursive": ours, "nlms": theirs})["tied_with"] == ["nlms"]


def test_an_off_line_method_does_not_win_and_is_named():
    ours = [reached_at("recursive", k, 30) for k in range(5)]
    oracle = [reached_at("oracle", k, 20, offline=True) for k in range(5)]
    won = winner({"recursive": ours, "oracle": oracle})
    assert (won["method"], won["offline_ahead"]) == ("recursive", ["oracle"])


def test_where_no_target_is_reached_the_remainder_decides():
    ours, theirs = ([run(name, 0, [value] * 120)] for name, value in (("recursive", 1.0), ("gradient", 2.0)))
    won = winner({"recursive": ours, "gradient": theirs})
    assert (won["method"], won["by"]) == ("recursive", "left over after 60 s")


def test_intervals_are_counted_by_duration_and_by_parameter():
    intervals = {"20": Intervals({"a": True, "b": False}, (3, 4)), "120": Intervals({"a": True, "b": True}, (4, 4))}
    figures = row([reached_at("recursive", k, 5, intervals=intervals) for k in range(2)])
    assert figures["coverage95"] == {"covered": 4, "of": 4}
    assert figures["coverage95_by_duration"]["20"] == {"covered": 2, "of": 4}
    assert figures["coverage95_torque_by_duration"]["20"] == {"covered": 6, "of": 8}
    assert figures["coverage95_by_parameter"]["b"] == {"covered": 2, "of": 2}


def test_a_summary_holds_no_number_that_json_lacks():
    runs = [
        reached_at("recursive", 0, 5),
        run("gradient", 0, [NEVER] * 3),
        Run("open_loop", "rls", CASE, PLACES, "No."),
    ]
    json.dumps(summary(runs), allow_nan=False)


def test_a_remainder_is_told_by_what_each_disturbance_adds():
    plain = [run("recursive", k, [0.3] * 120) for k in range(3)]
    off = [replace(one, case=replace(one.case, without="delay"), left_over_Nm=[[0.1] * 4] * 120) for one in plain]
    told = summary([*plain, *off])
    assert told["break_down"][0]["row"] == "delay"
    assert told["break_down"][0]["shoulder_change_Nm"]["median"] == pytest.approx(-0.2)
    assert list(told["winner_by_level"]["2"]) == ["harmonic"]


def test_a_disturbance_alone_is_told_from_none():
    none = [run("recursive", k, [0.1] * 120) for k in range(3)]
    none = [replace(one, case=replace(one.case, level=0)) for one in none]
    alone = [
        replace(run("recursive", k, [0.15] * 120), case=replace(CASE, wearer_seed=k, only="delay")) for k in range(3)
    ]
    told = summary([*none, *alone])
    assert [part["row"] for part in told["break_down"]] == ["delay"]
    assert told["break_down"][0]["shoulder_change_Nm"]["median"] == pytest.approx(0.05)
    assert list(told["winner_by_level"]) == ["0"]


def test_the_figure_s_course_is_what_is_left_over_at_each_time():
    one = run("recursive", 0, [0.5, 0.4, 0.3])
    assert row([one])["progress"]["shoulder"][1] == [left_over(one, t, "shoulder") for t in one.t]


def test_more_wearers_leave_the_first_ones_as_they_were():
    assert population("qdd", 2, 30, 0)[:7] == population("qdd", 2, 7, 0)


def test_tuning_wearers_share_no_machine_with_reported_ones():
    assert min(case.machine_seed for case in population("qdd", 2, 30, 1000)) == 1000


def test_some_wearers_are_third_parties_arms():
    arms = [case.arm for case in population("harmonic", 2, 12, 0)]
    assert (arms[5], arms[11], arms.count("drawn")) == ("arm26", "rajagopal", 10)


@pytest.mark.parametrize("arm", ["arm26", "rajagopal"])
def test_a_third_partys_arm_is_drawn_into_the_machine(arm):
    model = replace(CASE, arm=arm).laboratory().wearer_model
    assert model is not None
    assert model.title


def test_a_machine_is_calibrated_once_for_all_that_only_its_wearers_differ_in():
    wearers = [replace(CASE, without=name) for name in WEARER]
    assert len(by_machine([CASE, *wearers])) == 1
    assert len(by_machine([replace(CASE, without=name) for name in MACHINE])) == len(MACHINE)


def test_a_wearer_who_never_lets_go_stirs_more_and_is_else_the_same():
    calm, stirring = CASE.laboratory().wearer, replace(CASE, restless=True).laboratory().wearer
    assert (stirring.arms[0].unrest.bias_rms > calm.arms[0].unrest.bias_rms).all()
    assert (stirring.passive.stiffness == calm.passive.stiffness).all()


def test_streams_and_wearers_count_apart():
    groups = machines(BenchmarkOptions(wearers=1, streams=2, methods=("recursive", "anthropometric")))
    tasks = [task for group in groups for task in group]
    assert [(task.open_loop, task.closed_loop) for task in tasks] == [
        (("recursive", "anthropometric"), ("recursive",)),
        (("recursive", "anthropometric"), ()),
    ]


@pytest.mark.parametrize(
    ("given", "word"),
    [
        ({"wearers": -1}, "--wearers is -1"),
        ({"wearers": 0, "streams": 0}, "nothing would run"),
        ({"only": "rain"}, "--only names no disturbance 'rain'"),
        ({"only": "delay", "without": "delay"}, "exclude each other"),
        ({"processes": 0}, "--processes is 0"),
        ({"seed_from": -1}, "--seed-from is -1"),
        ({"break_down": "only", "streams": 0}, "--streams is 0"),
        ({"break_down": "only", "levels": (1, 2)}, "takes one level"),
    ],
)
def test_bad_options_are_refused_in_one_line(given, word):
    with pytest.raises(ConfigError) as error:
        BenchmarkOptions(**given)
    assert word in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("read", "text", "word"),
    [
        (levels_of, "2,5", "--levels has '5'; known: 0, 1"),
        (levels_of, "2,2", "'2' twice"),
        (methods_of, "magic", "--methods has 'magic'; known: recursive"),
        (methods_of, "", "--methods has ''"),
        (profiles_of, "harmonic,steam", "--profiles has 'steam'; known: harmonic, qdd"),
    ],
)
def test_names_that_nobody_knows_are_refused_with_those_that_exist(read, text: str, word: str):
    with pytest.raises(ConfigError) as error:
        read(text)
    assert word in str(error.value)


class Counting:
    """A method that says how many samples it was given."""

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
    return Samples(t, still, still, still, still)


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
    runs = [reached_at("recursive", 0, 5, intervals={"20": Intervals({"a": True}, (1, 2))}), reached_at("ekf", 0, 7)]
    for one in runs:
        file.add(one)
    assert RunFile(path, 120.0, resume=True).runs == runs
    path.write_text(path.read_text()[:-40])
    cut = RunFile(path, 120.0, resume=True)
    assert cut.runs == runs[:1]
    cut.add(runs[1])
    assert RunFile(path, 120.0, resume=True).runs == runs


def test_runs_of_another_length_are_not_resumed(tmp_path: Path):
    RunFile(tmp_path / "runs.jsonl", 60.0, resume=False)
    with pytest.raises(RecordingError, match="another length"):
        RunFile(tmp_path / "runs.jsonl", 120.0, resume=True)


def test_a_new_start_keeps_the_old_runs_beside(tmp_path: Path):
    RunFile(tmp_path / "runs.jsonl", 120.0, resume=False).add(reached_at("recursive", 0, 5))
    assert RunFile(tmp_path / "runs.jsonl", 120.0, resume=False).runs == []
    assert len((tmp_path / "runs.before.jsonl").read_text().splitlines()) == 2


def test_the_keyboard_stops_it_and_what_is_done_is_kept(tmp_path: Path, monkeypatch):
    def two_then_stop(*_):
        yield reached_at("recursive", 0, 5)
        yield reached_at("gradient", 0, 50)
        raise KeyboardInterrupt

    monkeypatch.setattr(benchmark, "run_all", two_then_stop)
    options = BenchmarkOptions(wearers=0, streams=3, methods=("recursive", "gradient"))
    result = run_benchmark(options, tmp_path, lambda _text, _share: None)
    assert (result["interrupted"], result["runs_done"], result["runs_wanted"]) == (True, 2, 6)
    assert len(RunFile(tmp_path / benchmark.FILE, 120.0, resume=True).runs) == 2


def test_several_processes_bring_the_same_runs_as_one():
    # A level that does not exist: refused in every process, in a moment, and counted.
    tasks = [[Task(replace(CASE, level=9, wearer_seed=k), ("recursive", "ekf"), ())] for k in range(2)]
    alone, together = (list(run_all(tasks, 1.0, processes, lambda _text: None)) for processes in (1, 2))
    assert all("level 9 does not exist" in (one.failed or "") for one in alone)
    assert sorted(alone, key=repr) == sorted(together, key=repr)
    assert len(alone) == 4


@pytest.mark.slow
def test_a_short_run_on_the_twin_measures_every_kind_of_method(tmp_path: Path):
    methods = ("recursive", "gradient", "anthropometric", "equilibrium")
    options = BenchmarkOptions(wearers=1, streams=1, levels=(0,), methods=methods, seconds=20.0, seed_from=1000)
    result = run_benchmark(options, tmp_path, lambda _text, _share: None)
    assert all(one["failed"] is None for one in result["wearers"])
    opened = {one["method"]: one for one in result["results"] if one["setting"] == "open_loop"}
    assert set(opened) == set(methods)
    table = opened["anthropometric"]["left_over_Nm"]["20"]["shoulder"]
    assert opened["recursive"]["left_over_Nm"]["20"]["shoulder"] < 0.5 * table
    assert opened["recursive"]["coverage95"]["of"] > 10
    assert opened["recursive"]["update_us"]["p50"] > 0.0
    assert opened["recursive"]["consistent_share"] == 1.0
    assert {one["method"] for one in result["results"] if one["setting"] == "closed_loop"} == {"recursive", "gradient"}
    again = run_benchmark(replace(options, resume=True), tmp_path, lambda _text, _share: None)
    assert again["wall_s"] < 5.0
    assert again["results"] == result["results"]
