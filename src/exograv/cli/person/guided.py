"""`exograv teach`, `exograv repeat`, `exograv mirror`: an arm is led once, again, or after the other one."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from exograv.cli.shell.base_options import Common, refuse_unwritable


@dataclass(frozen=True)
class Guided(Common):
    """What they take."""

    simulate: bool = False
    """On the twin; nothing else is led yet."""

    rig: str = "recupera_like_qdd"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""


@dataclass(frozen=True)
class Teach(Guided):
    """The arm floats, a therapist leads it once, and where it went is kept as a path, checked and slow enough."""

    path: Path = Path("out/path.toml")
    """File for the path."""

    code: str | None = None
    """The participant's code, kept with the path; never a name."""


@dataclass(frozen=True)
class Repeat(Guided):
    """The machine leads the weightless arm along a taught path, and lets go of whoever holds against it."""

    path: Path = Path("out/path.toml")
    """File of `exograv teach`."""

    code: str | None = None
    """The participant's code, where the path was taught with one; a path of somebody else is refused."""

    speed: float = 1.0
    """Share of the path's own speed, 0.1 to 1."""

    repetitions: int = 1
    """How often."""

    person: Literal["relaxed", "pauses", "overrules", "lets-go"] = "relaxed"
    """What the simulated person does: nothing, hold the arm for two seconds, hold it, or ask to be let go."""


@dataclass(frozen=True)
class Mirror(Guided):
    """In a machine for both arms the sound one leads, and the other is led along its mirror image."""

    rig: str = "recupera_like_dual"
    """Name of a machine for both arms, or path of its folder."""

    lead: Literal["right", "left"] = "right"
    """The sound arm."""

    seconds: float = 20.0
    """From when the other arm is taken hold of [s]."""

    person: Literal["relaxed", "overrules", "lets-go"] = "relaxed"
    """What the simulated person does: nothing, hold the led arm, or ask to be let go."""


def run_teach_command(command: Teach) -> dict[str, Any]:
    """Run it and say what was kept."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.guided.guided_command import GuidedOptions, run_teach

    options = GuidedOptions(command.rig, command.side, command.level, command.seed, command.simulate)
    code = _code(command.code) or ""
    refuse_unwritable(command.path, "--path")
    with bars() as progress:
        result = run_teach(options, command.path, code, command.out, progress)
    slower = f", {result['stretched']:.1f} times slower than it was led" if result["stretched"] > 1.0 else ""
    print(f"A path of {result['seconds']:.1f} s{slower}: {result['path']}")
    print("Repeat it with: exograv repeat --simulate --path", result["path"])
    return result


def run_repeat_command(command: Repeat) -> dict[str, Any]:
    """Run it and say how it went."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.guided.guided_command import RepeatOptions, run_repeat

    options = RepeatOptions(
        command.rig,
        command.side,
        command.level,
        command.seed,
        command.simulate,
        command.speed,
        command.repetitions,
        command.person,
    )
    with bars() as progress:
        result = run_repeat(options, command.path, _code(command.code), command.out, progress)
    print(f"{result['outcome']} Repetitions to the end: {result['repetitions']} of {command.repetitions}.")
    say_followed(result)
    return result


def run_mirror_command(command: Mirror) -> dict[str, Any]:
    """Run it and say how it went."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.guided.mirror_command import MirrorOptions, run_mirror

    options = MirrorOptions(
        command.rig,
        command.side,
        command.level,
        command.seed,
        command.simulate,
        command.lead,
        command.seconds,
        command.person,
    )
    with bars() as progress:
        result = run_mirror(options, command.out, progress)
    print(result["outcome"])
    if result["late_s"] is not None:
        print(f"It followed {result['late_s']:.2f} s late; against then off by {max(result['late_rms_deg']):.1f}° RMS.")
    say_followed(result)
    return result


def say_followed(result: dict[str, Any]) -> None:
    """How far the arm was from where it should be, and how hard it was pulled."""
    rms, pull = max(result["tracking_rms_deg"], default=0.0), max(result["pull_max_Nm"])
    print(f"Off by {rms:.1f}° RMS at the worst joint; pulled with {pull:.1f} N·m at most. The guard limited "
          f"{result['guard']['limited_ticks']} of {result['guard']['ticks']} ticks.")  # fmt: skip


def _code(typed: str | None) -> str | None:
    from exograv.study.participants.codes import typed_code

    return None if typed is None else typed_code(typed)
