"""`import exograv` offers a fixed list of names, imports nothing heavy, and each name is typed and documented."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import exograv

NAMES = (
    "Compensator", "Drives", "Estimate", "ExogravError", "Flight", "Person", "PointingSession", "Recording", "Study",
    "Twin", "float_arm", "identify", "load_calibration", "load_rig",
)  # fmt: skip
"""Public API. A name that leaves this list breaks the scripts of users."""

HEAVY = ("casadi", "mujoco", "numpy", "pandas", "pydantic", "scipy", "matplotlib")


def test_the_public_names_are_these():
    assert sorted(vars(exograv)["_MODULES"]) == sorted(NAMES)


def test_the_stub_declares_the_same_names():
    stub = ast.parse(Path(exograv.__file__).with_suffix(".pyi").read_text())
    imported = [alias.asname for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names]
    assert sorted(filter(None, imported)) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_can_be_imported_and_is_documented(name: str):
    value = getattr(exograv, name)
    assert inspect.getdoc(value)
    members = vars(value).items() if inspect.isclass(value) else ()
    missing = [key for key, member in members if not key.startswith("_") and callable(member) and not member.__doc__]
    assert missing == []


def test_importing_the_package_imports_no_heavy_package():
    code = f"import sys, exograv; print([name for name in {HEAVY} if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert run.stdout.strip() == "[]"


def test_an_unknown_name_is_refused_with_the_names_that_exist():
    with pytest.raises(AttributeError, match=r"no public name 'Compensater'.*Compensator"):
        _ = exograv.Compensater  # pyright: ignore[reportAttributeAccessIssue]


def test_a_machine_on_drives_needs_no_twin():
    code = "import sys, exograv; exograv.Drives, exograv.float_arm, exograv.identify; print('mujoco' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert run.stdout.strip() == "False"
