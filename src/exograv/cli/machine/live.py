"""`exograv live`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from exograv.cli.shell.base_options import refuse_unwritable

from .on_drives import WornOnDrives, say

if TYPE_CHECKING:
    from exograv.live.live_flight import LiveOptions
    from exograv.loop.pilot import Progress
    from exograv.runtime.ros2.bridging import Ros2

NOT_LEARNED = (
    "The arm was not learned to the end ({} findings until then), and did not float: what ended it is said above. "
    "Repeat with the same --identify."
)


@dataclass(frozen=True)
class Live(WornOnDrives):
    """Float the arm in real time: guard, control and recorder in processes of their own, the twin as the machine."""

    rig: str = "recupera_like"
    """Name of a machine (see `exograv rigs`) or path of its folder."""

    side: Literal["right", "left", "both"] | None = None
    """Arm; the machine's first if none is named."""

    level: int = 2
    """Disturbances of the twin: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one."""

    seconds: Annotated[float, tyro.conf.arg(metavar="S")] = 10.0
    """How long, in real time; with `--identify` after that."""

    identify: Annotated[float, tyro.conf.arg(metavar="S")] = 0.0
    """Move the arm for so long and learn it live, in a process of its own, before it floats; 10 or more. Without, it is
    identified before the live run."""

    gravity_level: float = 0.0
    """Felt share of the arm's own weight: 0 on a space station, 1 on Earth."""

    self_test: bool = False
    """Test the empty machine first, as a real one has to be; without, the recording says that it is skipped."""

    lsl: bool = False
    """Publish joint state, torque and markers over Lab Streaming Layer, from the recorder's process."""

    calibration: Path | None = None
    """On drives: calibration.toml of this machine; that in the folder of --out if none is named."""

    record_stream: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="NAME")] = ()
    """Record another device's stream of this name, or all of this type, beside the run; may be repeated. See `exograv
    streams`."""

    ros2: bool = False
    """Publish joint states, gravity level and safe state as a node of ROS 2, by Zenoh; ROS 2 need not be installed."""

    ros2_router: Annotated[str, tyro.conf.arg(metavar="LOCATOR")] = "tcp/localhost:7447"
    """Where Zenoh's router is, with `--ros2`."""

    ros2_accept_gravity_level: bool = False
    """Let a gravity level be asked for over ROS 2; only before the first stop."""


def run_live_command(command: Live) -> dict[str, Any]:
    """Run it and say how it went."""
    from exograv.cli.shell.terminal import bars
    from exograv.live.live_flight import LiveOptions

    options = LiveOptions(
        command.rig,
        command.side,
        command.level,
        command.seed,
        command.seconds,
        command.identify,
        command.gravity_level,
        command.self_test,
        command.lsl,
        command.record_stream,
        wanted_bridge(command),
    )
    refuse_unwritable(command.out / "live.mcap", "--out")  # found out now, not after minutes of preparation
    with bars() as progress:
        if command.is_on_drives:
            result = _on_drives(command, options, progress)
        else:
            from .rig_factory import run_live

            result = run_live(options, command.out, progress)
    show_live(result)
    if command.identify and result["identified"] is None:
        print(NOT_LEARNED.format(result["findings"]))
    return result


def _on_drives(command: Live, options: "LiveOptions", progress: "Progress") -> dict[str, Any]:
    from exograv.live.on_drives.float_command import run_live_on_drives

    from .rig_factory import simulated_wearer

    calibration = command.calibration or command.out / "calibration.toml"
    asked = command.asked(command.level)
    wearer = simulated_wearer(asked, command.rig, command.side)
    return run_live_on_drives(options, asked, command.person(), calibration, command.out, progress, say, wearer)


def wanted_bridge(command: Live) -> "Ros2 | None":
    """What is asked of the bridge to ROS 2.

    Raises:
        ConfigError: It is asked for something, but not for itself.
    """
    from exograv.errors import ConfigError
    from exograv.runtime.ros2.bridging import Ros2

    if command.ros2:
        return Ros2(command.ros2_router, command.ros2_accept_gravity_level)
    if command.ros2_accept_gravity_level:
        raise ConfigError("--ros2-accept-gravity-level is given without --ros2, which is the way for it. Give both.")
    return None


def show_live(result: dict[str, Any]) -> None:
    """Timing, recording, and every stop with what the computer did just before."""
    from rich.console import Console

    console, late = Console(), result["late_us"]
    console.print(
        f"{result['seconds']:g} s at {result['rate_Hz']:.1f} Hz; ticks late by {late['p50']:g} µs (median), "
        f"{late['p999']:g} (p99.9), {late['max']:g} (most); {result['overruns']} periods without their own command.",
        highlight=False,
    )
    console.print(
        f"Recorded {result['samples_recorded']} ticks, lost {result['samples_lost']}: {result['recording']}",
        highlight=False,
        soft_wrap=True,
    )
    for why in (result["recording_why"], result["unpublished"]):
        if why:
            console.print(why, highlight=False)
    for stream in result["streams"]:
        console.print(f"Recorded stream {stream['name']}: connected {stream['connected']} times.", highlight=False)
    if bridge := result["ros2"]:
        refused = ", ".join(f"{count} refused ({why})" for why, count in bridge["refused"].items())
        asked = f"; {len(bridge['levels'])} gravity levels passed on" + (f", {refused}" if refused else "")
        console.print(f"Sent {bridge['joint_states']} joint states to ROS 2{asked}. {bridge['ended']}", highlight=False)
    if found := result["identified"]:
        truth = ""
        if found["left_over_Nm"] is not None:
            left = ", ".join(f"{value:.2f}" for value in found["left_over_Nm"])
            truth = f" Left over by the twin's truth: {left} N·m."
        console.print(
            f"Learned live in {found['motion_s']:.0f} s ({result['findings']} findings). {found['outcome']} "
            f"{found['why']}{truth}",
            highlight=False,
        )
    modes = ", ".join(f"{one['mode'].replace('_', ' ')} from {one['at_s']:.2f} s" for one in result["modes"])
    console.print(f"Self-test {result['self_test']}. Modes: {modes}.", highlight=False)
    for latch in result["latches"]:
        before = f"Longest gap just before: {latch['stall_ms']:.1f} ms."
        console.print(f"Stopped after {latch['at_s']:.1f} s: {latch['cause']} {before}", highlight=False)
    for line in result["refused"]:
        console.print(line, highlight=False)
