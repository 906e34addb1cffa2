"""Command that a message advises next, for the machine of the options at hand."""

import shlex
from pathlib import Path
from typing import Any

from exograv.options import OUT, MachineOptions

CARRIED = ("side", "level", "seed", "drives")
"""Options of the machine that the next command needs as well, with a value each."""


def same_machine(command: str, options: Any, out: Path = OUT, more: str = "") -> str:
    """Return the next command for the machine of these options.

    Args:
        command: Name of the next command.
        options: Options of the command that has ended or was refused.
        out: Folder of its files.
        more: Further words of the next command.
    """
    words = ["exograv", command]
    if _is_needed("rig", options):
        words.append(shlex.quote(str(options.rig)))
    for name in CARRIED:
        if _is_needed(name, options):
            words += [f"--{name}", shlex.quote(str(getattr(options, name)))]
    if getattr(options, "simulate", False):
        words.append("--simulate")
        if (twin := getattr(options, "twin", MachineOptions.twin)) != MachineOptions.twin:
            words += ["--twin", twin]
    if out != OUT:
        words += ["--out", shlex.quote(str(out))]
    return " ".join(filter(None, (*words, more)))


def calibration_command(options: Any, out: Path = OUT) -> str:
    """Return the command that calibrates the machine of these options into the file that they read.

    Args:
        options: Options of the command that needs the calibration.
        out: Folder of its files.
    """
    return same_machine("rig calibrate", options, out, calibration_words(options))


def calibration_words(options: Any) -> str:
    """Return the words of a command that name the calibration file of these options; empty for the usual file."""
    file = getattr(options, "calibration", None)
    return "" if file is None else f"--calibration {shlex.quote(str(file))}"


def _is_needed(name: str, options: Any) -> bool:
    """Return True if the next command would otherwise take another value. Its default can be another one."""
    value = getattr(options, name, None)
    return value is not None and not value == getattr(type(options), name) == getattr(MachineOptions, name)
