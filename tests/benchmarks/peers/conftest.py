"""Rows in the form of a run, made without a run."""

from collections.abc import Callable
from typing import Any

import pytest


@pytest.fixture
def make_row() -> Callable[..., dict[str, Any]]:
    def make(name: str, implementation: str, p50: float, unit: str = "us") -> dict[str, Any]:
        figures = {"p50": p50, "p99": 2 * p50, "p999": 3 * p50, "max": 4 * p50}
        return {
            "name": name,
            "implementation": implementation,
            "unit": unit,
            **figures,
            "n": 100,
            "error_vs_reference": 0.0,
        }

    return make
