"""Command that usually follows a command, with the same machine."""

from pathlib import Path
from typing import Any

from exograv.cli.shell.base_options import OutFolder

CARRIED = ("side", "level", "seed", "drives")
"""Options of the machine that the next command needs as well, with a value each."""


def same_machine(command: str, options: Any, out: Path = OutFolder.out, more: str = "") -> str:
    """Return the next command for the machine of these options.

    Args:
        command: Name of the next command.
        options: Options of the command that has ended.
        out: Folder of its files.
        more: Further words of the next command.
    """
    kind = type(options)
    words = ["exograv", command]
    if options.rig != kind.rig:
        words.append(str(options.rig))
    for name in CARRIED:
        value = getattr(options, name, None)
        if value is not None and value != getattr(kind, name):
            words += [f"--{name}", str(value)]
    if getattr(options, "simulate", False):
        words.append("--simulate")
    if out != OutFolder.out:
        words += ["--out", str(out)]
    return " ".join(filter(None, (*words, more)))
