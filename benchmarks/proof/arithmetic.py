"""Numbers of the prover: IEEE doubles of z3, where products, quotients and roots are known by true laws only.

Addition, comparison, sign and rounding to whole numbers are exact. A product is an unknown number that obeys laws which
hold for every IEEE product (sign, size beside its factors, no NaN from finite factors). That is much quicker than the
circuit of a multiplier, and everything proved of such a product holds of the real one. A counterexample may then be
spurious, so it counts only after a replay; `Arithmetic(exact=True)` uses the circuits.
"""

import math
from dataclasses import dataclass
from typing import Any

import z3

DOUBLE = z3.Float64()
NEAREST = z3.RNE()
Value = Any
"""Python bool, int or float; z3 truth value or double; `Whole`."""


@dataclass(frozen=True)
class Whole:
    """Integer as constant + joint + rest, so that a place of the record shows its field and its joint."""

    constant: int
    joint: str = ""
    rest: z3.ArithRef | None = None

    def term(self) -> z3.ArithRef:
        """Return the sum."""
        total = z3.IntVal(self.constant)
        if self.joint:
            total = total + z3.Int(f"joint {self.joint}")
        return total if self.rest is None else total + self.rest


def whole_of(value: Value) -> Whole:
    """Return an integer in parts."""
    if isinstance(value, Whole):
        return value
    return Whole(int(value)) if isinstance(value, int) else Whole(0, "", value)


def is_known(value: Value) -> bool:
    """Return True for a number or truth value of Python."""
    return isinstance(value, bool | int | float)


class Facts:
    """Facts about unknown numbers. A fact belongs to the numbers that it describes, and is used only with them."""

    def __init__(self):
        self._facts = list[tuple[z3.BoolRef, set[int], bool]]()
        self._of = dict[int, list[int]]()
        self._of_all = list[int]()
        self._symbols = dict[int, tuple[z3.ExprRef, set[int]]]()

    def add(self, fact: z3.BoolRef, *owners: z3.ExprRef, is_costly: bool = False) -> None:
        """Add a fact about some unknown numbers; without owners it is used where all its numbers are."""
        number = len(self._facts)
        self._facts.append((fact, self.symbols(fact), is_costly))
        for symbol in set[int]().union(*(self.symbols(one) for one in owners)):
            self._of.setdefault(symbol, []).append(number)
        if not owners:
            self._of_all.append(number)

    def about(self, claim: z3.BoolRef, depth: int, is_exact: bool) -> tuple[list[z3.BoolRef], bool]:
        """Return the facts that a claim may need, followed so deep, and True if these are all.

        To leave one out is safe: less can be proved.
        """
        known = set(self.symbols(claim))
        new, used = set(known), dict[int, z3.BoolRef]()
        for _ in range(depth):
            found = [number for symbol in new for number in self._of.get(symbol, []) if number not in used]
            found += [number for number in self._of_all if number not in used and self._facts[number][1] <= known]
            more = set[int]()
            for number in found:
                fact, symbols, is_costly = self._facts[number]
                if is_exact or not is_costly:
                    used[number] = fact
                    more |= symbols
            new = more - known
            known |= more
            if not new:
                return list(used.values()), is_exact
        return list(used.values()), False

    def symbols(self, term: z3.ExprRef) -> set[int]:
        """Return the ids of the unknown numbers in a term."""
        stack = [term]
        while stack:
            one = stack[-1]
            if one.get_id() in self._symbols:
                stack.pop()
                continue
            children = one.children()
            new = [child for child in children if child.get_id() not in self._symbols]
            if new:
                stack += new
                continue
            stack.pop()
            found = set[int]()
            if not children and one.decl().kind() == z3.Z3_OP_UNINTERPRETED:
                found = {one.get_id()}
            for child in children:
                found |= self._symbols[child.get_id()][1]
            self._symbols[one.get_id()] = one, found
        return self._symbols[term.get_id()][1]


class Arithmetic:
    """Operations on values, and the facts about the unknown numbers that they made."""

    def __init__(self, exact: bool = False):
        self.exact, self.facts, self._made = exact, Facts(), 0
        self._known = dict[tuple, tuple[z3.ExprRef, tuple[z3.ExprRef, ...]]]()
        self._shared = dict[tuple[str, int], list[tuple[z3.FPRef, z3.FPRef]]]()
        self._differences = list[tuple[z3.FPRef, z3.FPRef, z3.FPRef]]()
        self._quotients = list[tuple[z3.FPRef, z3.FPRef, z3.FPRef]]()

    # --- values ---

    def fresh(self, name: str, like: Value = 0.0) -> Value:
        """Return an unknown value of the same kind as another."""
        self._made += 1
        name = f"{name}#{self._made}"
        if isinstance(like, bool | z3.BoolRef):
            return z3.Bool(name)
        if isinstance(like, int | Whole | z3.ArithRef):
            return Whole(0, "", z3.Int(name))
        return z3.FP(name, DOUBLE)

    def double(self, value: Value) -> z3.FPRef:
        """Return a value as a double."""
        if isinstance(value, z3.FPRef):
            return value
        if is_known(value):
            return z3.FPVal(float(value), DOUBLE)
        if isinstance(value, Whole) and not value.joint and value.rest is None:
            return z3.FPVal(float(value.constant), DOUBLE)
        integer = whole_of(value).term()
        made, is_new = self._result("double", z3.FP, integer)
        if is_new:
            small = z3.And(integer > -(2**53), integer < 2**53)
            self.facts.add(z3.Implies(small, self.finite(made)), made)
            self.facts.add(z3.Implies(z3.And(small, integer >= 0), made >= 0.0), made)
            self._known["whole", made.get_id()] = integer, (made,)
        return made

    def _result(self, name: str, kind: Any, *arguments: z3.ExprRef) -> tuple[Any, bool]:
        """Return the unknown result of an operation, and True if it is a new one; the same operands have the same."""
        key = (name, *(one.get_id() for one in arguments))
        if key in self._known:
            return self._known[key][0], False
        self._made += 1
        text = f"{name}#{self._made}"
        made = z3.FP(text, DOUBLE) if kind is z3.FP else kind(text)
        self._known[key] = made, arguments  # the operands are kept, so that their ids are not given again
        return made, True

    def _named(self, term: z3.ExprRef) -> Any:
        """Return a name for a result, so that a proof can leave out how it was computed."""
        if len(self.facts.symbols(term)) < 2:
            return term
        made, is_new = self._result("result", z3.Bool if z3.is_bool(term) else z3.FP, term)
        if is_new:
            self.facts.add(made == term, made)
        return made

    def truth(self, value: Value) -> z3.BoolRef:
        """Return a value as a truth value of z3."""
        return value if isinstance(value, z3.BoolRef) else z3.BoolVal(bool(value))

    def integer(self, value: Value) -> Value:
        """Return `int(value)`."""
        if is_known(value):
            return int(value)
        if isinstance(value, Whole):
            return value
        return Whole(0, "", self._result("whole", z3.Int, value)[0])

    def choice(self, test: Value, one: Value, other: Value) -> Value:
        """Return one value or the other."""
        if is_known(test):
            return one if test else other
        if one is other or (is_known(one) and is_known(other) and repr(one) == repr(other)):
            return one
        kinds = (bool, z3.BoolRef)
        if isinstance(one, kinds) and isinstance(other, kinds):
            return self._named(z3.If(test, self.truth(one), self.truth(other)))
        whole = (int, Whole)
        if isinstance(one, whole) and isinstance(other, whole):
            return Whole(0, "", z3.If(test, whole_of(one).term(), whole_of(other).term()))
        return self._named(z3.If(test, self.double(one), self.double(other)))

    # --- truth ---

    def negation(self, value: Value) -> Value:
        """Return `not value`."""
        return not value if is_known(value) else z3.Not(value)

    def both(self, one: Value, other: Value) -> Value:
        """Return `one and other`."""
        if is_known(one):
            return other if one else False
        if is_known(other):
            return one if other else False
        return self._named(z3.And(one, other))

    def either(self, one: Value, other: Value) -> Value:
        """Return `one or other`."""
        return self.negation(self.both(self.negation(one), self.negation(other)))

    def comparison(self, operator: str, one: Value, other: Value) -> Value:
        """Return one of the six comparisons."""
        if is_known(one) and is_known(other):
            return {
                "Lt": one < other,
                "LtE": one <= other,
                "Gt": one > other,
                "GtE": one >= other,
                "Eq": one == other,
                "NotEq": one != other,
            }[operator]
        if isinstance(one, bool | z3.BoolRef):
            same = self.truth(one) == self.truth(other)
            return same if operator == "Eq" else z3.Not(same)
        whole = (int, Whole)
        if isinstance(one, whole) and isinstance(other, whole):
            a, b = whole_of(one).term(), whole_of(other).term()
            pairs = {"Lt": a < b, "LtE": a <= b, "Gt": a > b, "GtE": a >= b, "Eq": a == b, "NotEq": a != b}
            return pairs[operator]
        a, b = self.double(one), self.double(other)
        if operator in ("Eq", "NotEq"):
            same = z3.fpEQ(a, b)
            return same if operator == "Eq" else z3.Not(same)
        return {"Lt": z3.fpLT, "LtE": z3.fpLEQ, "Gt": z3.fpGT, "GtE": z3.fpGEQ}[operator](a, b)

    # --- arithmetic ---

    def negative(self, value: Value) -> Value:
        """Return `-value`."""
        if is_known(value):
            return -value
        return z3.fpNeg(value) if isinstance(value, z3.FPRef) else Whole(0, "", -whole_of(value).term())

    def operation(self, operator: str, one: Value, other: Value) -> Value:
        """Return sum, difference, product, quotient or rest."""
        whole = (int, Whole)
        if isinstance(one, whole) and isinstance(other, whole) and operator != "Div":
            return self._of_whole(operator, one, other)
        if is_known(one) and is_known(other) and not (operator == "Div" and other == 0):
            with_numbers = {"Add": one + other, "Sub": one - other, "Mult": one * other}
            return with_numbers[operator] if operator in with_numbers else one / other
        a, b = self.double(one), self.double(other)
        if operator == "Add":
            return self._sum(a, b)
        if operator == "Sub":
            return self._sum(a, z3.simplify(z3.fpNeg(b)))  # the same in IEEE arithmetic, also for zeros
        return self._times(a, b) if operator == "Mult" else self._over(a, b)

    def _of_whole(self, operator: str, one: Value, other: Value) -> Value:
        if isinstance(one, int) and isinstance(other, int):
            if operator == "Mod":
                return one % other
            return {"Add": one + other, "Sub": one - other, "Mult": one * other}[operator]
        a, b = whole_of(one), whole_of(other)
        if operator == "Add" and not (a.joint and b.joint):
            rests = [rest for rest in (a.rest, b.rest) if rest is not None]
            return Whole(a.constant + b.constant, a.joint or b.joint, sum(rests[1:], rests[0]) if rests else None)
        terms = a.term(), b.term()
        made = {"Add": terms[0] + terms[1], "Sub": terms[0] - terms[1], "Mult": terms[0] * terms[1]}
        return Whole(0, "", made[operator] if operator in made else terms[0] % terms[1])

    def _sum(self, a: z3.FPRef, b: z3.FPRef) -> z3.FPRef:
        if z3.is_app_of(b, z3.Z3_OP_ITE):
            test, one, other = b.children()
            return self.choice(test, self._sum(a, one), self._sum(a, other))
        term = z3.fpAdd(NEAREST, a, b)
        made, is_new = self._result("sum", z3.FP, term)
        if is_new:
            laws = [
                z3.Not(z3.fpIsNaN(made)),
                *(z3.Implies(one >= 0.0, made >= other) for one, other in ((a, b), (b, a))),
                *(z3.Implies(one <= 0.0, made <= other) for one, other in ((a, b), (b, a))),
                z3.Implies(a >= -b, made >= 0.0),
                z3.Implies(a <= -b, made <= 0.0),
                # Beside so large a number a small one is lost.
                z3.Implies(z3.And(z3.fpAbs(a) <= VAST, z3.fpAbs(b) <= 1.0), z3.fpAbs(made) <= VAST),
            ]
            self.facts.add(z3.Implies(z3.And(self.finite(a), self.finite(b)), z3.And(laws)), made)
            self.facts.add(made == term, made, is_costly=True)
            if z3.is_fp_value(a):
                self._in_order("sum", a, b, made)
            # Of c − a > b follows a + b < c, and rounding keeps order.
            for c, minus_a, less in self._differences:
                if z3.eq(z3.simplify(-minus_a), a):
                    order = z3.And(z3.Implies(less > b, made <= c), z3.Implies(less < b, made >= c))
                    self.facts.add(z3.Implies(z3.And(*map(self.finite, (a, b, c))), order), made)
            self._differences.append((a, b, made))
        return made

    def _in_order(self, name: str, same: z3.FPRef, other: z3.FPRef, made: z3.FPRef) -> None:
        """Add that rounding keeps the order of results that share an operand."""
        key = name, same.get_id()
        for earlier, result in self._shared.get(key, []):
            a, b, c, d = (
                (other, earlier, made, result) if name == "sum" else map(z3.fpAbs, (other, earlier, made, result))
            )
            order = z3.And(z3.Implies(a <= b, c <= d), z3.Implies(b <= a, d <= c))
            self.facts.add(z3.Implies(z3.And(*map(self.finite, (same, other, earlier))), order), made)
        self._shared.setdefault(key, []).append((other, made))

    def _times(self, a: z3.FPRef, b: z3.FPRef) -> z3.FPRef:
        if self.exact:
            return z3.fpMul(NEAREST, a, b)
        if a.get_id() > b.get_id():
            a, b = b, a
        made, is_new = self._result("product", z3.FP, a, b)
        if not is_new:
            return made
        size, one, other = z3.fpAbs(made), z3.fpAbs(a), z3.fpAbs(b)
        both = z3.And(self.finite(a), self.finite(b))
        positive = z3.Or(z3.And(a >= 0.0, b >= 0.0), z3.And(a <= 0.0, b <= 0.0))
        negative = z3.Or(z3.And(a >= 0.0, b <= 0.0), z3.And(a <= 0.0, b >= 0.0))
        laws = [
            z3.Not(z3.fpIsNaN(made)),
            z3.Implies(positive, made >= 0.0),
            z3.Implies(negative, made <= 0.0),
            z3.Implies(one <= 1.0, size <= other),
            z3.Implies(other <= 1.0, size <= one),
            z3.Implies(one >= 1.0, size >= other),
            z3.Implies(other >= 1.0, size >= one),
            # Rounding keeps order: a product of bounded factors is at most the rounded product of the bounds.
            *(z3.Implies(z3.And(one <= x, other <= y), size <= x * y) for x in BOUNDS for y in BOUNDS),
        ]
        self.facts.add(z3.Implies(both, z3.And(laws)), made)
        self._in_order("product", a, b, made)
        self._in_order("product", b, a, made)
        return made

    def _over(self, a: z3.FPRef, b: z3.FPRef) -> z3.FPRef:
        if self.exact:
            return z3.fpDiv(NEAREST, a, b)
        made, is_new = self._result("quotient", z3.FP, a, b)
        if not is_new:
            return made
        size, one, other = z3.fpAbs(made), z3.fpAbs(a), z3.fpAbs(b)
        positive = z3.Or(z3.And(a >= 0.0, b > 0.0), z3.And(a <= 0.0, b < 0.0))
        negative = z3.Or(z3.And(a >= 0.0, b < 0.0), z3.And(a <= 0.0, b > 0.0))
        laws = [
            z3.Not(z3.fpIsNaN(made)),
            z3.Implies(positive, made >= 0.0),
            z3.Implies(negative, made <= 0.0),
            z3.Implies(one <= other, size <= 1.0),
            z3.Implies(one >= other, size >= 1.0),
            z3.Implies(other >= 1.0, size <= one),
        ]
        defined = z3.And(self.finite(a), self.finite(b), z3.Not(z3.fpIsZero(b)))
        self.facts.add(z3.Implies(defined, z3.And(laws)), made)
        for earlier, c, d in self._quotients:
            if z3.eq(b, d):  # rounding keeps order
                order = z3.And(z3.Implies(a <= c, made <= earlier), z3.Implies(c <= a, earlier <= made))
                self.facts.add(z3.Implies(z3.And(defined, self.finite(c), b > 0.0), order), made)
        self._quotients.append((made, a, b))
        return made

    def function(self, name: str, arguments: list[Value]) -> Value:
        """Return a function of Python or of `math`."""
        value = arguments[0]
        if all(map(is_known, arguments)) and name in ("abs", "isfinite", "isnan", "copysign", "floor"):
            return abs(value) if name == "abs" else getattr(math, name)(*arguments)
        if name == "min":
            a, b = (whole_of(one).term() for one in arguments)
            return Whole(0, "", z3.If(b < a, b, a))
        value = self.double(value)
        match name:
            case "abs":
                return z3.fpAbs(value)
            case "isfinite":
                return self.finite(value)
            case "isnan":
                return z3.fpIsNaN(value)
            case "floor":
                return z3.fpRoundToIntegral(z3.RTN(), value)
            case "copysign":
                sign, size = self.double(arguments[1]), z3.fpAbs(value)
                return z3.If(z3.fpIsNegative(sign), z3.fpNeg(size), size)
            case "sqrt":
                return self._root_of(value)
            case "cos" | "sin":
                made, _ = self._result(name, z3.FP, value)
                self.facts.add(z3.Implies(self.finite(value), z3.And(made >= -1.0, made <= 1.0)), made)
                return made
        raise ValueError(f"no function {name}")

    def _root_of(self, a: z3.FPRef) -> z3.FPRef:
        if self.exact:
            return z3.fpSqrt(NEAREST, a)
        made, _ = self._result("root", z3.FP, a)
        laws = [made >= 0.0, z3.Implies(a <= 1.0, z3.And(made <= 1.0, made >= a)), z3.Implies(a >= 1.0, made <= a)]
        self.facts.add(z3.Implies(a >= 0.0, z3.And(laws)), made)
        return made

    def finite(self, value: z3.FPRef) -> z3.BoolRef:
        """Return the claim that a double is neither NaN nor infinite."""
        return z3.Not(z3.Or(z3.fpIsNaN(value), z3.fpIsInf(value)))


VAST = 1e17
BOUNDS = (1e3, 1e6)
"""Bounds of factors for which the bound of their product is a law."""
