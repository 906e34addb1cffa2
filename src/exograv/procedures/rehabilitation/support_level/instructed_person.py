"""Instructions to the person in a machine on drives: shown to the operator, or sent to a simulated person."""

from collections.abc import Callable

from exograv.procedures.bring_up.hands import BenchHands, Hands
from exograv.sentence import support_text

from .flight import MOVE_S, InstructedPerson, Place
from .targets import TARGETS, TIME_S

Say = Callable[[str], object]


class SpokenPerson:
    """Person who is told by the operator; the operator reads the instructions from the screen."""

    def __init__(self, say: Say):
        """Show each instruction with `say`."""
        self._say = say

    def rest(self, seconds: float = MOVE_S, gravity_level: float | None = None) -> None:
        """Show the instruction to go to rest, and the support that comes."""
        change = "" if gravity_level is None else f" From now on: {support_text(gravity_level)}."
        self._say(f"Back to rest within {seconds:.0f} s.{change}")

    def attempt(self) -> None:
        """Show that an attempt follows."""
        self._say("Get ready for the next target.")

    def reach(self, target: int, place: Place) -> None:
        """Tell the person the next target, its place, and the time to reach it."""
        one = TARGETS[target]
        side = "outward" if one.outward_deg >= 0.0 else "inward"
        height = "above" if one.up_deg >= 0.0 else "below"
        self._say(
            f"Reach for target {target + 1} within {TIME_S:.0f} s, and hold it: {abs(one.outward_deg):.0f}° {side}, "
            f"{abs(one.up_deg):.0f}° {height} the shoulder, at {100 * one.share:.0f} % of the arm's length."
        )


class BenchPerson:
    """Weak person behind simulated drives (`exograv dev drive-sim --person weak`), who hears the bench."""

    def __init__(self, tell: Callable[[str], None]):
        """Send each instruction with `tell`."""
        self._tell, self._gravity_level = tell, 0.0

    def rest(self, seconds: float = MOVE_S, gravity_level: float | None = None) -> None:
        """Have the person go to rest within a time [s]."""
        if gravity_level is not None:
            self._gravity_level = gravity_level
        self._tell(f"rest {seconds:.6f} {self._gravity_level:.6f}")

    def attempt(self) -> None:
        """Have the person get ready for the next attempt."""
        self._tell("attempt")

    def reach(self, target: int, place: Place) -> None:
        """Have the person reach for a target."""
        x, y, z = place.tolist()
        self._tell(f"reach {target} {x:.6f} {y:.6f} {z:.6f}")


def person_of(hands: Hands, say: Say) -> InstructedPerson:
    """Return the person at these hands: simulated on simulated drives, else told by the operator."""
    return BenchPerson(hands.tell) if isinstance(hands, BenchHands) else SpokenPerson(say)
