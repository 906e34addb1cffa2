"""LLVM IR as text, for scalars and vectors."""

import struct


def number(value: float) -> str:
    """Return a double as its exact bits; LLVM reads decimals only if they are exact."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


def float_type(lanes: int, element: str = "double") -> str:
    """Type of a value with this number of lanes."""
    return element if lanes == 1 else f"<{lanes} x {element}>"


def integer_type(lanes: int) -> str:
    """Integer type of the same size as `float_type` of doubles, for their bits."""
    return float_type(lanes, "i64")


def splat(lanes: int, value: float | int, element: str = "double") -> str:
    """Return a constant in each lane."""
    text = number(value) if element in ("double", "float") else str(int(value))
    return text if lanes == 1 else "<" + ", ".join([f"{element} {text}"] * lanes) + ">"


class Block:
    """Lines of one basic block, each with a fresh name for its value."""

    def __init__(self, prefix: str = "%t"):
        self._prefix = prefix
        self._lines: list[str] = []

    @property
    def text(self) -> str:
        """Return all lines as one text."""
        return "\n".join(self._lines)

    def let(self, expression: str) -> str:
        """Append a line that names a value, and return the name."""
        name = f"{self._prefix}{len(self._lines)}"
        self._lines.append(f"  {name} = {expression}")
        return name

    def add(self, T: str, a: str, b: str) -> str:
        """Append the sum of two values."""
        return self.let(f"fadd {T} {a}, {b}")

    def sub(self, T: str, a: str, b: str) -> str:
        """Append the difference `a` − `b`."""
        return self.let(f"fsub {T} {a}, {b}")

    def mul(self, T: str, a: str, b: str) -> str:
        """Append the product of two values."""
        return self.let(f"fmul {T} {a}, {b}")

    def two_difference(self, T: str, a: str, b: str) -> tuple[str, str]:
        """Append the rounded difference `a` − `b` and its exact rounding error (Knuth's two-sum)."""
        difference = self.sub(T, a, b)
        taken = self.sub(T, a, difference)
        kept = self.add(T, difference, taken)
        return difference, self.add(T, self.sub(T, a, kept), self.sub(T, taken, b))

    def polynomial(self, T: str, z: str, coefficients: list[str]) -> str:
        """Append a polynomial of six coefficients, lowest power first, in pairs: a shorter chain than Horner's."""
        pairs = [self.add(T, a, self.mul(T, z, b)) for a, b in zip(coefficients[::2], coefficients[1::2], strict=True)]
        z_2 = self.mul(T, z, z)
        upper = self.add(T, pairs[1], self.mul(T, z_2, pairs[2]))
        return self.add(T, pairs[0], self.mul(T, z_2, upper))

    def select(self, lanes: int, condition: str, T: str, a: str, b: str) -> str:
        """Append the choice of `a` in each lane where the condition holds, else of `b`."""
        return self.let(f"select {float_type(lanes, 'i1')} {condition}, {T} {a}, {T} {b}")

    def bit(self, lanes: int, value: str, position: int) -> str:
        """Append the test, in each lane, of one bit."""
        I = integer_type(lanes)  # noqa: E741 - the type's letter
        masked = self.let(f"and {I} {value}, {splat(lanes, 1 << position, 'i64')}")
        return self.let(f"icmp ne {I} {masked}, {splat(lanes, 0, 'i64')}")

    def flip_sign(self, lanes: int, value: str, quadrant: str) -> str:
        """Append the value, negated where bit 1 of the quadrant is set."""
        T, I = float_type(lanes), integer_type(lanes)  # noqa: E741 - the types' letters
        moved = self.let(f"shl {I} {quadrant}, {splat(lanes, 62, 'i64')}")
        sign = self.let(f"and {I} {moved}, {splat(lanes, -(1 << 63), 'i64')}")
        bits = self.let(f"bitcast {T} {value} to {I}")
        return self.let(f"bitcast {I} {self.let(f'xor {I} {bits}, {sign}')} to {T}")
