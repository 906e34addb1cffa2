"""Translate the guard's source to C, statement by statement.

    python -m exograv.safety.native.to_c

The command writes `core.c` beside `core.py`. A test fails where the two differ. The source keeps to a part of Python
that means the same in C: numbers, places of a record, `if`, `for … in range`, and calls of functions of the same file.
Everything else is an error.
"""

import ast
import math
from pathlib import Path

from . import core
from .structs import check_sum

SOURCE = Path(__file__).with_name("core.py")
TARGET = Path(__file__).with_name("core.c")

HEADER = """\
/* Made from core.py by to_c.py; do not edit. Compile without -ffast-math and with -ffp-contract=off: its results must
   equal those of core.py to the last bit. */
#include <math.h>

static inline long modulo(long a, long b) { long rest = a % b; return rest < 0 ? rest + b : rest; }
static inline long smaller(long a, long b) { return b < a ? b : a; }

/* Check sum of core.py: a library that was made from another source is not used. */
const long long guard_source = CHECK_SUM_OF_SOURCE;
"""

TYPES = {"Record": "double *restrict", "float": "double", "int": "long", "bool": "int", "None": "void"}
MATH = {"isfinite": "int", "isnan": "int", "sqrt": "double", "cos": "double", "sin": "double", "floor": "double"}
MATH |= {"copysign": "double"}
OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.And: "&&", ast.Or: "||", ast.Lt: "<"}
OPERATORS |= {ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
CONSTANTS = {name: value for name, value in vars(core).items() if name.isupper() and isinstance(value, int | float)}

Typed = tuple[str, str]
"""C text of an expression, and its C type."""


class UntranslatableError(Exception):
    """Python that has no counterpart in the translation."""

    def __init__(self, node: ast.AST):
        super().__init__(f"core.py, line {getattr(node, 'lineno', 0)}: {ast.unparse(node)!r} has no translation to C.")


def translated(source: str) -> str:
    """Return the C text of the guard's source.

    Raises:
        UntranslatableError: The source leaves the part of Python that has a translation.
    """
    functions = [node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    returns = {one.name: TYPES[ast.unparse(one.returns or one)] for one in functions}
    parts = [_Function(one, returns) for one in functions]
    defines = [f"#define {name} {_number(value)}" for name, value in CONSTANTS.items()]
    prototypes = [f"{one.signature};" for one in parts]
    return "\n".join(
        [
            HEADER.replace("CHECK_SUM_OF_SOURCE", str(check_sum(source))),
            *defines,
            "",
            *prototypes,
            "",
            *(one.text() for one in parts),
        ]
    )


def _number(value: float | int) -> str:
    return repr(value) if math.isfinite(value) else "INFINITY"


class _Function:
    """Translation of one function."""

    def __init__(self, node: ast.FunctionDef, returns: dict[str, str]):
        self._node, self._returns = node, returns
        self._types = {one.arg: TYPES[ast.unparse(one.annotation or one)] for one in node.args.args}
        self._locals, self._lines, self._temporaries = dict[str, str](), list[str](), 0
        arguments = ", ".join(f"{kind} {name}" for name, kind in self._types.items())
        self.signature = f"{returns[node.name]} guard_{node.name}({arguments})"

    def text(self) -> str:
        """C text of the function."""
        for statement in self._node.body[1:]:  # the first is the docstring
            self._statement(statement, 1)
        declared = [f"    {kind} {name};" for name, kind in self._locals.items()]
        return "\n".join([f"{self.signature}", "{", *declared, *self._lines, "}", ""])

    def _say(self, depth: int, text: str) -> None:
        self._lines.append("    " * depth + text)

    def _block(self, body: list[ast.stmt], depth: int) -> None:
        for statement in body:
            self._statement(statement, depth)
        self._say(depth - 1, "}")

    def _statement(self, node: ast.stmt, depth: int) -> None:
        match node:
            case ast.Return(value=None):
                self._say(depth, "return;")
            case ast.Return(value=ast.expr() as value):
                self._say(depth, f"return {self._of(value)};")
            case ast.Expr(value=ast.Call() as call):
                self._say(depth, f"{self._of(call)};")
            case ast.Assign(targets=targets, value=value):
                self._assign(targets, value, depth)
            case ast.AugAssign(target=target, op=operator, value=value):
                self._say(depth, f"{self._of(target)} {OPERATORS[type(operator)]}= {self._of(value)};")
            case ast.If():
                self._if(node, depth)
            case ast.For(target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=limits), orelse=[]):
                self._for(name, [self._of(one) for one in limits], node.body, depth)
            case _:
                raise UntranslatableError(node)

    def _assign(self, targets: list[ast.expr], value: ast.expr, depth: int) -> None:
        pairs = list[tuple[ast.expr, str]]()
        match targets, value:
            case [ast.Tuple(elts=several)], ast.Tuple(elts=values) if len(several) == len(values):
                # All values are computed before the first target changes.
                for target, one in zip(several, values, strict=True):
                    text, kind = self._typed(one)
                    self._temporaries += 1
                    self._say(depth, f"const {kind} t{self._temporaries} = {text};")
                    self._declare(target, kind)
                    pairs.append((target, f"t{self._temporaries}"))
            case _:
                text, kind = self._typed(value)
                for target in targets:
                    self._declare(target, kind)
                    pairs.append((target, text))
        for target, text in pairs:
            self._say(depth, f"{self._of(target)} = {text};")

    def _declare(self, target: ast.expr, kind: str) -> None:
        if not isinstance(target, ast.Name):
            return
        known = self._types.setdefault(target.id, kind)
        if known != kind and (known, kind) != ("double", "long"):
            raise UntranslatableError(target)
        if target.id not in {one.arg for one in self._node.args.args}:
            self._locals[target.id] = known

    def _if(self, node: ast.If, depth: int) -> None:
        self._say(depth, f"if ({self._of(node.test)}) {{")
        self._block(node.body, depth + 1)
        if node.orelse:
            self._lines[-1] += " else {"
            self._block(node.orelse, depth + 1)

    def _for(self, name: str, limits: list[str], body: list[ast.stmt], depth: int) -> None:
        if name == "_":
            self._temporaries += 1
            name = f"t{self._temporaries}"
        first, end, step = {1: ("0", *limits, "1"), 2: (*limits, "1"), 3: (*limits,)}[len(limits)]
        self._types[name] = self._locals[name] = "long"
        self._temporaries += 1
        self._say(depth, f"const long t{self._temporaries} = {end};")
        self._say(depth, f"for ({name} = {first}; {name} < t{self._temporaries}; {name} += {step}) {{")
        self._block(body, depth + 1)

    def _of(self, node: ast.expr) -> str:
        return self._typed(node)[0]

    def _typed(self, node: ast.expr) -> Typed:
        return self._value(node) or self._operation(node)

    def _value(self, node: ast.expr) -> Typed | None:
        match node:
            case ast.Constant(value=bool(value)):
                return str(int(value)), "int"
            case ast.Constant(value=int(value)):
                return str(value), "long"
            case ast.Constant(value=float(value)):
                return repr(value), "double"
            case ast.Name(id=name) if name in CONSTANTS:
                return name, "double" if isinstance(CONSTANTS[name], float) else "long"
            case ast.Name(id=name) if name in self._types:
                return name, self._types[name]
            case ast.Attribute(value=ast.Name(id="math"), attr=("nan" | "inf") as name):
                return {"nan": "NAN", "inf": "INFINITY"}[name], "double"
            case ast.Subscript(value=ast.Name(id=name), slice=index):
                return f"{name}[{self._of(index)}]", "double"
        return None

    def _operation(self, node: ast.expr) -> Typed:
        match node:
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                text, kind = self._typed(operand)
                return f"(-{text})", kind
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"(!{self._of(operand)})", "int"
            case ast.BinOp(left=left, op=ast.Mod(), right=right):
                return f"modulo({self._of(left)}, {self._of(right)})", "long"
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in OPERATORS:
                (one, kind), (other, other_kind) = self._typed(left), self._typed(right)
                both = "double" if "double" in (kind, other_kind) or isinstance(operator, ast.Div) else "long"
                return f"({one} {OPERATORS[type(operator)]} {other})", both
            case ast.BoolOp(op=operator, values=values):
                terms = [self._typed(one) for one in values]
                # In Python `and` and `or` give one of their values; only of truth values does C give the same.
                if {kind for _, kind in terms} != {"int"}:
                    raise UntranslatableError(node)
                return "(" + f" {OPERATORS[type(operator)]} ".join(text for text, _ in terms) + ")", "int"
            case ast.Compare(left=left, ops=operators, comparators=rights):
                terms = [self._of(one) for one in (left, *rights)]
                pairs = zip(terms, operators, terms[1:], strict=False)
                return "(" + " && ".join(f"{a} {OPERATORS[type(op)]} {b}" for a, op, b in pairs) + ")", "int"
            case ast.IfExp(test=test, body=body, orelse=orelse):
                (one, kind), other = self._typed(body), self._of(orelse)
                return f"({self._of(test)} ? {one} : {other})", kind
            case ast.Call(func=function, args=arguments, keywords=[]):
                return self._call(node, ast.unparse(function), [self._typed(one) for one in arguments])
        raise UntranslatableError(node)

    def _call(self, node: ast.expr, name: str, arguments: list[Typed]) -> Typed:
        texts = ", ".join(text for text, _ in arguments)
        if name in self._returns:
            return f"guard_{name}({texts})", self._returns[name]
        if name == "abs" and arguments[0][1] == "double":
            return f"fabs({texts})", "double"
        if name == "min" and [kind for _, kind in arguments] == ["long", "long"]:
            return f"smaller({texts})", "long"
        if name in ("int", "float"):
            return f"({TYPES[name]})({texts})", TYPES[name]
        if name.removeprefix("math.") in MATH:
            name = name.removeprefix("math.")
            return f"{name}({texts})", MATH[name]
        raise UntranslatableError(node)


if __name__ == "__main__":
    TARGET.write_text(translated(SOURCE.read_text(encoding="utf-8")), encoding="utf-8")
