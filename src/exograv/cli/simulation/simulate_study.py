"""`exograv simulate-study`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.cli.shell.base_options import Common, named_number, whole_pair, write_json
from exograv.errors import ConfigError


@dataclass(frozen=True)
class SimulateStudy(Common):
    """Virtual people train, fly and are compared: what a training is worth in flight. No evidence about people."""

    participants: Annotated[str, tyro.conf.arg(metavar="A,B")] = "3,3"
    """Trained and untrained."""

    sessions: Annotated[str, tyro.conf.arg(metavar="A,B")] = "16,4"
    """Of each before the flight: trainings, familiarisations."""

    conditions: str = "dam"
    """By commas; the trained group has the first. table, gcm, gradient, dam, ideal, water, parabolic; with a machine
    also @quasi-direct, +left=0.2 (share of the weight left on purpose), +friction=2 (over the machine's own)."""

    compared: Annotated[str, tyro.conf.arg(metavar="A,B")] = "4,1"
    """Sessions before flights that only compare conditions, at most."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    windows: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Only so many of each protocol, to try it."""

    flight_windows: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Only so many of the flight's: one is enough for transfer. As --windows where absent."""

    constant: tuple[str, ...] = ()
    """NAME=VALUE of the virtual participants (docs/virtual_participant.md), such as width=0.1."""

    sensitivity: bool = False
    """Sweep every constant of the virtual people that no source was read for, too: transfer at its low and high end."""

    ablate: bool = False
    """Fly all conditions with one mechanism of the virtual people off at a time, too: from which transfer comes."""

    processes: int = 2
    """At the same time; figures do not depend on it."""

    resume: bool = False
    """Go on with the study in the folder of `--out`."""


def run_simulate_study(command: SimulateStudy) -> dict[str, Any]:
    """Run it and say what came out."""
    from exograv.campaigns.virtual_study.options import StudyOptions
    from exograv.campaigns.virtual_study.study import Work, simulate_study
    from exograv.cli.shell.terminal import bars

    if not 1 <= command.processes <= 64:
        raise ConfigError(f"--processes is {command.processes}; allowed: 1 to 64.")
    options = StudyOptions(
        participants=whole_pair(command.participants, "--participants"),
        sessions=whole_pair(command.sessions, "--sessions"),
        conditions=tuple(name.strip() for name in command.conditions.split(",") if name.strip()),
        compared=whole_pair(command.compared, "--compared"),
        seed=command.seed,
        level=command.level,
        windows=command.windows,
        flight_windows=command.flight_windows,
        constants=dict(named_number(text, "--constant") for text in command.constant),
    )
    folder = command.out / f"simulated_study_{command.seed}" if command.out == Path("out") else command.out
    print(f"The study goes into {folder}. Ctrl-C keeps who is done; --resume goes on.")
    work = Work(folder, command.processes, command.resume, command.sensitivity, command.ablate)

    def keep(result: dict[str, Any]) -> None:
        if command.json is not None:
            write_json(command.json, result)

    with bars() as progress:
        result = simulate_study(options, work, progress, keep)
    show_study(result)
    return result


def show_study(result: dict[str, Any]) -> None:
    """One table of all conditions, and the two groups."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title="Simulated: nobody took part")
    for heading in ("after", "people", "median in flight, px", "left over, N·m", "first window, mm up", "transfer"):
        table.add_column(heading, justify="left" if heading == "after" else "right")
    for name, one in result["conditions"].items():
        interval = one.get("ci95")
        transfer = _number(one["transfer"], 2)
        if interval:
            transfer += f" ({_number(interval[0], 2)} to {_number(interval[1], 2)})"
        table.add_row(
            name, str(one["people"]), _number(one["median_px"], 1), _number(one["left_over_Nm"], 2),
            _number(one["first_window_up_mm"], 1), transfer,
        )  # fmt: skip
    console = Console()
    console.print(table)
    for group, one in result["groups"].items():
        console.print(f"{group}: {one['people']} people, median {_number(one['median_px'], 1)} px", highlight=False)
    console.print(result["note"], highlight=False)
    took = result["time"]
    spent_min = sum(took["spent_s"].values()) / 60
    console.print(
        f"{took['simulated_s'] / 3600:.1f} h of movement simulated in {spent_min:.1f} min of all processes together.",
        highlight=False,
    )
    for name, key in (("Page", "report"), ("Report of the study", "study_report"), ("Data set", "dataset")):
        console.print(f"{name}: {result[key]}", highlight=False, soft_wrap=True)


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
