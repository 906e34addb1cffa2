"""Findings of a check: sentences for the builder of the machine."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from exograv.errors import ExogravError, ModelFaultsError

Result = TypeVar("Result")


@dataclass
class CheckFindings:
    """Problems, which must be solved before the machine can be used, and notes about its capabilities."""

    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def attempt(self, action: Callable[[], Result]) -> Result | None:
        """Run the action and return its result. On an error, add its sentences as problems and return None."""
        try:
            return action()
        except ModelFaultsError as error:
            for fault in error.args:
                self.problem(fault)
        except ExogravError as error:
            self.problem(str(error))
        return None

    def problem(self, sentence: str) -> None:
        """Add a problem once, even if both the right and the left file have it."""
        if sentence not in self.problems:
            self.problems.append(sentence)

    def note(self, sentence: str) -> None:
        """Add a note once."""
        if sentence not in self.notes:
            self.notes.append(sentence)
