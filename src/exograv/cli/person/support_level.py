"""Command `exograv run support-level`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.cli.shell.kept_arm import say_kept
from exograv.errors import ConfigError
from exograv.live.options import ReturningPerson
from exograv.procedures.rehabilitation.support_level.options import SupportOptions

if TYPE_CHECKING:
    from exograv.laboratory.support_level.support_level_command import RecordedSupport, SupportResult
    from exograv.live.on_drives.support_level import SupportOnDrives
    from exograv.report.figures.support_data import SupportOutcome


@dataclass(frozen=True)
class Recorded:
    """Option of `exograv run support-level` for a recorded person."""

    recording: Path | None = None
    """Recording (MCAP) of a person who reached with several supports, in place of a person in a machine."""


def run_support_level_command(
    options: SupportOptions, person: ReturningPerson, recorded: Recorded, common: OutFolder
) -> "SupportResult | RecordedSupport | SupportOnDrives":
    """Find the smallest weight support with which a weak person, virtual, real or recorded, reaches most targets."""
    if recorded.recording is not None:
        return _recorded(options, recorded.recording, common.out)
    return _on_drives(options, person, common.out) if options.is_on_drives else _virtual(options, common.out)


def _recorded(options: SupportOptions, recording: Path, folder: Path) -> "RecordedSupport":
    from exograv.laboratory.support_level.support_level_command import run_recorded

    if (options.strength, options.synergy, options.person_file) != (None, None, None) or options.is_on_drives:
        raise ConfigError(
            "--recording already determines the person; leave out --strength, --synergy, --person-file, --drives and "
            "--simulate."
        )
    result = run_recorded(recording, folder, "support_level_recorded")
    print(result.outcome.text)
    print(f"Picture: {result.figure}")
    return result


def _virtual(options: SupportOptions, folder: Path) -> "SupportResult":
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.support_level.support_level_command import run_support_level

    with bars() as progress:
        result = run_support_level(options, folder, progress)
    _show(result.found.outcome, result.found.rescues, result.figure)
    return result


def _on_drives(options: SupportOptions, person: ReturningPerson, folder: Path) -> "SupportOnDrives":
    from exograv.api.rig_factory import simulated_wearer
    from exograv.cli.shell.motion_note import say_motion
    from exograv.cli.shell.terminal import bars, say, say_unbroken
    from exograv.live.on_drives.support_level import run_support_level_on_drives

    refuse_unwritable(folder / f"{options.name}.mcap", "--out")  # Checked now, not after minutes of preparation.
    say_motion(options.rig)
    with bars() as progress:
        result = run_support_level_on_drives(options, person, folder, progress, say, simulated_wearer(options))
    _show(result.outcome, result.rescues, result.figure)
    say_kept(result.live)
    say_unbroken(f"Recording: {result.recording}")
    return result


def _show(outcome: "SupportOutcome", rescues: int, figure: Path) -> None:
    print(outcome.text)
    print(
        f"Test with that support: {outcome.reached} of {outcome.targets} targets reached. "
        f"{outcome.attempts} attempts; the arm sank and was carried again {rescues} times."
    )
    print(f"Picture: {figure}")
