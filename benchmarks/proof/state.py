"""Record of the guard during a symbolic run: known and unknown numbers by place."""

from dataclasses import dataclass, field
from typing import Any

from .arithmetic import Arithmetic, Value

Cell = tuple[str, int, str]
"""Record, first place of the field, and joint; for a single number its place and no joint."""


@dataclass(frozen=True)
class Record:
    """Local name of a record."""

    name: str


@dataclass
class State:
    """Numbers of all records, and local names of the function that runs."""

    initial: dict[Cell, Value]
    """Numbers before the run, made when they are read; shared by all copies."""
    cells: dict[Cell, Value] = field(default_factory=dict)
    """Numbers that were written."""
    names: dict[str, Any] = field(default_factory=dict)
    done: Value = False
    """True if the function has returned."""
    result: Value = None

    def copy(self) -> "State":
        """Return a state that changes on its own."""
        return State(self.initial, dict(self.cells), dict(self.names), self.done, self.result)

    def read(self, cell: Cell, numbers: Arithmetic, name: str) -> Value:
        """Return a number; one that nobody has written or read yet is unknown."""
        if cell in self.cells:
            return self.cells[cell]
        if cell not in self.initial:
            self.initial[cell] = numbers.fresh(name)
        return self.initial[cell]


def merged(test: Value, one: State, other: State, numbers: Arithmetic, name_of: Any) -> State:
    """Return the state after `one if test else other`."""
    made = State(one.initial)
    for cell in {**one.cells, **other.cells}:
        a, b = (each.read(cell, numbers, name_of(cell)) for each in (one, other))
        made.cells[cell] = numbers.choice(test, a, b)
    for name in one.names.keys() & other.names.keys():
        a, b = one.names[name], other.names[name]
        made.names[name] = a if a is b or isinstance(a, Record) else numbers.choice(test, a, b)
    made.done = numbers.choice(test, one.done, other.done)
    if one.result is None or other.result is None:
        made.result = one.result if other.result is None else other.result
    else:
        made.result = numbers.choice(test, one.result, other.result)
    return made
