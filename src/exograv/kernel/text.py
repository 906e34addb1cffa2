"""LLVM IR as text, for one number or for a vector of them."""

import struct


def number(value: float) -> str:
    """A double to the last bit; LLVM reads decimals only where they are exact."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


def float_type(lanes: int, element: str = "double") -> str:
    """Type of a value that has as many lanes."""
    return element if lanes == 1 else f"<{lanes} x {element}>"


def integer_type(lanes: int) -> str:
    """Type of the same size as `float_type` of doubles, for their bits."""
    return float_type(lanes, "i64")


def splat(lanes: int, value: float | int, element: str = "double") -> str:
    """The same constant in every lane."""
    text = number(value) if element in ("double", "float") else str(int(value))
    return text if lanes == 1 else "<" + ", ".join([f"{element} {text}"] * lanes) + ">"


class Block:
    """Lines of one basic block, each with a fresh name for its value."""

    def __init__(self, prefix: str = "%t"):
        self._prefix = prefix
        self._lines: list[str] = []

    @property
    def text(self) -> str:
        """All lines."""
        return "\n".join(self._lines)

    def let(self, expression: str) -> str:
        """Name a value."""
        name = f"{self._prefix}{len(self._lines)}"
        self._lines.append(f"  {name} = {expression}")
        return name

    def add(self, T: str, a: str, b: str) -> str:
        """Sum of two."""
        return self.let(f"fadd {T} {a}, {b}")

    def sub(self, T: str, a: str, b: str) -> str:
        """First less second."""
        return self.let(f"fsub {T} {a}, {b}")

    def mul(self, T: str, a: str, b: str) -> str:
        """Product of two."""
        return self.let(f"fmul {T} {a}, {b}")

    def two_difference(self, T: str, a: str, b: str) -> tuple[str, str]:
        """First less second, rounded, and what the rounding lost, exactly (Knuth's two-sum)."""
        difference = self.sub(T, a, b)
        taken = self.sub(T, a, difference)
        kept = self.add(T, difference, taken)
        return difference, self.add(T, self.sub(T, a, kept), self.sub(T, taken, b))

    def polynomial(self, T: str, z: str, coefficients: list[str]) -> str:
        """Of six coefficients from the lowest power on, in pairs: a shorter chain than Horner's."""
        pairs = [self.add(T, a, self.mul(T, z, b)) for a, b in zip(coefficients[::2], coefficients[1::2], strict=True)]
        z_2 = self.mul(T, z, z)
        upper = self.add(T, pairs[1], self.mul(T, z_2, pairs[2]))
        return self.add(T, pairs[0], self.mul(T, z_2, upper))

    def select(self, lanes: int, condition: str, T: str, a: str, b: str) -> str:
        """In each lane a where the condition holds, else b."""
        return self.let(f"select {float_type(lanes, 'i1')} {condition}, {T} {a}, {T} {b}")

    def bit(self, lanes: int, value: str, position: int) -> str:
        """Whether a bit is set, in each lane."""
        I = integer_type(lanes)  # noqa: E741 - the type's letter
        masked = self.let(f"and {I} {value}, {splat(lanes, 1 << position, 'i64')}")
        return self.let(f"icmp ne {I} {masked}, {splat(lanes, 0, 'i64')}")

    def flip_sign(self, lanes: int, value: str, quadrant: str) -> str:
        """Minus the value where bit 1 of the quadrant is set."""
        T, I = float_type(lanes), integer_type(lanes)  # noqa: E741 - the types' letters
        moved = self.let(f"shl {I} {quadrant}, {splat(lanes, 62, 'i64')}")
        sign = self.let(f"and {I} {moved}, {splat(lanes, -(1 << 63), 'i64')}")
        bits = self.let(f"bitcast {T} {value} to {I}")
        return self.let(f"bitcast {I} {self.let(f'xor {I} {bits}, {sign}')} to {T}")
