"""`exograv support-level`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exograv.cli.shell.base_options import Common
from exograv.errors import ConfigError
from exograv.laboratory.support_level.options import SupportOptions


@dataclass(frozen=True)
class Recorded:
    """Person who was recorded."""

    recording: Path | None = None
    """Of a person who reached with several supports, in place of a virtual one (MCAP)."""


def run_support_level_command(options: SupportOptions, recorded: Recorded, common: Common) -> dict[str, Any]:
    """The smallest support of the arm's weight with which a weak person, virtual or recorded, reaches most targets."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.support_level.support_level_command import run_recorded, run_support_level

    if recorded.recording is not None:
        if (options.strength, options.synergy, options.person_file) != (None, None, None):
            raise ConfigError("--recording is of somebody; give it without --strength, --synergy and --person-file.")
        result = run_recorded(recorded.recording, common.out, "support_level_recorded")
    else:
        print("Calibrated, worn, identified, then some sixty attempts: a minute or two.")
        with bars() as progress:
            result = run_support_level(options, common.out, progress)
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
