"""Conditions of the guard that no test has seen both ways."""

import ast
import builtins
import copy
import json
import tempfile
from pathlib import Path
from typing import Any

from guard_mutants import ROOMS, name_of
from mutant_runs import Order, Result, run_imported, side_by_side


class Watched(ast.NodeTransformer):
    """Transformer that notes outcomes of conditions, of each operand of and/or but the last, and function calls."""

    def __init__(self, file: str):
        self.file = file
        self.expected: dict[str, tuple[bool, ...]] = {}

    def _note(self, node: ast.expr, outcomes: tuple[bool, ...] = (True, False), name: str = "") -> ast.expr:
        name = f"{self.file}:{node.lineno}:{node.col_offset} {(name or ast.unparse(node))[:70]}"
        self.expected[name] = outcomes
        return ast.Call(ast.Name("__noted__", ast.Load()), [ast.Constant(name), node], [])

    def visit_If(self, node: ast.If | ast.IfExp | ast.While) -> ast.AST:
        """Watch the condition of a statement or an expression."""
        whole = copy.deepcopy(node.test)
        self.generic_visit(node)
        node.test = self._note(node.test, name=ast.unparse(whole))
        return node

    visit_IfExp = visit_While = visit_If

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        """Watch each operand but the last: it decides if the next ones are evaluated."""
        names = [ast.unparse(value) for value in node.values]
        self.generic_visit(node)
        *asked, last = node.values
        node.values = [*(self._note(value, name=name) for value, name in zip(asked, names, strict=False)), last]
        return node

    def visit_comprehension(self, node: ast.comprehension) -> ast.AST:
        """Watch the filters."""
        self.generic_visit(node)
        node.ifs = [self._note(one) for one in node.ifs]
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Watch that the function is called."""
        self.generic_visit(node)
        called = self._note(ast.copy_location(ast.Constant(node.name), node), (True,))
        node.body.insert(0, ast.Expr(called))
        return node


def watch() -> None:
    """Print the conditions that no test has seen both ways."""
    seen: set[tuple[str, bool]] = set()
    expected: dict[str, tuple[bool, ...]] = {}
    trees = {}
    room = ROOMS["safety"]
    for path in room.modules:
        watched = Watched(path.name)
        tree = watched.visit(ast.parse(path.read_text(encoding="utf-8")))
        trees[name_of(path)] = ast.fix_missing_locations(tree)
        expected.update(watched.expected)

    def noted(name: str, value: Any) -> Any:
        seen.add((name, bool(value)))
        return value

    builtins.__dict__["__noted__"] = noted
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "seen.json"

        def save() -> None:
            file.write_text(json.dumps(sorted(seen)), encoding="utf-8")

        def seen_by_all() -> Result:
            result = run_imported(room, trees, Order({}))
            save()
            return result

        [(_, (code, *_rest))] = side_by_side([None], lambda _: seen_by_all(), 1, 1e4)
        found = {(name, value) for name, value in json.loads(file.read_text(encoding="utf-8"))}
    wanted = [(name, value) for name, values in expected.items() for value in values]
    missed = [one for one in wanted if one not in found]
    for name, value in missed:
        print(f"never {value}: {name}")
    print(f"{len(wanted) - len(missed)} of {len(wanted)} outcomes seen; tests ended with {code}")
