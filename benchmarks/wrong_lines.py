"""Small changes that make a line of Python wrong; `mutants.py` tries them all."""

import ast
from collections.abc import Callable, Iterator
from typing import Any

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
}
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any", "abs": "float", "sin": "cos", "cos": "sin"}
DROPPED = (ast.Assign, ast.AugAssign, ast.AnnAssign, ast.Expr, ast.Return, ast.Raise, ast.Delete)
UNTOUCHED = (ast.JoinedStr, ast.Import, ast.ImportFrom)

Change = tuple[str, Callable[[], None]]
"""Name of the change, and a function that applies it in place."""


def visited(node: ast.AST) -> Iterator[ast.AST]:
    """Yield all nodes with an effect: no annotations, decorators, error messages, and no `strict` of equal lengths."""
    yield node
    skipped = {"annotation", "returns", "decorator_list"}
    for name, value in ast.iter_fields(node):
        inner = isinstance(node, ast.Raise) or name in skipped or getattr(node, "arg", None) == "strict"
        for child in [] if inner else value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not isinstance(child, UNTOUCHED):
                yield from visited(child)


def changes(node: Any) -> Iterator[Change]:
    """Yield the changes that make a node wrong."""
    yield from _operators(node)
    yield from _conditions(node)
    yield from _values(node)
    for body in ("body", "orelse"):
        statements = getattr(node, body, None)
        if isinstance(statements, list) and not isinstance(node, ast.Module | ast.ClassDef):
            yield from _drops(statements)


def _operators(node: Any) -> Iterator[Change]:
    if isinstance(node, ast.Compare):
        for k, op in enumerate(node.ops):
            for other in COMPARISONS[type(op)]:
                name = f"{type(op).__name__} {k} to {other.__name__}"
                yield name, lambda k=k, other=other: node.ops.__setitem__(k, other())
    elif isinstance(node, ast.BinOp | ast.AugAssign) and type(node.op) in OPERATORS:
        other = OPERATORS[type(node.op)]
        yield f"{type(node.op).__name__} to {other.__name__}", lambda: setattr(node, "op", other())
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "minus dropped", lambda: setattr(node, "op", ast.UAdd())


def _conditions(node: Any) -> Iterator[Change]:
    if isinstance(node, ast.BoolOp):
        other = ast.Or if isinstance(node.op, ast.And) else ast.And
        yield f"{type(node.op).__name__} to {other.__name__}", lambda: setattr(node, "op", other())
        for k in range(len(node.values)):
            yield f"operand {k} dropped", lambda k=k: _drop_operand(node, k)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield "not dropped", lambda: setattr(node, "operand", ast.UnaryOp(ast.Not(), node.operand))
    elif isinstance(node, ast.IfExp | ast.If | ast.While):
        for value in (True, False):
            yield f"condition {value}", lambda value=value: setattr(node, "test", ast.Constant(value))


def _values(node: Any) -> Iterator[Change]:
    match node:
        case ast.Constant(value=bool() | int() | float() as value):
            other = _other_constant(value)
            yield f"{value} to {other}", lambda: setattr(node, "value", other)
        case ast.Call(func=ast.Name(id=name)) if name in NAMES:
            yield f"{name} to {NAMES[name]}", lambda: setattr(node.func, "id", NAMES[name])
        case ast.Call(func=ast.Attribute(attr=name)) if name in NAMES:
            yield f".{name} to {NAMES[name]}", lambda: setattr(node.func, "attr", NAMES[name])


def _drop_operand(node: ast.BoolOp, k: int) -> None:
    node.values[k] = ast.Constant(isinstance(node.op, ast.And))


def _other_constant(value: float) -> float:
    if isinstance(value, bool):
        return not value
    if isinstance(value, int) or value == 0.0:
        return value + 1
    return 1.25 * value


def _drops(statements: list[ast.stmt]) -> Iterator[Change]:
    for k, statement in enumerate(statements):
        if not isinstance(statement, DROPPED):
            continue
        if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
            continue
        line, name = ast.unparse(statement).splitlines()[0], type(statement).__name__.lower()
        other = ast.Return(None) if isinstance(statement, ast.Return) else ast.Pass()
        if not (isinstance(statement, ast.Return) and statement.value is None):
            yield f"{name} dropped: {line[:60]}", lambda k=k, other=other: statements.__setitem__(k, other)
