"""Text for the operator of a stopped machine: reason, joint, value, where the recording is, and the next step."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from exograv.safety.envelope import Envelope
from exograv.safety.stops import StopReason

from .drift_finding import DriftFinding

TEST_AGAIN = "Run `exograv rig self-test` before the machine is worn again."

NEXT: Mapping[StopReason, str] = {
    StopReason.NOT_FINITE: "The wearer did not cause this: report the stop with the recording.",
    StopReason.TOO_FAST: "If the wearer jerked or held back, let the arm rest and repeat; if not, test the machine.",
    StopReason.NO_MEASUREMENT: TEST_AGAIN,
    StopReason.MODEL_LOST: "Check that the arm lies in its cuffs as when fastened, ask the wearer to relax, repeat.",
    StopReason.PAST_A_STOP: "If the wearer pushed, repeat; if not, check the joint's encoder with the self-test.",
    StopReason.ASTRAY: "Check what the joint touched, then repeat.",
    StopReason.NOT_THIS_ARM: "Check what the hand holds and who wears the machine, ask for a relaxed arm, repeat.",
    StopReason.CONTROL_SILENT: "Run `exograv doctor --loop 60` to check the timing of this computer.",
    StopReason.DRIFTED: "Check base, cuffs, name of the wearer and load of the hand, then test the machine.",
    StopReason.STOP_PRESSED: "Repeat when the wearer is ready.",
}
"""Next step by reason of the stop. The self-test is the default, for faults of the machine itself."""


def stopped_text(
    envelope: Envelope, joints: Sequence[str], recording: Path | None, drift: DriftFinding | None = None
) -> str:
    """Return a text for the operator: the cause of the stop, and the next step.

    Args:
        envelope: The envelope that stopped the run.
        joints: Names of its joints.
        recording: File of the recording, if there is one.
        drift: Last finding of the drift monitor, if there was one.
    """
    reason = envelope.stop
    if reason is None:
        raise ValueError("The envelope has not stopped the run: there is no stop to describe.")
    kept = "" if recording is None else f" Recorded until then: {recording}."
    values = _values(envelope, joints)
    if reason is StopReason.DRIFTED and drift is not None:
        values = f" {drift.text(joints)}"
    return (
        f"The run was stopped: {reason.value}{values} The arm was let down softly.{kept} {NEXT.get(reason, TEST_AGAIN)}"
    )


def _values(envelope: Envelope, joints: Sequence[str]) -> str:
    """Joints that caused the stop, and the value allowed there."""
    if envelope.stop is StopReason.TOO_FAST:
        trips = [one.limits.v_trip_rad_s for one in (envelope, envelope.person) if one is not None]
        fast = ", ".join(joints[j] for j in sorted(envelope.powerless))
        return f" At: {fast}; allowed here: {min(trips):.1f} rad/s."
    found = ", ".join(joints[j] for j in sorted(envelope.isolated))
    return f" At: {found}." if found and len(envelope.isolated) < len(joints) else ""
