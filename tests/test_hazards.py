"""Every control of every hazard has tests, and they exist."""

import ast
from pathlib import Path
from typing import Any

import pytest
import yaml
from tests.syntax import nodes_of

ROOT = Path(__file__).parents[1]
HAZARDS: list[dict[str, Any]] = yaml.safe_load((ROOT / "docs" / "hazards.yaml").read_text(encoding="utf-8"))


def is_there(test: str) -> bool:
    file, _, name = test.partition("::")
    path = ROOT / file
    if not path.is_file():
        return False
    names = [node.name for node in nodes_of(path) if isinstance(node, ast.FunctionDef)]
    return (name in names) if name else any(each.startswith("test_") for each in names)


@pytest.mark.parametrize("hazard", HAZARDS, ids=lambda hazard: hazard["id"])
def test_every_control_has_a_test_that_exists(hazard: dict[str, Any]):
    assert hazard["causes"]
    assert hazard["residual"]
    assert hazard["severity"] in (1, 2, 3)
    for control in hazard["controls"]:
        assert control["tests"], control["what"]
        missing = [test for test in control["tests"] if not is_there(test)]
        assert not missing, f"{hazard['id']}: {missing}"


def test_hazards_have_ids_of_their_own():
    ids = [hazard["id"] for hazard in HAZARDS]
    assert len(set(ids)) == len(ids) >= 8


def test_a_test_that_does_not_exist_is_seen():
    assert not is_there("tests/safety/test_guard.py::test_that_nobody_wrote")
    assert not is_there("tests/safety/test_nothing.py")
