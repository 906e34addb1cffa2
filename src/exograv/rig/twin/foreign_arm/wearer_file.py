"""A third party's MJCF or URDF as a compiled model: bodies, joints and masses, without all that moves or shows them."""

import warnings
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from exograv.errors import ConfigError, ModelError

SIZE_MAX = 20_000_000
"""Of the file; the largest arm models have a few megabytes, without their meshes [bytes]."""

# MuJoCo refuses moving bodies without mass, which models put between the hinges of one joint; a hair is heavier.
MASS_LEAST = 1e-9
INERTIA_LEAST = 1e-12


def read_wearer_file(path: Path) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """The compiled model, and notes on what of it is not used.

    Raises:
        ConfigError: The file cannot be read.
        ModelError: MuJoCo cannot make a model of it.
    """
    try:
        if path.stat().st_size > SIZE_MAX:
            raise ConfigError(
                f"{path} is larger than {SIZE_MAX // 1_000_000} MB. Give the MJCF or URDF itself, without meshes in it."
            )
        is_urdf = "<robot" in path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be read: {error.strerror}. Give an MJCF or URDF with --wearer-model."
        ) from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path} is no text file. Give an MJCF or URDF with --wearer-model.") from error
    try:
        spec = _spec_of_urdf(path) if is_urdf else mujoco.MjSpec.from_file(str(path))
        _refuse_impossible_masses(spec, path)
        notes = _strip(spec)
        spec.compiler.boundmass = max(spec.compiler.boundmass, MASS_LEAST)
        spec.compiler.boundinertia = max(spec.compiler.boundinertia, INERTIA_LEAST)
        with warnings.catch_warnings():
            # A model whose axes coincide is refused by what its joints are, in our words.
            warnings.simplefilter("ignore")
            return spec.compile(), notes
    except (ValueError, ElementTree.ParseError) as error:
        raise ModelError(
            f"MuJoCo cannot make a model of {path}: {' '.join(str(error).split())}. Correct the file; it must be an "
            "MJCF or URDF with all files that it includes beside it."
        ) from error


def _spec_of_urdf(path: Path) -> mujoco.MjSpec:
    """A URDF's links have the masses that it states, never those of its pictures."""
    robot = ElementTree.parse(path).getroot()
    for link in robot.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    for extension in robot.findall("mujoco"):
        robot.remove(extension)
    ElementTree.SubElement(ElementTree.SubElement(robot, "mujoco"), "compiler", fusestatic="false")
    return mujoco.MjSpec.from_string(ElementTree.tostring(robot, encoding="unicode"))


def _refuse_impossible_masses(spec: mujoco.MjSpec, path: Path) -> None:
    """MuJoCo would lift a mass below zero to its least."""
    for body in spec.bodies:
        if body.explicitinertial and not (np.isfinite(body.mass) and body.mass >= 0.0):
            raise ModelError(
                f"{path}: body '{body.name}' weighs {body.mass} kg; it must be 0 or more. Correct it there."
            )


def _strip(spec: mujoco.MjSpec) -> tuple[str, ...]:
    """Take away what an arm's masses and joints do not need; says what of it would have acted."""
    notes = []
    for count, what in (
        (len(spec.actuators), "actuators and muscles"),
        (len(spec.tendons), "tendons"),
        (sum(one.type != mujoco.mjtEq.mjEQ_JOINT for one in spec.equalities), "welds and other constraints"),
        (sum(bool(joint.stiffness.any() or joint.damping.any()) for joint in spec.joints), "springs and dampers"),
    ):
        if count:
            notes.append(f"{count} {what} of the model are left out.")
    # Muscles before the tendons that they pull, these before what they wrap.
    unused = [*spec.sensors, *spec.actuators, *spec.tendons, *spec.keys, *spec.tuples, *spec.pairs, *spec.excludes]
    unused += [one for one in spec.equalities if one.type != mujoco.mjtEq.mjEQ_JOINT]
    unused += [*spec.skins, *spec.flexes]
    for element in unused:
        spec.delete(element)
    _strip_shapes(spec)
    return tuple(notes)


def _strip_shapes(spec: mujoco.MjSpec) -> None:
    """Shapes go where a body states its mass; elsewhere they are its mass, but need no colours."""
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
