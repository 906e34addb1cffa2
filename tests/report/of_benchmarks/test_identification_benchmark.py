"""The page of the benchmark names every method, and states if a method never reaches the target."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from exograv.report.figures.benchmark_result import (
    BenchmarkSummary,
    Coverage,
    LearningCurves,
    MedianFigures,
    MethodFigures,
    PairedRatio,
    PlaceFigures,
    TimePercentiles,
    Winner,
)
from exograv.report.figures.identification_benchmark import look
from exograv.report.of_benchmarks.identification_benchmark import (
    HEADINGS,
    cells,
    tables,
    verdicts,
    write_benchmark_page,
)
from exograv.report.style.page import Table

NEVER = MedianFigures(None, (None, None))
CURVE = [[0.5, 0.3, 0.1], [0.6, 0.4, 0.2], [0.7, None, 0.3]]
ROW = MethodFigures(
    method="recursive",
    setting="open_loop",
    level=2,
    profile="harmonic",
    only=None,
    without=None,
    never_relaxed=False,
    world="home",
    offline=False,
    wearers=3,
    failed=0,
    time_to_target_s=MedianFigures(12.0, (9.0, None)),
    time_to_coarse_s=MedianFigures(4.0, (3.0, 6.0)),
    reached_share=0.9,
    reached_coarse_share=1.0,
    reached_within_share={},
    left_over_Nm={t: PlaceFigures(0.2, None) for t in ("20", "60", "120")},
    coverage95=Coverage(19, 20),
    coverage95_by_duration={},
    coverage95_torque_by_duration={},
    coverage95_by_parameter={},
    consistent_share=1.0,
    outcomes={"CONVERGED": 2, "NOT_RELAXED": 1},
    stop_s=40.0,
    told_restless_share=0.33,
    rejected_share=0.02,
    noise_scale=1.2,
    update_us=TimePercentiles(20.0, 40.0, 80.0),
    estimate_us=TimePercentiles(),
    work_share=0.5,
    method_s=1.0,
    progress=LearningCurves([1.0, 2.0, 3.0], CURVE, CURVE),
)


def row(method: str, **more: Any) -> MethodFigures:
    """Return the figures of one method."""
    return replace(ROW, method=method, **more)


def result(rows: list[MethodFigures]) -> BenchmarkSummary:
    """Return figures as `exograv dev benchmark-identification` gives them."""
    ratio = PairedRatio("open_loop", 2, "harmonic", "recursive", "gradient", "target", 0.25, (0.1, None), 3, 3, 0, 0, 0)
    won = Winner("recursive", "time to target", 12.0, ["ekf"], ["oracle"])
    ratios = [ratio, replace(ratio, ratio_of_medians=0.0), replace(ratio, ratio_of_medians=None)]
    return BenchmarkSummary(rows, {"2": {"harmonic": won}}, ratios, [], [0, 1, 2], [0], [])


def test_a_line_has_a_cell_under_every_heading():
    assert len(cells(row("recursive"))) == len(HEADINGS)


def test_a_method_that_never_reaches_is_said_to():
    figures = cells(row("gradient", time_to_target_s=NEVER, update_us=TimePercentiles()))
    assert figures[1] == "never"
    assert cells(row("gradient"))[1] == "12 (9–∞)"


def test_settings_and_levels_have_tables_of_their_own():
    rows = [row("recursive"), row("recursive", setting="closed_loop"), row("recursive", level=0), row("ekf")]
    blocks = [block for chapter in tables(rows) for block in chapter.blocks]
    assert [len(block.rows) for block in blocks if isinstance(block, Table)] == [2, 1, 1]


def test_the_page_names_winner_ties_and_who_is_ahead_off_line(tmp_path: Path):
    files = write_benchmark_page(result([row("recursive"), row("oracle", offline=True)]), tmp_path / "new")
    text = files.page.read_text(encoding="utf-8")
    for words in (
        "recursive, by time to target",
        "ekf",
        "better off line: oracle",
        "0.25 of its time",
        "never reaches",
    ):
        assert words in text
    assert files.figure is not None
    assert files.figure.stat().st_size > 10_000


def test_what_was_said_about_wearers_is_told_of_methods_that_state_an_uncertainty():
    silent = row("gradient", coverage95=Coverage(0, 0))
    lines = verdicts([row("recursive", never_relaxed=True), silent])
    assert [line[0] for line in lines] == ["recursive"]
    assert "converged 2, not relaxed 1" in lines[0]
    assert "never relaxed" in lines[0][1]


def test_runs_that_gave_nothing_have_a_page_and_no_figure(tmp_path: Path):
    empty = row("recursive", progress=LearningCurves([], [[], [], []], [[], [], []]))
    files = write_benchmark_page(result([empty]), tmp_path)
    assert files.page.is_file()
    assert files.figure is None


@pytest.mark.parametrize("count", [7, 15])
def test_no_two_methods_look_alike(count: int):
    methods = ["recursive", *(f"method {k}" for k in range(count - 1))]
    assert len({str(look(method, methods)) for method in methods}) == count
