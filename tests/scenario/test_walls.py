"""Rooms that decide on motion have no access to the twin's truth."""

import ast
import inspect
from pathlib import Path

import pytest
from tests.syntax import nodes_of

import exograv
from exograv.procedures.identification import identify
from exograv.procedures.identification.identify import Identifier

SOURCE = Path(exograv.__file__).parent
DECIDING = sorted(path for room in ("control", "identification", "dynamics") for path in (SOURCE / room).rglob("*.py"))
TRUTH = {"Truth", "truth", "Examiner", "Examination", "VirtualLaboratory", "parameter_truth", "Wearer", "Machine"}
SHOWN_BESIDE = {
    SOURCE / "live/on_drives/calibration.py",
    SOURCE / "procedures/calibration/calibrate_command.py",
    SOURCE / "procedures/calibration/figures.py",
}
"""Files that print the true values of a simulated machine beside a finished calibration. Callers pass the values in."""

SHARED = sorted(path for room in ("loop", "storage", "procedures", "live") for path in (SOURCE / room).rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Modules and names that a file imports."""
    found = set()
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {node.module or ""} | {alias.name for alias in node.names}
    return found


@pytest.mark.parametrize("path", DECIDING, ids=lambda path: str(path.relative_to(SOURCE)))
def test_no_room_that_decides_imports_the_rig(path: Path):
    assert not {name for name in imported(path) if "rig" in name.split(".")}


@pytest.mark.parametrize("path", SHARED, ids=lambda path: str(path.relative_to(SOURCE)))
def test_no_room_that_serves_hardware_too_touches_the_truth(path: Path):
    words = {node.attr for node in nodes_of(path) if isinstance(node, ast.Attribute)}
    words |= {node.id for node in nodes_of(path) if isinstance(node, ast.Name)}
    allowed = {"truth"} if path in SHOWN_BESIDE else set()
    assert not (TRUTH - allowed) & (words | imported(path))


def test_the_identifier_is_given_a_way_to_note_and_no_way_to_look():
    names = list(inspect.signature(Identifier).parameters)
    assert names == ["pilot", "controller", "machine", "name", "torque_source", "note", "belief"]
    assert not any("exam" in name.lower() or "laboratory" in name.lower() for name in vars(identify))
