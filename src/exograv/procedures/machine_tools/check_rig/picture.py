"""What the picture of a machine shows: points in the base frame, nothing that needs the model to be drawn."""

from typing import Any

import numpy as np

from exograv.model.arm import Limb
from exograv.results import json_value

from .check_result import CheckResult
from .fit import Donned, ancestors, cuffs_of
from .reach import VOXEL_M, ArmReach


def picture_data(donned: Donned, reached: list[ArmReach], result: CheckResult) -> dict[str, Any]:
    """Points [m] of both arms and of what they reach, beside the figures of the check."""
    arms = []
    for limb, reach in zip(donned.assembly.arm.limbs, reached, strict=True):
        arms.append({
            "side": limb.side,
            "exo": _machine(donned, limb),
            "links": _links(donned, limb),
            "arm": [
                donned.arm_frame(limb.prefix + name)[1].tolist()
                for name in ("upper_arm", "forearm", "wrist", "finger_tip")
            ],
            "cuffs": [donned.exo_frame(cuff.exo_frame)[1].tolist() for cuff in cuffs_of(donned.assembly, limb)],
            "reach": reach.points.tolist(),
            "task": reach.task_points.tolist(),
        })  # fmt: skip
    return {
        "title": donned.assembly.description.settings.title,
        "arms": arms,
        "rank": result.rank,
        "human_dof": result.human_dof,
        "largest_arm_kg": result.largest_arm_kg,
        "wearer_arm_kg": result.wearer_arm_kg,
        "torque_Nm": json_value(result.torque_Nm),
        "voxel_m": VOXEL_M,
    }


def _links(donned: Donned, limb: Limb) -> list[list[float]]:
    """Centre of mass [m] and mass [kg] of each link that carries this arm."""
    exo = donned.assembly.exo
    rows = []
    for body in ancestors(exo, exo.frame(cuffs_of(donned.assembly, limb)[-1].exo_frame).body):
        R, p = donned.exo_body(body)
        mass = exo.phi[body, 0]
        rows.append([*(p + R @ exo.phi[body, 1:4] / mass).tolist(), float(mass)])
    return rows


def _machine(donned: Donned, limb: Limb) -> list[list[float]]:
    """Shoulder centre, joints, and the frame of the last cuff; what coincides stands once."""
    exo = donned.assembly.exo
    last = cuffs_of(donned.assembly, limb)[-1].exo_frame
    points = [donned.exo_frame(donned.assembly.description.shoulder_centre(limb.side))[1]]
    points += [donned.exo_body(body)[1] for body in ancestors(exo, exo.frame(last).body)]
    points.append(donned.exo_frame(last)[1])
    kept = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) > 1e-3:
            kept.append(point)
    return [point.tolist() for point in kept]
