"""`exograv rig export`: the personalised machine and arm as files for other tools."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.parameters import ParameterLayout
from exograv.errors import ConfigError, ModelError
from exograv.files import replace_file
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.loops import LoopSolver
from exograv.model.mjcf_writer import ArmSprings, Posture, mjcf_text
from exograv.model.personal import Personal, joint_positions, personal
from exograv.model.support import put_together
from exograv.model.tree import inertial_parameters, is_physical
from exograv.model.urdf_writer import mass_centre_inertia, urdf_text
from exograv.storage.calibration_file import identity_of, read_calibration, refuse_other_machine
from exograv.storage.participant_file import read_participant
from exograv.storage.participant_schema import StoredParticipant, parameter_names

from .export_loops import loops_text
from .options import ExportOptions

EXO, ARM, LOOPS, BOTH = "exo.urdf", "arm.urdf", "loops.toml", "exo_and_arm.xml"
GIVE = "Give a calibration.toml of the participant's machine with --calibration, or leave it out."


@dataclass(frozen=True)
class Links:
    """Links of the exported machine, and the source of their parameters."""

    phi: Float[np.ndarray, "joint 10"]
    gravity: Float[np.ndarray, " 3"]
    """Gravity vector in the base frame [m/s²]."""
    rotor: Float[np.ndarray, " joint"]
    """Rotor inertia at the joint [kg·m²]."""
    source: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class ExportedMachine:
    """Result of `exograv rig export`."""

    code: str
    folder: Path
    files: list[str]
    links: str
    """Source of the machine's links."""
    notes: tuple[str, ...]
    segment_mass_kg: dict[str, float]


def run_export(options: ExportOptions, folder: Path) -> ExportedMachine:
    """Write the files of a participant's machine and arm.

    Raises:
        ConfigError: A file cannot be read, used or written.
        ModelError: The mass or inertia of a body is physically impossible.
    """
    whole = read_participant(options.participant)
    assembly = _assembly(options, whole)
    links = _links(options, assembly, whole)
    layout = ParameterLayout.of(assembly)
    person = personal(assembly, links.phi, whole.mean[layout.phi], whole.mean[layout.fit])
    _refuse_impossible(person)
    springs, shifts, donned = (
        springs_of(assembly, whole.mean),
        _shifts(assembly, whole.mean),
        _donned(assembly, whole.mean),
    )
    files = {
        EXO: urdf_text(person.exo),
        ARM: urdf_text(person.arm),
        LOOPS: loops_text(whole, person, springs, links.gravity, links.source),
        BOTH: mjcf_text(person, springs, links.rotor, links.gravity, shifts, donned),
    }
    _write(folder, files)
    masses = {
        name: round(float(whole.mean[body.start]), 4)
        for name, body in zip(assembly.arm.segments, layout.bodies, strict=True)
    }
    return ExportedMachine(whole.person.code, folder, list(files), links.source, links.notes, masses)


def _assembly(options: ExportOptions, whole: StoredParticipant) -> Assembly:
    description = load_rig(options.rig or whole.machine.rig, whole.machine.side)
    present = identity_of(description, whole.machine.machine)
    refuse_other_machine(options.participant, whole.machine, present, "Give its folder with --rig.")
    person = whole.person
    assembly = put_together(description, Body(person.height_m, person.mass_kg, person.sex, dict(person.lengths_m)))
    if [row.name for row in whole.parameters] != parameter_names(assembly):
        raise ConfigError(
            f"{options.participant} has other parameters than an arm in {description.name}. Identify the person again."
        )
    return assembly


def _links(options: ExportOptions, assembly: Assembly, whole: StoredParticipant) -> Links:
    description = assembly.description
    if options.calibration is None:
        rotor = description.per_actuator("rotor_inertia_kgm2")
        return Links(assembly.exo.phi, GRAVITY, rotor, "as described: no calibration was given")
    stored = read_calibration(options.calibration)
    refuse_other_machine(options.calibration, stored.identity, whole.machine, GIVE)
    machine = stored.calibration().machine
    phi, changed = possible_links(machine.phi, assembly.exo.phi, description.joints)
    notes = tuple(
        f"{joint}: the calibrated moments of inertia are physically impossible; those of the description are written. "
        "Mass and centre of mass, which determine gravity torque, are calibrated."
        for joint in changed
    )
    return Links(phi, machine.gravity, machine.rotor_inertia, f"calibration {stored.content_sha256[:12]}", notes)


def possible_links(
    phi: Float[np.ndarray, "joint 10"], described: Float[np.ndarray, "joint 10"], joints: tuple[str, ...]
) -> tuple[Float[np.ndarray, "joint 10"], tuple[str, ...]]:
    """Calibrated links as possible bodies, and the joints that kept the description's moments of inertia.

    Calibration moves slowly: it measures what affects gravity torque. The other parameters may be physically
    impossible.

    Raises:
        ModelError: A link has no positive mass.
    """
    possible, changed = phi.copy(), []
    for i, joint in enumerate(joints):
        if phi[i, 0] <= 0.0:
            raise ModelError(f"The link of {joint} has {phi[i, 0]:.3f} kg by its calibration. Calibrate again.")
        if not is_physical(phi[i]):
            mass, com, _ = mass_centre_inertia(phi[i])
            possible[i] = inertial_parameters(mass, com, mass_centre_inertia(described[i])[2])
            changed.append(joint)
    return possible, tuple(changed)


def _refuse_impossible(person: Personal) -> None:
    for tree in (person.exo, person.arm):
        for joint, phi in zip(tree.joints, tree.phi, strict=True):
            if phi[0] != 0.0 and not is_physical(phi):
                raise ModelError(f"The body behind {joint.name} is physically impossible. Identify the person again.")


def springs_of(assembly: Assembly, x: Float[np.ndarray, " parameter"]) -> ArmSprings:
    """Springs of the arm's joints; a joint with stiffness of zero or less has none."""
    layout, tree = ParameterLayout.of(assembly), assembly.arm.tree
    names = [tree.joints[i].name for limb in assembly.arm.limbs for i in limb.joints]
    stiffness = np.maximum(x[layout.stiffness], 0.0)
    neutral = np.divide(x[layout.spring_offset], stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
    damping = np.maximum(x[layout.damping], 0.0)
    return ArmSprings(*(dict(zip(names, values.tolist(), strict=True)) for values in (stiffness, neutral, damping)))


def _positions(
    assembly: Assembly, x: Float[np.ndarray, " parameter"], z: Float[np.ndarray, " freedom"]
) -> Mapping[str, float]:
    values = joint_positions(assembly, z, x[ParameterLayout.of(assembly).fit])
    return dict(zip(assembly.arm.tree.joint_names, values.tolist(), strict=True))


def _shifts(assembly: Assembly, x: Float[np.ndarray, " parameter"]) -> Mapping[str, float]:
    """Positions of the joints that shift a shoulder's centre, in the middle of the task workspace."""
    lower, upper = assembly.description.workspace
    z, _ = LoopSolver(assembly).solve(0.5 * (lower + upper), fit=x[ParameterLayout.of(assembly).fit])
    at = _positions(assembly, x, z)
    names = [joint.name for limb in assembly.arm.limbs for joint in assembly.arm.tree.joints[limb.shifts]]
    return {name: at[name] for name in names}


def _donned(assembly: Assembly, x: Float[np.ndarray, " parameter"]) -> Posture:
    description = assembly.description
    machine = dict(zip(description.joints, description.donning_posture.tolist(), strict=True))
    return Posture({**machine, **_positions(assembly, x, description.arm_donning_posture)})


def _write(folder: Path, files: Mapping[str, str]) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            replace_file(folder / name, text)
    except OSError as error:
        raise ConfigError(f"{folder} cannot be written: {error.strerror}. Give another folder with --out.") from error
