"""Symbolic run of the guard's own source: the part of Python that `to_c` translates, on numbers of `Arithmetic`.

One joint J of n is followed exactly, and J is any of them. Another joint is met only in a loop, and nothing but the
settings' limits is known of it (`loops.py`). With `joints=1` all loops over joints run once, which gives a
counterexample that can be replayed.
"""

import ast
from collections.abc import Callable, Sequence

import z3

from .arithmetic import Arithmetic, Value, Whole, is_known, whole_of
from .fields import Fields
from .loops import run_loop
from .source import Source
from .state import Record, State, merged

TRACKED = "J"
"""Joint that is followed."""


class UnknownPythonError(Exception):
    """Python that the prover does not know. Extend the prover or write the guard otherwise."""

    def __init__(self, node: ast.AST):
        super().__init__(
            f"core.py, line {getattr(node, 'lineno', 0)}: {ast.unparse(node)!r} is not known to the prover."
        )


_IS_OF_DOUBLES = z3.Probe("is-qffp")
LITTLE = 2_000_000
"""Steps of z3 for a relation that a loop may keep."""
ALL = 1000
DEPTHS = ((2, False), (5, False), (12, False), (2, True), (5, True), (ALL, True))
"""Depths of a proof, from a glance to everything, and True where sums are exact and not only known by laws."""


class Run:
    """Symbolic run of functions of one source."""

    def __init__(self, source: Source, joints: int | None = None, numbers: Arithmetic | None = None):
        self.source, self.numbers, self.joints = source, numbers or Arithmetic(), joints
        self.path = list[z3.BoolRef]()
        self.duties = list[tuple[z3.BoolRef, z3.BoolRef, str]]()
        """Path, claim and place of each division, which must not be by zero."""
        self.snapshots = dict[str, State]()
        self.summaries = dict[str, list]()
        self.returned = dict[str, list[Value]]()
        """Values of the calls that always happen."""
        self.in_summary = 0
        self.others, self.active, self.tracked = 0, list[str](), TRACKED
        self.assumed_of_others = list[str]()
        """Claims about settings that hold for every joint."""
        self.kept_claims = list[str]()
        """Claims about a joint that a loop may keep."""
        self.about = Fields(source.constants)
        self.count = float(joints) if joints is not None else self.numbers.fresh("N")
        self.joint: Value = 0 if joints is not None else Whole(0, TRACKED)
        """Joint that the promises are about."""
        self.after_call: dict[str, Callable[[State], None]] = {}

    # --- functions ---

    def call(self, state: State, name: str, arguments: list[Value]) -> Value:
        """Run a function of the source, and return its value."""
        node = self.source.functions[name]
        outer = state.names, state.done, state.result
        state.names = {one.arg: value for one, value in zip(node.args.args, arguments, strict=True)}
        state.done, state.result = False, None
        self.block(node.body, state)
        value = state.result
        state.names, state.done, state.result = outer
        if self.path == []:
            self.returned.setdefault(name, []).append(value)
        if name in self.after_call:
            self.after_call[name](state)
        return value

    def claim(self, state: State, name: str, joint: Value, *arguments: Value) -> Value:
        """Return a promise about a joint, in a state that it leaves alone."""
        node = self.source.functions[name]
        given = [Record("b") if one.arg == "b" else Record("r") for one in node.args.args if one.arg in ("b", "r")]
        return self.call(state.copy(), name, [*given, joint, *arguments][: len(node.args.args)])

    # --- statements ---

    def block(self, body: list[ast.stmt], state: State) -> None:
        """Run statements in place."""
        for k, statement in enumerate(body):
            if is_known(state.done):
                if state.done:
                    return
                self.statement(statement, state)
                continue
            other = state.copy()
            test, state.done = state.done, True
            other.done = False
            with self.under(self.numbers.negation(test)):
                self.block(body[k:], other)
            self.take(state, merged(test, state, other, self.numbers, self.about.name))
            return

    def take(self, state: State, other: State) -> None:
        """Replace the content of a state."""
        state.cells, state.names, state.done, state.result = other.cells, other.names, other.done, other.result

    def under(self, test: Value) -> "_Under":
        """Return a context in which a condition holds."""
        return _Under(self.path, self.numbers.truth(test))

    def statement(self, node: ast.stmt, state: State) -> None:
        """Run one statement in place."""
        match node:
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                pass
            case ast.Return(value=value):
                state.result = None if value is None else self.value(value, state)
                state.done = True
            case ast.Expr(value=ast.Call() as call):
                self.value(call, state)
            case ast.Assign(targets=targets, value=value):
                self._assign(targets, value, state)
            case ast.AugAssign(target=target, op=operator, value=value):
                before = self.value(_loaded(target), state)
                made = self._operation(operator, before, self.value(value, state), node)
                self._store(target, made, state)
            case ast.If(test=test, body=body, orelse=orelse):
                self._if(self.value(test, state), body, orelse, state)
            case ast.For():
                run_loop(self, node, state)
            case _:
                raise UnknownPythonError(node)

    def _if(self, test: Value, body: list[ast.stmt], orelse: list[ast.stmt], state: State) -> None:
        if is_known(test):
            self.block(body if test else orelse, state)
            return
        one, other = state.copy(), state.copy()
        with self.under(test):
            self.block(body, one)
        with self.under(self.numbers.negation(test)):
            self.block(orelse, other)
        self.take(state, merged(test, one, other, self.numbers, self.about.name))

    def _assign(self, targets: list[ast.expr], value: ast.expr, state: State) -> None:
        if isinstance(targets[0], ast.Tuple):
            if not (isinstance(value, ast.Tuple) and len(targets) == 1):
                raise UnknownPythonError(value)
            made = [self.value(one, state) for one in value.elts]
            for target, one in zip(targets[0].elts, made, strict=True):
                self._store(target, one, state)
            return
        one = self.value(value, state)
        for target in targets:
            self._store(target, one, state)

    def _store(self, target: ast.expr, value: Value, state: State) -> None:
        match target:
            case ast.Name(id=name):
                state.names[name] = value
            case ast.Subscript(value=ast.Name(id=name), slice=index):
                self.about.write(self, state, state.names[name].name, whole_of(self.value(index, state)), value, target)
            case _:
                raise UnknownPythonError(target)

    # --- expressions ---

    def value(self, node: ast.expr, state: State) -> Value:
        """Return the value of an expression."""
        match node:
            case ast.Constant(value=bool() | int() | float() as value):
                return value
            case ast.Name(id=name) if name in state.names:
                return state.names[name]
            case ast.Name(id=name) if name in self.source.constants:
                return self.source.constants[name]
            case ast.Attribute(value=ast.Name(id="math"), attr=("nan" | "inf") as name):
                return float(name)
            case ast.Subscript(value=ast.Name(id=name), slice=index):
                record = state.names[name].name
                place = whole_of(self.value(index, state))
                return self.about.read(self, self.snapshots.get(record, state), record, place, node)
        return self._computed(node, state)

    def _computed(self, node: ast.expr, state: State) -> Value:
        numbers = self.numbers
        match node:
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return numbers.negative(self.value(operand, state))
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.value(operand, state)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return numbers.negation(self.value(operand, state))
            case ast.BinOp(left=left, op=operator, right=right):
                return self._operation(operator, self.value(left, state), self.value(right, state), node)
            case ast.BoolOp(op=operator, values=values):
                return self._all_or_any(isinstance(operator, ast.And), values, state)
            case ast.Compare(left=left, ops=operators, comparators=rights):
                terms = [self.value(one, state) for one in (left, *rights)]
                made: Value = True
                for a, op, b in zip(terms, operators, terms[1:], strict=False):
                    made = numbers.both(made, numbers.comparison(type(op).__name__, a, b))
                return made
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return self._either_of(self.value(test, state), body, orelse, state)
            case ast.Call(func=function, args=arguments, keywords=[]):
                return self._call(node, ast.unparse(function), [self.value(one, state) for one in arguments], state)
        raise UnknownPythonError(node)

    def _either_of(self, test: Value, body: ast.expr, orelse: ast.expr, state: State) -> Value:
        if is_known(test):
            return self.value(body if test else orelse, state)
        with self.under(test):
            one = self._value_if(test, body, state)
        with self.under(self.numbers.negation(test)):
            other = self._value_if(self.numbers.negation(test), orelse, state)
        return self.numbers.choice(test, one, other)

    def _value_if(self, test: Value, node: ast.expr, state: State) -> Value:
        """Return a value that is computed only if a condition holds: what it writes is written only then."""
        other = state.copy()
        value = self.value(node, other)
        if other.cells.keys() != state.cells.keys() or any(
            other.cells[cell] is not state.cells[cell] for cell in other.cells
        ):
            self.take(state, merged(test, other, state, self.numbers, self.about.name))
        return value

    def _all_or_any(self, is_all: bool, values: list[ast.expr], state: State) -> Value:
        numbers, made, before = self.numbers, is_all, len(self.path)
        for k, one in enumerate(values):
            asked = True if k == 0 else made if is_all else numbers.negation(made)
            value = self.value(one, state) if is_known(asked) else self._value_if(asked, one, state)
            if not isinstance(value, bool | z3.BoolRef):
                raise UnknownPythonError(one)
            made = numbers.both(made, value) if is_all else numbers.either(made, value)
            if is_known(made) and made is not is_all:
                break
            self.path.append(numbers.truth(value if is_all else numbers.negation(value)))
        del self.path[before:]
        return made

    def _operation(self, operator: ast.operator, one: Value, other: Value, node: ast.AST) -> Value:
        name = type(operator).__name__
        if name == "Div":
            self.duty(self.numbers.comparison("NotEq", other, 0.0), node)
        if name not in ("Add", "Sub", "Mult", "Div", "Mod"):
            raise UnknownPythonError(node)
        return self.numbers.operation(name, one, other)

    def _call(self, node: ast.expr, name: str, arguments: list[Value], state: State) -> Value:
        if name in self.source.functions:
            return self.call(state, name, arguments)
        name = name.removeprefix("math.")
        if name == "int":
            return self.numbers.integer(arguments[0])
        if name == "float":
            value = arguments[0]
            return float(value) if is_known(value) else self.numbers.double(value)
        if name in ("abs", "min", "isfinite", "isnan", "copysign", "floor", "sqrt", "cos", "sin"):
            return self.numbers.function(name, arguments)
        raise UnknownPythonError(node)

    def duty(self, claim: Value, node: ast.AST) -> None:
        """Note that something must hold here; a turn that stands for many is no place of its own."""
        if self.in_summary or (is_known(claim) and claim):
            return
        self.duties.append((z3.And(list(self.path)), self.numbers.truth(claim), ast.unparse(node)))

    def joint_keys(self, state: State) -> list[str]:
        """Return the joints that are followed now."""
        return [str(j) for j in range(self.joints)] if self.joints is not None else [self.tracked, *self.active]

    def proves(self, claim: Value) -> bool:
        """Return True if a claim is proved for all numbers with little effort."""
        return self.check(claim, LITTLE, ((1, False), (4, False)))[0] == z3.unsat

    def check(
        self, claim: Value, effort: int, depths: Sequence[tuple[int, bool]] = DEPTHS
    ) -> tuple[z3.CheckSatResult, z3.ModelRef | None]:
        """Look for numbers for which a claim does not hold.

        Args:
            claim: Claim about unknown numbers.
            effort: Number of steps of z3: unlike a time, it is the same on every day.
            depths: As in `DEPTHS`, one after the other.
        """
        if is_known(claim):
            return (z3.unsat if claim else z3.sat), None
        claim, found, model = z3.simplify(claim), z3.unknown, None
        if z3.is_true(claim):
            return z3.unsat, None
        for depth, is_exact in depths:
            facts, are_all = self.numbers.facts.about(claim, depth, is_exact)
            goal = z3.Goal()
            goal.add(*facts, z3.Not(claim))
            solver = z3.SolverFor("QF_FP") if _IS_OF_DOUBLES(goal) else z3.Solver()
            solver.set("rlimit", effort)
            solver.add(*facts, z3.Not(claim))
            found = solver.check()
            if found == z3.unsat:
                return found, None
            model = solver.model() if found == z3.sat and are_all else None
            if are_all:
                break
        return found, model

    def is_joint_count(self, value: Whole) -> bool:
        """Return True if a number is that of the joints."""
        count = whole_of(self.numbers.integer(self.count))
        both = value.rest, count.rest
        is_named = value.constant == 0 and not value.joint and all(isinstance(one, z3.AstRef) for one in both)
        return is_named and z3.eq(*both)


class _Under:
    """Context in which a condition holds."""

    def __init__(self, path: list[z3.BoolRef], test: z3.BoolRef):
        self._path, self._test = path, test

    def __enter__(self):
        self._path.append(self._test)

    def __exit__(self, *_: object):
        self._path.pop()


def _loaded(target: ast.expr) -> ast.expr:
    made = ast.parse(ast.unparse(target), mode="eval").body
    return ast.copy_location(made, target)
