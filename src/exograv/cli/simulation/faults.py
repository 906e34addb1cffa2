"""Command `exograv dev faults` and the table of its result."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from exograv.campaigns.faults.options import FaultOptions
from exograv.cli.shell.base_options import OutFolder, write_json
from exograv.cli.shell.motion_note import say_twin
from exograv.results import json_value

if TYPE_CHECKING:
    from exograv.campaigns.faults.figures import CampaignFigures, FaultFigures, GuardEndFigures, StrikeFigures

ROOM_FOR_WORDS = 160
"""Terminal width from which each fault is also described in a sentence [columns]."""

HANDS_SHOWN = 20
"""Number of flights with a fast hand that are listed, the fastest first; the JSON file has all of them."""

ROOM_FOR_TABLE = 72
"""Terminal width below which a table would cut off figures, so that each fault has a line of text [columns]."""


def run_faults_command(options: FaultOptions, common: OutFolder) -> "CampaignFigures":
    """Inject thousands of faults into simulated machine, control and person, and evaluate the guard's reactions."""
    from exograv.campaigns.faults.campaign import Campaign, run_campaign
    from exograv.cli.shell.terminal import bars

    campaign = Campaign(**vars(options), out=common.out)
    say_twin(campaign.twin)
    with bars() as progress:
        result = run_campaign(campaign, progress)
    show_faults(result)
    if campaign.replay is None and result.scenarios < len(campaign.numbers):
        print(f"{result.scenarios} of {len(campaign.numbers)} scenarios were flown. Continue with --resume.")
        if common.json is not None:
            write_json(common.json, json_value(result))
        raise KeyboardInterrupt
    return result


def show_faults(result: "CampaignFigures") -> None:
    """Print the tables of faults, hand speeds and missed budgets, then the counts that must be zero."""
    from rich.console import Console

    console = Console()
    _show_rows(console, result)
    _show_hands(console, result)
    _show_misses(console, result)
    for line in result.relaxed_hand_every_flight_m_s.cases[:HANDS_SHOWN]:
        console.print(f"  {line}", highlight=False, soft_wrap=True)
    for title in ("envelope_violations", "unexplained_misses", "diverged"):
        console.print(f"{title.replace('_', ' ')}: {getattr(result, title)}", highlight=False)
    console.print(
        f"{len(result.false_trips)} false trips in {result.quiet_hours:g} h; 95 % bound "
        f"{result.false_trips_per_hour_at_most} per hour.",
        highlight=False,
    )
    for line in (*result.crashed, *result.violations, *result.missed, *result.false_trips):
        console.print(f"  {line}", highlight=False, soft_wrap=True)
    if result.live and result.live.not_struck:
        console.print(f"Not struck: {', '.join(result.live.not_struck)}. {result.live.outcome}")
    if result.course is not None:
        console.print(json_value(result.course))
    for line in result.replay:
        console.print(f"again: {line}", highlight=False, soft_wrap=True)


def _show_rows(console: Any, result: "CampaignFigures") -> None:
    title = f"{result.scenarios} scenarios, {result.ticks} ticks, seed {result.seed}"
    through = result.through
    title += f", through {through}" if through else ""
    has_room = console.width >= ROOM_FOR_WORDS
    words = ("fault", *(("what",) if has_room else ()), *(("done to",) if through and has_room else ()))
    headings = (*words, "alone", "found", "ms", "most", "budget", "missed", "known")
    _show_table(
        console, title, headings, words, [_cells(name, row, words) for name, row in result.by_fault.items() if row.runs]
    )


def _show_hands(console: Any, result: "CampaignFigures") -> None:
    """Print the hand speeds of relaxed arms by fault, for flights with a stop and for all flights."""
    stopped, every = result.relaxed_hand_m_s, result.relaxed_hand_every_flight_m_s
    title = f"Hands of relaxed arms above {every.allowed:g} m/s, of flights with one fault"
    headings = ("fault", "stopped", "above", "m/s", "all", "above", "m/s")
    rows: list[list[str]] = []
    for name, row in result.by_fault.items():
        # Rows of strikes have no hands.
        hands, after = getattr(row, "hands", None), getattr(row, "hands_stopped", None)
        if hands is not None and after is not None and hands.runs:
            numbers = (after.runs, after.above, after.max, hands.runs, hands.above, hands.max)
            rows.append([name, *map(_number, numbers)])
    if rows:
        _show_table(console, title, headings, ("fault",), rows)
    pairs = result.pairs
    for what, hand in (("after a stop by one fault", stopped), ("in all flights, stopped or not", every)):
        console.print(
            f"Hand of a relaxed person {what}: at most {hand.max} m/s, above {hand.allowed} in {hand.above} of "
            f"{hand.runs}.",
            highlight=False,
        )
    console.print(
        f"Several faults: {pairs.missed} of {pairs.runs} flights missed their budgets together.", highlight=False
    )


def _show_misses(console: Any, result: "CampaignFigures") -> None:
    """Print each missed criterion with its figure and its cause."""
    for name, row in result.by_fault.items():
        for measure, miss in getattr(row, "misses", {}).items():
            worst = "not found in time" if miss.worst is None else f"worst {miss.worst:g}"
            limit = "" if miss.limit is None else f" of {miss.limit:g}"
            cause = miss.cause or "The cause is not known."
            beyond = f" {miss.unexplained} exceed what this explains." if miss.cause and miss.unexplained else ""
            console.print(
                f"{name} misses {measure}{limit} in {miss.runs} of {row.alone}, {worst}. {cause}{beyond}",
                highlight=False,
            )


def _show_table(
    console: Any, title: str, headings: Sequence[str], words: Sequence[str], rows: Sequence[Sequence[str]]
) -> None:
    """Print a table; a narrow terminal gets one line of text per row."""
    from rich.table import Table

    if console.width < ROOM_FOR_TABLE:
        console.print(title)
        for name, *cells in rows:
            told = ", ".join(f"{heading} {cell}" for heading, cell in zip(headings[1:], cells, strict=True))
            console.print(f"{name}: {told}", highlight=False)
        return
    table = Table(title=title)
    for heading in headings:
        table.add_column(heading, justify="left" if heading in words else "right", no_wrap=True)
    for cells in rows:
        table.add_row(*cells)
    console.print(table)


def _cells(name: str, row: "FaultFigures | StrikeFigures | GuardEndFigures", words: Sequence[str]) -> list[str]:
    numbers = (row.alone, row.detected, row.reaction_ms.p50, row.reaction_ms.max)
    numbers = (*numbers, row.budget_ms, row.missed, getattr(row, "known", 0))
    told = {"fault": name, "what": row.what, "done to": getattr(row, "injected_by", "")}
    return [*(told[word] for word in words), *map(_number, numbers)]


def _number(cell: float | int | None) -> str:
    return "–" if cell is None else f"{cell:g}"
