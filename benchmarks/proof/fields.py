"""Places of the guard's record: single numbers, joint fields, and rings."""

import ast
from typing import TYPE_CHECKING

import z3

from .arithmetic import Value, Whole
from .state import Cell, State

if TYPE_CHECKING:
    from .execute import Run


class Fields:
    """Layout of the record, taken from the names of the source."""

    def __init__(self, constants: dict[str, int | float]):
        self.joints = int(constants["JOINTS"])
        self.first, self.used, self.size = (int(constants[name]) for name in ("_FIELDS", "USED", "SIZE"))
        self.misses = int(constants["MISSES"])
        self.blocks = [int(constants[name]) for name in ("MACHINE_MISSES", "CONTROL_MISSES")]
        self.count_place = int(constants["N"])
        named = {name: value for name, value in constants.items() if isinstance(value, int)}
        order = list(named)
        fields = order[order.index("TORQUE_MAX") : order.index("FAULTY") + 1]
        single = order[order.index("N") : order.index("SAFE_STATE") + 1]
        self._names = {named[name]: name for name in (*fields, *single)}

    def name(self, cell: Cell) -> str:
        """Return a cell as the source writes it."""
        record, place, joint = cell
        name = self._names.get(place, str(place))
        return f"{record}[{name}+{joint}]" if joint else f"{record}[{name}]"

    def place_name(self, place: int) -> str:
        """Return a place as the source writes it."""
        if not self.first <= place < self.used:
            return self.name(("r", place, ""))
        joint = (place - self.first) % self.joints
        return self.name(("r", place - joint, str(joint)))

    def is_field(self, place: int) -> bool:
        """Return True if a place begins a joint field."""
        return self.first <= place < self.used and (place - self.first) % self.joints == 0

    def read(self, run: "Run", state: State, record: str, place: Whole, node: ast.AST) -> Value:
        """Return the number at a place."""
        state_record = "r" if record == "b" else record
        if state_record == "r" and place == Whole(self.count_place):
            return run.count
        cell = self._cell(state_record, place)
        if cell is None:
            return self._read_unknown(run, state, state_record, place, node)
        is_new = cell[2].startswith("o") and cell not in state.cells and cell not in state.initial
        value = state.read(cell, run.numbers, self.name(cell))
        if is_new:
            self._assume_settings(run, state, cell)
        return value

    def write(self, run: "Run", state: State, record: str, place: Whole, value: Value, node: ast.AST) -> None:
        """Write a number to a place; where the place is not known, every place that it may be is unknown after."""
        if record == "b":
            raise ValueError("A promise writes to the record before.")
        if record == "r" and place == Whole(self.count_place):
            raise ValueError(f"line {getattr(node, 'lineno', 0)}: the number of joints is written")
        if not isinstance(value, bool | int | float | z3.FPRef):
            value = run.numbers.double(value)
        cell = self._cell(record, place)
        if cell is not None:
            state.cells[cell] = float(value) if isinstance(value, bool | int) else value
            return
        for cell, is_here in self._possible(run, state, record, place, node):
            before = state.read(cell, run.numbers, self.name(cell))
            if is_here is None:
                state.cells[cell] = run.numbers.fresh(self.name(cell))
            else:
                state.cells[cell] = run.numbers.choice(is_here, value, before)

    def _cell(self, record: str, place: Whole) -> Cell | None:
        if place.rest is not None or record not in ("r", "b"):
            return None
        if place.joint:
            if not self.is_field(place.constant):
                return None
            return record, place.constant, place.joint
        if self.first <= place.constant < self.used:
            start = place.constant - (place.constant - self.first) % self.joints
            return record, start, str(place.constant - start)
        return (record, place.constant, "") if place.constant < self.first else None

    def _possible(self, run: "Run", state: State, record: str, place: Whole, node: ast.AST):
        """Yield the followed cells that an unknown place may be, each with the condition (None: unknown)."""
        if record != "r":
            return
        term, base = place.term(), place.constant
        if base < self.first:
            block = next((one + 2 for one in self.blocks if one + 2 == base), None)
            if block is None:
                raise ValueError(f"line {getattr(node, 'lineno', 0)}: a place before the joint fields is not known")
            for k in range(self.misses):
                yield (record, block + k, ""), term == block + k
            return
        if base < self.used:
            known = {cell for cell in {**state.initial, **state.cells} if cell[0] == record and cell[1] == base}
            for cell in sorted({*known, *((record, base, joint) for joint in run.joint_keys(state))}):
                yield cell, None

    def _read_unknown(self, run: "Run", state: State, record: str, place: Whole, node: ast.AST) -> Value:
        if record == "r":
            for cell, is_here in self._possible(run, state, record, place, node):
                if is_here is not None:
                    state.read(cell, run.numbers, self.name(cell))
        return run.numbers.fresh(f"{record}[…]")

    def _assume_settings(self, run: "Run", state: State, cell: Cell) -> None:
        # In the state before: a guard that writes a setting must not make the assumption a contradiction.
        for name in run.assumed_of_others:
            claim = run.claim(State(state.initial), name, Whole(0, cell[2]))
            run.numbers.facts.add(run.numbers.truth(claim))
