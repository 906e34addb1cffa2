"""One command per session. Heavy rooms are imported by the command that needs them: `--help` must not wait for them."""

import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from exograv.errors import ConfigError, ExogravError, RecordingError

MethodName = Literal["recursive", "gradient", "anthropometric"]


@dataclass(frozen=True)
class Common:
    """What every command takes."""

    seed: int = 0
    """Draws machine, wearer and run; the same seed gives the same figures."""

    json: Path | None = None
    """Write the figures to this file."""

    out: Path = Path("out")
    """Folder for recording and report."""


@dataclass(frozen=True)
class Demo(Common):
    """Identify a virtual arm in a virtual machine, float it, find a known weight, write a report."""

    rig: str = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left"] = "right"
    """Arm."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    method: MethodName = "recursive"
    """How the arm is identified: ours, the paper's, or the table alone."""

    gravity_level: float = 0.0
    """Felt share of the arm's own weight: 0 weightless, 0.165 Moon, 0.378 Mars, 1 Earth."""

    seconds: float = 60.0
    """Motion that the arm is identified from [s]."""

    torque_source: Literal["current", "commanded"] = "current"
    """What counts as real torque: motor current, or what was commanded."""

    realtime: bool = False
    """Show it at the pace of life."""


@dataclass(frozen=True)
class Identify(Demo):
    """Calibrate the empty machine and identify the arm, nothing more."""


@dataclass(frozen=True)
class IdentifyLog(Common):
    """Identify a payload from recorded logs of a robot: the same methods on real motors."""

    log: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Recorded with the payload: CSV with time [s], positions [rad], velocities [rad/s], currents [A]; no more."""

    unloaded: Path = field(default=tyro.MISSING)
    """The same robot without the payload."""

    urdf: Path = field(default=tyro.MISSING)
    """Description of the robot."""

    payload_frame: str = field(default=tyro.MISSING)
    """Link or frame that carries the payload."""

    gains: str = field(default=tyro.MISSING)
    """Joint torque per motor current [N·m/A], one a joint, separated by commas."""

    true_kg: float | None = None
    """The payload's mass, if it is known: then the time until the estimate stays within 10 % is reported."""

    method: MethodName = "recursive"
    """How the payload is identified."""

    rows: str | None = None
    """First and last row of the log to use, counted from 1, as a:b; without it the log is cut to the motion."""

    rows_unloaded: str | None = None
    """The same for the unloaded log."""

    gain_sd: float = 0.0
    """Standard deviation of the gains, as a share; widens the interval."""


@dataclass(frozen=True)
class Report(Common):
    """Make the report of a recording again."""

    recording: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """File that a run has written (.mcap)."""


@dataclass(frozen=True)
class Rigs(Common):
    """List the machines that come with exograv."""


@dataclass(frozen=True)
class Doctor(Common):
    """Say whether this computer has what exograv needs, and how fast its loop is here."""

    loop: float | None = None
    """Also run the live loop for so long [s], half of it with real-time rights: may a worn machine hang on it?"""


@dataclass(frozen=True)
class Bench(Common):
    """Time our kernels beside every opponent that is installed (`make bench-setup` installs them)."""

    quick: bool = False
    """A minute in place of half an hour: fewer and shorter rows, and JAX only where it compiles fast."""

    save: Path | None = None
    """Keep the run in this file."""

    compare: Path | None = None
    """Show what became faster or slower since the run in this file."""


Command = (
    Annotated[Demo, tyro.conf.subcommand("demo")]
    | Annotated[Identify, tyro.conf.subcommand("identify")]
    | Annotated[IdentifyLog, tyro.conf.subcommand("identify-log")]
    | Annotated[Report, tyro.conf.subcommand("report")]
    | Annotated[Rigs, tyro.conf.subcommand("rigs")]
    | Annotated[Doctor, tyro.conf.subcommand("doctor")]
    | Annotated[Bench, tyro.conf.subcommand("bench")]
)


def main() -> None:
    """Entry point of the `exograv` command."""
    # Our matrices are small: on a busy computer the threads of OpenBLAS wait milliseconds for each other, and a demo
    # takes twice as long. Read when NumPy is imported, so it has to be said here.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    command = tyro.cli(
        Command,  # pyright: ignore[reportArgumentType] - tyro takes unions
        prog="exograv",
        description="Take the weight off an arm inside an exoskeleton. Research software, not a medical device.",
    )
    try:
        if command.json is not None:
            refuse_unwritable(command.json)
        result = run(command)
        if command.json is not None:
            write_json(command.json, result)
        # The doctor's verdict: a script must not go on where something is missing.
        if not result.get("ok", True):
            sys.exit(1)
    except ExogravError as error:
        print(f"exograv: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("\nexograv: stopped by the keyboard; what was recorded so far is kept.", file=sys.stderr)
        sys.exit(130)


def run(command: Common) -> dict[str, Any]:
    """Run one command and show its result; returns what `--json` writes."""
    actions: dict[type, Callable[[Any], dict[str, Any]]] = {
        Demo: _demo,
        Identify: _demo,
        IdentifyLog: _identify_log,
        Report: _report,
        Rigs: _rigs,
        Doctor: _doctor,
        Bench: _bench,
    }
    return actions[type(command)](command)


def refuse_unwritable(path: Path, option: str = "--json") -> None:
    """Try the file for the figures before a long run, and leave no trace of the trial.

    Raises:
        RecordingError: The file cannot be written.
    """
    is_new = not path.exists()
    _with_file(path, lambda: path.open("a").close(), option)
    if is_new:
        path.unlink()


def write_json(path: Path, result: dict[str, Any], option: str = "--json") -> None:
    """Write the figures.

    Raises:
        RecordingError: The file cannot be written, or a figure is not a number.
    """
    try:
        text = json.dumps(result, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    except ValueError as error:
        raise RecordingError(
            f"{path} is not written: a figure is infinite or not a number ({error}). The method diverged; "
            "the recording shows when."
        ) from error
    _with_file(path, lambda: path.write_text(text, encoding="utf-8"), option)


def _with_file(path: Path, act: Callable[[], object], option: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        act()
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {error.strerror}. Give another path with {option}.") from error


def _demo(command: Demo) -> dict[str, Any]:
    from exograv.session.demo import DemoOptions, run_demo
    from exograv.terminal import bars, show_demo

    options = DemoOptions(
        command.rig,
        command.side,
        command.level,
        command.method,
        command.gravity_level,
        command.seed,
        command.seconds,
        command.torque_source,
        command.realtime,
        only_identify=isinstance(command, Identify),
    )
    with bars() as progress:
        result = run_demo(options, command.out, progress)
    show_demo(result)
    return result


def _identify_log(command: IdentifyLog) -> dict[str, Any]:
    from exograv.session.identify_log import identify_log
    from exograv.terminal import bars, show_payload

    with bars() as progress:
        result = identify_log(
            log=command.log,
            unloaded=command.unloaded,
            urdf=command.urdf,
            payload_frame=command.payload_frame,
            gains=numbers(command.gains, "--gains"),
            true_kg=command.true_kg,
            method=command.method,
            rows=command.rows,
            rows_unloaded=command.rows_unloaded,
            gain_sd=command.gain_sd,
            seed=command.seed,
            progress=progress,
        )
    show_payload(result)
    return result


def numbers(text: str, option: str) -> list[float]:
    """Numbers separated by commas.

    Raises:
        ConfigError: One of them is not a number.
    """
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise ConfigError(f"{option} is '{text}'; give numbers separated by commas, without spaces.") from error


def _report(command: Report) -> dict[str, Any]:
    from exograv.study.report import write_report

    if not command.recording.is_file():
        raise RecordingError(f"No recording '{command.recording}'. Give the .mcap file that a run has written.")
    report = write_report(command.recording, command.out / "report.html")
    print(f"Report: {report}")
    return {"recording": str(command.recording), "report": str(report)}


def _rigs(_command: Rigs) -> dict[str, Any]:
    from exograv.model.description import load_rig, rig_names

    rows = []
    for name in rig_names():
        description = load_rig(name)
        rows.append({"name": name, "title": description.settings.title, "joints": list(description.joints)})
        print(f"{name}: {description.settings.title} ({len(description.joints)} joints, right or left)")
    return {"rigs": rows}


def _doctor(command: Doctor) -> dict[str, Any]:
    from exograv.session.doctor import examine_computer, has_all_it_needs
    from exograv.session.doctor_loop import loop_test, refuse_unusable
    from exograv.terminal import bars, show_doctor, show_loop

    if command.loop is not None:
        refuse_unusable(command.loop)
    result = examine_computer(command.out)
    show_doctor(result)
    if command.loop is not None and has_all_it_needs(result):
        with bars() as progress:
            result["loop"] = loop_test(command.loop, progress)
        show_loop(result["loop"])
    return result


def _bench(command: Bench) -> dict[str, Any]:
    from exograv.bench.compare import read_run, show_changes
    from exograv.bench.run import run_bench
    from exograv.bench.table import show_bench
    from exograv.terminal import bars

    before = None if command.compare is None else read_run(command.compare)
    if command.save is not None:
        refuse_unwritable(command.save, "--save")
    with bars() as progress:
        result = run_bench(command.quick, progress)
    show_bench(result)
    if command.save is not None:
        write_json(command.save, result, "--save")
    if before is not None and command.compare is not None:
        show_changes(before, result, command.compare.name)
    return result


if __name__ == "__main__":
    main()
