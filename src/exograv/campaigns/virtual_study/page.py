"""The page of a virtual study: sentences, tables and four pictures in one file, SIMULATED on every part of it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.figure import Figure

from exograv.files import write_whole
from exograv.report.study_figures.groups import JOURNAL
from exograv.report.study_report.headline import Tile
from exograv.report.study_report.page import write_figure
from exograv.report.study_report.results import number
from exograv.report.style.figure_style import house_style, inline_svg
from exograv.report.style.templates import template

from . import ablation
from . import figure_curves as curves
from . import figure_flights as flights
from . import figure_sensitivity as sensitivity
from . import figure_windows as windows
from .ablation import Ablated
from .figure_sensitivity import Swept
from .flight import VirtualFlight
from .outcome import NO_EVIDENCE
from .sentences import headline, sentences

Row = tuple[str, ...]


@dataclass(frozen=True)
class Content:
    """All that the page says."""

    outcome: Mapping[str, Any]
    """Of `outcome_of`."""

    flights: Sequence[VirtualFlight]
    settings: Mapping[str, str]
    """What it was made with, in the order in which it is shown: seed, people, sessions, versions …"""

    swept: Sequence[Swept] = ()
    swept_usual: float | None = None
    """Transfer with all constants as they are, in the sweep's own shorter sessions."""
    links: Mapping[str, str] = field(default_factory=dict)
    """The study's own report, its data set: words and address, best relative to the page."""

    ablated: Sequence[Ablated] = ()
    left_out: Sequence[str] = ()
    """Sentences about people whose machine was refused in a condition."""


def write_virtual_page(folder: Path, content: Content) -> tuple[Path, tuple[Path, ...]]:
    """Pictures as SVG and PNG under `figures/`, and `virtual_study.html`.

    Raises:
        RecordingError: The folder cannot be written.
    """
    figures, chapters = list[Path](), []
    with house_style(), mpl.rc_context(JOURNAL):
        for name, title, figure, text in drawn(content):
            svg = inline_svg(figure, name, letters="path")
            figures += write_figure(folder / "figures", name, figure)
            chapters.append({"name": name, "title": title, "text": text, "svg": Markup(svg)})
    write_whole(folder / "virtual_study.html", render(content, chapters))
    return folder / "virtual_study.html", tuple(figures)


def drawn(content: Content) -> Iterator[tuple[str, str, Figure, str]]:
    """Name, title, picture and what one sees, of all that there is to see."""
    told = content.outcome["transfer"]
    found = (
        ("flights", "Deviation in flight", flights.draw(content.flights), flights.TEXT),
        ("windows", "The course of the flight", windows.draw(content.flights), windows.TEXT),
        ("transfer", "Transfer, what is left over, friction", curves.draw(told), curves.TEXT),
        ("sensitivity", "What it depends on",
         sensitivity.draw(content.swept, content.swept_usual), sensitivity.TEXT),
    )  # fmt: skip
    for name, title, figure, text in found:
        if figure is not None:
            yield name, title, figure, text


def render(content: Content, chapters: Sequence[Mapping[str, Any]]) -> str:
    """The page as text; the same content gives the same text."""
    outcome = content.outcome
    return template("virtual_study.html.j2", "exograv.campaigns.virtual_study", "exograv.report.study_report").render(
        study="Virtual study",
        authors="",
        licence="",
        is_simulated=True,
        headline=headline(outcome),
        tiles=tiles(outcome),
        note=NO_EVIDENCE,
        sentences=[*sentences(outcome, content.swept, content.swept_usual, content.ablated), *content.left_out],
        chapters=chapters,
        condition_rows=condition_rows(outcome),
        secondary_rows=secondary_rows(outcome),
        person_rows=person_rows(outcome),
        ablation_text=ablation.TEXT,
        ablation_rows=ablation_rows(content.ablated),
        limits=outcome["direction"]["whole_flight"].get("limits", []),
        definition=outcome["transfer"]["definition"],
        enters=[outcome["transfer"][name].get("which_flights", "") for name in ("by_left_over", "by_friction")],
        setting_rows=list(content.settings.items()),
        links=content.links,
    )


def tiles(outcome: Mapping[str, Any]) -> list[Tile]:
    """Beside each other under the headline."""
    shown = []
    for name, of in outcome["groups"].items():
        if of["median_px"] is not None:
            low, high = (number(end) for end in of["quartiles_px"])
            note = f"simulated; half of {of['touches']} touches within {low} to {high} px"
            shown.append(Tile(f"{name}, n = {of['people']}", f"{number(of['median_px'])} px", note))
    main = outcome["conditions"].get(outcome["main"])
    if main is not None and main["transfer"] is not None:
        interval = main["ci95"] and f"95 % interval {ends(main['ci95'])}"
        note = f"simulated; {interval or main['reason']}"
        shown.append(Tile(f"transfer of {outcome['main']}", number(main["transfer"]), note))
    return shown


def ends(interval: Sequence[float] | None) -> str:
    """Of a 95 % interval in words; empty without one."""
    return "" if interval is None else f"{number(interval[0])} to {number(interval[1])}"


def told(value: float | None) -> str:
    """A number, or nothing."""
    return "" if value is None else number(value)


def condition_rows(outcome: Mapping[str, Any]) -> list[Row]:
    """Smallest median first."""
    by_median = sorted(
        outcome["conditions"].items(), key=lambda one: (one[1]["median_px"] is None, one[1]["median_px"])
    )
    return [
        (
            name, str(of["people"]), str(of["sessions"]), " or ".join(map(str, of["sessions_familiarised"])),
            told(of["median_px"]), told(of["iqr_px"]), told(of["left_over_Nm"]), told(of["friction_Nm"]),
            told(of["first_window_up_mm"]), told(of["transfer"]), ends(of["ci95"]), of["reason"] or "",
        )
        for name, of in by_median
    ]  # fmt: skip


def secondary_rows(outcome: Mapping[str, Any]) -> list[Row]:
    """The same transfer by other measures of the first window."""
    return [
        (
            name,
            *(
                f"{told(value['transfer'])} ({ends(value['ci95'])})" if value["ci95"] else told(value["transfer"])
                for value in (of, of["first_touch"], of["median_deviation"])
            ),
        )
        for name, of in outcome["conditions"].items()
        if of["transfer"] is not None
    ]


def ablation_rows(rows: Sequence[Ablated]) -> list[Row]:
    """Condition by condition, all as they are first."""
    return [
        (
            row.condition, row.off, ", ".join(f"{name} = {value:g}" for name, value in row.constants.items()),
            str(row.people), told(row.first_window_up_mm), told(row.familiarised_up_mm), told(row.transfer),
            ends(row.ci95), told(row.change), ends(row.change_ci95), row.reason or "",
        )
        for row in rows
    ]  # fmt: skip


def person_rows(outcome: Mapping[str, Any]) -> list[Row]:
    """Each person of the main study."""
    return [
        (code, name, number(median), told(of["first_window_up_mm_by_person"].get(code)))
        for name, of in outcome["groups"].items()
        for code, median in of["median_px_by_person"].items()
    ]
