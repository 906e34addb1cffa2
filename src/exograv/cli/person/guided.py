"""Commands `exograv run teach`, `exograv run repeat` and `exograv run mirror`: guided motion of an arm."""

import contextlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.cli.shell.kept_arm import say_kept
from exograv.live.options import ReturningPerson
from exograv.next_command import same_machine
from exograv.procedures.rehabilitation.guided.options import GuidedOptions, MirrorOptions, RepeatOptions

if TYPE_CHECKING:
    from exograv.laboratory.guided.guided_command import GuidedResult, RepeatedFigures, TaughtFigures
    from exograv.laboratory.guided.mirror_command import FollowedFigures
    from exograv.live.on_drives.connection import Say
    from exograv.live.on_drives.guided import RepeatedOnDrives, TaughtOnDrives
    from exograv.live.on_drives.mirror import MirrorOnDrives
    from exograv.loop.pilot import Progress
    from exograv.procedures.identification.simulated_wearer import SimulatedWearer
    from exograv.procedures.rehabilitation.guided.floating_arm import GuardRecord
    from exograv.procedures.rehabilitation.guided.mirror_following import Following


@dataclass(frozen=True)
class NewPath:
    """Options of `exograv run teach`: the file of the path to be taught."""

    path: Path | None = None
    """File for the path; path.toml in the folder of --out if none is named."""

    code: str | None = None
    """Code of the participant, which is stored with the path. Never a name."""


@dataclass(frozen=True)
class TaughtPath:
    """Options of a command that repeats a path: the file of the taught path."""

    path: Path | None = None
    """File that `exograv run teach` wrote; path.toml in the folder of --out if none is named."""

    code: str | None = None
    """Code of the participant, if the path was taught with one. A path of another participant is refused."""


def run_teach_command(
    options: GuidedOptions, new: NewPath, person: ReturningPerson, common: OutFolder
) -> "GuidedResult[TaughtFigures] | TaughtOnDrives":
    """Float the arm while a therapist leads it once, and store the path, checked and slowed down where necessary."""
    code, path = _code(new.code) or "", path_in(common.out, new.path)
    refuse_unwritable(path, "--path or --out")
    if options.is_on_drives:
        taught = _teach_on_drives(options, path, code, person, common.out)
        _say_taught(taught, options, new, code, common.out, person)
        return taught
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.guided.guided_command import run_teach

    with bars() as progress:
        result = run_teach(options, path, code, common.out, progress)
    _say_taught(result.found, options, new, code, common.out, person)
    return result


def _teach_on_drives(
    options: GuidedOptions, path: Path, code: str, person: ReturningPerson, folder: Path
) -> "TaughtOnDrives":
    from exograv.cli.shell.terminal import say_unbroken
    from exograv.live.on_drives.guided import run_teach_on_drives

    with _on_drives(options, folder / "teach.mcap") as (progress, say, wearer):
        result = run_teach_on_drives(options, path, code, person, folder, progress, say, wearer)
    say_kept(result.flight.live)
    say_unbroken(f"Recording: {result.flight.recording}")
    return result


def _say_taught(
    found: "TaughtFigures | TaughtOnDrives",
    options: GuidedOptions,
    new: NewPath,
    code: str,
    folder: Path,
    person: ReturningPerson,
) -> None:
    slower = f", {found.stretched:.1f} times slower than the therapist moved" if found.stretched > 1.0 else ""
    print(f"A path of {found.seconds:.1f} s{slower}: {found.path}")
    more = [] if new.path is None else ["--path", str(new.path)]
    more += ["--code", code] if code else []
    more += [] if person.participant is None else ["--participant", person.participant]
    more += [] if person.participants is None else ["--participants", str(person.participants)]
    print("Repeat it with:", same_machine("run repeat", options, folder, " ".join(more)))


def run_repeat_command(
    options: RepeatOptions, taught: TaughtPath, person: ReturningPerson, common: OutFolder
) -> "GuidedResult[RepeatedFigures] | RepeatedOnDrives":
    """Lead the weightless arm along a taught path, and release it if the person resists."""
    path = path_in(common.out, taught.path)
    if options.is_on_drives:
        return _repeat_on_drives(options, path, _code(taught.code), person, common.out)
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.guided.guided_command import run_repeat

    with bars() as progress:
        result = run_repeat(options, path, _code(taught.code), common.out, progress)
    found, done = result.found, result.found.session
    print(f"{done.outcome.value} Complete repetitions: {done.repetitions} of {options.repetitions}.")
    say_followed(done.tracking_rms_deg, done.pull_max_Nm, found.guard)
    return result


def _repeat_on_drives(
    options: RepeatOptions, path: Path, code: str | None, person: ReturningPerson, folder: Path
) -> "RepeatedOnDrives":
    from exograv.cli.shell.terminal import say_unbroken
    from exograv.live.on_drives.guided import run_repeat_on_drives

    with _on_drives(options, folder / "repeat.mcap") as (progress, say, wearer):
        result = run_repeat_on_drives(options, path, code, person, folder, progress, say, wearer)
    done = result.session
    print(f"{done.outcome.value} Complete repetitions: {done.repetitions} of {options.repetitions}.")
    _say_tracked(done.tracking_rms_deg, done.pull_max_Nm)
    say_kept(result.flight.live)
    say_unbroken(f"Recording: {result.flight.recording}")
    return result


def run_mirror_command(
    options: MirrorOptions, person: ReturningPerson, common: OutFolder
) -> "GuidedResult[FollowedFigures] | MirrorOnDrives":
    """Lead one arm along the mirror image of the sound arm, in a machine for both arms."""
    if options.is_on_drives:
        return _mirror_on_drives(options, person, common.out)
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.guided.mirror_command import run_mirror

    with bars() as progress:
        result = run_mirror(options, common.out, progress)
    found, following = result.found, result.found.following
    print(found.session.outcome.value)
    _say_late(following)
    say_followed(following.tracking_rms_deg, found.session.pull_max_Nm, found.guard)
    return result


def _mirror_on_drives(options: MirrorOptions, person: ReturningPerson, folder: Path) -> "MirrorOnDrives":
    from exograv.cli.shell.terminal import say_unbroken
    from exograv.live.on_drives.mirror import run_mirror_on_drives

    with _on_drives(options, folder / "mirror.mcap") as (progress, say, wearer):
        result = run_mirror_on_drives(options, person, folder, progress, say, wearer)
    print(result.session.outcome.value)
    _say_late(result.following)
    _say_tracked(result.following.tracking_rms_deg, result.session.pull_max_Nm)
    say_kept(result.flight.live)
    say_unbroken(f"Recording: {result.flight.recording}")
    return result


@contextlib.contextmanager
def _on_drives(options: GuidedOptions, recording: Path) -> "Iterator[tuple[Progress, Say, SimulatedWearer | None]]":
    """Yield progress, the function that speaks to the operator, and the simulated wearer of a session on drives."""
    from exograv.api.rig_factory import simulated_wearer
    from exograv.cli.shell.motion_note import say_motion
    from exograv.cli.shell.terminal import bars, say

    refuse_unwritable(recording, "--out")  # Checked now, not after minutes of preparation.
    say_motion(options.rig)
    with bars() as progress:
        yield progress, say, simulated_wearer(options)


def _say_late(following: "Following") -> None:
    if following.late_s is not None:
        print(
            f"Delay of the led arm: {following.late_s:.2f} s; error without it: {max(following.late_rms_deg):.1f}° RMS."
        )


def say_followed(rms_deg: Iterable[float], pull_max_Nm: Iterable[float], guard: "GuardRecord") -> None:
    """Print the tracking error of the arm, the largest guiding torque, and the ticks that the guard limited."""
    _say_tracked(rms_deg, pull_max_Nm)
    print(f"The guard limited {guard.limited_ticks} of {guard.ticks} ticks.")


def _say_tracked(rms_deg: Iterable[float], pull_max_Nm: Iterable[float]) -> None:
    worst = max(rms_deg, default=None)
    tracked = "No path was followed" if worst is None else f"Tracking error {worst:.1f}° RMS at the worst joint"
    print(f"{tracked}; guiding torque at most {max(pull_max_Nm):.1f} N·m.")


def path_in(folder: Path, named: Path | None) -> Path:
    """Return the file of a taught path: the named one, or path.toml in the folder of --out."""
    return folder / "path.toml" if named is None else named


def _code(typed: str | None) -> str | None:
    from exograv.study.participants.codes import typed_code

    return None if typed is None else typed_code(typed)
