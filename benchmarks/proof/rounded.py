"""Real numbers with a bound on each rounding, where the circuits of IEEE sums would take too long.

The result of a sum differs from the exact one by at most 2⁻⁵³ of it, as IEEE 754 demands without underflow (a sum has
none). Products and quotients are any number. All numbers are finite here, which the IEEE proofs show for the numbers
that are promised to be so.
"""

import math
from fractions import Fraction
from typing import Any

import z3

from .arithmetic import Arithmetic, Value, Whole, is_known

UNIT = Fraction(1, 2**53)


class Rounded(Arithmetic):
    """Operations on reals; `unit=0` for whole numbers below 2⁵³, whose sums are exact."""

    def __init__(self, unit: Fraction = UNIT):
        super().__init__()
        self._is_exact = unit == 0
        self._unit = z3.RealVal(str(unit))

    def fresh(self, name: str, like: Value = 0.0) -> Value:
        """Return an unknown value of the same kind as another."""
        if isinstance(like, float) or (isinstance(like, z3.ArithRef) and like.is_real()):
            self._made += 1
            return z3.Real(f"{name}#{self._made}")
        return super().fresh(name, like)

    def double(self, value: Value) -> Any:
        """Return a value as a real."""
        if isinstance(value, z3.ArithRef):
            return value if value.is_real() else z3.ToReal(value)
        if isinstance(value, Whole):
            return z3.ToReal(value.term())
        return z3.RealVal(str(Fraction(value)))

    def integer(self, value: Value) -> Value:
        """Return `int(value)`."""
        return Whole(0, "", z3.ToInt(value)) if isinstance(value, z3.ArithRef) else super().integer(value)

    def comparison(self, operator: str, one: Value, other: Value) -> Value:
        """Return one of the six comparisons."""
        if isinstance(one, int | Whole) and isinstance(other, int | Whole):
            return super().comparison(operator, one, other)
        if is_known(one) and is_known(other):
            return super().comparison(operator, one, other)
        for value, sign in ((one, 1), (other, -1)):
            if is_known(value) and not math.isfinite(value):
                is_less, is_more = sign * value < 0, sign * value > 0
                known = {"Lt": is_less, "LtE": is_less, "Gt": is_more, "GtE": is_more, "Eq": False, "NotEq": True}
                return known[operator]
        a, b = self.double(one), self.double(other)
        return {"Lt": a < b, "LtE": a <= b, "Gt": a > b, "GtE": a >= b, "Eq": a == b, "NotEq": a != b}[operator]

    def negative(self, value: Value) -> Value:
        """Return `-value`."""
        return -value if isinstance(value, z3.ArithRef) else super().negative(value)

    def operation(self, operator: str, one: Value, other: Value) -> Value:
        """Return sum, difference, product, quotient or rest."""
        if not isinstance(one, z3.ArithRef) and not isinstance(other, z3.ArithRef):
            return super().operation(operator, one, other)
        a, b = self.double(one), self.double(other)
        if operator not in ("Add", "Sub"):
            return self.fresh(operator)
        exact = a + b if operator == "Add" else a - b
        if self._is_exact:
            return z3.simplify(exact)
        made = self.fresh("sum")
        size = z3.If(exact < 0, -exact, exact)
        self.facts.add(z3.And(made - exact <= self._unit * size, exact - made <= self._unit * size), made)
        return made

    def choice(self, test: Value, one: Value, other: Value) -> Value:
        """Return one value or the other."""
        if is_known(test) or not (isinstance(one, z3.ArithRef) or isinstance(other, z3.ArithRef)):
            if not is_known(test) and isinstance(one, float) and isinstance(other, float) and one != other:
                return z3.If(test, self.double(one), self.double(other))
            return super().choice(test, one, other)
        return z3.If(test, self.double(one), self.double(other))

    def function(self, name: str, arguments: list[Value]) -> Value:
        """Return a function of Python or of `math`."""
        if all(map(is_known, arguments)) or name == "min":
            return super().function(name, arguments)
        value = self.double(arguments[0])
        if name in ("isfinite", "isnan"):
            return name == "isfinite"
        if name == "abs":
            return z3.If(value < 0, -value, value)
        return self.fresh(name)

    def finite(self, value: Any) -> z3.BoolRef:
        """Return True: all numbers are finite here."""
        return z3.BoolVal(True)
