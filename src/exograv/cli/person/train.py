"""`exograv train`."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import Common
from exograv.errors import ConfigError


@dataclass(frozen=True)
class Train(Common):
    """A session of a protocol: somebody in the machine touches a target, window after window."""

    protocol: str = "training"
    """`training`, `familiarisation`, `flight`, or the path of a protocol of your own."""

    participant: str = ""
    """Code that stands for the person, such as P-07, never a name."""

    session: int = 1
    """Which one of this protocol it is for this person; it names the files."""

    simulate: bool = False
    """With the twin and a virtual participant, faster than real time, nobody there."""

    rig: str | None = None
    """Name of a machine (see `exograv rigs`) or path of its folder; `recupera_like`, in flight its passive sister."""

    side: Literal["right", "left"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    donning: int = 0
    """Day on which the twin's wearer is in the machine: 0 the first."""

    calibration: Path | None = None
    """calibration.toml of this machine (`exograv calibrate`); without it the machine is calibrated first."""

    person_file: Path | None = None
    """File of this person's arm: started from where it is there, written after the identification."""

    allocation: Path | None = None
    """The study's sealed list of groups (JSON)."""

    windows: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Only so many, to try it; the record then says that it is not the protocol."""

    verify_every: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """Verify after so many windows what is left over, 138 s of motion each time; 0 never."""

    lsl: bool = False
    """Push every record as a marker into Lab Streaming Layer, stamped with the moment and not with the twin's clock."""

    resume: bool = False
    """Go on with a run that was broken off, at the next window."""


def run_train_command(command: Train) -> dict[str, Any]:
    """Run it and say how it went."""
    from exograv.cli.shell.terminal import bars
    from exograv.experiment.train.options import TrainOptions
    from exograv.experiment.train.train_command import how_to_go_on, run_training

    if not command.simulate:
        raise ConfigError(
            "A session with a person is run at the console: exograv console --protocol NAME (docs/console.md). For one "
            "with nobody there give --simulate."
        )
    options = TrainOptions(
        protocol=command.protocol,
        participant=command.participant,
        session=command.session,
        rig=command.rig,
        side=command.side,
        level=command.level,
        seed=command.seed,
        donning=command.donning,
        calibration=command.calibration,
        person_file=command.person_file,
        allocation=command.allocation,
        windows=command.windows,
        verify_every=command.verify_every,
        resume=command.resume,
        lsl=command.lsl,
    )
    try:
        with bars() as progress:
            result = run_training(options, command.out, progress)
    except KeyboardInterrupt:
        print(f"\n{how_to_go_on(options, command.out) or 'No window had begun.'}", file=sys.stderr)
        raise
    show_training(result)
    return result


def show_training(result: dict[str, Any]) -> None:
    """What was touched, how far off, and where it is recorded."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{result['protocol']}, participant {result['participant']}, session {result['session']}")
    for heading in ("", "median", "quarter below", "quarter above"):
        table.add_column(heading, justify="right" if heading else "left")
    for name, unit in (("deviation_px", "px"), ("deviation_mm", "mm")):
        values = (result[name][key] for key in ("median", "q1", "q3"))
        table.add_row(f"deviation, {unit}", *("-" if value is None else f"{value:.1f}" for value in values))
    console = Console()
    console.print(table)
    rejected = ", ".join(f"{count} {reason}" for reason, count in result["rejected"].items()) or "none"
    per_window = result["touches_per_window"]["median"]
    lines = [
        f"{result['windows']} windows, {result['accepted']} touches that count of {result['touches']} "
        f"(rejected: {rejected}); {'no' if per_window is None else f'{per_window:g}'} touches a window in the median.",
        f"{result['simulated_s']:.0f} s simulated in {result['wall_s']:.0f} s; {result['recording_MB']:g} MB.",
    ]
    if not result["is_whole_protocol"]:
        lines.insert(0, "Not the whole protocol: --windows.")
    for line in lines:
        console.print(line, highlight=False)
    console.print(f"Report: {result['report']}", highlight=False, soft_wrap=True)
