"""Data of a machine's picture: points in the base frame, so that drawing does not need the model."""

import numpy as np
from jaxtyping import Float

from exograv.model.arm import Limb
from exograv.report.figures.machine_data import DrawnArm, MachinePicture, Points

from .check_result import CheckResult
from .fit import Donned, ancestors, cuffs_of
from .reach import VOXEL_M, ArmReach


def picture_data(donned: Donned, reached: list[ArmReach], result: CheckResult) -> MachinePicture:
    """Return points of machine, arms and their reach, beside the figures of the check."""
    return MachinePicture(
        title=donned.assembly.description.settings.title,
        arms=[_arm(donned, *one) for one in zip(donned.assembly.arm.limbs, reached, strict=True)],
        rank=result.rank,
        human_dof=result.human_dof,
        largest_arm_kg=result.largest_arm_kg,
        wearer_arm_kg=result.wearer_arm_kg,
        torque_Nm=result.torque_Nm or (),
        voxel_m=VOXEL_M,
    )


def _arm(donned: Donned, limb: Limb, reach: ArmReach) -> DrawnArm:
    segments = ("upper_arm", "forearm", "wrist", "finger_tip")
    return DrawnArm(
        side=limb.side,
        exo=_machine(donned, limb),
        links=_links(donned, limb),
        arm=np.array([donned.arm_frame(limb.prefix + name)[1] for name in segments]),
        cuffs=np.array([donned.exo_frame(cuff.exo_frame)[1] for cuff in cuffs_of(donned.assembly, limb)]),
        reach=reach.points,
        task=reach.task_points,
    )


def _links(donned: Donned, limb: Limb) -> Float[np.ndarray, "_ 4"]:
    """Centre of mass [m] and mass [kg] of each link that carries this arm."""
    exo = donned.assembly.exo
    rows = []
    for body in ancestors(exo, exo.frame(cuffs_of(donned.assembly, limb)[-1].exo_frame).body):
        R, p = donned.exo_body(body)
        mass = exo.phi[body, 0]
        rows.append([*(p + R @ exo.phi[body, 1:4] / mass), mass])
    return np.array(rows)


def _machine(donned: Donned, limb: Limb) -> Points:
    """Points of the shoulder centre, the joints, and the frame of the last cuff, without duplicates."""
    exo = donned.assembly.exo
    last = cuffs_of(donned.assembly, limb)[-1].exo_frame
    points = [donned.exo_frame(donned.assembly.description.shoulder_centre(limb.side))[1]]
    points += [donned.exo_body(body)[1] for body in ancestors(exo, exo.frame(last).body)]
    points.append(donned.exo_frame(last)[1])
    kept = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) > 1e-3:
            kept.append(point)
    return np.array(kept)
