"""`exograv rig new`: folder of a user's machine, filled from its URDF, with a question for each other value."""

import re
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
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
        folder.mkdir(parents=True)
        (folder / options.urdf.name).write_text(urdf, encoding="utf-8")
        (folder / "rig.toml").write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{folder} cannot be written: {error.strerror}. Give another folder with --out.") from error
    read_urdf(folder / options.urdf.name)
    return NewRig(folder, tree.joint_names, open_questions(text))


def _name(tree: Tree) -> str:
    """Return the robot's name as a valid folder name."""
    return re.sub(r"[^\w.-]+", "_", tree.name).strip("._") or "machine"
