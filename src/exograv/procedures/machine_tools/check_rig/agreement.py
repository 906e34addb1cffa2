"""Agreement between `rig.toml` and a URDF: joints, frames, lengths, torques and postures."""

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .findings import CheckFindings

SAME_M = 1e-6
ARM_ANGLE_MAX_DEG = 180.0
RADIANS = 3.5
"""Largest angle of a file below which the file was probably written in radians [°]."""


def examine_agreement(description: RigDescription, tree: Tree, findings: CheckFindings) -> bool:
    """Add all disagreements to the findings. Return True if the rest can be examined."""
    file = description.urdf_path.name
    same = _examine_joints(description, tree, file, findings)
    same = _examine_frames(description, tree, file, findings) and same
    if same:
        _examine_lengths(description, tree, file, findings)
        _examine_torques(description, tree, file, findings)
        # Beyond the limits the loops are meaningless, and far beyond them the search for closed loops would not end.
        same = _examine_angles(description, tree, findings)
    return same


def _examine_joints(description: RigDescription, tree: Tree, file: str, findings: CheckFindings) -> bool:
    named, found = description.joints, tree.joint_names
    for joint in (joint for joint in found if joint not in named):
        findings.problem(
            f"joint '{joint}' of {file} has no entry in [[actuators]]. Add it. Without a motor its drive is 'passive'; "
            "if it never moves, make it a fixed joint."
        )
    for joint in (joint for joint in named if joint not in found):
        findings.problem(
            f"[[actuators]] has a joint '{joint}', which does not move in {file}. Joints there: {', '.join(found)}."
        )
    if sorted(named) == sorted(found) and named != found:
        findings.problem(
            f"[[actuators]] are in the order {', '.join(named)}; those of {file} in the order {', '.join(found)}. "
            "Use the URDF's order, also in every list of angles."
        )
    return named == found


def _examine_frames(description: RigDescription, tree: Tree, file: str, findings: CheckFindings) -> bool:
    centres = {f"wearer.shoulder_centre ({side})": description.shoulder_centre(side) for side in description.arm_sides}
    cuffs = {f"exo_frame of cuff '{cuff.name}'": cuff.exo_frame for cuff in description.settings.cuffs}
    mounts = {f"mount '{mount}' of [calibration]": mount for mount in description.mounts}
    missing = {what: frame for what, frame in (centres | cuffs | mounts).items() if frame not in tree.frames}
    for what, frame in missing.items():
        findings.problem(f"{what} is '{frame}', no link of {file}. Links there: {', '.join(sorted(tree.frames))}.")
    for what, frame in centres.items():
        if frame in tree.frames and tree.frames[frame].body >= 0:
            findings.problem(f"{what} is '{frame}', which moves with a joint of {file}. Fix that link to the base.")
    return not missing and all(tree.frames[frame].body < 0 for frame in centres.values())


def _examine_lengths(description: RigDescription, tree: Tree, file: str, findings: CheckFindings) -> None:
    for adjustment in description.settings.adjustments:
        place = tree.joints[tree.index(adjustment.joint)].p_parent_joint["xyz".index(adjustment.axis)]
        if abs(abs(place) - adjustment.nominal_m) > SAME_M:
            findings.problem(
                f"adjustment of '{adjustment.joint}': nominal_m is {adjustment.nominal_m} m; {file} has "
                f"{abs(place):.6g} m along {adjustment.axis} of its parent. Make them equal, or change the axis."
            )


def _examine_torques(description: RigDescription, tree: Tree, file: str, findings: CheckFindings) -> None:
    for actuator, joint in zip(description.settings.actuators, tree.joints, strict=True):
        if actuator.torque_max_Nm is not None and actuator.torque_max_Nm > joint.effort:
            findings.problem(
                f"torque_max_Nm of '{joint.name}' is {actuator.torque_max_Nm} N·m; {file} allows {joint.effort:g} N·m. "
                "Give the lower of the two in both."
            )


def _examine_angles(description: RigDescription, tree: Tree, findings: CheckFindings) -> bool:
    """Check angles against the limits. Return True if at least donning and task workspace are within them."""
    settings, within = description.settings, True
    box = settings.task_workspace
    largest = np.abs([settings.donning.posture_deg, box.lower_deg, box.upper_deg]).max()
    if 0.0 < largest < RADIANS:
        findings.problem(
            f"the largest angle of [donning] and [task_workspace] is {largest:g}°. It seems to be in radians; "
            "rig.toml is in °."
        )
    arm = settings.donning.arm_posture_deg or [0.0]
    if np.abs(arm).max() > ARM_ANGLE_MAX_DEG:
        within = False
        findings.problem(
            f"donning.arm_posture_deg holds {max(arm, key=abs):g}°; allowed: ±{ARM_ANGLE_MAX_DEG:g}°. Give the "
            "wearer's joint angles in the posture in which the cuffs are fastened."
        )
    for what, postures in _postures(description).items():
        for i, joint in enumerate(tree.joints):
            low, high = postures[:, i].min(), postures[:, i].max()
            lower, upper = np.rad2deg([joint.lower, joint.upper])
            if low < lower or high > upper:
                within = within and what not in ("donning", "task_workspace")
                is_motion = what == "excitation"
                step = (
                    f" `exograv rig motion {description.folder} --write` designs one within them." if is_motion else ""
                )
                findings.problem(
                    f"{what} takes '{joint.name}' from {low:.1f} to {high:.1f}°; its limits are {lower:.1f} to "
                    f"{upper:.1f}°. Stay within them.{step}"
                )
    return within


def _postures(description: RigDescription) -> dict[str, Float[np.ndarray, "posture joint"]]:
    """Postures of `rig.toml` [°], by the name that a message gives them."""
    settings = description.settings
    box = settings.task_workspace
    postures = {"donning": [settings.donning.posture_deg], "task_workspace": [box.lower_deg, box.upper_deg]}
    for sweep in settings.sweeps:
        moving = description.joints.index(sweep.joint)
        ends = [list(sweep.posture_deg), list(sweep.posture_deg)]
        ends[0][moving], ends[1][moving] = sweep.from_deg, sweep.to_deg
        postures[f"the calibration's sweep of '{sweep.joint}'"] = ends
    found = {what: np.array(rows) for what, rows in postures.items()}
    plan = settings.excitation
    if plan is not None:
        centre, sine, cosine = (np.array(rows) for rows in (plan.centre_deg, plan.sine_deg, plan.cosine_deg))
        period = plan.period_s
        found["excitation"] = motion.fourier(centre, sine, cosine, period, period, period / 500).q
    return found
