"""Implausible lengths, masses and angles: degrees for radians, mm for m, g for kg."""

import numpy as np

from exograv.model.rig_settings import Actuator, Cuff, RigSettings
from exograv.model.tree import Joint, Tree, inertia_about_origin

from .findings import CheckFindings

TURN_MAX = 2 * np.pi  # rad: no joint of an exoskeleton makes a full turn
SPEED_MAX = 35.0  # rad/s: 2000°/s; a larger limit is probably in degrees
LENGTH_MAX_M, LENGTH_MIN_M = 1.5, 0.05
"""Plausible largest distance between two joints, or from a joint to its link's centre. An arm is shorter than the
maximum; the longest distance in a machine is not below the minimum."""
CURRENT_MIN_A, CURRENT_MAX_A = 0.2, 300.0
"""Plausible current at peak torque. A torque constant in mN·m/A gives a current that is 1000 times lower."""
ROTOR_MAX = 2.0  # kg·m² at the joint: ten times that of a harmonic drive of 60 N·m
STIFFNESS_MAX_N_PER_MM, STIFFNESS_MAX_NM_PER_DEG = 500.0, 50.0
"""Largest plausible stiffness of a cuff: 100 times that of a strap. No flesh is that stiff."""
WEIGHT_MAX_KG = 30.0
GYRATION_MAX_M = 0.5
"""Largest plausible radius of gyration of a link. A rod of 1.5 m has 0.43 m."""
LINK_MAX_KG, LINK_MIN_KG = 25.0, 0.005
"""Plausible mass of a link. The heaviest published link weighs 6.7 kg (NESM), a bare bracket some grams."""


def examine_units(file: str, tree: Tree, findings: CheckFindings) -> None:
    """Report values that cannot be in the units of URDF (m, kg, rad)."""
    for joint in tree.joints:
        _examine_joint(file, joint, findings)
    longest = 0.0
    for joint, body, phi in zip(tree.joints, tree.bodies, tree.phi, strict=True):
        place, centre = np.linalg.norm(joint.p_parent_joint), np.linalg.norm(phi[1:4] / phi[0])
        longest = max(longest, float(place), float(centre))
        for what, length in ((f"joint '{joint.name}' from its parent", place), (f"centre of link '{body}'", centre)):
            if length > LENGTH_MAX_M:
                findings.problem(
                    f"{file}: {what} is {length:.4g} m away; allowed: up to {LENGTH_MAX_M} m. It may be in mm. "
                    "URDF is in m."
                )
        if not LINK_MIN_KG <= phi[0] <= LINK_MAX_KG:
            findings.problem(
                f"{file}: link '{body}' weighs {phi[0]:.4g} kg; allowed: {LINK_MIN_KG} to {LINK_MAX_KG} kg. It may be "
                "in another unit; URDF is in kg."
            )
    _examine_inertias(file, tree, findings)
    if longest < LENGTH_MIN_M:
        findings.problem(
            f"{file}: no joint or centre of mass is more than {longest:.2g} m from its joint; a machine for an arm has "
            f"distances over {LENGTH_MIN_M} m. URDF is in m."
        )


def _examine_inertias(file: str, tree: Tree, findings: CheckFindings) -> None:
    """Note inertias that no link of this mass has, and inertials that were copied from link to link."""
    measured = "`exograv rig calibrate` measures the links; until then the twin has the inertials of the file."
    for body, phi in zip(tree.bodies, tree.phi, strict=True):
        centre = phi[1:4] / phi[0]
        about_centre = inertia_about_origin(phi) - phi[0] * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        largest = max(0.0, float(np.linalg.eigvalsh(about_centre).max()))
        radius = float(np.sqrt(largest / phi[0]))
        if radius > GYRATION_MAX_M:
            findings.note(
                f"{file}: link '{body}' of {phi[0]:.3g} kg has an inertia of {largest:.3g} kg·m², as if its mass were "
                f"{radius:.2g} m away from its centre; allowed: up to {GYRATION_MAX_M} m. Mass or inertia is wrong. "
                f"{measured}"
            )
    for i, body in enumerate(tree.bodies):
        same = [k for k in range(len(tree.bodies)) if np.array_equal(tree.phi[k], tree.phi[i])]
        same = [k for k in same if k == i or i in _before(tree, k)]
        if len(same) > 1 and not any(np.array_equal(tree.phi[k], tree.phi[i]) for k in _before(tree, i)):
            names = ", ".join(f"'{tree.bodies[k]}'" for k in same)
            findings.note(
                f"{file}: links {names} have the same mass ({tree.phi[i, 0]:.4g} kg), centre and inertia, as copied "
                f"from one to the next. Link '{body}' and those after it cannot all have them. {measured}"
            )


def _before(tree: Tree, body: int) -> list[int]:
    """Return the bodies that carry a body."""
    found = []
    while (body := tree.joints[body].parent) >= 0:
        found.append(body)
    return found


def _examine_joint(file: str, joint: Joint, findings: CheckFindings) -> None:
    where = f"{file}: joint '{joint.name}'"
    if joint.kind == "prismatic":
        if max(abs(joint.lower), abs(joint.upper)) > LENGTH_MAX_M:
            findings.problem(f"{where} slides {joint.lower:.4g} to {joint.upper:.4g} m. It may be in mm; URDF is in m.")
        return
    if not np.isfinite([joint.lower, joint.upper]).all():
        findings.problem(
            f"{where} is continuous: no limit protects the arm from a full turn. Make it revolute, with limits."
        )
    elif max(abs(joint.lower), abs(joint.upper)) > TURN_MAX:
        findings.problem(
            f"{where} turns from {joint.lower:.4g} to {joint.upper:.4g} rad, more than a full turn. These may be "
            "degrees; URDF is in rad."
        )
    if joint.velocity > SPEED_MAX:
        findings.problem(
            f"{where} may turn at {joint.velocity:.4g} rad/s; allowed: up to {SPEED_MAX:g}. It may be in °/s; "
            "URDF is in rad/s."
        )


def examine_numbers(settings: RigSettings, findings: CheckFindings) -> None:
    """Report values that cannot be in the units of `rig.toml`."""
    for actuator in settings.actuators:
        _examine_drive(actuator, findings)
    for cuff in settings.cuffs:
        _examine_cuff(cuff, findings)
    for weight in [] if settings.calibration is None else settings.calibration.weights_kg:
        if weight > WEIGHT_MAX_KG:
            findings.problem(
                f"calibration.weights_kg holds {weight:g} kg; allowed: up to {WEIGHT_MAX_KG:g} kg. It may be in g; "
                "give kg."
            )


def _examine_drive(actuator: Actuator, findings: CheckFindings) -> None:
    if actuator.torque_max_Nm is None or actuator.rotor_inertia_kgm2 is None:
        return
    current = actuator.torque_max_Nm / actuator.nominal_gain
    if not CURRENT_MIN_A <= current <= CURRENT_MAX_A:
        findings.problem(
            f"'{actuator.joint}' gives {actuator.nominal_gain:.4g} N·m/A by torque constant, gear ratio and efficiency "
            f"and would need {current:.2g} A for its {actuator.torque_max_Nm:g} N·m; allowed: {CURRENT_MIN_A} to "
            f"{CURRENT_MAX_A:g} A. Check that torque_constant_Nm_per_A is not in mN·m/A."
        )
    if actuator.rotor_inertia_kgm2 > ROTOR_MAX:
        findings.problem(
            f"rotor_inertia_kgm2 of '{actuator.joint}' is {actuator.rotor_inertia_kgm2:g} kg·m²; allowed: up to "
            f"{ROTOR_MAX:g}. It is the inertia of the rotor times the square of the gear ratio."
        )


def _examine_cuff(cuff: Cuff, findings: CheckFindings) -> None:
    for name, most in (
        ("along_N_per_mm", STIFFNESS_MAX_N_PER_MM),
        ("across_N_per_mm", STIFFNESS_MAX_N_PER_MM),
        ("about_limb_Nm_per_deg", STIFFNESS_MAX_NM_PER_DEG),
        ("about_others_Nm_per_deg", STIFFNESS_MAX_NM_PER_DEG),
    ):
        value = getattr(cuff, name)
        if value > most:
            findings.problem(
                f"{name} of cuff '{cuff.name}' is {value:g}; allowed: up to {most:g}. Check its unit. Cuffs "
                "have some N/mm and tenths of N·m/°."
            )
