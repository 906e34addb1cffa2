"""Command `exograv study power` and the tables of its result."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from exograv.cli.shell.base_options import OutFolder
from exograv.errors import ConfigError
from exograv.options import Acts
from exograv.results import MERGED
from exograv.study.power.options import CurveOptions, Price

if TYPE_CHECKING:
    from exograv.study.power.curve import CurveRow, PowerResult, WhatMatters
    from exograv.study.power.pilot import PilotVariance


OF_PILOT = Acts(lambda all_: all_.pilot is not None, "with --from")


@dataclass(frozen=True)
class PowerAssumptions:
    """Assumptions about the next study, and the pilot that gives the others."""

    pilot: Annotated[Path | None, tyro.conf.arg(name="from")] = None
    """Folder of a completed study, the pilot. Values that are given as options replace those of the pilot."""

    sd: float | None = None
    """Standard deviation between people of a group [log units]; 0.35 is a factor of 1.4."""

    difference: float | None = None
    """Difference between the groups [log units]; 0.69 is half the deviation. By default 0.69 without --from, as
    published, and with --from the value of the pilot, which is usually too large."""

    touch_sd: float | None = None
    """Standard deviation between touches of a person [log units]; 0.6 without --from."""

    window_sd: float | None = None
    """Standard deviation between windows of a person [log units]; 0 without --from."""

    flight_sd: float = 0.0
    """Standard deviation between flights of a person [log units]."""

    windows: int | None = None
    """Number of windows of a flight; 31 without --from."""

    touches: int | None = None
    """Number of counted touches in a window; 8 without --from."""

    flights: int = 1
    """Number of flights of each person."""

    alpha: float = 0.05
    """Accepted probability of a false positive."""

    groups: Annotated[str | None, OF_PILOT] = None
    """Two groups of the pilot, separated by a comma; by default the first two in its study.toml."""

    protocol: Annotated[str, OF_PILOT] = "flight"
    """Protocol of the pilot whose touches are compared."""


@dataclass(frozen=True)
class SpreadFigures:
    """Standard deviation with its interval [log units]."""

    median: float
    ci95: tuple[float, float]


@dataclass(frozen=True)
class PilotFigures:
    """Summary of the pilot; spreads and difference in log units."""

    people: tuple[int, int]
    touches: int
    difference: float
    person_sd: SpreadFigures
    touch_sd: float
    window_sd: float
    is_simulated: bool
    """True if the participants of the pilot were simulated."""

    left_out: tuple[str, ...]


@dataclass(frozen=True)
class PlannedPower:
    """Result of `exograv study power`."""

    power: "PowerResult" = field(metadata=MERGED)
    pilot: PilotFigures | None
    figure: Path


def run_power(command: PowerAssumptions, asked: CurveOptions, price: Price, common: OutFolder) -> PlannedPower:
    """Compute how many people the next study needs, from a pilot or assumptions.

    All standard deviations are those of the natural logarithm of the deviation from the target.
    """
    from exograv.cli.shell.terminal import bars
    from exograv.report.study_figures.power import draw
    from exograv.report.style.figure_style import write_picture
    from exograv.study.power.assumptions import LOG_2, TOUCH_SD, PlannedStudy
    from exograv.study.power.curve import power_study

    if command.pilot is None and command.sd is None:
        raise ConfigError(
            "The spread between people is not known. Give a study with --from, or give --sd, such as 0.35 log units."
        )
    pilot, is_simulated = (None, False) if command.pilot is None else _pilot(command, command.pilot)

    def first(stated: float | int | None, of_pilot: float | int | None, otherwise: float | int = 0.0) -> float | int:
        return stated if stated is not None else of_pilot if of_pilot is not None else otherwise

    plan = PlannedStudy(
        difference=first(command.difference, pilot and pilot.difference, LOG_2),
        person_sd=first(command.sd, pilot and pilot.grid.person_sd_quantile(0.5)),
        touch_sd=first(command.touch_sd, pilot and pilot.touch_sd, TOUCH_SD),
        window_sd=first(command.window_sd, pilot and pilot.window_sd),
        flight_sd=command.flight_sd,
        windows=round(first(command.windows, pilot and pilot.windows, 31)),
        touches=round(first(command.touches, pilot and max(1.0, pilot.touches_per_window), 8)),
        flights=command.flights,
        alpha=command.alpha,
    )
    with bars() as progress:
        # A stated spread is taken as known: the uncertainty of the pilot's spread is then ignored.
        carried = None if command.sd is not None else pilot
        result = power_study(plan, price, asked, progress, carried, command.difference is not None)
    figure = write_picture(common.out / "power.svg", lambda: draw(result, is_simulated))
    shown = PlannedPower(result, None if pilot is None else _of_pilot(pilot, is_simulated), figure)
    show_power(shown)
    return shown


def _pilot(command: PowerAssumptions, folder: Path) -> "tuple[PilotVariance, bool]":
    """Read the pilot; return it with True if its participants were simulated."""
    from exograv.study.dataset.tables import read_tables
    from exograv.study.folder.columns import TOUCHES
    from exograv.study.folder.settings import read_settings
    from exograv.study.folder.study_folder import StudyFolder
    from exograv.study.measures.pointing import counted
    from exograv.study.measures.selecting import columns
    from exograv.study.power.pilot import read_pilot

    known = list(read_settings(StudyFolder(folder)).groups)
    groups = known[:2] if command.groups is None else command.groups.split(",")
    if len(groups) != 2 or groups[0] == groups[1] or not {*groups} <= {*known}:
        given = "absent" if command.groups is None else f"'{command.groups}'"
        raise ConfigError(
            f"--groups is {given}; give two groups of study.toml, separated by a comma: {', '.join(known)}."
        )
    tables = read_tables(folder)
    touches = columns(counted(tables), [one.name for one in TOUCHES])
    pilot = read_pilot(touches, tables.participants, (groups[0], groups[1]), command.protocol)
    of_protocol = tables.sessions[tables.sessions["protocol"] == command.protocol]
    return pilot, bool(of_protocol["is_simulated"].any())


def _of_pilot(pilot: "PilotVariance", is_simulated: bool) -> PilotFigures:
    low, middle, high = (pilot.grid.person_sd_quantile(share) for share in (0.025, 0.5, 0.975))
    spread = SpreadFigures(middle, (low, high))
    return PilotFigures(
        pilot.people, pilot.touches, pilot.difference, spread, pilot.touch_sd, pilot.window_sd, is_simulated,
        pilot.left_out,
    )  # fmt: skip


def show_power(shown: PlannedPower) -> None:
    """Print the power curve as a table, and the conclusions."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    result, pilot = shown.power, shown.pilot
    assumed, curve = result.assumptions, result.curve
    headings = {
        "n": ("people\nper group", "{:d}"),
        "power": ("power", "{:.2f}"),
        "assurance": ("assurance", "{:.2f}"),
        "p_min": ("smallest\np", "{:.2g}"),
        "width_factor": ("95 %:\n×, ÷", "{:.2f}"),
        "seats": ("seats", "{:d}"),
        "flights": ("flights", "{:d}"),
        "cost": ("cost", "{:,.0f}"),
    }
    columns = {key: value for key, value in headings.items() if getattr(curve[0], key) is not None}
    table = Table(title=f"Ratio {assumed.ratio:.2g}, spread between people {assumed.plan.person_sd:.2f} log units")
    for heading, _ in columns.values():
        table.add_column(heading, justify="right")
    for row in told(curve, result.n_per_group):
        table.add_row(*(text.format(getattr(row, key)) for key, (_, text) in columns.items()))
    console.print(table)
    console.print(_what_matters(result.matters))
    if pilot is not None:
        low, high = pilot.person_sd.ci95
        console.print(
            f"Pilot: {pilot.people[0]} and {pilot.people[1]} people; their spread lies between {low:.2f} and "
            f"{high:.2f} log units (95 %).",
            highlight=False,
        )
        for sentence in pilot.left_out:
            console.print(f"Left out: {sentence}", highlight=False)
    if pilot is not None and pilot.is_simulated:
        console.print("The pilot is simulated: this is no evidence about people.", style="bold", highlight=False)
    for sentence in result.sentences:
        console.print(sentence, highlight=False)
    console.print(f"Figure: {shown.figure}", highlight=False, soft_wrap=True)


def told(curve: Sequence["CurveRow"], needed: dict[str, int | None]) -> "list[CurveRow]":
    """Return the rows up to twelve people, every fourth row after that, and the rows of `needed`."""
    return [row for row in curve if row.n <= 12 or row.n % 4 == 0 or row.n in needed.values()]


def _what_matters(matters: "WhatMatters") -> Any:
    """Return a table of power by number of windows, of touches and of flights."""
    from rich.table import Table

    table = Table(title=f"Power at {matters.n} people per group", show_header=False)
    for name in ("windows", "touches", "flights"):
        cells = [f"{getattr(row, name)}: {row.power:.2f}" for row in matters.rows if getattr(row, name) is not None]
        table.add_row(name, "   ".join(cells))
    return table
