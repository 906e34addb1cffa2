"""The benchmark of identification methods as a page: one table a level and kind of drive, and one figure."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from exograv.files import write_whole
from exograv.report.figures.identification_benchmark import PROFILES, Row, draw_benchmark
from exograv.report.style.figure_style import write_picture

HEADINGS = (
    "method",
    "target s",
    "coarse s",
    "reached",
    "20 s",
    "60 s",
    "120 s",
    "95 % hold",
    "possible",
    "update µs",
)
SETTINGS = {"open_loop": "same recorded stream for all", "closed_loop": "each method drives its own arm"}

LEGEND = (
    "Times: seconds of motion until what is left over (total) stays below 0.2 N·m at each shoulder axis and 0.1 N·m at "
    "the elbow (coarse: 0.5 and 0.25), median over wearers with its 95 % bootstrap interval; `never` where half of the "
    "wearers or more do not get there. At 20, 60 and 120 s: median of the worst shoulder axis / elbow in N·m. "
    "Update: median and 99th percentile of the updates that do work, processor time."
)


def tables(rows: Sequence[Row]) -> list[tuple[str, list[list[str]]]]:
    """Title and lines of cells, one table a setting, level and kind of drive; variations of a level are left out."""
    places = list(dict.fromkeys(_place(row) for row in rows))
    found = []
    for place in places:
        here = [row for row in rows if _place(row) == place]
        setting, level, profile, only, without, never_relaxed = place
        title = f"Level {level}, {PROFILES.get(profile, profile)}, {here[0]['wearers']} wearers, {SETTINGS[setting]}"
        title += f", only {only}" if only else ""
        title += f", without {without}" if without else ""
        title += ", never relaxed" if never_relaxed else ""
        found.append((title, [cells(row) for row in here]))
    return found


def _place(row: Row) -> tuple[Any, ...]:
    return tuple(row[key] for key in ("setting", "level", "profile", "only", "without", "never_relaxed"))


def cells(row: Row) -> list[str]:
    """Of one method, under `HEADINGS`."""
    coverage, update = row["coverage95"], row["update_us"]
    failed = f" ({row['failed']} failed)" if row["failed"] else ""
    return [
        row["method"] + (" (off line)" if row["offline"] else ""),
        _time(row["time_to_target_s"]),
        _time(row["time_to_coarse_s"]),
        _percent(row["reached_share"]) + failed,
        *(_pair(row["left_over_Nm"][seconds]) for seconds in ("20", "60", "120")),
        _percent(coverage["covered"] / coverage["of"]) if coverage["of"] else "–",
        _percent(row["consistent_share"]),
        "–" if update["p50"] is None else f"{update['p50']:.0f} / {update['p99']:.0f}",
    ]


def _time(figure: dict[str, Any]) -> str:
    if figure["median"] is None:
        low = figure["ci95"][0]
        return "never" if low is None else f"never ({low:.0f}–∞)"
    low, high = (("∞" if end is None else f"{end:.0f}") for end in figure["ci95"])
    return f"{figure['median']:.0f} ({low}–{high})"


def _pair(figure: dict[str, float | None]) -> str:
    return " / ".join("∞" if figure[place] is None else f"{figure[place]:.2f}" for place in ("shoulder", "elbow"))


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"


def write_benchmark_page(result: dict[str, Any], folder: Path) -> tuple[Path, Path | None]:
    """Write the tables as Markdown and the figure as PNG, or replace them.

    Returns:
        Paths of both; no figure where no run gave anything to draw.

    Raises:
        RecordingError: They cannot be written.
    """
    page, picture = folder / "benchmark_identification.md", folder / "benchmark_identification.png"
    rows = _drawn(result["results"])
    if rows:
        write_picture(picture, lambda: draw_benchmark(rows))
    write_whole(page, markdown(result, picture.name if rows else None))
    return page, picture if rows else None


def _drawn(rows: Sequence[Row]) -> list[Row]:
    """Open loop where there is any; variations of a level only where nothing else is there."""
    with_curves = [row for row in rows if row["progress"]["t"]]
    for setting in ("open_loop", "closed_loop"):
        of_setting = [row for row in with_curves if row["setting"] == setting]
        plain = [row for row in of_setting if not (row["only"] or row["without"] or row["never_relaxed"])]
        if plain or of_setting:
            return plain or _first_variation(of_setting)
    return []


def _first_variation(rows: Sequence[Row]) -> list[Row]:
    key = [(row["only"], row["without"], row["never_relaxed"]) for row in rows]
    return [row for row, one in zip(rows, key, strict=True) if one == key[0]]


def markdown(result: dict[str, Any], picture: str | None) -> str:
    """The whole page."""
    lines = ["# Identification methods on the same wearers", "", LEGEND, ""]
    if picture is not None:
        lines += [f"![Left over against motion time]({picture})", ""]
    for title, of_methods in tables(told(result)):
        lines += [f"**{title}**", "", *_table(HEADINGS, of_methods), ""]
    lines += [*sentences(result), ""]
    headings, said = verdicts(told(result))
    if said:
        lines += ["**What was said about the wearers**", "", *_table(headings, said), ""]
    if result["break_down"]:
        lines += ["**What the remainder after 120 s is made of**", "", *_table(*break_down_table(result)), ""]
    seeds = result["seeds"]
    if seeds:
        lines += [f"Wearer seeds {seeds[0]} to {seeds[-1]}, machine seeds {_listed(result['machine_seeds'])}."]
    return "\n".join(lines) + "\n"


def told(result: dict[str, Any]) -> list[Row]:
    """Rows for the tables: where disturbances were switched one at a time, those have a table of their own."""
    rows = result["results"]
    return [row for row in rows if not (row["only"] or row["without"])] if result["break_down"] else rows


def verdicts(rows: Sequence[Row]) -> tuple[tuple[str, ...], list[list[str]]]:
    """Headings and lines: what methods that state an uncertainty said about their wearers, and when they would stop."""
    headings = ("method", "where", "stop rule, wearers", "stop s", "told restless", "rejected", "unrest")
    lines = []
    for row in rows:
        if not row["coverage95"]["of"] or row["setting"] != "open_loop":
            continue
        where = f"level {row['level']}, {row['profile']}" + (", never relaxed" if row["never_relaxed"] else "")
        said = ", ".join(f"{name.lower().replace('_', ' ')} {count}" for name, count in row["outcomes"].items())
        stop = "–" if row["stop_s"] is None else f"{row['stop_s']:.0f}"
        shares = [_percent(row["told_restless_share"]), _percent(row["rejected_share"])]
        unrest = "–" if row["noise_scale"] is None else f"{row['noise_scale']:.1f}"
        lines.append([row["method"], where, said, stop, *shares, unrest])
    return headings, lines


def sentences(result: dict[str, Any]) -> list[str]:
    """Who won each level, and how much sooner ours is than the paper's method."""
    lines = []
    for level, of_profiles in result["winner_by_level"].items():
        for profile, won in of_profiles.items():
            if won["method"] is None:
                lines.append(f"- Level {level}, {PROFILES.get(profile, profile)}: {won['by']}.")
                continue
            tied = f"; not to be told from it: {', '.join(won['tied_with'])}" if won["tied_with"] else ""
            tied += f"; off line ahead of it: {', '.join(won['offline_ahead'])}" if won["offline_ahead"] else ""
            lines.append(f"- Level {level}, {PROFILES.get(profile, profile)}: {won['method']}, by {won['by']}{tied}.")
    return [*lines, *(ratio_sentence(one) for one in result["paired_ratios"])]


def ratio_sentence(one: dict[str, Any]) -> str:
    """One ratio of times in words."""
    place = f"level {one['level']}, {one['profile']}, {one['setting'].replace('_', ' ')}"
    head = f"- {one['ours']} against {one['rival']} ({place}, {one['threshold']}): "
    count = (
        f"sooner with {one['ours_sooner']} of {one['wearers']} wearers, later with {one['rival_sooner']}, neither got "
        f"there with {one['neither_reached']}"
    )
    value = one["ratio_of_medians"]
    if value is None:
        return f"{head}no ratio of medians; {count}."
    if value == 0.0:
        return f"{head}the rival's median never gets there; {count}."
    low, high = ("∞" if end is None else f"{end:.2f}" for end in one["ci95"])
    return f"{head}{value:.2f} of its time ({low}–{high}); {count}."


def break_down_table(result: dict[str, Any]) -> tuple[tuple[str, ...], list[list[str]]]:
    """Headings and lines: what each disturbance changes, N·m."""
    headings = ("method", "drives", "disturbance", "shoulder", "change (95 %)", "elbow", "change (95 %)")
    lines = []
    for part in result["break_down"]:
        cells_of = [
            cell
            for place in ("shoulder", "elbow")
            for cell in (_number(part[f"{place}_Nm"]), _change(part[f"{place}_change_Nm"]))
        ]
        lines.append([part["method"], part["profile"], f"{part['kind']} {part['row']}", *cells_of])
    return headings, lines


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"


def _change(figure: dict[str, Any]) -> str:
    if figure["median"] is None:
        return "–"
    low, high = ("–" if end is None else f"{end:+.3f}" for end in figure["ci95"])
    return f"{figure['median']:+.3f} ({low} to {high})"


def _table(headings: Sequence[str], lines: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(line)} |" for line in (headings, ["---"] * len(headings), *lines)]


def _listed(values: Sequence[int]) -> str:
    return ", ".join(map(str, values))
