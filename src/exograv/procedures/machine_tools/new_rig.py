"""`exograv new-rig`: a folder for a user's machine, with all that its URDF tells and a question for everything else."""

import re
from pathlib import Path
from typing import Any

from exograv.errors import ConfigError
from exograv.model.open_questions import open_questions
from exograv.model.tree import Tree
from exograv.model.urdf import read_urdf

from .options import NewRigOptions
from .rig_questions import rig_text

# Pictures for people: nothing here looks at them, and the twin would search for their meshes.
PICTURES = re.compile(r"[ \t]*<(visual|collision)\b[^>]*?(?:/>|>.*?</\1\s*>)[ \t]*\n?", re.DOTALL)


def new_rig(options: NewRigOptions) -> dict[str, Any]:
    """Write the folder; the contract of `exograv new-rig --json`.

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
    questions = open_questions(text)
    return {
        "folder": str(folder),
        "joints": list(tree.joint_names),
        "questions": [{"line": q.line, "key": q.key, "comment": q.comment} for q in questions],
    }


def _name(tree: Tree) -> str:
    """The robot's name as a folder's."""
    return re.sub(r"[^\w.-]+", "_", tree.name).strip("._") or "machine"
