"""Manual actions at the machine: turn a joint, press the hardware stop, hang the weights."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from exograv.procedures.calibration.operator import KeyboardOperator, Operator


@runtime_checkable
class Hands(Protocol):
    """Person or test bench that carries out manual actions. The machine's sensors report the effect."""

    patience_s: float
    """Longest wait for a manual action [s]."""

    @property
    def weights(self) -> Operator:
        """Operator who hangs the known weights."""
        ...

    def turn(self, joint: str, way: int) -> None:
        """Turn this joint by hand: 1 in the URDF's positive direction, -1 back to where it hung, 0 let go."""
        ...

    def press_stop(self) -> None:
        """Press the hardware stop."""
        ...

    def release_stop(self) -> None:
        """Release the hardware stop."""
        ...

    def pull_cable(self, joint: str) -> None:
        """Disconnect the drive of a joint from its bus."""
        ...

    def plug_cable(self, joint: str) -> None:
        """Connect the drive of a joint to its bus again."""
        ...

    def push(self, joint: str, tau_Nm: float) -> None:
        """Push the machine's joint with this torque from now on; 0 lets go."""
        ...


class KeyboardHands:
    """Person who follows instructions on the screen."""

    patience_s = 60.0

    def __init__(self, say: Callable[[str], object]):
        self._say = say
        self.weights: Operator = KeyboardOperator(say)

    def turn(self, joint: str, way: int) -> None:
        """Show the instruction to turn the joint."""
        self._say(
            {
                1: f"Turn '{joint}' by hand by about 10°, in the positive direction of its axis in the URDF "
                "(docs/reference/frames_and_signs.md).",
                -1: f"Turn '{joint}' back to where it hung.",
                0: f"Let go of '{joint}'.",
            }[way]
        )

    def press_stop(self) -> None:
        """Show the instruction to press the hardware stop."""
        self._say("Press the hardware stop now.")

    def release_stop(self) -> None:
        """Show the instruction to release the hardware stop."""
        self._say("Release the hardware stop.")

    def pull_cable(self, joint: str) -> None:
        """Show the instruction to pull a cable."""
        self._say(f"Pull the bus cable of the drive of '{joint}' now.")

    def plug_cable(self, joint: str) -> None:
        """Show the instruction to plug the cable in."""
        self._say(f"Plug the bus cable of the drive of '{joint}' in again.")

    def push(self, joint: str, tau_Nm: float) -> None:
        """Show the instruction to push the joint, or to let go."""
        away = "away from its path now, faster and faster, until the machine stops"
        self._say(f"Push '{joint}' {away}." if tau_Nm else f"Let go of '{joint}'.")


class BenchHands:
    """Test bench of simulated drives (`exograv dev drive-sim`), commanded by text lines."""

    patience_s = 5.0
    lowers_s = 1.0

    def __init__(self, tell: Callable[[str], None]):
        """Prepare to command the bench.

        Args:
            tell: Function that sends one line of text to the bench.
        """
        self.tell = self._tell = tell

    @property
    def weights(self) -> Operator:
        """Return this bench, which also hangs the weights."""
        return self

    def turn(self, joint: str, way: int) -> None:
        """Turn the joint at the bench."""
        self._tell(f"turn {joint} {12 * way}")

    def press_stop(self) -> None:
        """Press the hardware stop at the bench."""
        self._tell("press")

    def release_stop(self) -> None:
        """Release the hardware stop at the bench."""
        self._tell("release")

    def pull_cable(self, joint: str) -> None:
        """Disconnect the drive at the bench."""
        self._tell(f"unplug {joint}")

    def plug_cable(self, joint: str) -> None:
        """Connect the drive at the bench."""
        self._tell(f"plug {joint}")

    def push(self, joint: str, tau_Nm: float) -> None:
        """Push the joint at the bench."""
        self._tell(f"turn {joint} {tau_Nm:.3f}")

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Return True: the bench is always ready."""
        return True

    def lower(self, mount: str, mass_kg: float) -> None:
        """Hang this mass on the mount at the bench."""
        self._tell(f"hang {mount} {mass_kg:.6f}")
