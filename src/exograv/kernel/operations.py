"""CasADi's scalar operations as LLVM IR, with the same results for zeros, infinities and NaN as in CasADi."""

import casadi as ca

from exograv.errors import KernelError

from .text import float_type, splat

ARITHMETIC = {ca.OP_ADD: "fadd", ca.OP_SUB: "fsub", ca.OP_MUL: "fmul", ca.OP_DIV: "fdiv"}
COMPARISONS = {ca.OP_LT: "olt", ca.OP_LE: "ole", ca.OP_EQ: "oeq", ca.OP_NE: "une"}
INTRINSICS = {ca.OP_SQRT: "sqrt", ca.OP_FABS: "fabs", ca.OP_FLOOR: "floor", ca.OP_CEIL: "ceil"}
LIBRARY = {
    ca.OP_EXP: "exp", ca.OP_LOG: "log", ca.OP_LOG1P: "log1p", ca.OP_EXPM1: "expm1",
    ca.OP_TAN: "tan", ca.OP_ASIN: "asin", ca.OP_ACOS: "acos", ca.OP_ATAN: "atan",
    ca.OP_SINH: "sinh", ca.OP_COSH: "cosh", ca.OP_TANH: "tanh",
    ca.OP_ASINH: "asinh", ca.OP_ACOSH: "acosh", ca.OP_ATANH: "atanh", ca.OP_ERF: "erf",
}  # fmt: skip
"""Functions of the C library, called for each lane; sine and cosine are our own (`trigonometry`)."""

LIBRARY_OF_TWO = {
    ca.OP_POW: "pow", ca.OP_CONSTPOW: "pow", ca.OP_ATAN2: "atan2",
    ca.OP_FMOD: "fmod", ca.OP_REMAINDER: "remainder", ca.OP_HYPOT: "hypot",
}  # fmt: skip
TRIGONOMETRIC = (ca.OP_SIN, ca.OP_COS)
PLACED = (ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT)
"""Operations that only read or write memory."""


class Operations:
    """Writer of one operation's lines, for one number of lanes and one element type."""

    def __init__(self, lanes: int, element: str = "double"):
        self.lanes, self.element = lanes, element
        self.T = float_type(lanes, element)
        self._suffix = ("" if lanes == 1 else f"v{lanes}") + {"double": "f64", "float": "f32"}[element]
        self._zero, self._one = (splat(lanes, value, element) for value in (0.0, 1.0))
        self.declared: set[str] = set()
        """Declarations of external functions that the lines call."""

    def lines(self, operation: int, name: str, operands: list[str]) -> list[str]:
        """Return the IR that gives `name` its value, for each operation except sine, cosine and those of memory."""
        T, a, b = self.T, operands[0] if operands else "", operands[-1] if operands else ""
        if operation in ARITHMETIC:
            return [f"{name} = {ARITHMETIC[operation]} {T} {a}, {b}"]
        if operation in COMPARISONS:
            return self._truth(name, f"fcmp {COMPARISONS[operation]} {T} {a}, {b}")
        if operation in INTRINSICS:
            return [f"{name} = {self._intrinsic(INTRINSICS[operation], [a])}"]
        if operation in LIBRARY:
            return self._by_lane(LIBRARY[operation], name, [a])
        if operation in LIBRARY_OF_TWO:
            return self._by_lane(LIBRARY_OF_TWO[operation], name, [a, b])
        return self._special(operation, name, a, b)

    def _special(self, operation: int, name: str, a: str, b: str) -> list[str]:
        T, zero = self.T, self._zero
        match operation:
            case ca.OP_NEG:
                return [f"{name} = fneg {T} {a}"]
            case ca.OP_SQ:
                return [f"{name} = fmul {T} {a}, {a}"]
            case ca.OP_TWICE:
                return [f"{name} = fadd {T} {a}, {a}"]
            case ca.OP_INV:
                return [f"{name} = fdiv {T} {self._one}, {a}"]
            case ca.OP_COPYSIGN:
                return [f"{name} = {self._intrinsic('copysign', [a, b])}"]
            case ca.OP_NOT:
                return self._truth(name, f"fcmp oeq {T} {a}, {zero}")
            case ca.OP_IF_ELSE_ZERO:
                return [f"{name}.c = fcmp une {T} {a}, {zero}", self._select(name, f"{name}.c", b, zero)]
        return self._of_two_conditions(operation, name, a, b)

    def _of_two_conditions(self, operation: int, name: str, a: str, b: str) -> list[str]:
        T, zero = self.T, self._zero
        match operation:
            case ca.OP_AND | ca.OP_OR:
                word = "and" if operation == ca.OP_AND else "or"
                first, second = (f"{name}.{i} = fcmp une {T} {x}, {zero}" for i, x in enumerate((a, b)))
                return [first, second, *self._truth(name, f"{word} {self._bits} {name}.0, {name}.1")]
            case ca.OP_SIGN:
                # The sign of zero is that zero, and of NaN it is NaN.
                minus = splat(self.lanes, -1.0, self.element)
                conditions = [f"{name}.n = fcmp olt {T} {a}, {zero}", f"{name}.p = fcmp ogt {T} {a}, {zero}"]
                positive = self._select(f"{name}.s", f"{name}.p", self._one, a)
                return [*conditions, positive, self._select(name, f"{name}.n", minus, f"{name}.s")]
            case ca.OP_FMIN | ca.OP_FMAX:
                # C's rule: the smaller of two numbers; the number if the other is NaN; the first of two zeros.
                word = "ole" if operation == ca.OP_FMIN else "oge"
                conditions = [f"{name}.n = fcmp uno {T} {b}, {b}", f"{name}.c = fcmp {word} {T} {a}, {b}"]
                either = f"{name}.o = or {self._bits} {name}.n, {name}.c"
                return [*conditions, either, self._select(name, f"{name}.o", a, b)]
        raise AssertionError(f"{OPERATION_NAMES[operation]} is known, but has no IR here.")

    @property
    def _bits(self) -> str:
        return float_type(self.lanes, "i1")

    def _truth(self, name: str, condition: str) -> list[str]:
        return [f"{name}.c = {condition}", f"{name} = uitofp {self._bits} {name}.c to {self.T}"]

    def _select(self, name: str, condition: str, a: str, b: str) -> str:
        return f"{name} = select {self._bits} {condition}, {self.T} {a}, {self.T} {b}"

    def _intrinsic(self, word: str, operands: list[str]) -> str:
        function = f"@llvm.{word}.{self._suffix}"
        self.declared.add(f"declare {self.T} {function}({', '.join([self.T] * len(operands))})")
        return f"call {self.T} {function}({', '.join(f'{self.T} {x}' for x in operands)})"

    def _by_lane(self, function: str, name: str, operands: list[str]) -> list[str]:
        """Return a call of a C library function for each lane; single precision is computed in double."""
        self.declared.add(f"declare double @{function}({', '.join(['double'] * len(operands))}) nounwind memory(none)")
        if self.lanes == 1:
            return [f"{name} = call double @{function}({', '.join(f'double {x}' for x in operands)})"]
        wide = float_type(self.lanes)
        lines, vectors = self.widened(name, operands)
        gathered = "poison"
        for lane in range(self.lanes):
            elements = []
            for i, vector in enumerate(vectors):
                lines.append(f"{name}.x{lane}.{i} = extractelement {wide} {vector}, i32 {lane}")
                elements.append(f"double {name}.x{lane}.{i}")
            lines.append(f"{name}.y{lane} = call double @{function}({', '.join(elements)})")
            is_last = lane == self.lanes - 1 and self.element == "double"
            result = name if is_last else f"{name}.g{lane}"
            lines.append(f"{result} = insertelement {wide} {gathered}, double {name}.y{lane}, i32 {lane}")
            gathered = result
        return lines + self.narrowed(name, gathered)[0]

    def widened(self, name: str, operands: list[str]) -> tuple[list[str], list[str]]:
        """Return lines that convert operands to doubles, and the converted operands."""
        if self.element == "double":
            return [], operands
        wide = float_type(self.lanes)
        lines = [f"{name}.w{i} = fpext {self.T} {operand} to {wide}" for i, operand in enumerate(operands)]
        return lines, [f"{name}.w{i}" for i in range(len(operands))]

    def narrowed(self, name: str, doubles: str) -> tuple[list[str], str]:
        """Return lines that convert doubles to the element type, and the name of the result."""
        if self.element == "double":
            return [], doubles
        return [f"{name} = fptrunc {float_type(self.lanes)} {doubles} to {self.T}"], name


def known_operations() -> set[int]:
    """CasADi's codes of all operations that can be compiled."""
    special = {
        ca.OP_NEG, ca.OP_SQ, ca.OP_TWICE, ca.OP_INV, ca.OP_NOT, ca.OP_AND, ca.OP_OR,
        ca.OP_IF_ELSE_ZERO, ca.OP_SIGN, ca.OP_FMIN, ca.OP_FMAX, ca.OP_COPYSIGN,
    }  # fmt: skip
    # CasADi also has codes for mere renaming of a value; `program` leaves such instructions out.
    tables = (ARITHMETIC, COMPARISONS, INTRINSICS, LIBRARY, LIBRARY_OF_TWO)
    return special.union(*tables, TRIGONOMETRIC, PLACED)


def refuse_unknown(operation: int) -> None:
    """Raise an error that names an operation that cannot be compiled.

    Raises:
        KernelError: The operation is unknown.
    """
    if operation not in KNOWN:
        known = ", ".join(sorted(OPERATION_NAMES[code] for code in KNOWN))
        raise KernelError(
            f"The operation {OPERATION_NAMES.get(operation, operation)} cannot be compiled. Known operations: {known}. "
            "Write the expression with these."
        )


OPERATION_NAMES = {getattr(ca, name): name.removeprefix("OP_") for name in dir(ca) if name.startswith("OP_")}
"""Names of CasADi's operations by code."""

KNOWN = known_operations()
