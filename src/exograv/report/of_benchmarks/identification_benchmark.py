"""Page of the benchmark of identification methods: one table per level and kind of drive, and one figure."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from exograv.files import write_whole
from exograv.report.figures.benchmark_result import (
    BenchmarkFiles,
    BenchmarkSummary,
    MedianFigures,
    MethodFigures,
    PairedRatio,
    PlaceFigures,
)
from exograv.report.figures.identification_benchmark import PROFILES, draw_benchmark
from exograv.report.style.figure_style import write_picture
from exograv.report.style.page import SIMULATED, Bullets, Chapter, Page, Table, markdown_text

HEADINGS = (
    "method", "target s", "coarse s", "reached", "20 s", "60 s", "120 s", "95 % coverage", "possible", "update µs"
)  # fmt: skip
PLACE = ("setting", "level", "profile", "only", "without", "never_relaxed", "world")
"""Fields of a result that have a table of their own for each value."""

VERDICTS = ("method", "where", "stop rule, wearers", "stop s", "rated restless", "rejected", "unrest")
BREAK_DOWN = ("method", "drives", "disturbance", "shoulder", "change (95 %)", "elbow", "change (95 %)")
SETTINGS = {"open_loop": "same recorded stream for all", "closed_loop": "each method drives its own arm"}

LEGEND = (
    "Times: seconds of motion until the left over (total) stays below 0.2 N·m at each shoulder axis and 0.1 N·m at the "
    "elbow (coarse: 0.5 and 0.25), median over wearers with its 95 % bootstrap interval; `never` if at least half of "
    "the wearers do not reach this. At 20, 60 and 120 s: median of the worst shoulder axis / elbow in N·m. Update: "
    "median and 99th percentile of the processor time of updates that do work."
)


def page_of(result: BenchmarkSummary) -> Page:
    """Return the content of the page."""
    rows, seeds = told(result), result.seeds
    chapters = [*tables(rows), Chapter("", [Bullets(sentences(result))])]
    if said := verdicts(rows):
        chapters.append(Chapter("Verdicts about the wearers", [Table(VERDICTS, said)]))
    if changes := break_down(result):
        chapters.append(Chapter("Causes of the left over after 120 s, N·m", [Table(BREAK_DOWN, changes)]))
    if seeds:
        machines = ", ".join(map(str, result.machine_seeds))
        chapters.append(Chapter("", [f"Wearer seeds {seeds[0]} to {seeds[-1]}, machine seeds {machines}."]))
    return Page("Identification methods on the same wearers", chapters, SIMULATED, lead=[LEGEND])


def tables(rows: Sequence[MethodFigures]) -> list[Chapter]:
    """Return one table per setting, level and kind of drive; variations of a level have their own tables."""
    found = dict[tuple[Any, ...], list[MethodFigures]]()
    for row in rows:
        place = tuple(getattr(row, key) for key in PLACE)
        found.setdefault(place, []).append(row)
    return [Chapter(_title(here[0]), [Table(HEADINGS, [cells(row) for row in here])]) for here in found.values()]


def _title(row: MethodFigures) -> str:
    drives = PROFILES.get(row.profile, row.profile)
    title = f"Level {row.level}, world {row.world}, {drives}, {row.wearers} wearers, {SETTINGS[row.setting]}"
    variations = "".join(f", {name} {getattr(row, name)}" for name in ("only", "without") if getattr(row, name))
    return title + variations + (", never relaxed" if row.never_relaxed else "")


def cells(row: MethodFigures) -> list[str]:
    """Return the cells of one method, under `HEADINGS`."""
    coverage, update = row.coverage95, row.update_us
    failed = f" ({row.failed} failed)" if row.failed else ""
    return [
        row.method + (" (off line)" if row.offline else ""),
        _time(row.time_to_target_s),
        _time(row.time_to_coarse_s),
        _percent(row.reached_share) + failed,
        *(_pair(row.left_over_Nm[seconds]) for seconds in ("20", "60", "120")),
        _percent(coverage.covered / coverage.of) if coverage.of else "–",
        _percent(row.consistent_share),
        "–" if update.p50 is None else f"{update.p50:.0f} / {update.p99:.0f}",
    ]


def _time(figure: MedianFigures) -> str:
    if figure.median is None:
        low = figure.ci95[0]
        return "never" if low is None else f"never ({low:.0f}–∞)"
    low, high = (("∞" if end is None else f"{end:.0f}") for end in figure.ci95)
    return f"{figure.median:.0f} ({low}–{high})"


def _pair(figure: PlaceFigures) -> str:
    return " / ".join("∞" if value is None else f"{value:.2f}" for value in (figure.shoulder, figure.elbow))


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"


def write_benchmark_page(result: BenchmarkSummary, folder: Path) -> BenchmarkFiles:
    """Write the tables as Markdown and the figure as PNG, or replace them; without any curve there is no figure.

    Raises:
        RecordingError: A file cannot be written.
    """
    page, picture = folder / "benchmark_identification.md", folder / "benchmark_identification.png"
    rows = _drawn(result.results)
    if rows:
        write_picture(picture, lambda: draw_benchmark(rows))
    write_whole(page, markdown_text(page_of(result), {"Left over against motion time": picture} if rows else {}))
    return BenchmarkFiles(page, picture if rows else None)


def _drawn(rows: Sequence[MethodFigures]) -> list[MethodFigures]:
    """Select open-loop rows if there are any, and variations of a level only if there is nothing else."""
    with_curves = [row for row in rows if row.progress.t]
    for setting in ("open_loop", "closed_loop"):
        if of_setting := [row for row in with_curves if row.setting == setting]:
            key = [(row.only or None, row.without or None, row.never_relaxed) for row in of_setting]
            plain = (None, None, False)
            shown = plain if plain in key else key[0]
            return [row for row, one in zip(of_setting, key, strict=True) if one == shown]
    return []


def told(result: BenchmarkSummary) -> list[MethodFigures]:
    """Return the rows for the tables, without runs of single disturbances, which have a table of their own."""
    rows = result.results
    return [row for row in rows if not (row.only or row.without)] if result.break_down else rows


def verdicts(rows: Sequence[MethodFigures]) -> list[list[str]]:
    """Return outcomes and stop times of methods that state an uncertainty, under `VERDICTS`."""
    lines = []
    for row in rows:
        if not row.coverage95.of or row.setting != "open_loop":
            continue
        where = f"level {row.level}, world {row.world}, {row.profile}" + (
            ", never relaxed" if row.never_relaxed else ""
        )
        said = ", ".join(f"{name.lower().replace('_', ' ')} {count}" for name, count in row.outcomes.items())
        stop = "–" if row.stop_s is None else f"{row.stop_s:.0f}"
        shares = [_percent(row.told_restless_share), _percent(row.rejected_share)]
        unrest = "–" if row.noise_scale is None else f"{row.noise_scale:.1f}"
        lines.append([row.method, where, said, stop, *shares, unrest])
    return lines


def sentences(result: BenchmarkSummary) -> list[str]:
    """Return sentences on the best method of each level, and on the time of ours relative to the paper's method."""
    lines = []
    for level, of_profiles in result.winner_by_level.items():
        for profile, won in of_profiles.items():
            if won.method is None:
                lines.append(f"Level {level}, {PROFILES.get(profile, profile)}: {won.by}.")
                continue
            tied = f"; not distinguishable from it: {', '.join(won.tied_with)}" if won.tied_with else ""
            tied += f"; better off line: {', '.join(won.offline_ahead)}" if won.offline_ahead else ""
            lines.append(f"Level {level}, {PROFILES.get(profile, profile)}: {won.method}, by {won.by}{tied}.")
    return [*lines, *(ratio_sentence(one) for one in result.paired_ratios)]


def ratio_sentence(one: PairedRatio) -> str:
    """Return one ratio of times as a sentence."""
    place = f"level {one.level}, {one.profile}, {one.setting.replace('_', ' ')}"
    head = f"{one.ours} against {one.rival} ({place}, {one.threshold}): "
    count = (
        f"sooner with {one.ours_sooner} of {one.wearers} wearers, later with {one.rival_sooner}, neither reached "
        f"it with {one.neither_reached}"
    )
    value = one.ratio_of_medians
    if value is None:
        return f"{head}no ratio of medians; {count}."
    if value == 0.0:
        return f"{head}the rival's median never reaches it; {count}."
    low, high = ("∞" if end is None else f"{end:.2f}" for end in one.ci95)
    return f"{head}{value:.2f} of its time ({low}–{high}); {count}."


def break_down(result: BenchmarkSummary) -> list[list[str]]:
    """Return the change by each disturbance, under `BREAK_DOWN` [N·m]."""
    return [
        [part.method, part.profile, f"{part.kind} {part.row}"]
        + [
            cell
            for value, change in ((part.shoulder_Nm, part.shoulder_change_Nm), (part.elbow_Nm, part.elbow_change_Nm))
            for cell in (_number(value), _change(change))
        ]
        for part in result.break_down
    ]


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _change(figure: MedianFigures) -> str:
    if figure.median is None:
        return "–"
    low, high = ("–" if end is None else f"{end:+.3f}" for end in figure.ci95)
    return f"{figure.median:+.3f} ({low} to {high})"
