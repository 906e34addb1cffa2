"""Who hangs weights on a machine: somebody at the keyboard, or a bench that is only computed."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, TextIO, runtime_checkable

from exograv.loop.keyboard import is_line_typed


@runtime_checkable
class Operator(Protocol):
    """Is asked for something while the machine goes on holding; nobody waits for the answer in a tick."""

    lowers_s: float
    """What it takes to lower a weight onto a mount, or off it [s]."""

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Whether the weight is at the mount, about to be lowered; asked again until it is."""
        ...

    def lower(self, mount: str, mass_kg: float) -> None:
        """So much of it hangs now [kg]."""
        ...


@dataclass
class ComputedOperator:
    """Hangs weights by a call, at once."""

    hang: Callable[[str, float], None]
    lowers_s: float = 1.0
    """All at once it would drop the arm, and the way back is as steep as the envelope allows: the machine would
    swing."""

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Always."""
        return True

    def lower(self, mount: str, mass_kg: float) -> None:
        """As told."""
        self.hang(mount, mass_kg)


@dataclass
class KeyboardOperator:
    """Asks on the screen, and goes on when Enter is pressed."""

    say: Callable[[str], object]
    answers: TextIO = field(default_factory=lambda: sys.stdin)
    lowers_s: float = 4.0
    _asked: tuple[str, float] | None = None

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Ask once; whether Enter has been pressed since."""
        if self._asked != (mount, mass_kg):
            self._asked = mount, mass_kg
            what = f"hang {mass_kg:g} kg on '{mount}'" if mass_kg else f"take the weight off '{mount}'"
            self.say(f"Get ready to {what}: press Enter, then do it within {self.lowers_s:g} s, gently.")
        if not is_line_typed(self.answers, 0.0):
            return False
        self._asked = None
        return True

    def lower(self, mount: str, mass_kg: float) -> None:
        """By hand."""
