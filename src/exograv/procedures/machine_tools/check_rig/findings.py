"""What a check has found so far: sentences for whoever builds the machine."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from exograv.errors import ExogravError

Result = TypeVar("Result")


@dataclass
class CheckFindings:
    """Problems must be solved before the machine can be used; notes only say how far it goes."""

    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def attempt(self, action: Callable[[], Result]) -> Result | None:
        """What the action returns; None where it refuses, and its reason is one problem more."""
        try:
            return action()
        except ExogravError as error:
            self.problem(str(error))
            return None

    def problem(self, sentence: str) -> None:
        """Add one; said twice, as for a right and a left file, it stands once."""
        if sentence not in self.problems:
            self.problems.append(sentence)

    def note(self, sentence: str) -> None:
        """Add one."""
        if sentence not in self.notes:
            self.notes.append(sentence)
