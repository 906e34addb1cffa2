"""Command `exograv data replay` and the table of its result."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.loop.replay.options import InsteadOptions

if TYPE_CHECKING:
    from exograv.loop.replay.difference import TorqueDifference

    from .replaying import ReplayFigures, ReplayResult

TITLE = "Commanded torque, replayed minus recorded: RMS (largest) [N·m]"

ROOM_FOR_JOINT = 12
"""Columns of a terminal per cell. If the terminal is narrower, each phase has a line of text, not a table row."""


@dataclass(frozen=True)
class Recording:
    """Options of `exograv data replay`: the recording to replay."""

    file: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Recording of `exograv demo`, `exograv arm identify` or `exograv run live` (.mcap)."""


def run_replay_command(recording: Recording, options: InsteadOptions, common: OutFolder) -> "ReplayResult":
    """Compute the decisions of control and guard again from recorded measurements; exit status 1 if they differ.

    With another person, calibration, gravity level or machine, the result shows how the torque would have differed.
    """
    from exograv.cli.shell.terminal import FIRST_LINE_S, bars
    from exograv.loop.replay.what_if import ReplayOverrides

    from .replaying import run_replay

    refuse_unwritable(common.out / "replay.png", "--out")
    with bars(FIRST_LINE_S) as progress:
        result = run_replay(recording.file, common.out, progress, ReplayOverrides(**vars(options)))
    show_replay(result.figures, result.figure)
    return result


def show_replay(result: "ReplayFigures", figure: Path | None) -> None:
    """Print a table of phases and joints, then the answer in a sentence."""
    from rich.console import Console

    console = Console()
    if console.width < ROOM_FOR_JOINT * (2 + len(result.joints)):
        console.print(TITLE)
        for name, ticks, cells in _rows(result):
            told = ", ".join(
                f"{joint.replace('_', ' ')} {cell}" for joint, cell in zip(result.joints, cells, strict=True)
            )
            console.print(f"{name}, {ticks} ticks: {told}.", highlight=False)
    else:
        console.print(_table(result))
    flown = [] if result.world is None else [f"Flown in the world '{result.world}' of the twin."]
    for line in [*flown, *result.circumstances, _answer(result)]:
        console.print(line, highlight=False)
    console.print(f"Figure: {figure}", highlight=False, soft_wrap=True)


def _table(result: "ReplayFigures") -> Any:
    from rich.table import Table

    table = Table(title=TITLE, title_justify="left")
    table.add_column("phase")
    table.add_column("ticks", justify="right")
    for joint in result.joints:
        table.add_column(joint.replace("_", " "), justify="right")
    for name, ticks, cells in _rows(result):
        table.add_row(name, str(ticks), *cells)
    return table


def _rows(result: "ReplayFigures") -> list[tuple[str, int, list[str]]]:
    """Return phase, number of ticks, and a cell per joint."""
    rows = [(phase.name, phase.ticks, phase.tau_commanded) for phase in result.phases]
    rows.append(("all", result.ticks, result.difference_Nm["tau_commanded"]))
    return [(name, ticks, _cells(found) or ["–"] * len(result.joints)) for name, ticks, found in rows]


def _cells(found: "TorqueDifference") -> list[str]:
    pairs = zip(found.rms, found.max, strict=True)
    return [f"{rms:.2g} ({largest:.2g})" if largest else "0" for rms, largest in pairs]


def _answer(result: "ReplayFigures") -> str:
    first, states, guard = result.first_difference, result.safe_state_differs, result.guard_states
    if first is None and not states.ticks and result.ok:
        bits = "to the last bit" if all(result.bit_identical.values()) else f"within {result.resolution_Nm:g} N·m"
        given = f" In {result.given} ticks the torque of control was taken from the recording." if result.given else ""
        of_all = guard.equal + len(guard.differ_s)
        whole = f" The guard's whole state is equal in {guard.equal} of {of_all} recorded moments." if of_all else ""
        return f"The same decisions in {result.ticks} ticks, {bits}.{whole}{given}"
    words = []
    if first is not None:
        size = "is decided in one of the two only" if first.Nm is None else f"by {first.Nm:g} N·m"
        words.append(f"first at {first.t:.3f} s (tick {first.tick}): {first.what} of {first.joint} {size}")
    if states.ticks:
        words.append(f"another safe state in {states.ticks} ticks, first at {states.first_s:.3f} s")
    if guard.differ_s:
        words.append(f"another state of the guard {len(guard.differ_s)} times, first at {guard.differ_s[0]:.3f} s")
    return f"It differs, {'; '.join(words)}."
