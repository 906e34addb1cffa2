"""Source of the guard, as a tree for the prover and as functions for a replay."""

import ast
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
CORE = ROOT / "src" / "exograv" / "safety" / "native" / "core.py"
PROMISES = Path(__file__).with_name("promises.py")


@dataclass
class Source:
    """Functions of the guard and of its promises. A proof reads their tree, and a replay runs the same tree."""

    tree: ast.Module
    functions: dict[str, ast.FunctionDef] = field(default_factory=dict)
    run: dict[str, Callable[..., Any]] = field(default_factory=dict)
    constants: dict[str, int | float] = field(default_factory=dict)

    def __post_init__(self):
        namespace = _executed(self.tree, {"__name__": "core"})
        promises = ast.parse(PROMISES.read_text(encoding="utf-8"))
        # The promises use places of the record, and may call no function of the guard that they judge.
        places = {name: value for name, value in namespace.items() if name.isupper()}
        spoken = _executed(promises, {"__name__": "promises", **places, "Record": list, "math": math})
        for tree, names in ((self.tree, namespace), (promises, spoken)):
            for node in tree.body:
                if isinstance(node, ast.FunctionDef):
                    if node.name in self.functions:
                        raise ValueError(f"{node.name} is a function of the guard and a promise. Rename the promise.")
                    self.functions[node.name], self.run[node.name] = node, names[node.name]
        self.constants = {name: one for name, one in places.items() if isinstance(one, int | float)}

    def names(self, prefix: str) -> list[str]:
        """Return the promises whose name begins so."""
        return [name for name in self.functions if name.startswith(prefix)]


def read(path: Path = CORE) -> Source:
    """Return the source of a file."""
    return Source(ast.parse(path.read_text(encoding="utf-8")))


def _executed(tree: ast.Module, namespace: dict[str, Any]) -> dict[str, Any]:
    exec(compile(tree, "<proof>", "exec"), namespace)
    return namespace
