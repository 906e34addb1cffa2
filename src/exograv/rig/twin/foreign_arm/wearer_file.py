"""Import of a third party's MJCF, URDF or OpenSim model: bodies, joints and masses, without actuators and visuals."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from exograv.errors import ConfigError, ModelError

from .opensim.document import OsimDocument, read_opensim
from .opensim_specification import arm_specification
from .wearer_map import WearerMap

SIZE_MAX = 20_000_000
"""Largest size of the file; the largest arm models have a few megabytes without their meshes [bytes]."""

# MuJoCo rejects moving bodies without mass, which some models have between the hinges of one joint. These values are
# negligible.
MASS_LEAST = 1e-9
INERTIA_LEAST = 1e-12


FORMATS = "MJCF, URDF or OpenSim model (.osim)"


@dataclass(frozen=True)
class WearerFile:
    """Text of a model of an arm; `opensim` is its content if OpenSim wrote it."""

    path: Path
    content: str
    opensim: OsimDocument | None


def open_wearer_file(path: Path) -> WearerFile:
    """Read the file of a model.

    Raises:
        ConfigError: The file cannot be read.
        ModelError: The file is a damaged OpenSim model.
    """
    try:
        if path.stat().st_size > SIZE_MAX:
            raise ConfigError(
                f"{path} is larger than {SIZE_MAX // 1_000_000} MB. Give the {FORMATS} itself, without meshes in it."
            )
        content = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. Give an {FORMATS} with --wearer-model.") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path} is not a text file. Give an {FORMATS} with --wearer-model.") from error
    is_opensim = path.suffix.lower() == ".osim" or "<OpenSimDocument" in content
    return WearerFile(path, content, read_opensim(content, path) if is_opensim else None)


def compile_wearer(file: WearerFile, told: WearerMap) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """Return the compiled model, and notes about parts that are not used.

    Raises:
        ModelError: MuJoCo cannot compile the model, or the arm of an OpenSim model cannot be represented.
    """
    path, notes = file.path, ()
    try:
        if file.opensim is not None:
            spec, notes = arm_specification(file.opensim, told)
        else:
            spec = _spec_of_urdf(path) if "<robot" in file.content else mujoco.MjSpec.from_file(str(path))
        _refuse_impossible_masses(spec, path)
        notes = (*notes, *_strip(spec))
        spec.compiler.boundmass = max(spec.compiler.boundmass, MASS_LEAST)
        spec.compiler.boundinertia = max(spec.compiler.boundinertia, INERTIA_LEAST)
        with warnings.catch_warnings():
            # A model whose axes coincide is refused later with a message about its joints.
            warnings.simplefilter("ignore")
            return spec.compile(), notes
    except (ValueError, ElementTree.ParseError) as error:
        raise ModelError(
            f"MuJoCo cannot compile {path}: {' '.join(str(error).split())}. Correct the file; it must be an {FORMATS} "
            "with all files that it includes beside it."
        ) from error


def _spec_of_urdf(path: Path) -> mujoco.MjSpec:
    """Return the specification of a URDF; its links have the masses that it states, never those of its shapes."""
    robot = ElementTree.parse(path).getroot()
    for link in robot.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    for extension in robot.findall("mujoco"):
        robot.remove(extension)
    ElementTree.SubElement(ElementTree.SubElement(robot, "mujoco"), "compiler", fusestatic="false")
    return mujoco.MjSpec.from_string(ElementTree.tostring(robot, encoding="unicode"))


def _refuse_impossible_masses(spec: mujoco.MjSpec, path: Path) -> None:
    """Refuse a mass below zero, which MuJoCo would silently raise to its lower bound."""
    for body in spec.bodies:
        if body.explicitinertial and not (np.isfinite(body.mass) and body.mass >= 0.0):
            raise ModelError(
                f"{path}: body '{body.name}' weighs {body.mass} kg; it must be 0 or more. Correct it there."
            )


def _strip(spec: mujoco.MjSpec) -> tuple[str, ...]:
    """Remove the parts that masses and joints do not need; return notes about those with an effect."""
    notes = []
    for count, what in (
        (len(spec.actuators), "actuators and muscles"),
        (len(spec.tendons), "tendons"),
        (sum(one.type != mujoco.mjtEq.mjEQ_JOINT for one in spec.equalities), "welds and other constraints"),
        (sum(bool(joint.stiffness.any() or joint.damping.any()) for joint in spec.joints), "springs and dampers"),
    ):
        if count:
            notes.append(f"{count} {what} of the model are left out.")
    # Delete muscles before the tendons that they pull, and tendons before the shapes that they wrap.
    unused = [*spec.sensors, *spec.actuators, *spec.tendons, *spec.keys, *spec.tuples, *spec.pairs, *spec.excludes]
    unused += [one for one in spec.equalities if one.type != mujoco.mjtEq.mjEQ_JOINT]
    unused += [*spec.skins, *spec.flexes]
    for element in unused:
        spec.delete(element)
    _strip_shapes(spec)
    return tuple(notes)


def _strip_shapes(spec: mujoco.MjSpec) -> None:
    """Delete shapes of bodies with a stated mass. Elsewhere shapes define the mass, but need no colours."""
    counts_shapes = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    for body in spec.bodies:
        for geom in body.geoms:
            if body.explicitinertial and not counts_shapes:
                spec.delete(geom)
            else:
                geom.material = ""
    used = {geom.meshname for geom in spec.geoms}
    unused = [*spec.materials, *spec.textures, *(mesh for mesh in spec.meshes if mesh.name not in used)]
    for element in unused:
        spec.delete(element)
