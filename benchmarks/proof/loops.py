"""Loops of the guard: a few turns are run, and any number of turns is summarised by what every turn keeps.

A loop over the joints is: any number of turns of other joints, the turn of the followed joint, any number of turns of
other joints. A summary is a set of relations between the numbers before and after one turn. Each relation is true of
no turn, and of two turns if it is of one, so it is true of any number. The relations are guessed from a fixed list, and
each is proved of one turn from any state; what cannot be proved is not used.
"""

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import z3

from .arithmetic import Arithmetic, Value, Whole, is_known, whole_of
from .state import Cell, Record, State, merged

if TYPE_CHECKING:
    from .execute import Run

Relation = Callable[[Arithmetic, Value, Value], z3.BoolRef]
MOST_TURNS = 16


def _double(law: Callable[[z3.FPRef, z3.FPRef, Arithmetic], z3.BoolRef]) -> Relation:
    return lambda numbers, a, b: law(numbers.double(a), numbers.double(b), numbers)


RELATIONS_OF_TRUTH: dict[str, Relation] = {
    "stays true": lambda numbers, a, b: z3.Implies(numbers.truth(a), numbers.truth(b)),
    "stays false": lambda numbers, a, b: z3.Implies(numbers.truth(b), numbers.truth(a)),
}
RELATIONS: dict[str, Relation] = {
    "same": _double(lambda a, b, _: a == b),
    "not less": _double(lambda a, b, _: z3.Or(a == b, z3.fpGEQ(b, a))),
    "not more": _double(lambda a, b, _: z3.Or(a == b, z3.fpLEQ(b, a))),
    "latched": _double(lambda a, b, _: z3.Or(z3.fpIsZero(a), a == b)),
    "not zero again": _double(lambda a, b, _: z3.Implies(z3.fpIsZero(b), z3.fpIsZero(a))),
    "stays finite": _double(lambda a, b, numbers: z3.Implies(numbers.finite(a), numbers.finite(b))),
    "stays not negative": _double(lambda a, b, _: z3.Implies(a >= 0.0, b >= 0.0)),
    "stays a flag": _double(lambda a, b, _: z3.Implies(_is_flag(a), _is_flag(b))),
}


def _is_flag(a: z3.FPRef) -> z3.BoolRef:
    return z3.Or(z3.fpEQ(a, z3.FPVal(0.0, a.sort())), z3.fpEQ(a, z3.FPVal(1.0, a.sort())))


@dataclass
class Summary:
    """Numbers that any number of turns may change, and the relations that it keeps."""

    cells: dict[Cell, list[Relation]]
    fields: set[tuple[str, int]]
    """Fields that a turn writes at its own joint."""
    names: dict[str, list[Relation]]
    returns: list[Value] | None
    """Values that a turn may return; None if no turn returns."""
    claims: list[str]
    """Claims about the followed joint that the turns keep together."""


def run_loop(run: "Run", node: ast.For, state: State) -> None:
    """Run a loop in place."""
    if not (isinstance(node.target, ast.Name) and isinstance(node.iter, ast.Call) and not node.orelse):
        raise ValueError(f"line {node.lineno}: a loop that is not over a range")
    limits = [run.value(one, state) for one in node.iter.args]
    first, end, step = {1: (0, *limits, 1), 2: (*limits, 1), 3: (*limits,)}[len(limits)]
    name = node.target.id
    if all(isinstance(one, int) for one in (first, end, step)):
        turns = range(first, end, step)
        if len(turns) <= MOST_TURNS:
            for k in turns:
                _turn(run, node, state, name, k)
            return
    if isinstance(end, Whole) and first == 0 and step == 1 and run.joints is None and run.is_joint_count(end):
        _over_joints(run, node, state, name)
        return
    _turns_unknown(run, node, state, name, (whole_of(first), whole_of(end)))


def _turn(run: "Run", node: ast.For, state: State, name: str, value: Value) -> None:
    if is_known(state.done):
        if not state.done:
            state.names[name] = value
            run.block(node.body, state)
        return
    other, test = state.copy(), state.done
    other.done = False
    other.names[name] = value
    with run.under(run.numbers.negation(test)):
        run.block(node.body, other)
    run.take(state, merged(test, state, other, run.numbers, run.about.name))


def _over_joints(run: "Run", node: ast.For, state: State, name: str) -> None:
    inside = {value.joint for value in state.names.values() if isinstance(value, Whole)} | set(run.active)
    summary = _summary(run, node, state, name, None)
    _apply(run, summary, state, inside)
    _turn(run, node, state, name, Whole(0, run.tracked))
    _apply(run, summary, state, inside)


def _turns_unknown(run: "Run", node: ast.For, state: State, name: str, limits: tuple[Whole, Whole]) -> None:
    summary = _summary(run, node, state, name, limits)
    _apply(run, summary, state, set(run.active))


def _summary(run: "Run", node: ast.For, state: State, name: str, limits: tuple[Whole, Whole] | None) -> Summary:
    """Return what any number of turns keeps, from any state."""
    known = {one: repr(value) for one, value in state.names.items() if is_known(value) or isinstance(value, Record)}
    joints = {one: value.joint and "a joint" for one, value in state.names.items() if isinstance(value, Whole)}
    same = {one: value.joint == run.tracked for one, value in state.names.items() if isinstance(value, Whole)}
    key = f"{node.lineno}:{node.col_offset}:{sorted(known.items())}:{sorted(joints.items())}:{sorted(same.items())}"
    if key not in run.summaries:
        changed = _names_written(node)
        # A name that the loop writes starts from any value, also where it is known before the first turn.
        run.summaries[key] = _prove_summary(run, node, _any_state(run, state, changed), name, limits)
    return run.summaries[key]


def _names_written(node: ast.For) -> set[str]:
    return {one.id for one in ast.walk(node) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)}


def _any_state(run: "Run", state: State, changed: set[str]) -> State:
    made = State({})
    for name, value in state.names.items():
        is_counted = isinstance(value, Whole) and run.is_joint_count(value)
        is_fixed = isinstance(value, Record) or (isinstance(value, Whole) and bool(value.joint))
        if is_fixed or (name not in changed and (is_known(value) or is_counted)):
            made.names[name] = value
        elif value is not None:
            made.names[name] = run.numbers.fresh(name, value)
            if isinstance(value, Whole) and name not in changed:
                made.names[name] = Whole(value.constant, "", made.names[name].rest)  # which keeps its field
    return made


def _prove_summary(run: "Run", node: ast.For, before: State, name: str, limits: Any) -> Summary:
    after, path = before.copy(), run.path
    run.path = []
    run.others += 1
    joint = f"o{run.others}"
    if limits is None:
        run.active.append(joint)
        value: Value = Whole(0, joint)
        index = value.term()
        count = whole_of(run.numbers.integer(run.count)).term()
        run.numbers.facts.add(z3.And(index >= 0, index < count), index)
    else:
        # The limits are those of one run of the loop; of any run only the first is used.
        value = run.numbers.fresh(name, 0)
        bounds = z3.And(value.term() >= limits[0].term(), value.term() < limits[1].term())
        run.numbers.facts.add(bounds, value.term())
    after.names[name] = value
    run.in_summary += 1
    run.block(node.body, after)
    run.in_summary -= 1
    if limits is None:
        run.active.remove(joint)
    run.path = path
    cells = {
        cell: list(_kept(run, before.read(cell, run.numbers, run.about.name(cell)), made))
        for cell, made in after.cells.items()
        if not cell[2].startswith("o")
    }
    names = {
        one: list(_kept(run, before.names[one], after.names[one]))
        for one in before.names
        if one in after.names and after.names[one] is not before.names[one]
    }
    returns = None
    if not (is_known(after.done) and not after.done):
        returns = [value for value in (True, False) if _returns(run, after, value)] or [None]
    fields = {cell[:2] for cell in after.cells if cell[2].startswith("o")}
    return Summary(cells, fields, names, returns, _claims_kept(run, before, after))


def _returns(run: "Run", after: State, value: bool) -> bool:
    if after.result is None:
        return False
    made = run.numbers.truth(after.result) == value
    return run.proves(z3.Implies(run.numbers.truth(after.done), made))


def _kept(run: "Run", before: Value, after: Value) -> Iterator[Relation]:
    if isinstance(before, Whole | int) and not isinstance(before, bool):
        return
    is_truth = isinstance(before, bool | z3.BoolRef)
    for relation in (RELATIONS_OF_TRUTH if is_truth else RELATIONS).values():
        if run.proves(relation(run.numbers, before, after)):
            yield relation


def _claims_kept(run: "Run", before: State, after: State) -> list[str]:
    """Return the largest set of claims that a turn keeps if all of the set hold before it."""
    kept = list(run.kept_claims)
    tracked = Whole(0, run.tracked)
    held = {name: run.numbers.truth(run.claim(before, name, tracked)) for name in kept}
    holds = {name: run.numbers.truth(run.claim(after, name, tracked)) for name in kept}
    while True:
        lost = [one for one in kept if not run.proves(z3.Implies(z3.And([held[name] for name in kept]), holds[one]))]
        if not lost:
            return kept
        kept = [one for one in kept if one not in lost]


def _kept_of(numbers: Arithmetic, name: str, old: Value, kept: list[Relation]) -> Value:
    """Return a new unknown value with the relations to the old one."""
    made = numbers.fresh(name, old)
    for one in kept:
        numbers.facts.add(one(numbers, old, made), made)
    return made


def _apply(run: "Run", summary: Summary, state: State, inside: set[str]) -> None:
    numbers, tracked = run.numbers, Whole(0, run.tracked)
    before = state.copy()
    made, new = state.copy(), list[z3.ExprRef]()
    for cell, kept in summary.cells.items():
        old = before.read(cell, numbers, run.about.name(cell))
        made.cells[cell] = _kept_of(numbers, run.about.name(cell), numbers.double(old), kept)
        new.append(made.cells[cell])
    # Joints of the loops around this one: their numbers are not followed through it.
    for record, place in summary.fields | {cell[:2] for cell in summary.cells if cell[2] == run.tracked}:
        for joint in inside - {"", run.tracked}:
            made.cells[record, place, joint] = numbers.fresh(run.about.name((record, place, joint)))
    for name, kept in summary.names.items():
        if name in before.names:
            made.names[name] = _kept_of(numbers, name, before.names[name], kept)
    if summary.returns is not None:
        made.done = numbers.fresh("returned", True)
        made.result = summary.returns[0] if summary.returns[0] is not None else numbers.fresh("result", True)
    held = z3.And([numbers.truth(run.claim(before, name, tracked)) for name in summary.claims])
    for name in summary.claims:
        holds = numbers.truth(run.claim(made, name, tracked))
        numbers.facts.add(z3.Implies(held, holds), *new)
    if is_known(state.done) and not state.done:
        run.take(state, made)
    elif not is_known(state.done):
        run.take(state, merged(state.done, state, made, numbers, run.about.name))
