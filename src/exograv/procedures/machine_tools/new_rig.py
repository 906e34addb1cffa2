"""`exograv rig new`: folder of a user's machine, filled from its URDF, with a question for each other value."""

import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
from exograv.files import PARTIAL
from exograv.model.open_questions import Question, open_questions
from exograv.model.tree import Tree
from exograv.model.urdf import read_urdf

from .options import NewRigOptions
from .rig_questions import rig_text

# Visual and collision shapes are only for pictures; no code here uses them, and the twin would search for their meshes.
PICTURES = re.compile(r"[ \t]*<(visual|collision)\b[^>]*?(?:/>|>.*?</\1\s*>)[ \t]*\n?", re.DOTALL)


@dataclass(frozen=True)
class NewRig:
    """Result of `exograv rig new`."""

    folder: Path
    joints: tuple[str, ...]
    questions: list[Question]
    """Values of `rig.toml` that the URDF does not determine."""


def new_rig(options: NewRigOptions) -> NewRig:
    """Write the folder.

    Raises:
        ModelError: The URDF cannot be used.
        ConfigError: The folder exists already, or cannot be written.
    """
    tree = read_urdf(options.urdf)
    folder = Path(_name(tree)) if options.out == Path() else options.out
    if folder.exists():
        raise ConfigError(f"{folder} exists already; nothing is overwritten. Give another folder with --out.")
    text = rig_text(tree, folder.name, options.urdf.name, options.side)
    urdf = PICTURES.sub("", options.urdf.read_text(encoding="utf-8"))
    try:
        _write(folder, {options.urdf.name: urdf, "rig.toml": text})
    except OSError as error:
        raise ConfigError(f"{folder} cannot be written: {error.strerror}. Give another folder with --out.") from error
    read_urdf(folder / options.urdf.name)
    return NewRig(folder, tree.joint_names, open_questions(text))


def _write(folder: Path, files: Mapping[str, str]) -> None:
    """Write a new folder completely or not at all: half a folder would refuse the repetition."""
    partial = folder.with_name(f"{PARTIAL}{folder.name}")
    shutil.rmtree(partial, ignore_errors=True)
    try:
        partial.mkdir(parents=True)
        for name, text in files.items():
            (partial / name).write_text(text, encoding="utf-8")
        partial.rename(folder)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _name(tree: Tree) -> str:
    """Return the robot's name as a valid folder name."""
    return re.sub(r"[^\w.-]+", "_", tree.name).strip("._") or "machine"
