"""Who stands at the machine: turns a joint by hand, presses the hardware stop, hangs the weights."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from exograv.procedures.calibration.operator import KeyboardOperator, Operator


@runtime_checkable
class Hands(Protocol):
    """Is told what to do; what comes of it the machine itself has to say."""

    patience_s: float
    """How long to wait for it [s]."""

    @property
    def weights(self) -> Operator:
        """Hangs the known weights."""
        ...

    def turn(self, joint: str, way: int) -> None:
        """Turn this joint by hand: 1 the way that the URDF calls positive, -1 back to where it was, 0 let go."""
        ...

    def press_stop(self) -> None:
        """Press the hardware stop."""
        ...

    def release_stop(self) -> None:
        """Release it."""
        ...


class KeyboardHands:
    """Somebody who reads the screen."""

    patience_s = 60.0

    def __init__(self, say: Callable[[str], object]):
        self._say = say
        self.weights: Operator = KeyboardOperator(say)

    def turn(self, joint: str, way: int) -> None:
        """Say so."""
        self._say(
            {
                1: f"Turn '{joint}' by hand by about 10°, the way that its axis in the URDF calls positive "
                "(docs/frames_and_signs.md).",
                -1: f"Turn '{joint}' back to where it hung.",
                0: f"Let go of '{joint}'.",
            }[way]
        )

    def press_stop(self) -> None:
        """Say so."""
        self._say("Press the hardware stop now.")

    def release_stop(self) -> None:
        """Say so."""
        self._say("Release the hardware stop.")


class BenchHands:
    """Writes to the bench of simulated drives (`exograv drive-sim`)."""

    patience_s = 5.0
    lowers_s = 1.0

    def __init__(self, tell: Callable[[str], None]):
        """With what writes a line to it."""
        self._tell = tell

    @property
    def weights(self) -> Operator:
        """Itself."""
        return self

    def turn(self, joint: str, way: int) -> None:
        """With a torque that overcomes friction and brake."""
        self._tell(f"turn {joint} {12 * way}")

    def press_stop(self) -> None:
        """At once."""
        self._tell("press")

    def release_stop(self) -> None:
        """At once."""
        self._tell("release")

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Always."""
        return True

    def lower(self, mount: str, mass_kg: float) -> None:
        """As told."""
        self._tell(f"hang {mount} {mass_kg:.6f}")
