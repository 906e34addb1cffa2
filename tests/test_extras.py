"""Every package of every extra is mapped to an extra that installs it, and one sentence reports a missing package."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from exograv.cli import ACTIONS
from exograv.cli.shell import needs
from exograv.cli.shell.command import command_class
from exograv.errors import ConfigError
from exograv.extras import EXTRAS, INSIDE, missing_package
from exograv.procedures.calibration.options import CalibrateOptions

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
IMPORT_NAMES = {"mujoco-core": "mujoco", "python-can": "can", "eclipse-zenoh": "zenoh"}


def packages(extra: str) -> set[str]:
    """Return the packages of an extra by import name, including those of extras inside it."""
    found = set[str]()
    for requirement in PROJECT["optional-dependencies"][extra]:
        name = requirement.split(">=")[0].split("[")[0]
        if name == "exograv":
            inner = requirement.partition("[")[2].rstrip("]").split(",")
            found |= {package for one in inner for package in packages(one)}
        else:
            found.add(str(IMPORT_NAMES.get(name, name)))
    return found


@pytest.mark.parametrize("extra", PROJECT["optional-dependencies"])
def test_every_package_of_an_extra_is_mapped_to_an_extra_that_installs_it(extra: str):
    for package in packages(extra):
        assert package in packages(EXTRAS[package])


def test_a_package_outside_the_extras_has_no_sentence():
    assert missing_package(ModuleNotFoundError("x", name="exograv.nothing")) is None


@pytest.mark.parametrize(
    ("package", "statement", "extra"),
    [
        ("mujoco", "exograv.Twin", "twin"),
        ("casadi", "exograv.Compensator", "control"),
        ("mcap", "exograv.Recording", "recording"),
    ],
)
def test_the_api_names_the_extra_that_is_missing(package: str, statement: str, extra: str, tmp_path: Path):
    code = f"import sys; sys.modules[{package!r}] = None\nimport exograv\n{statement}"
    run = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, cwd=tmp_path)
    assert f"pip install 'exograv[{extra}]'" in run.stderr


@pytest.mark.parametrize("extra", INSIDE)
def test_an_extra_contains_the_extras_that_the_table_says(extra: str):
    inner = {package for one in INSIDE[extra] for package in packages(one)}
    assert inner <= packages(extra)


def test_a_command_names_all_its_missing_extras_before_it_starts(monkeypatch: pytest.MonkeyPatch):
    installed = {"casadi", "llvmlite", "scipy", "mcap", "zstandard"}
    monkeypatch.setattr("exograv.extras.find_spec", lambda name: name if name in installed else None)
    with pytest.raises(ConfigError, match=r"^`exograv demo` needs .*pip install 'exograv\[twin,study\]'.*mujoco"):
        needs.refuse_missing("demo", command_class(ACTIONS["demo"])())
    needs.refuse_missing("rig new", object())


@pytest.mark.parametrize(("simulate", "extras"), [(False, ("twin",)), (True, ("control", "recording"))])
def test_only_the_twin_itself_needs_mujoco(simulate: bool, extras: tuple[str, ...]):
    assert needs.extras_of("rig calibrate", CalibrateOptions(simulate=simulate)) == extras


def test_the_needs_are_those_of_commands_and_extras():
    assert set(needs.NEEDS) <= set(ACTIONS)
    assert {extra for extras in needs.NEEDS.values() for extra in extras} <= set(EXTRAS.values())
