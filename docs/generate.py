"""Write the pages that come from elsewhere: commands with their options, public API, notebooks, release notes.

python docs/generate.py
"""

import contextlib
import inspect
import io
import os
import re
import shutil
from pathlib import Path

import tyro

import exograv
from exograv.cli import ACTIONS, GROUPS, group_help
from exograv.cli.shell.command import Action, command_class

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "reference" / "generated"
COLUMNS = "100"


def main() -> None:
    """Write the pages."""
    os.environ["COLUMNS"] = COLUMNS
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / "commands.md").write_text(commands(), encoding="utf-8")
    (FOLDER / "api.md").write_text(api(), encoding="utf-8")
    (FOLDER / "release_notes.md").write_text((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), encoding="utf-8")
    for notebook in (ROOT / "examples" / "notebooks").glob("*.ipynb"):
        shutil.copy(notebook, FOLDER / f"notebook_{notebook.name}")


def commands() -> str:
    """One section per group and command, with the text of `--help`."""
    parts = ["# Commands", "The text of `exograv COMMAND --help`, for every command.", CONVENTIONS]
    parts += ["## Without a group"]
    for name, action in ACTIONS.items():
        group, _, member = name.rpartition(" ")
        if group and member == next(iter(GROUPS[group].commands)):
            parts += [f"## exograv {group}", f"```text\n{group_help(group)}\n```"]
        parts += [f"### exograv {name}", f"```text\n{help_of(name, action)}\n```"]
    return "\n\n".join(parts) + "\n"


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
    """One section per public name."""
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


if __name__ == "__main__":
    main()
