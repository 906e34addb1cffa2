"""`exograv live`."""

from typing import Any

from exograv.cli.shell.base_options import Common, refuse_unwritable
from exograv.live.options import LiveOptions, PersonForm

NOT_LEARNED = (
    "The arm was not learned to the end ({} findings until then), and did not float: what ended it is said above. "
    "Repeat with the same --identify."
)


def run_live_command(options: LiveOptions, person: PersonForm, common: Common) -> dict[str, Any]:
    """Float the arm in real time: guard, control and recorder in processes of their own, the twin as the machine."""
    from exograv.cli.shell.terminal import bars, say

    from .rig_factory import run_live, simulated_wearer

    refuse_unwritable(common.out / "live.mcap", "--out")  # found out now, not after minutes of preparation
    with bars() as progress:
        if options.is_on_drives:
            from exograv.live.on_drives.float_command import fly_on_drives

            wearer = simulated_wearer(options)
            result = fly_on_drives(options, person, common.out, progress, say, wearer).figures
        else:
            result = run_live(options, common.out, progress)
    show_live(result)
    if options.identify_s and result["identified"] is None:
        print(NOT_LEARNED.format(result["findings"]))
    return result


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
