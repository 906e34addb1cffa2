"""Command `exograv run support-level`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder
from exograv.errors import ConfigError
from exograv.laboratory.support_level.options import SupportOptions

if TYPE_CHECKING:
    from exograv.laboratory.support_level.support_level_command import RecordedSupport, SupportResult


@dataclass(frozen=True)
class Recorded:
    """Option of `exograv run support-level` for a recorded person."""

    recording: Path | None = None
    """Recording (MCAP) of a person who reached with several supports, in place of a virtual person."""


def run_support_level_command(
    options: SupportOptions, recorded: Recorded, common: OutFolder
) -> "SupportResult | RecordedSupport":
    """Find the smallest weight support with which a weak person, virtual or recorded, reaches most targets."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.support_level.support_level_command import SupportResult, run_recorded, run_support_level

    if recorded.recording is not None:
        if (options.strength, options.synergy, options.person_file) != (None, None, None):
            raise ConfigError(
                "--recording already determines the person; leave out --strength, --synergy and --person-file."
            )
        result = run_recorded(recorded.recording, common.out, "support_level_recorded")
    else:
        with bars() as progress:
            result = run_support_level(options, common.out, progress)
    outcome = result.found.outcome if isinstance(result, SupportResult) else result.outcome
    print(outcome.text)
    if isinstance(result, SupportResult):
        print(
            f"Test with that support: {outcome.reached} of {outcome.targets} targets reached. "
            f"{outcome.attempts} attempts; the arm sank and was carried again {result.found.rescues} times."
        )
    print(f"Picture: {result.figure}")
    return result
