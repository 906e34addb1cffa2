"""Command `exograv run live` and the printout of its result."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.cli.shell.kept_arm import say_kept
from exograv.cli.shell.motion_note import say_motion
from exograv.live.options import LiveOptions, ReturningPerson

if TYPE_CHECKING:
    from exograv.live.live_figures import LiveFigures

NOT_LEARNED = (
    "The identification did not finish ({} findings until then), so the arm did not float. The reason is printed "
    "above. Repeat with the same options."
)


def run_live_command(options: LiveOptions, person: ReturningPerson, common: OutFolder) -> "LiveFigures":
    """Float the arm in real time on the twin or on drives, with guard, control and recorder in separate processes."""
    from exograv.api.rig_factory import run_live, simulated_wearer
    from exograv.cli.shell.terminal import bars, say, say_unbroken

    refuse_unwritable(common.out / "live.mcap", "--out")  # Checked now, not after minutes of preparation.
    if options.identify_s or person.participant is not None:
        say_motion(options.rig)
    with bars() as progress:
        if options.is_on_drives:
            from exograv.live.on_drives.float_command import float_on_drives

            result = float_on_drives(options, person, common.out, progress, say, simulated_wearer(options)).figures
        else:
            result = run_live(options, common.out, progress)
    show_live(result)
    if (options.identify_s or person.participant is not None) and result.identified is None:
        print(NOT_LEARNED.format(result.findings))
    say_kept(result)
    say_unbroken(f"Next: exograv data view {result.recording}, or exograv data replay {result.recording}")
    return result


def _times(result: "LiveFigures") -> str:
    """Sentence on the timing of the loop."""
    from exograv.live.live_figures import waited_text

    if result.waited_s is not None:
        return f"{result.seconds:g} s in {result.wall_s:.0f} s. {waited_text(result.waited_s)}"
    late = result.late_us
    return (
        f"{result.seconds:g} s at {result.rate_Hz:.1f} Hz; ticks late by {late.p50:g} µs (median), {late.p999:g} "
        f"(p99.9), {late.max:g} (max); {result.overruns} periods without a command of their own."
    )


def show_live(result: "LiveFigures") -> None:
    """Print timing, recording, and every stop with the longest gap before it."""
    from exograv.cli.shell.terminal import say, say_unbroken

    say(_times(result))
    say_unbroken(f"Recorded {result.samples_recorded} ticks, lost {result.samples_lost}: {result.recording}")
    for why in (result.recording_why, result.unpublished):
        if why:
            say(why)
    for stream in result.streams:
        say(f"Recorded stream {stream.name}: connected {stream.connected} times.")
    if bridge := result.ros2:
        refused = ", ".join(f"{count} refused ({why})" for why, count in bridge.refused.items())
        asked = f"; passed on {len(bridge.levels)} gravity levels" + (f", {refused}" if refused else "")
        say(f"Sent {bridge.joint_states} joint states to ROS 2{asked}. {bridge.ended}")
    if found := result.identified:
        truth = ""
        if found.left_over_Nm is not None:
            truth = f" Left over by the twin's truth: {', '.join(f'{value:.2f}' for value in found.left_over_Nm)} N·m."
        if found.arm_check is not None:
            say(f"Arm check: {found.arm_check} The arm has {found.arm_mass_kg:.2f} kg.")
        say(f"Learned live in {found.motion_s:.0f} s ({result.findings} findings). {found.outcome} {found.why}{truth}")
    modes = ", ".join(f"{one.mode.replace('_', ' ')} from {one.at_s:.2f} s" for one in result.modes)
    say(f"Self-test {result.self_test}. Modes: {modes}.")
    for latch in result.latches:
        before = f"Longest gap between commands just before: {latch.stall_ms:.1f} ms."
        say(f"Stopped after {latch.at_s:.1f} s: {latch.cause} {before}")
    for line in result.refused:
        say(line)
