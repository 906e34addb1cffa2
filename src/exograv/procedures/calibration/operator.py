"""Operators who hang weights on a machine: a person at the keyboard, or a computed bench."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, TextIO, runtime_checkable

from exograv.loop.keyboard import is_line_typed


@runtime_checkable
class Operator(Protocol):
    """Person or bench that hangs weights while the machine holds. A tick never waits for the answer."""

    lowers_s: float
    """Time to lower a weight onto a mount, or to take it off [s]."""

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Return True if the weight is at the mount, about to be lowered. The run asks again until then."""
        ...

    def lower(self, mount: str, mass_kg: float) -> None:
        """Record that a mass [kg] hangs on the mount from now on. A simulated bench hangs the mass."""
        ...


@dataclass
class ComputedOperator:
    """Simulated bench that hangs weights by a call."""

    hang: Callable[[str, float], None]
    lowers_s: float = 1.0
    """Duration [s]. A sudden weight would drop the arm, and the envelope would return it so steeply that the machine
    would swing.
    """

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Return True: the bench is always ready."""
        return True

    def lower(self, mount: str, mass_kg: float) -> None:
        """Hang this mass on the mount of the bench."""
        self.hang(mount, mass_kg)


@dataclass
class KeyboardOperator:
    """Operator at the keyboard: the program asks on the screen, and the person answers with Enter."""

    say: Callable[[str], object]
    answers: TextIO = field(default_factory=lambda: sys.stdin)
    lowers_s: float = 4.0
    _asked: tuple[str, float] | None = None

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Ask the operator once to prepare the weight; True if Enter has been pressed since then."""
        if self._asked != (mount, mass_kg):
            self._asked = mount, mass_kg
            what = f"hang {mass_kg:g} kg on '{mount}'" if mass_kg else f"take the weight off '{mount}'"
            self.say(f"Get ready to {what}: press Enter, then do it within {self.lowers_s:g} s, gently.")
        if not is_line_typed(self.answers, 0.0):
            return False
        self._asked = None
        return True

    def lower(self, mount: str, mass_kg: float) -> None:
        """Do nothing: the person lowers the weight by hand."""
