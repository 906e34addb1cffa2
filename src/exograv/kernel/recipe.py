"""Recipes: functions that are built only if no earlier process has built them.

To write the dynamics of an arm as an expression, with derivatives and common subexpressions shared, takes CasADi and
Python a second. Compiled code needs only its outline: names, shapes, constants and the fingerprint of the code. The
outline is stored on disk under a digest of the builder, its arguments, and the source of this package.
"""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import blake2b
from pathlib import Path

import casadi as ca
import numpy as np
from jaxtyping import Float

from . import cache as disk
from .content import content_digest

IMPORTED_S = time.time()
"""Time at which this process imported this module [s since 1970]."""

IMPORT_S = 30.0
"""Longest time between the import of the first module of the package and of this one [s]."""

Shapes = dict[str, tuple[int, int]]
"""Rows and columns by name, in order."""


@dataclass(frozen=True)
class Outline:
    """Facts about a program that its compiled code needs."""

    name: str
    arguments: Shapes
    results: Shapes
    constants: Float[np.ndarray, " constant"]
    fingerprint: str
    n_instructions: int

    @property
    def content(self) -> bytes:
        """Outline as bytes: a line of JSON, then the constants."""
        head = [self.name, self.arguments, self.results, self.fingerprint, self.n_instructions]
        return json.dumps(head).encode() + b"\n" + self.constants.tobytes()

    @classmethod
    def of_content(cls, content: bytes) -> "Outline":
        """Return the outline of `content`."""
        head, _, constants = content.partition(b"\n")
        name, arguments, results, fingerprint, n_instructions = json.loads(head)
        arguments, results = ({key: tuple(size) for key, size in shapes.items()} for shapes in (arguments, results))
        return cls(name, arguments, results, np.frombuffer(constants), fingerprint, n_instructions)


@dataclass(frozen=True)
class Recipe:
    """Function that `build(*of)` returns. The builder must depend on nothing but its arguments and this package."""

    build: Callable[..., ca.Function]
    of: tuple[object, ...]

    def __call__(self) -> ca.Function:
        """Build the CasADi function from the arguments `of`."""
        return self.build(*self.of)

    def name(self) -> str:
        """Name of the builder, for messages."""
        return self.build.__name__

    def outline(self) -> Outline | None:
        """Read the outline that an earlier process has stored; None if there is none."""
        content = None if self.key is None else disk.read(self.key)
        return None if content is None else Outline.of_content(content)

    def store(self, outline: Outline) -> None:
        """Store the outline for later processes."""
        if self.key is not None:
            disk.write(self.key, outline.content)

    @cached_property
    def key(self) -> str | None:
        """Name of the outline on disk; None if an argument has no digest, so that the function is always built."""
        arguments, source = content_digest(self.of), source_digest()
        if arguments is None or source is None:
            return None
        compiler = ca.__version__  # pyright: ignore[reportAttributeAccessIssue] - CasADi's stub lacks it
        return disk.key("outline", self.build.__module__, self.build.__qualname__, arguments, compiler, source)


AnyFunction = ca.Function | Recipe
"""Function to compile, or the recipe for it."""


@cache
def source_digest() -> str | None:
    """Digest of the whole package, any of whose modules may take part in building a function.

    None if a file was changed about when this process imported it, or later: the code in memory may be another.
    """
    digest, package = blake2b(digest_size=20), Path(__file__).parent.parent
    for path in sorted(package.rglob("*.py")):
        if path.stat().st_mtime > IMPORTED_S - IMPORT_S:
            return None
        content = path.read_bytes()
        digest.update(f"{path.relative_to(package)} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()
