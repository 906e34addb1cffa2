"""What to tell whoever stands beside a machine that was stopped: why, where, which value, what is kept, what next."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from exograv.safety.envelope import Envelope, StopReason

TEST_AGAIN = "Run `exograv self-test` before anybody is in the machine again."

NEXT: Mapping[StopReason, str] = {
    StopReason.NOT_FINITE: "Nothing is wrong with the person: report it with the recording.",
    StopReason.TOO_FAST: "If the person jerked or held back, let the arm rest and repeat; if not, test the machine.",
    StopReason.NO_MEASUREMENT: TEST_AGAIN,
    StopReason.MODEL_LOST: "Look whether the arm lies in its cuffs as when fastened, ask the person to let go, repeat.",
    StopReason.PAST_A_STOP: "If the person pushed, repeat; if nobody did, check the joint's encoder by the self-test.",
    StopReason.ASTRAY: "Look what the joint met, then repeat.",
    StopReason.NOT_THIS_ARM: "Look what the hand holds and whether it is this person, ask for a loose arm, repeat.",
    StopReason.CONTROL_SILENT: "Ask `exograv doctor --loop 60` whether this computer is punctual enough.",
    StopReason.STOP_PRESSED: "Repeat when the person is ready.",
}
"""What to do; the self-test for everything that a machine does to itself."""


def stopped_text(envelope: Envelope, joints: Sequence[str], recording: Path | None) -> str:
    """What happened and what to do next.

    Args:
        envelope: The one that stopped it.
        joints: Their names.
        recording: What holds all of it, if anything does.
    """
    reason = envelope.stop
    if reason is None:
        raise ValueError("nothing was stopped")
    kept = "" if recording is None else f" Recorded until then: {recording}."
    return (
        f"The run was stopped: {reason.value}{_values(envelope, joints)} The arm was let down softly.{kept} "
        f"{NEXT.get(reason, TEST_AGAIN)}"
    )


def _values(envelope: Envelope, joints: Sequence[str]) -> str:
    """Which joints, and what they may."""
    if envelope.stop is StopReason.TOO_FAST:
        trips = [one.limits.v_trip_rad_s for one in (envelope, envelope.person) if one is not None]
        fast = ", ".join(joints[j] for j in sorted(envelope.powerless))
        return f" At: {fast}; allowed here: {min(trips):.1f} rad/s."
    found = ", ".join(joints[j] for j in sorted(envelope.isolated))
    return f" At: {found}." if found and len(envelope.isolated) < len(joints) else ""
