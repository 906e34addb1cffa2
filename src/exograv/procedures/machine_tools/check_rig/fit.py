"""Fit of an arm in the machine at donning, and strain of the cuffs through the task workspace."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.model.arm import Limb
from exograv.model.assembly import Assembly
from exograv.model.description import Cuff
from exograv.model.kinematics import body_poses, frame_pose
from exograv.model.loops import LoopSolver, arm_poses, fit_names
from exograv.model.support import sample_postures
from exograv.model.tree import Tree
from exograv.spatial import Transform

from .check_result import CuffStrain
from .findings import CheckFindings

POSTURES = 32
ELBOW_OFF_M = 0.04
"""Allowed distance from the arm's elbow to the machine's elbow axis [m]: twice the error of donning."""
CUFF_OFF_M = 0.10
"""Allowed distance of a cuff's frame from the axis of its segment, or beyond its ends [m]: more than an arm's
thickness."""
TILT_MAX_DEG = 30.0
"""Allowed angle of a cuff's z, or the machine's elbow axis, to the arm's own [°]."""
AIM_MAX_DEG = 3.0
"""Allowed angle of the wearer's upper arm at donning to the line from the shoulder centre to the machine's elbow axis
[°]; flexion and abduction that are swapped by 5° exceed it."""
STRETCH_MAX_M, TURN_MAX_DEG = 0.03, 30.0
"""Allowed strain of a cuff. Under the weight of an arm it sags 4-19 mm (docs/explanation/arm.md)."""
SLOPE_MAX = 1e-3  # N·m: allowed residual of the search for the closed posture

Point = Float[np.ndarray, " 3"]
Pose = tuple[Float[np.ndarray, "3 3"], Point]


class Donned:
    """Numeric poses of machine and arm in the posture of donning."""

    def __init__(self, assembly: Assembly, z: Float[np.ndarray, " freedom"] | None = None):
        """`z`: posture of the arm [rad], if not the one of donning."""
        self.assembly, description = assembly, assembly.description
        fit = ca.SX.zeros(len(fit_names(assembly)))
        self.q, self.z = description.donning_posture, description.arm_donning_posture if z is None else z
        self._exo = body_poses(assembly.exo, ca.SX(ca.DM(self.q)))
        self._arm = arm_poses(assembly, ca.SX(ca.DM(self.z)), fit)

    def exo_body(self, body: int) -> Pose:
        """Pose of a body of the machine."""
        return _numbers(self._exo[body])

    def exo_axis(self, joint: int) -> Point:
        """Axis of a joint of the machine, in the base frame."""
        return self.exo_body(joint)[0] @ self.assembly.exo.joints[joint].axis

    def arm_axis(self, joint: int) -> Point:
        """Axis of a joint of the arm's tree, in the base frame."""
        return _numbers(self._arm[joint])[0] @ self.assembly.arm.tree.joints[joint].axis

    def exo_frame(self, name: str) -> Pose:
        """Pose of a frame of the machine."""
        return self._frame(self.assembly.exo, self._exo, name)

    def arm_frame(self, name: str) -> Pose:
        """Pose of a frame of the arms; a machine with two arms has the side before the name."""
        return self._frame(self.assembly.arm.tree, self._arm, name)

    def _frame(self, tree: Tree, poses: list[Transform], name: str) -> Pose:
        return _numbers(frame_pose(tree, poses, name))


def cuffs_of(assembly: Assembly, limb: Limb) -> list[Cuff]:
    """Cuffs that hold one arm, the most distal last."""
    order = ("upper_arm", "forearm", "hand")
    mine = [cuff for cuff in assembly.cuffs if cuff.side in (None, limb.side)]
    return sorted(mine, key=lambda cuff: order.index(cuff.segment))


def ancestors(tree: Tree, body: int) -> list[int]:
    """Joints that move a body, from the base outwards."""
    chain = []
    while body >= 0:
        chain.insert(0, body)
        body = tree.joints[body].parent
    return chain


def examine_donning(donned: Donned, findings: CheckFindings) -> None:
    """Check that the described arm lies where the machine and its cuffs are."""
    assembly = donned.assembly
    for limb in assembly.arm.limbs:
        for cuff in cuffs_of(assembly, limb):
            _examine_cuff(donned, limb, cuff, findings)
        _examine_elbow(donned, limb, findings)


def _examine_cuff(donned: Donned, limb: Limb, cuff: Cuff, findings: CheckFindings) -> None:
    lengths = donned.assembly.arm.lengths
    (R_arm, p_arm), (R_cuff, p_cuff) = donned.arm_frame(limb.prefix + cuff.segment), donned.exo_frame(cuff.exo_frame)
    if cuff.segment == "hand":
        p_arm = donned.arm_frame(f"{limb.prefix}wrist")[1]
    place = R_arm.T @ (p_cuff - p_arm)
    beyond = max(place[2], -lengths[cuff.segment] - place[2], 0.0)
    beside = float(np.hypot(*place[:2]))
    if max(beside, beyond) > CUFF_OFF_M:
        findings.problem(
            f"cuff '{cuff.name}' is {1e3 * beside:.0f} mm beside the axis of the {cuff.segment} at donning and "
            f"{1e3 * beyond:.0f} mm beyond its ends; allowed: {1e3 * CUFF_OFF_M:.0f} mm. Correct its exo_frame, "
            "shoulder_centre or donning.arm_posture_deg."
        )
    tilt = _degrees(float(abs(R_arm[:, 2] @ R_cuff[:, 2])))
    if tilt > TILT_MAX_DEG:
        findings.problem(
            f"z of '{cuff.exo_frame}' is {tilt:.0f}° off the axis of the {cuff.segment} at donning; allowed: "
            f"{TILT_MAX_DEG:.0f}°. A cuff's z is along the limb: turn that frame in the URDF, or correct "
            "donning.arm_posture_deg."
        )


def _examine_elbow(donned: Donned, limb: Limb, findings: CheckFindings) -> None:
    assembly = donned.assembly
    moved = assembly.exo.frame(cuffs_of(assembly, limb)[-1].exo_frame).body
    for i in ancestors(assembly.exo, moved):
        if assembly.description.places[i] != "elbow":
            continue
        joint = assembly.exo.joints[i]
        (R, p), elbow = donned.exo_body(i), donned.arm_frame(f"{limb.prefix}forearm")[1]
        axis, own = R @ joint.axis, donned.arm_frame(f"{limb.prefix}upper_arm")[0][:, 1]
        beside, tilt = float(np.linalg.norm(np.cross(axis, elbow - p))), _degrees(float(abs(axis @ own)))
        if beside > ELBOW_OFF_M or tilt > TILT_MAX_DEG:
            findings.problem(
                f"the wearer's elbow is {1e3 * beside:.0f} mm beside the axis of '{joint.name}' at donning, and "
                f"{tilt:.0f}° tilted against it; allowed: {1e3 * ELBOW_OFF_M:.0f} mm and {TILT_MAX_DEG:.0f}°. Correct "
                "donning, shoulder_centre or the lengths."
            )
        else:
            _refuse_wrong_aim(donned, limb, i, findings)


def _aim_deg(donned: Donned, limb: Limb, joint: int) -> float:
    """Angle of the upper arm to the plane through the shoulder centre and the machine's elbow axis [°]."""
    R, p = donned.exo_body(joint)
    axis, elbow = R @ donned.assembly.exo.joints[joint].axis, donned.arm_frame(f"{limb.prefix}forearm")[1]
    upper_arm = elbow - donned.arm_frame(f"{limb.prefix}upper_arm")[1]
    length = float(np.linalg.norm(upper_arm))
    along = upper_arm / length
    # A wrong length moves the elbow along the upper arm; only the distance across it is an error of the angles.
    across = elbow - p - axis * (axis @ (elbow - p))
    across = across - along * (along @ across)
    return float(np.rad2deg(np.arctan2(np.linalg.norm(across), length)))


def _refuse_wrong_aim(donned: Donned, limb: Limb, joint: int, findings: CheckFindings) -> None:
    off = _aim_deg(donned, limb, joint)
    if off <= AIM_MAX_DEG:
        return
    swapped = donned.z.copy()
    first = limb.freedoms.start
    swapped[[first, first + 1]] = swapped[[first + 1, first]]
    flexion, abduction = np.rad2deg(donned.z[[first, first + 1]])
    hint = "Correct donning or shoulder_centre."
    if _aim_deg(Donned(donned.assembly, swapped), limb, joint) < 0.5 * off:
        hint = "With these two swapped it points there: the first angle is flexion, the second abduction."
    findings.problem(
        f"the wearer's upper arm points {off:.1f}° beside the axis of '{donned.assembly.exo.joints[joint].name}' at "
        f"donning; allowed: {AIM_MAX_DEG:g}°. donning.arm_posture_deg has flexion {flexion:.1f}° and abduction "
        f"{abduction:.1f}°. {hint}"
    )


def examine_loops(assembly: Assembly, solver: LoopSolver, findings: CheckFindings) -> CuffStrain:
    """Return the largest strain of unloaded cuffs through the task workspace: 0 in a perfect fit."""
    worst = (0.0, 0.0, np.zeros(assembly.n))
    turned = 0.0
    for y in sample_postures(assembly.description, POSTURES):
        z, slope = solver.solve(y)
        stretch, turn = solver.strain(y, z)
        turned = max(turned, float(np.rad2deg(turn)))
        if slope > SLOPE_MAX:
            stretch = np.inf
        if stretch >= worst[0]:
            worst = (stretch, turn, y)
    stretch, _, y = worst
    if stretch > STRETCH_MAX_M or turned > TURN_MAX_DEG:
        at = ", ".join(f"{angle:.0f}" for angle in np.rad2deg(y))
        amount = f"stretched by {1e3 * stretch:.0f} mm" if np.isfinite(stretch) else "without any position of rest"
        findings.problem(
            f"the loops of machine and arm cannot close: at [{at}]° a cuff is {amount}, and one is turned by up to "
            f"{turned:.0f}°; allowed: {1e3 * STRETCH_MAX_M:.0f} mm and {TURN_MAX_DEG:.0f}°. The machine's axes miss "
            "the arm's, or its lengths are not set to the wearer's."
        )
    return CuffStrain(round(1e3 * min(stretch, 10.0), 3), round(turned, 3))


def _degrees(cosine: float) -> float:
    return float(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _numbers(pose: Transform) -> Pose:
    return np.array(ca.evalf(pose.R)), np.array(ca.evalf(pose.p)).ravel()
