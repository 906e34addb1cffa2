"""Page of a virtual study: sentences, tables and four figures in one file, with SIMULATED on every part."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from markupsafe import Markup

from exograv.report.study_report.results import number
from exograv.report.style.figure_style import JOURNAL, house_style, write_figure
from exograv.report.style.page import NO_EVIDENCE as SIMULATED
from exograv.report.style.page import Block, Bullets, Chapter, Page, Table, Text, Tile, write_page

from . import ablation
from . import figure_curves as curves
from . import figure_flights as flights
from . import figure_sensitivity as sensitivity
from . import figure_windows as windows
from .ablation import Ablated
from .figure_sensitivity import SensitivityPoint
from .flight import VirtualFlight
from .outcome import NO_EVIDENCE, StudyOutcome
from .sentences import headline, sentences

Row = tuple[str, ...]

ABLATION = (
    "training", "what is off", "constants", "people", "E [mm]", "E₀ [mm]", "transfer", "95 % interval", "change",
    "95 % interval of it", "why not",
)  # fmt: skip
CONDITIONS = (
    "training", "people", "sessions before E", "before E₀", "median [px]", "IQR [px]", "left over [N·m]",
    "friction [N·m]", "first window, up [mm]", "transfer", "95 % interval", "why not",
)  # fmt: skip
MEASURES = ("training", "constant error", "first touch alone", "median deviation")
SECONDARY = Text("Secondary. A deviation has no sign and includes scatter, which no training removes.")


@dataclass(frozen=True)
class Content:
    """Content of the page of a virtual study."""

    outcome: StudyOutcome

    flights: Sequence[VirtualFlight]
    settings: Mapping[str, str]
    """Settings of the study in the order shown: seed, people, sessions, versions …"""

    swept: Sequence[SensitivityPoint] = ()
    swept_usual: float | None = None
    """Transfer [-] with all constants at their usual values, in the shorter sessions of the sweep."""
    links: Mapping[str, str] = field(default_factory=dict)
    """Links to the study's report and its data set: text and address, preferably relative to the page."""

    ablated: Sequence[Ablated] = ()
    left_out: Sequence[str] = ()
    """Sentences about people whose machine was refused in a condition."""


def write_virtual_page(folder: Path, content: Content) -> tuple[Path, tuple[Path, ...]]:
    """Write figures as SVG and PNG under `figures/`, and `virtual_study.html`.

    Raises:
        RecordingError: The folder cannot be written.
    """
    with house_style(JOURNAL):
        pictures = list(drawn(content))
        shown = ((one.name, one.figure) for one in pictures if one.figure is not None)
        files = [path for name, figure in shown for path in write_figure(folder / "figures", name, figure)]
    return write_page(folder / "virtual_study.html", page_of(content, pictures)), tuple(files)


def drawn(content: Content) -> Iterator[Chapter]:
    """Yield the chapters that have a figure, for all data that exist."""
    found = (
        ("flights", "Deviation in flight", flights.draw(content.flights), flights.TEXT),
        ("windows", "The course of the flight", windows.draw(content.flights), windows.TEXT),
        ("transfer", "Transfer, what is left over, friction", curves.draw(content.outcome.transfer), curves.TEXT),
        ("sensitivity", "What it depends on",
         sensitivity.draw(content.swept, content.swept_usual), sensitivity.TEXT),
    )  # fmt: skip
    for name, title, figure, text in found:
        if figure is not None:
            yield Chapter(title, (), name, figure, text)


def page_of(content: Content, pictures: Sequence[Chapter]) -> Page:
    """Return the page with these chapters in its middle. The same content gives the same page."""
    return Page(
        headline=headline(content.outcome),
        title="Virtual study",
        line="Virtual study",
        simulated=SIMULATED,
        mark="SIMULATED",
        tiles=tiles(content.outcome),
        chapters=[Chapter("What it says, and what not", list(_says(content)), "says"), *pictures, *_tables(content)],
    )


def _says(content: Content) -> Iterator[Block]:
    said = sentences(content.outcome, content.swept, content.swept_usual, content.ablated)
    yield Text(NO_EVIDENCE, "strong")
    yield Bullets([*said, *content.left_out])
    links = (Markup('<a href="{}">{}</a>').format(address, words) for words, address in content.links.items())
    if content.links:
        yield Markup(" · ").join(links)


def _tables(content: Content) -> Iterator[Chapter]:
    outcome, limits = content.outcome, getattr(content.outcome.direction.whole_flight, "limits", [])
    if content.ablated:
        table = Table(ABLATION, ablation_rows(content.ablated))
        yield Chapter("From which mechanism transfer comes", [Text(ablation.TEXT), table], "mechanisms")
    blocks: list[Block] = [Table(CONDITIONS, condition_rows(outcome))]
    if rows := secondary_rows(outcome):
        blocks += [Text("Transfer by other measures of the first window", "heading"), SECONDARY, Table(MEASURES, rows)]
    yield Chapter("Each training", blocks, "conditions")
    if rows := person_rows(outcome):
        people: list[Block] = [Table(("person", "group", "median [px]", "first window, up [mm]"), rows)]
        yield Chapter("Each person of the main study", people + ([Bullets(limits)] if limits else []), "people")
    told = outcome.transfer
    enters = [
        f"Over {words}: {getattr(told, name).which_flights}"
        for name, words in (("by_left_over", "what is left over"), ("by_friction", "friction"))
    ]
    yield Chapter("Definitions", [told.definition, *enters], "definitions")
    yield Chapter("Settings", [Table(("setting", "value"), list(content.settings.items()))], "settings")


def tiles(outcome: StudyOutcome) -> list[Tile]:
    """Tiles beside each other under the headline."""
    shown = []
    for name, of in outcome.groups.items():
        if of.median_px is not None:
            low, high = (number(end) for end in of.quartiles_px or ())
            note = f"simulated; half of {of.touches} touches within {low} to {high} px"
            shown.append(Tile(f"{name}, n = {of.people}", f"{number(of.median_px)} px", note))
    main = outcome.conditions.get(outcome.main)
    if main is not None and main.transfer is not None:
        interval = main.ci95 and f"95 % interval {ends(main.ci95)}"
        note = f"simulated; {interval or main.reason}"
        shown.append(Tile(f"transfer of {outcome.main}", number(main.transfer), note))
    return shown


def ends(interval: Sequence[float] | None) -> str:
    """Return the ends of a 95 % interval as text; empty without an interval."""
    return "" if interval is None else f"{number(interval[0])} to {number(interval[1])}"


def told(value: float | None) -> str:
    """Format a number; empty for None."""
    return "" if value is None else number(value)


def condition_rows(outcome: StudyOutcome) -> list[Row]:
    """Rows of the table of conditions, the smallest median first."""
    by_median = sorted(outcome.conditions.items(), key=lambda one: (one[1].median_px is None, one[1].median_px))
    return [
        (
            name, str(of.people), str(of.sessions), " or ".join(map(str, of.sessions_familiarised)),
            told(of.median_px), told(of.iqr_px), told(of.left_over_Nm), told(of.friction_Nm),
            told(of.first_window_up_mm), told(of.transfer), ends(of.ci95), of.reason or "",
        )
        for name, of in by_median
    ]  # fmt: skip


def secondary_rows(outcome: StudyOutcome) -> list[Row]:
    """Rows of the transfer of each condition, by three measures of the error in the first window."""
    return [
        (
            name,
            *(
                f"{told(value.transfer)} ({ends(value.ci95)})" if value.ci95 else told(value.transfer)
                for value in (of, of.first_touch, of.median_deviation)
            ),
        )
        for name, of in outcome.conditions.items()
        if of.transfer is not None
    ]


def ablation_rows(rows: Sequence[Ablated]) -> list[Row]:
    """Rows of the ablation by condition; the row with all mechanisms comes first."""
    return [
        (
            row.condition, row.off, ", ".join(f"{name} = {value:g}" for name, value in row.constants.items()),
            str(row.people), told(row.first_window_up_mm), told(row.familiarised_up_mm), told(row.transfer),
            ends(row.ci95), told(row.change), ends(row.change_ci95), row.reason or "",
        )
        for row in rows
    ]  # fmt: skip


def person_rows(outcome: StudyOutcome) -> list[Row]:
    """Rows of each person of the main study."""
    return [
        (code, name, number(median), told(of.first_window_up_mm_by_person.get(code)))
        for name, of in outcome.groups.items()
        for code, median in of.median_px_by_person.items()
    ]
