"""Mirror map: the pairs from the machine's axes agree with the positions of its arms."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from exograv.errors import ConfigError
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.model.kinematics import body_poses, frame_pose
from exograv.procedures.rehabilitation.guided.mirror_map import MirrorMap

RIG = load_rig("recupera_like_dual")
EXO = read_exoskeleton(RIG)
MAP = MirrorMap.of(RIG, EXO, "right")
EIGHT = arrays(float, 8, elements=st.floats(-1.5, 1.5))


def _cuffs() -> ca.Function:
    q = ca.SX.sym("q", 8)
    poses = body_poses(EXO, q)
    places = [frame_pose(EXO, poses, f"{side}_forearm_cuff").p for side in ("right", "left")]
    return ca.Function("cuffs", [q], [ca.horzcat(*places)])


CUFFS = _cuffs()


@given(q=EIGHT)
def test_mirroring_twice_is_the_identity(q):
    assert (MAP.mirrored(MAP.mirrored(q)) == q).all()


@given(q=EIGHT)
def test_mirrored_joints_put_the_cuffs_at_mirrored_places(q):
    right, left = np.array(CUFFS(q)).T
    right_in_mirror, left_in_mirror = np.array(CUFFS(MAP.mirrored(q))).T
    image = np.array([1.0, -1.0, 1.0])
    assert right_in_mirror == pytest.approx(image * left, abs=1e-9)
    assert left_in_mirror == pytest.approx(image * right, abs=1e-9)


def test_either_arm_may_lead():
    other = MirrorMap.of(RIG, EXO, "left")
    assert other.lead.tolist() == MAP.follow.tolist()
    assert [RIG.joints[k] for k in other.lead] == [name for name in RIG.joints if name.startswith("left_")]


def test_a_machine_for_one_arm_is_refused():
    one = load_rig("recupera_like_qdd")
    with pytest.raises(ConfigError, match="does not have two arms"):
        MirrorMap.of(one, read_exoskeleton(one), "right")
