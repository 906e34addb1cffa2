"""The benchmark treats all methods equally, counts failures, and lets another method win."""

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.campaigns.benchmark_identification import bootstrap
from exograv.campaigns.benchmark_identification.benchmark import summary
from exograv.campaigns.benchmark_identification.cases import Case
from exograv.campaigns.benchmark_identification.comparison import paired, ratios, winner
from exograv.campaigns.benchmark_identification.measures import left_over, row, time_to
from exograv.campaigns.benchmark_identification.runs import Intervals, MethodRun
from exograv.report.figures.benchmark_result import Coverage
from exograv.results import json_value

PLACES = ["shoulder", "shoulder", "shoulder", "elbow"]
CASE = Case("harmonic", 2, wearer_seed=0, machine_seed=0)
NEVER = 9.0
"""Left over above every target [N·m]."""


def run(method: str, seed: int, shoulder: Sequence[float], **more) -> MethodRun:
    """Run with this left over at the worst shoulder axis and half of it at the elbow, with one estimate per second."""
    rows: list[list[float | None]] = [[0.0, value, 0.0, 0.5 * value] for value in shoulder]
    case = replace(CASE, wearer_seed=seed)
    return MethodRun(
        "open_loop", method, case, PLACES, t=[k + 1.0 for k in range(len(rows))], left_over_Nm=rows, **more
    )


def reached_at(method: str, seed: int, t: int, **more) -> MethodRun:
    """Run of two minutes that reaches the target after `t` seconds."""
    return run(method, seed, [NEVER] * (t - 1) + [0.1] * (121 - t), **more)


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30), st.floats(0.1, 5.0), st.floats(1.0, 5.0))
def test_a_coarser_target_is_never_reached_later(values: list[float], factor: float, looser: float):
    one = run("recursive", 0, values)
    assert time_to(one, factor * looser) <= time_to(one, factor)


def test_a_target_that_is_left_again_counts_from_the_return():
    assert time_to(run("recursive", 0, [NEVER, 0.1, NEVER, 0.1, 0.1])) == 4.0
    assert time_to(run("recursive", 0, [0.1, 0.1, NEVER])) == np.inf


def test_a_failed_run_is_counted_and_never_reaches():
    failed = MethodRun("open_loop", "recursive", CASE, PLACES, failed="It fell.")
    figures = row([reached_at("recursive", 1, 5), failed, failed])
    assert (figures.wearers, figures.failed) == (3, 2)
    assert figures.reached_share == pytest.approx(1 / 3, abs=1e-4)
    assert figures.time_to_target_s.median is None
    assert figures.left_over_Nm["60"].shoulder is None
    assert figures.outcomes["FAILED"] == 2


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
    assert ratios({"recursive": ours, "gradient": never})[0].ratio_of_medians == 0.0
    also = [replace(one, method="recursive") for one in never]
    told = ratios({"recursive": also, "gradient": never})[0]
    assert told.ratio_of_medians is None
    assert told.neither_reached == 3


def test_wearers_that_one_method_has_not_met_yet_are_left_out_of_pairs():
    met = paired([reached_at("recursive", 0, 5), reached_at("recursive", 1, 5), reached_at("gradient", 1, 9)])
    assert [one.case.wearer_seed for one in met["recursive"]] == [1]


def test_another_method_may_win():
    ours, theirs = ([reached_at(name, k, t + k) for k in range(9)] for name, t in (("recursive", 30), ("nlms", 5)))
    assert winner({"recursive": ours, "nlms": theirs}).method == "nlms"


def test_equal_methods_are_tied():
    ours, theirs = ([reached_at(name, k, 10 + k) for k in range(9)] for name in ("recursive", "nlms"))
    assert winner({"recursive": ours, "nlms": theirs}).tied_with == ["nlms"]


def test_an_off_line_method_does_not_win_and_is_named():
    ours = [reached_at("recursive", k, 30) for k in range(5)]
    oracle = [reached_at("oracle", k, 20, offline=True) for k in range(5)]
    won = winner({"recursive": ours, "oracle": oracle})
    assert (won.method, won.offline_ahead) == ("recursive", ["oracle"])


def test_where_no_target_is_reached_the_remainder_decides():
    ours, theirs = ([run(name, 0, [value] * 120)] for name, value in (("recursive", 1.0), ("gradient", 2.0)))
    won = winner({"recursive": ours, "gradient": theirs})
    assert (won.method, won.by) == ("recursive", "left over after 60 s")


def test_intervals_are_counted_by_duration_and_by_parameter():
    intervals = {"20": Intervals({"a": True, "b": False}, (3, 4)), "120": Intervals({"a": True, "b": True}, (4, 4))}
    figures = row([reached_at("recursive", k, 5, intervals=intervals) for k in range(2)])
    assert figures.coverage95 == Coverage(4, 4)
    assert figures.coverage95_by_duration["20"] == Coverage(2, 4)
    assert figures.coverage95_torque_by_duration["20"] == Coverage(6, 8)
    assert figures.coverage95_by_parameter["b"] == Coverage(2, 2)


def test_a_summary_holds_no_number_that_json_lacks():
    runs = [
        reached_at("recursive", 0, 5),
        run("gradient", 0, [NEVER] * 3),
        MethodRun("open_loop", "rls", CASE, PLACES, "No."),
    ]
    json.dumps(json_value(summary(runs)), allow_nan=False)


def test_a_remainder_is_told_by_what_each_disturbance_adds():
    plain = [run("recursive", k, [0.3] * 120) for k in range(3)]
    off = [replace(one, case=replace(one.case, without="delay"), left_over_Nm=[[0.1] * 4] * 120) for one in plain]
    told = summary([*plain, *off])
    assert told.break_down[0].row == "delay"
    assert told.break_down[0].shoulder_change_Nm.median == pytest.approx(-0.2)
    assert list(told.winner_by_level["2"]) == ["harmonic"]


def test_a_disturbance_alone_is_told_from_none():
    none = [run("recursive", k, [0.1] * 120) for k in range(3)]
    none = [replace(one, case=replace(one.case, level=0)) for one in none]
    alone = [
        replace(run("recursive", k, [0.15] * 120), case=replace(CASE, wearer_seed=k, only="delay")) for k in range(3)
    ]
    told = summary([*none, *alone])
    assert [part.row for part in told.break_down] == ["delay"]
    assert told.break_down[0].shoulder_change_Nm.median == pytest.approx(0.05)
    assert list(told.winner_by_level) == ["0"]


def test_the_figure_s_course_is_what_is_left_over_at_each_time():
    one = run("recursive", 0, [0.5, 0.4, 0.3])
    assert row([one]).progress.shoulder[1] == [left_over(one, t, "shoulder") for t in one.t]
