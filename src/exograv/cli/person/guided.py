"""`exograv teach`, `exograv repeat`, `exograv mirror`: an arm is led once, again, or after the other one."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import Common, refuse_unwritable
from exograv.laboratory.guided.options import GuidedOptions, MirrorOptions, RepeatOptions

if TYPE_CHECKING:
    from collections.abc import Iterable

    from exograv.laboratory.guided.guided_command import GuidedResult, RepeatedFigures, TaughtFigures
    from exograv.laboratory.guided.mirror_command import FollowedFigures
    from exograv.procedures.rehabilitation.guided.floating_arm import GuardRecord


@dataclass(frozen=True)
class NewPath:
    """Path that is taught."""

    path: Path = Path("out/path.toml")
    """File for the path."""

    code: str | None = None
    """The participant's code, kept with the path; never a name."""


@dataclass(frozen=True)
class TaughtPath:
    """Path that is repeated."""

    path: Path = Path("out/path.toml")
    """File of `exograv teach`."""

    code: str | None = None
    """The participant's code, where the path was taught with one; a path of somebody else is refused."""


def run_teach_command(options: GuidedOptions, new: NewPath, common: Common) -> "GuidedResult[TaughtFigures]":
    """The arm floats, a therapist leads it once, and where it went is kept as a path, checked and slow enough."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.guided.guided_command import run_teach

    code = _code(new.code) or ""
    refuse_unwritable(new.path, "--path")
    with bars() as progress:
        result = run_teach(options, new.path, code, common.out, progress)
    found = result.found
    slower = f", {found.stretched:.1f} times slower than it was led" if found.stretched > 1.0 else ""
    print(f"A path of {found.seconds:.1f} s{slower}: {found.path}")
    print("Repeat it with: exograv repeat --simulate --path", found.path)
    return result


def run_repeat_command(options: RepeatOptions, taught: TaughtPath, common: Common) -> "GuidedResult[RepeatedFigures]":
    """The machine leads the weightless arm along a taught path, and lets go of whoever holds against it."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.guided.guided_command import run_repeat

    with bars() as progress:
        result = run_repeat(options, taught.path, _code(taught.code), common.out, progress)
    found, done = result.found, result.found.session
    print(f"{done.outcome.value} Repetitions to the end: {done.repetitions} of {options.repetitions}.")
    say_followed(done.tracking_rms_deg, done.pull_max_Nm, found.guard)
    return result


def run_mirror_command(options: MirrorOptions, common: Common) -> "GuidedResult[FollowedFigures]":
    """In a machine for both arms the sound one leads, and the other is led along its mirror image."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.guided.mirror_command import run_mirror

    with bars() as progress:
        result = run_mirror(options, common.out, progress)
    found, following = result.found, result.found.following
    print(found.session.outcome.value)
    if following.late_s is not None:
        print(f"It followed {following.late_s:.2f} s late; against then off by {max(following.late_rms_deg):.1f}° RMS.")
    say_followed(following.tracking_rms_deg, found.session.pull_max_Nm, found.guard)
    return result


def say_followed(rms_deg: "Iterable[float]", pull_max_Nm: "Iterable[float]", guard: "GuardRecord") -> None:
    """Print how far the arm was from where it should be, and how hard it was pulled."""
    rms, pull = max(rms_deg, default=0.0), max(pull_max_Nm)
    print(f"Off by {rms:.1f}° RMS at the worst joint; pulled with {pull:.1f} N·m at most. The guard limited "
          f"{guard.limited_ticks} of {guard.ticks} ticks.")  # fmt: skip


def _code(typed: str | None) -> str | None:
    from exograv.study.participants.codes import typed_code

    return None if typed is None else typed_code(typed)
