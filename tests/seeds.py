"""Seed sweeps: `make test` runs the first seed of each test, a server and `make test-slow` run all."""

from collections.abc import Iterable

import pytest

PARAMETER = "seed"
"""Name of the parameter whose values are the seeds of a sweep."""


def mark_further(items: Iterable[pytest.Item]) -> None:
    """Mark every test with another seed than the first of its function as `long`."""
    first: dict[str, object] = {}
    for item in items:
        callspec = getattr(item, "callspec", None)
        if callspec is None or PARAMETER not in callspec.params:
            continue
        seed = callspec.params[PARAMETER]
        if first.setdefault(item.nodeid.partition("[")[0], seed) != seed:
            item.add_marker("long")
