"""`exograv rig new`: folder of a user's machine, filled from its URDF or MJCF, with a question for each other value."""

import re
import shutil
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
from exograv.files import PARTIAL
from exograv.model.completed_urdf import completed_urdf
from exograv.model.open_questions import Question, open_questions
from exograv.model.tree import Tree
from exograv.model.urdf import MESHES, tree_of
from exograv.model.urdf_inference import ONLY_JOINT, arms, side_of

from .foreign_file import prepare
from .foreign_file.frames import add_frames, base_at_shoulder, carry_by_body
from .foreign_file.geometry import arm_geometry
from .foreign_file.inertias import clean_fixed_inertias
from .foreign_file.limits import missing_limits, placeholders, rotor_inertias
from .foreign_file.postures import donning_posture
from .foreign_file.reading import Converter, read_foreign
from .options import NewRigOptions
from .rig_questions import Draft, rig_text

ELBOW_NOTE = (
    "Neither names nor axes tell the place of every joint. If one of them is the elbow, repeat with --elbow JOINT and "
    "another --out: most of these questions are then answered."
)


@dataclass(frozen=True)
class NewRig:
    """Result of `exograv rig new`."""

    folder: Path
    joints: tuple[str, ...]
    questions: list[Question]
    """Values of `rig.toml` that the file does not determine."""

    notes: tuple[str, ...] = ()
    """Changes to the file: joints that are fixed or left out, and links that are added."""


def new_rig(options: NewRigOptions, convert: Converter | None = None) -> NewRig:
    """Write the folder; `convert` is needed for MJCF.

    Raises:
        ModelError: The file cannot be used; the message lists its faults.
        ConfigError: The folder exists already or cannot be written, or the file needs an answer first.
    """
    robot = read_foreign(options.urdf, convert)
    notes = prepare(robot, options.side, options.wearer_links, tuple(options.joints))
    notes += clean_fixed_inertias(robot, options.urdf.name)
    missing = missing_limits(robot)
    rotors = rotor_inertias(robot)
    file = Path(f"{options.urdf.name.split('.')[0] or 'machine'}.urdf")
    _refuse_unknown(options.elbow, _tree(robot, file, missing))
    notes += _with_frames(robot, file, missing, options.elbow)
    tree = _tree(robot, file, missing)
    folder = Path(_name(tree)) if options.out == Path() else options.out
    if folder.exists():
        raise ConfigError(f"{folder} exists already; nothing is overwritten. Give another folder with --out.")
    found = arms(tree, options.elbow)
    if not options.elbow and any(None in [guess.place for guess in arm.places] for arm in found):
        notes.append(ELBOW_NOTE)
    geometry = [arm_geometry(tree, arm) for arm in found]
    known = [one for one in geometry if one is not None]
    closing = donning_posture(tree, known) if len(known) == len(found) else None
    draft = Draft(tree, found, options.side or side_of(tree), missing, rotors, closing)
    text = rig_text(draft, folder.name, file.name)
    for link in robot.findall("link"):
        link.attrib.pop(MESHES, None)
    ElementTree.indent(robot)
    urdf = ElementTree.tostring(robot, encoding="unicode", xml_declaration=False) + "\n"
    try:
        _write(folder, {file.name: urdf, "rig.toml": text})
    except OSError as error:
        raise ConfigError(f"{folder} cannot be written: {error.strerror}. Give another folder with --out.") from error
    return NewRig(folder, tree.joint_names, open_questions(text), tuple(notes))


def _tree(robot: ElementTree.Element, file: Path, missing: Mapping[str, set[str]]) -> Tree:
    text = completed_urdf(ElementTree.tostring(robot, encoding="unicode"), placeholders(missing))
    return tree_of(ElementTree.fromstring(text), file)


def _refuse_unknown(elbows: Sequence[str], tree: Tree) -> None:
    for name in elbows:
        if name not in tree.joint_names:
            raise ConfigError(f"--elbow names {name}; joints that move the arm: {', '.join(tree.joint_names)}.")


def _with_frames(
    robot: ElementTree.Element, file: Path, missing: Mapping[str, set[str]], elbows: Sequence[str]
) -> list[str]:
    """Add the frames that the file lacks, and let each adjustable length be one coordinate of a joint."""
    tree = _tree(robot, file, missing)
    found = arms(tree, elbows)
    notes: list[str] = []
    if found[0].places == (ONLY_JOINT,):
        notes = [
            f"The only joint, {tree.joint_names[0]}, is taken as the elbow. If it is not, put shoulder or wrist into "
            "its name and repeat."
        ]
    if len(found) == 1 and found[0].places[0].place == "elbow":
        geometry = arm_geometry(tree, found[0])
        if geometry is not None:
            base_at_shoulder(robot, geometry.shoulder)
            tree = _tree(robot, file, missing)
            carry_by_body(robot, tree, tree.joint_names[found[0].joints[0]])
    for arm in found:
        if arm.upper_arm is not None:
            carry_by_body(robot, tree, arm.upper_arm.joint)
    tree = _tree(robot, file, missing)
    return notes + add_frames(robot, tree, arms(tree, elbows))


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
