"""Reading of a machine's folder that collects all mistakes in its files, not only the first."""

import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from exograv.model.completed_urdf import completed_urdf, unfinished_limits
from exograv.model.description import rig_folder, validation_sentence
from exograv.model.open_questions import MARK, open_questions
from exograv.model.rig_settings import RigSettings
from exograv.model.tree import Tree
from exograv.model.urdf import root_of, text_of, tree_of

from .findings import CheckFindings


def locate(rig: str) -> Path:
    """Return the folder of a machine, by its name or path.

    Raises:
        ConfigError: No machine has this name or path.
    """
    return Path(rig) if Path(rig).is_dir() else rig_folder(rig)


def read_settings(folder: Path, findings: CheckFindings) -> tuple[RigSettings | None, list[Path]]:
    """Return the settings, or None if anything is wrong with them, and the URDF files that `rig.toml` names."""
    data = _data(folder, findings)
    files = _files(folder, data)
    asked = len(findings.problems)
    try:
        settings = RigSettings.model_validate(data) if data else None
    except ValidationError as error:
        # An open question was already reported; the error at its field would only repeat it.
        about = [finding for finding in error.errors(include_url=False) if MARK not in str(finding["input"])]
        for finding in about:
            findings.problem(f"rig.toml: {validation_sentence(finding)}")
        if not about and not asked:
            findings.problem("rig.toml: a value is still '?'. Replace it.")
        settings = None
    return (settings if not findings.problems else None), files


def read_trees(folder: Path, files: list[Path], findings: CheckFindings) -> dict[str, Tree]:
    """Return the trees of all files that can be read, by file name."""
    limits = _limits(folder / "rig.toml")
    trees = {}
    for file in files:
        if not file.is_file():
            findings.problem(f"rig.toml names '{file.name}', which is not in {file.parent}. Put it there.")
            continue
        tree = findings.attempt(lambda file=file: _tree(file, limits))
        if tree is not None:
            trees[file.name] = tree
    return trees


def _limits(path: Path) -> dict[str, dict[str, float]]:
    """Return the joint limits in `rig.toml`, with placeholders for open questions; empty if it cannot be read."""
    try:
        return unfinished_limits(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def _tree(file: Path, limits: dict[str, dict[str, float]]) -> Tree:
    return tree_of(root_of(completed_urdf(text_of(file), limits), file.name), file)


def _data(folder: Path, findings: CheckFindings) -> dict[str, Any]:
    path = folder / "rig.toml"
    if not path.is_file():
        findings.problem(f"{folder} has no rig.toml. `exograv rig new URDF` writes one with all required entries.")
        return {}
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except OSError as error:
        findings.problem(f"rig.toml cannot be read: {error.strerror}. Check its permissions.")
        return {}
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        findings.problem(f"rig.toml is not valid TOML: {error}. Correct it there.")
        return {}
    for question in open_questions(text):
        findings.problem(f"rig.toml still asks, {question.sentence}.")
    return data


def _files(folder: Path, data: dict[str, Any]) -> list[Path]:
    named = data.get("urdf")
    names = [value for key, value in named.items() if key != "side"] if isinstance(named, dict) else []
    return [folder / name for name in names if isinstance(name, str) and name and name != MARK]
