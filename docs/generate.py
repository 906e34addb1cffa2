"""Write the pages of the documentation that come from the code: the commands with their options, and the public API.

    python docs/generate.py
"""

import inspect
import os
from pathlib import Path

import tyro

import exograv
from exograv.cli import GROUPS
from exograv.cli.shell.command import command_class

FOLDER = Path(__file__).parent / "reference" / "generated"
COLUMNS = "100"


def main() -> None:
    """Write both pages."""
    os.environ["COLUMNS"] = COLUMNS
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / "commands.md").write_text(commands(), encoding="utf-8")
    (FOLDER / "api.md").write_text(api(), encoding="utf-8")


def commands() -> str:
    """One section per group and command, with the text of `--help`."""
    parts = ["# Commands", "The text of `exograv COMMAND --help`, for every command."]
    for group, (about, members) in GROUPS.items():
        parts += [f"## {group}", about]
        for name, action in members.items():
            parser = tyro.extras.get_parser(command_class(action), prog=f"exograv {group} {name}", config=CONFIG)
            parts += [f"### {name}", f"```text\n{parser.format_help().strip()}\n```"]
    return "\n\n".join(parts) + "\n"


CONFIG = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.SuppressFixed)


def api() -> str:
    """One section per public name."""
    parts = ["# Python API", "Every name below is an attribute of `exograv`. Names that are not listed here may change."]
    for name, module in sorted(exograv._MODULES.items()):
        value = getattr(exograv, name)
        kind = "autofunction" if inspect.isfunction(value) else "autoexception" if name.endswith("Error") else "autoclass"
        parts += [f"## {name}", f"```{{eval-rst}}\n.. {kind}:: exograv.{module}.{name}\n```"]
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    main()
