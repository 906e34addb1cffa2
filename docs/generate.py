"""Write the pages that come from elsewhere: commands with their options, public API, notebooks, release notes.

python docs/generate.py
"""

import ast
import contextlib
import inspect
import io
import math
import os
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import get_args

import tyro
from fault_tables import fault_page
from settings_pages import SettingsFile, documentation, settings_page, table_of
from udp_tables import udp_tables

import exograv
from exograv.campaigns.sweep.study_file import StudyFile
from exograv.cli import ACTIONS, GROUPS, group_help
from exograv.cli.shell.command import Action, command_class
from exograv.experiment.steered.requests import Act
from exograv.laboratory.participant.habits import register
from exograv.laboratory.support_level.person_file import PersonFile
from exograv.model.rig_settings import RigSettings
from exograv.recording.document import format_document
from exograv.rig.drives.settings import DrivesSettings
from exograv.rig.twin.disturbances.levels import MACHINE, WEARER, LevelRow, Value
from exograv.rig.twin.foreign_arm.wearer_map import WearerMap
from exograv.storage.machine_readiness import NEEDED, WITHOUT_DRIVES
from exograv.study.folder.settings import StudySettings
from exograv.study.importers.xdf_mapping import XdfMapping
from exograv.task.assist_as_needed import AssistSettings
from exograv.task.assist_protocol import AssistProtocol
from exograv.task.protocol_schema import Protocol

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "reference" / "generated"
COLUMNS = "100"
SETTINGS_FILES = (
    SettingsFile("rig.toml", {RigSettings: ""}, "A machine, beside its URDF ([machines](../robots.md))."),
    SettingsFile(
        "drives.toml", {DrivesSettings: ""}, "Bus and drives of a machine ([bring-up](../../howto/rig_test.md))."
    ),
    SettingsFile("Protocol", {Protocol: ""}, "Sessions of the pointing task ([task](../../explanation/task.md))."),
    SettingsFile(
        "Assist protocol",
        {AssistProtocol: "", AssistSettings: "support"},
        "Adaptive support ([assist](../../howto/assist.md)).",
    ),
    SettingsFile("study.toml", {StudySettings: ""}, "A study and its groups ([studies](../../howto/study.md))."),
    SettingsFile("Sweep", {StudyFile: ""}, "Grid of simulated runs ([sweeps](../../howto/sweep.md))."),
    SettingsFile("Wearer map", {WearerMap: ""}, "A third party's arm ([arm models](../../howto/wearer_models.md))."),
    SettingsFile(
        "Person of little strength", {PersonFile: ""}, "A virtual person ([support](../../howto/support_level.md))."
    ),
    SettingsFile("XDF mapping", {XdfMapping: ""}, "Touches in a recording of LSL ([studies](../../howto/study.md))."),
)
"""Files that a person writes."""


def main() -> None:
    """Write the pages."""
    os.environ["COLUMNS"] = COLUMNS
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / "commands.md").write_text(commands(), encoding="utf-8")
    (FOLDER / "api.md").write_text(api(), encoding="utf-8")
    (FOLDER / "disturbances.md").write_text(disturbances(), encoding="utf-8")
    (FOLDER / "faults.md").write_text(fault_page(), encoding="utf-8")
    (FOLDER / "acts.md").write_text(acts(), encoding="utf-8")
    (FOLDER / "claims.md").write_text(claims(), encoding="utf-8")
    (FOLDER / "virtual_participant.md").write_text(participant_constants(), encoding="utf-8")
    (FOLDER / "settings.md").write_text(settings_page(SETTINGS_FILES), encoding="utf-8")
    (FOLDER / "udp_tables.inc").write_text(udp_tables(), encoding="utf-8")
    (FOLDER / "channels.md").write_text(format_document(), encoding="utf-8")
    (FOLDER / "release_notes.md").write_text((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), encoding="utf-8")
    for notebook in (ROOT / "examples" / "notebooks").glob("*.ipynb"):
        shutil.copy(notebook, FOLDER / f"notebook_{notebook.name}")


def commands() -> str:
    """One section per group and command, with the text of `--help`."""
    parts = ["# Commands", "The text of `exograv COMMAND --help`, for every command.", CONVENTIONS]
    parts += ["## Over drives", commands_over_drives()]
    parts += ["## Without a group"]
    for name, action in ACTIONS.items():
        group, _, member = name.rpartition(" ")
        if group and member == next(iter(GROUPS[group].commands)):
            parts += [f"## exograv {group}", f"```text\n{group_help(group)}\n```"]
        parts += [f"### exograv {name}", f"```text\n{help_of(name, action)}\n```"]
    return "\n\n".join(parts) + "\n"


def commands_over_drives() -> str:
    """Table of the commands for a machine: the checks that come before, or the reason why a command has no drives."""
    lines = [(f"`{name}`", "yes", ", ".join(needs) or "nothing") for name, needs in NEEDED.items()]
    lines += [(f"`{name}`", "no", f"{reason[0].upper()}{reason[1:]}.") for name, reason in WITHOUT_DRIVES.items()]
    return table(("command", "over drives", "what the machine must have passed, or why not"), lines)


def help_of(name: str, action: Action) -> str:
    """Text of `--help`, without the colours of a terminal."""
    with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.suppress(SystemExit):
        tyro.cli(command_class(action), prog=f"exograv {name}", args=["--help"], config=CONFIG)
    return re.sub(r"\x1b\[[0-9;]*m", "", said.getvalue()).strip()


CONVENTIONS = """- The machine is the first word after a command; `--rig NAME` is another spelling. Commands for a
  recording take the recording first.
- `--drives FILE` connects a real machine, `--simulate` simulated drives in its place; without both a command runs on
  the twin. Commands that can only simulate accept `--simulate` and do not need it.
- `--settings FILE.toml` reads options of any command: a table `[run.train]` for one command, keys of `[run]` for a
  group, keys at the top for all. `--write-settings FILE.toml` writes the options in force.
- Exit status: 0 done; 1 refused, failed, or a check that did not pass; 2 a command line that cannot be read; 130 ended
  by the keyboard."""

CONFIG = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.SuppressFixed)


def api() -> str:
    """Sections of the public names."""
    parts = [
        "# Python API",
        "Every name below is an attribute of `exograv`. Names that are not listed here may change.",
    ]
    for name, module in sorted(exograv._MODULES.items()):
        value = getattr(exograv, name)
        kind = (
            "autofunction" if inspect.isfunction(value) else "autoexception" if name.endswith("Error") else "autoclass"
        )
        parts += [f"## {name}", f"```{{eval-rst}}\n.. {kind}:: exograv.{module}.{name}\n```"]
    return "\n\n".join(parts) + "\n"


def disturbances() -> str:
    """One table of the wearer's and one of the machine's disturbances, with the size at every level."""
    parts = [
        "# Sizes of the disturbances",
        "A range is uniform, a dash means no limit. A size without a source is our choice "
        "([disturbances](../../explanation/disturbances.md)).",
    ]
    for title, rows in (("The wearer", WEARER), ("The machine", MACHINE)):
        lines = [line for name, row in rows.items() for line in disturbance_lines(name, row)]
        parts += [f"## {title}", table(("switch", "size", "column", *"01234"), lines), *sources(rows)]
    return "\n\n".join(parts) + "\n"


def disturbance_lines(name: str, row: LevelRow) -> list[tuple[str, ...]]:
    """One line per column of a disturbance; name and meaning stand in the first line only."""
    heads = [(f"`{name}`", row.meaning)] + [("", "")] * (len(row.columns) - 1)
    return [
        (*head, f"`{column}`", *(size(value) for value in values))
        for head, (column, values) in zip(heads, row.columns.items(), strict=True)
    ]


def sources(rows: Mapping[str, LevelRow]) -> list[str]:
    """List of the sources of sizes; none where all are our choice."""
    lines = [f"- `{name}`: {row.source}." for name, row in rows.items() if row.source]
    return ["Sources:", "\n".join(lines)] if lines else []


def size(value: Value) -> str:
    """Size of a disturbance as text."""
    if isinstance(value, tuple):
        return f"{value[0]:g}–{value[1]:g}"
    return "–" if math.isinf(value) else f"{value:g}"


def acts() -> str:
    """One section per act of a page, with the fields that only this act has."""
    kinds, _ = get_args(Act)
    parts = ["# Acts of a page", "Requests to a live session ([steering](../../howto/steering.md))."]
    for kind in get_args(kinds):
        head, rule, *rows = table_of(kind).splitlines()
        own = [row for row in rows if re.match(r"\| `(\w+)`", row)[1] in {*kind.__annotations__} - {"kind"}]  # pyright: ignore[reportOptionalSubscript]
        parts += [f"## {kind.model_fields['kind'].default}", documentation(kind)]
        parts += ["\n".join((head, rule, *own))] if own else []
    return "\n\n".join(parts) + "\n"


def claims() -> str:
    """One line per claim about the guard, with its meaning."""
    source = ast.parse((ROOT / "benchmarks" / "proof" / "promises.py").read_text(encoding="utf-8"))
    functions = [node for node in source.body if isinstance(node, ast.FunctionDef)]
    lines = [
        f"- `{one.name}`: {(ast.get_docstring(one) or '').removeprefix('Return True if ')}"
        for one in functions
        if one.name.startswith(("holds_", "promise_", "setting_"))
        and (ast.get_docstring(one) or "").startswith("Return True if ")
    ]
    lines += [
        "- bridge of machine, of control: the bridge ends at the latest after the allowed number of missed ticks.",
        "- missed ticks stop: too many missed ticks start a stop.",
        "- divisions: the guard never divides by zero.",
    ]
    return (
        "# Claims about the guard\n\n`make prove` uses these claims; the [proof](../../results/proof.md) has the "
        "results. A claim concerns any joint, before and after a call.\n\n" + "\n".join(lines) + "\n"
    )


def participant_constants() -> str:
    """One line per constant of a virtual participant."""
    lines = [
        (
            f"`{one.name}`",
            f"{one.value:.4g} {one.unit}".removesuffix(" -"),
            f"{one.low:.4g}–{one.high:.4g}",
            one.standing,
            one.source,
        )
        for one in register()
    ]
    return (
        "# Constants of a virtual participant\n\n"
        "Results are swept over the range. A `fitted` value was chosen with one published figure in view; that figure "
        "confirms nothing. Model: [virtual participant](../../explanation/virtual_participant.md).\n\n"
        + table(("constant", "value", "swept", "standing", "source or reason"), lines)
        + "\n"
    )


def table(head: tuple[str, ...], lines: list[tuple[str, ...]]) -> str:
    """Markdown table."""
    rows = [head, ("---",) * len(head), *lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


if __name__ == "__main__":
    main()
