"""The statements of the project about itself hold: lock files, README, map and extras."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import exograv

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "exograv"
FURTHER = ("bench", "prove", "audit", "fuzz")
LOCKS = ("requirements.lock", "requirements-dev.lock", *(f"requirements-{group}.lock" for group in FURTHER))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
README = (ROOT / "README.md").read_text(encoding="utf-8")
MAP = (ROOT / "docs" / "explanation" / "map.md").read_text(encoding="utf-8")


def run_python(program: str) -> subprocess.CompletedProcess[str]:
    """Run a program in a fresh interpreter, so that imports of other tests cannot hide a fault."""
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)


def pinned(lock: str) -> dict[str, str]:
    """Return the versions that a lock pins, by package (with its marker, if any)."""
    text = (ROOT / lock).read_text(encoding="utf-8")
    found = re.findall(r"^([a-z0-9-]+)==(\S+)( ; [^\\]+)? \\$", text, flags=re.MULTILINE)
    return {name + marker: version for name, version, marker in found}


def modules_after(statement: str) -> set[str]:
    """Return the names of all modules that a fresh interpreter imports for this statement."""
    program = f"import sys\nbefore = set(sys.modules)\n{statement}\nprint(*(set(sys.modules) - before))"
    return set(run_python(program).stdout.split())


def test_importing_exograv_imports_nothing_else():
    assert modules_after("import exograv") == {"exograv"}


def test_the_first_tick_of_a_demo_waits_neither_for_drawing_nor_for_statistics():
    late = {"matplotlib", "scipy.stats", "scipy.optimize", "scipy.signal"}
    modules = modules_after("import exograv.laboratory.demo")
    assert {"mujoco", "casadi"} <= modules
    assert modules & late == set()


def test_the_study_tools_run_without_casadi_and_mujoco():
    program = (
        "import importlib, pkgutil, sys\n"
        "sys.modules.update(dict.fromkeys(['casadi', 'mujoco']))\n"
        "import exograv.study, exograv.recording\n"
        "for room in (exograv.study, exograv.recording):\n"
        "    for module in pkgutil.walk_packages(room.__path__, room.__name__ + '.'):\n"
        "        importlib.import_module(module.name)\n"
    )
    result = run_python(program)
    assert result.returncode == 0, result.stderr


def test_the_task_runs_without_engine_solver_and_recorder():
    program = (
        "import importlib, pkgutil, sys\n"
        "missing = ['casadi', 'mujoco', 'scipy', 'mcap', 'zstandard', 'exograv.recording']\n"
        "sys.modules.update(dict.fromkeys(missing))\n"
        "import exograv.task\n"
        "for module in pkgutil.walk_packages(exograv.task.__path__, 'exograv.task.'):\n"
        "    importlib.import_module(module.name)\n"
    )
    result = run_python(program)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_names_no_registry_address_and_no_path(lock: str):
    text = (ROOT / lock).read_text(encoding="utf-8")
    assert not re.search(r"https?:|file:|--(extra-)?index|--find-links|(^|\s)/|@ ", text)


@pytest.mark.parametrize("lock", LOCKS)
def test_every_line_of_a_lock_pins_a_version_with_its_hashes(lock: str):
    text = (ROOT / lock).read_text(encoding="utf-8")
    entry = r"[a-z0-9-]+==[^\s;]+( ; [^\\\n]+)? \\\n(    --hash=sha256:[0-9a-f]{64}( \\)?\n)+"
    assert re.sub(rf"#.*\n|{entry}", "", text) == ""


def test_the_tests_run_on_the_versions_of_the_demo():
    demo, development, *_ = (pinned(lock) for lock in LOCKS)
    assert demo
    assert demo.items() <= development.items()


def test_the_opponents_leave_the_versions_of_the_tests_alone():
    _, development, *others = (pinned(lock) for lock in LOCKS)
    for opponents in others:
        shared = development.keys() & opponents.keys()
        assert shared
        assert [name for name in shared if development[name] != opponents[name]] == []


def test_the_study_extra_asks_for_neither_casadi_nor_mujoco():
    extras = PROJECT["project"]["optional-dependencies"]
    wanted = " ".join(extras["study"] + extras["recording"] + PROJECT["project"]["dependencies"])
    assert not re.search(r"casadi|mujoco|control|twin", wanted)


def test_the_source_archive_holds_every_lock_and_page_beside_the_readme():
    included = set(PROJECT["tool"]["hatch"]["build"]["targets"]["sdist"]["only-include"])
    named = {path.name for pattern in ("*.lock", "*.md", "*.cff") for path in ROOT.glob(pattern)}
    assert named - included == {"README.md"}  # hatchling adds it by itself


def test_every_make_command_of_the_readme_exists():
    commands = set(re.findall(r"(?:^|`)make ([a-z-]+)", README, flags=re.MULTILINE))
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE))
    assert {"demo", "test"} <= commands <= targets


def test_every_link_of_the_documentation_leads_somewhere():
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("[!_]*/*.md")), *sorted((ROOT / "docs").glob("*.md"))]
    links = [(page, link) for page in pages for link in re.findall(r"\]\(([^)#\s]+)", visible(page)) if ":" not in link]
    # `make docs` writes the generated pages, and finds links to pages that it does not write.
    links = [(page, link) for page, link in links if "generated/" not in link]
    assert [f"{page.name}: {link}" for page, link in links if not (page.parent / link).exists()] == []


def visible(page: Path) -> str:
    """Return a page without its comments."""
    return re.sub(r"<!--.*?-->", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_the_map_shows_exactly_the_rooms_that_exist_and_marks_the_others_as_planned():
    drawn = re.findall(r"^  (\w+)(?:/|\.py) +(.+)$", MAP, flags=re.MULTILINE)
    planned = {room for room, what in drawn if what.endswith("(planned)")}
    files = {path.stem for path in PACKAGE.glob("*.py")} - {"__init__"}
    folders = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert {room for room, _ in drawn} - planned == files | folders


def test_the_map_draws_the_layers_that_are_enforced():
    contract = PROJECT["tool"]["importlinter"]["contracts"][0]
    layers = [re.sub(r"[()]", "", layer) for layer in contract["layers"]]
    assert "```\n" + "\n".join(layers) + "\n```" in MAP


def test_runtime_is_shut_off_from_every_room_that_decides_what_moves():
    contracts = {contract["name"]: contract for contract in PROJECT["tool"]["importlinter"]["contracts"]}
    forbidden = set(contracts["runtime names no controller, method or task"]["forbidden_modules"])
    deciding = {room for room in ("control", "identification", "task") if (PACKAGE / room / "__init__.py").is_file()}
    assert forbidden == {f"exograv.{room}" for room in deciding}


def test_one_version_is_stated_everywhere():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"version: {exograv.__version__}\n" in citation
    assert re.search(r"^## (\S+)", changelog, flags=re.MULTILINE)[1] == exograv.__version__  # pyright: ignore[reportOptionalSubscript]


def test_every_dependency_is_explained():
    groups = PROJECT["dependency-groups"]
    extras = PROJECT["project"]["optional-dependencies"].values()
    stated = [*PROJECT["project"]["dependencies"], *(item for extra in extras for item in extra)]
    stated += [item for group in groups.values() for item in group if isinstance(item, str)]
    names = {re.split(r"[\[<>=]", item)[0] for item in stated} - {"exograv"}
    table = (ROOT / "docs" / "explanation" / "stack.md").read_text(encoding="utf-8").split("## What it does not use")[0]
    explained = {name for row in re.findall(r"^\| ([^|]+) \|", table, flags=re.MULTILINE) for name in row.split(", ")}
    assert names <= explained
