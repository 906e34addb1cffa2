"""`exograv support-level`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from exograv.cli.shell.base_options import Common
from exograv.errors import ConfigError


@dataclass(frozen=True)
class SupportLevel(Common):
    """The smallest support of the arm's weight with which a weak person, virtual or recorded, reaches most targets."""

    rig: str = "recupera_like_qdd"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    strength: float | None = None
    """Of the virtual person over a healthy adult's; 0.1 if neither this nor a file is given."""

    synergy: float | None = None
    """Torque that bends the elbow over the one with which the shoulder lifts; none if not given."""

    person_file: Path | None = None
    """TOML file of a virtual person: strength, synergy, mobilised_sd, noise (docs/support_level.md)."""

    recording: Path | None = None
    """Of a person who reached with several supports, in place of a virtual one (MCAP)."""


def run_support_level_command(command: SupportLevel) -> dict[str, Any]:
    """Run it and say the answer."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.support_level.options import SupportOptions
    from exograv.laboratory.support_level.support_level_command import run_recorded, run_support_level

    if command.recording is not None:
        if (command.strength, command.synergy, command.person_file) != (None, None, None):
            raise ConfigError("--recording is of somebody; give it without --strength, --synergy and --person-file.")
        result = run_recorded(command.recording, command.out, "support_level_recorded")
    else:
        options = SupportOptions(
            command.rig,
            command.side,
            command.level,
            command.seed,
            command.strength,
            command.synergy,
            command.person_file,
        )
        print("Calibrated, worn, identified, then some sixty attempts: a minute or two.")
        with bars() as progress:
            result = run_support_level(options, command.out, progress)
    _show(result)
    return result


def _show(result: dict[str, Any]) -> None:
    print(result["text"])
    if "rescues" in result:
        print(
            f"Tried with that support: {result['reached']} of {result['targets']} targets reached. "
            f"{result['attempts']} attempts; the arm sank and was carried again {result['rescues']} times."
        )
    print(f"Picture: {result['figure']}")
