"""Shoulder joints whose names contradict their axes: flexion, abduction and rotation in exchanged places."""

from itertools import permutations

import numpy as np

from exograv.model.limb import FREEDOMS, Limb

from .findings import CheckFindings
from .fit import Donned, ancestors, cuffs_of

MOTIONS = tuple(name.removeprefix("shoulder_") for name in FREEDOMS[:3])
"""Flexion, abduction and rotation of the shoulder."""

CLEARER = 0.5
"""Sum of cosines by which another assignment has to fit better [-]; exchanged perpendicular axes give 2."""


def examine_axis_names(donned: Donned, limb: Limb, findings: CheckFindings) -> None:
    """Compare the axes of the machine's shoulder with the arm's at donning, where all three names tell a motion."""
    assembly, tree = donned.assembly, donned.assembly.arm.tree
    moved = assembly.exo.frame(cuffs_of(assembly, limb)[-1].exo_frame).body
    joints = [i for i in ancestors(assembly.exo, moved) if assembly.description.places[i] == "shoulder"]
    told = [[motion for motion in MOTIONS if motion in assembly.exo.joints[i].name.lower()] for i in joints]
    if sorted(one[0] if len(one) == 1 else "" for one in told) != sorted(MOTIONS):
        return
    axes = [donned.exo_axis(i) for i in joints]
    own = [donned.arm_axis(tree.index(f"{limb.prefix}arm_{motion}")) for motion in MOTIONS]
    cosines = np.abs(np.array(axes) @ np.array(own).T)
    named = [MOTIONS.index(one[0]) for one in told]
    best = max(permutations(range(3)), key=lambda order: float(cosines[range(3), order].sum()))
    if cosines[range(3), best].sum() - cosines[range(3), named].sum() <= CLEARER:
        return
    wrong = [(joints[k], MOTIONS[best[k]]) for k in range(3) if best[k] != named[k]]
    turns = ", ".join(f"'{assembly.exo.joints[i].name}' turns about the arm's axis of {motion}" for i, motion in wrong)
    findings.problem(
        f"names and axes of the shoulder are exchanged: {turns} at donning. Correct the names or the axes."
    )
