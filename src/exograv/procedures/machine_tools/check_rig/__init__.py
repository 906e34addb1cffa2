"""`exograv rig check`: mistakes in a machine's files, support by its cuffs, reach, and largest arm that it carries."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from exograv.errors import ConfigError
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription
from exograv.model.loops import LoopSolver
from exograv.model.rig_settings import FREEDOMS_OF_ARM, RigSettings
from exograv.model.support import Support, put_together, support
from exograv.model.tree import Tree
from exograv.options import Side
from exograv.procedures.machine_tools.options import CheckOptions
from exograv.report.figures.machine_data import TorqueRow

from .agreement import examine_agreement
from .axis_names import examine_axis_names
from .check_result import CheckResult, ConditioningFigures, ReachedVolume, SoftestFreedom
from .findings import CheckFindings
from .fit import Donned, examine_donning, examine_loops
from .folder import locate, read_settings, read_trees
from .known_weights import examine_weights
from .picture import picture_data
from .reach import conditioning, examine_conditioning, reach
from .strength import DriveStrength, examine_strength, strength
from .units import examine_numbers, examine_units

Progress = Callable[[str, float], None]

SOFTEST = 0.5
"""Stiffness below which a freedom sags far under the weight of a hand [N·m/rad]."""


def check_rig(options: CheckOptions, out: Path, progress: Progress) -> CheckResult:
    """Examine a machine's folder.

    Raises:
        ConfigError: There is no such machine, or the height and mass are not those of a person.
        RecordingError: The picture cannot be written.
    """
    folder, findings = locate(options.rig), CheckFindings()
    body = Body(options.height_m, options.mass_kg, options.sex)
    progress("Reading the machine's files", 0.0)
    settings, files = read_settings(folder, findings)
    trees = read_trees(folder, files, findings)
    for file, tree in trees.items():
        examine_units(file, tree, findings)
    result = CheckResult(folder.name if settings is None else settings.name)
    if settings is not None and not findings.problems:
        description = _described(settings, folder, options.side)
        examine_numbers(settings, findings)
        result.side, result.human_dof = description.side, _freedoms(description)
        if _agrees(settings, folder, trees, findings):
            _examine_with_a_wearer(description, body, findings, result, out, progress)
    plan = None if settings is None else settings.excitation
    if plan is not None and plan.source == "proposed" and not findings.problems:
        findings.note(
            "[excitation] is the proposal of `exograv rig new`, not designed for this machine: more torque is left "
            f"over. `exograv rig motion {options.rig} --write` designs it."
        )
    result.ok, result.problems, result.notes = not findings.problems, findings.problems, findings.notes
    return result


def _described(settings: RigSettings, folder: Path, side: Side | None) -> RigDescription:
    sides = settings.urdf.sides
    if side is not None and side not in sides:
        raise ConfigError(f"{settings.name} has no side '{side}'; rig.toml has a URDF for: {', '.join(sides)}.")
    return RigDescription(settings, side or sides[0], folder)


def _freedoms(description: RigDescription) -> int:
    return FREEDOMS_OF_ARM[description.settings.wearer.arm] * len(description.arm_sides)


def _agrees(settings: RigSettings, folder: Path, trees: dict[str, Tree], findings: CheckFindings) -> bool:
    """Return True if `rig.toml` and the URDF of every side agree."""
    agrees = True
    for side in settings.urdf.sides:
        description = RigDescription(settings, side, folder)
        tree = trees[description.urdf_path.name]
        if examine_agreement(description, tree, findings):
            examine_weights(description, tree, findings)
        else:
            agrees = False
    return agrees


def _examine_with_a_wearer(
    description: RigDescription,
    body: Body,
    findings: CheckFindings,
    result: CheckResult,
    out: Path,
    progress: Progress,
) -> None:
    assembly = findings.attempt(lambda: put_together(description, body))
    if assembly is None:
        return
    progress("Adding the arm", 0.1)
    # The check must not end with an exception for an unusual machine: a failed computation is a finding, too.
    try:
        _examine_mechanics(assembly, findings, result, out, progress)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError, RuntimeError) as error:
        findings.problem(f"its mechanics cannot be computed ({error}). Check masses, axes and lengths.")


def _examine_mechanics(
    assembly: Assembly, findings: CheckFindings, result: CheckResult, out: Path, progress: Progress
) -> None:
    description, donned, solver = assembly.description, Donned(assembly), LoopSolver(assembly)
    held = support(assembly, solver)
    _examine_support(assembly, held, findings)
    examine_donning(donned, findings)
    for limb in assembly.arm.limbs:
        examine_axis_names(donned, limb, findings)
    result.rank, result.unsupported = held.rank, list(held.unsupported)
    result.softest = SoftestFreedom(held.softest, round(held.softest_Nm_per_rad, 3))
    progress("Moving the machine through its workspace", 0.4)
    result.loops = examine_loops(assembly, solver, findings)
    found = conditioning(assembly)
    examine_conditioning(description, found, findings)
    result.conditioning = ConditioningFigures(
        round(found.worst, 4), found.worst_deg, found.margin_deg, found.margin_at_deg
    )
    reached = reach(donned)
    result.workspace = [ReachedVolume(arm.side, round(arm.volume_m3, 3), round(arm.furthest_m, 3)) for arm in reached]
    progress("Computing the largest arm", 0.7)
    carrying = strength(assembly, solver)
    arm_kg = float(assembly.arm.phi.reshape(-1, 10)[:, 0].sum()) / len(assembly.arm.limbs)
    examine_strength(description, arm_kg, carrying, findings)
    result.largest_arm_kg, result.wearer_arm_kg = round(carrying.largest_arm_kg, 2), round(arm_kg, 2)
    result.torque_Nm = _torque_rows(description, carrying)
    progress("Drawing the machine", 0.9)
    # Matplotlib takes 0.4 s to import, which no other command needs.
    from exograv.report.figures.machine import draw
    from exograv.report.style.figure_style import write_picture

    drawn = picture_data(donned, reached, result)
    result.picture = write_picture(out / "check_rig.png", lambda: draw(drawn))


def _examine_support(assembly: Assembly, held: Support, findings: CheckFindings) -> None:
    cuffs = ", ".join(cuff.name for cuff in assembly.cuffs)
    for name, count in held.unsupported.items():
        findings.problem(
            f"the cuffs ({cuffs}) leave the arm free in {name} (in {count} postures): its weight there cannot be "
            "carried. Add a cuff, or give one stiffness in that direction."
        )
    if not held.unsupported and held.softest_Nm_per_rad < SOFTEST:
        findings.problem(
            f"the cuffs ({cuffs}) hold {held.softest} with {held.softest_Nm_per_rad:.2g} N·m/rad only; allowed: at "
            f"least {SOFTEST} N·m/rad. Give one cuff more stiffness in that direction."
        )


def _torque_rows(description: RigDescription, found: DriveStrength) -> list[TorqueRow]:
    """Rows of the table, one per joint, in the posture in which the joint is loaded most."""
    limits = (float(limit) if limit > 0.0 else None for limit in found.limit)
    loads = ([round(float(one), 2) for one in load] for load in (found.exo, found.arm, found.hand, found.friction))
    return [TorqueRow(*row) for row in zip(description.joints, limits, *loads, strict=True)]
