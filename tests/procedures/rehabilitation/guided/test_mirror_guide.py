"""Mirror guide: the target follows late, with limited speed, inside the limits, and not after a jerk."""

from collections.abc import Callable

import numpy as np
import pytest

from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.rehabilitation.guided.grip import DROP_S, GripOutcome
from exograv.procedures.rehabilitation.guided.mirror_guide import BEHIND_RAD, LOOK_TICKS, MIDDLE_M, MirrorGuide
from exograv.procedures.rehabilitation.guided.mirror_map import MirrorMap
from exograv.procedures.rehabilitation.guided.path_shaping import A_MAX_RAD_S2, V_MAX_RAD_S, allowed_range
from exograv.procedures.rehabilitation.guided.pull import PullStrength

DT = 0.005
RIG = load_rig("recupera_like_dual")
EXO = read_exoskeleton(RIG)
MAP = MirrorMap.of(RIG, EXO, "right")
START = 0.5 * np.sum(RIG.workspace, axis=0)


def guide(to_middle: Callable[[np.ndarray], float] = lambda _q: np.inf) -> MirrorGuide:
    one = MirrorGuide(MAP, PullStrength.of(RIG), allowed_range(RIG, EXO), START, DT, "right", to_middle)
    one.lead()
    return one


def lead_to(one: MirrorGuide, q_lead: np.ndarray, seconds: float, held: np.ndarray | None = None) -> np.ndarray:
    """Hold the leading arm there, and let the other follow or be held. Return positions and speeds (tick, 2, lead)."""
    rows = []
    for _ in range(round(seconds / DT)):
        q = START.copy()
        q[MAP.lead], q[MAP.follow] = q_lead, one.target[MAP.follow] if held is None else held
        one(q, np.zeros(8))
        rows.append([one.target[MAP.follow], one.v_target[MAP.follow]])
    return np.array(rows)


def test_the_place_comes_to_the_mirror_image_within_speed_and_acceleration():
    one = guide()
    lead_to(one, START[MAP.lead], 2.5)
    rows = lead_to(one, START[MAP.lead] + np.deg2rad(25.0), 3.0)
    assert rows[-1, 0] == pytest.approx(START[MAP.follow] + np.deg2rad(25.0) * np.ones(4), abs=1e-3)
    assert np.abs(rows[:, 1]).max() <= V_MAX_RAD_S
    assert np.abs(np.diff(rows[:, 1], axis=0)).max() <= A_MAX_RAD_S2 * DT + 1e-12


def test_the_place_stays_inside_the_limits_wherever_the_leading_arm_is():
    one = guide()
    upper = allowed_range(RIG, EXO)[1][MAP.follow]
    rows = lead_to(one, START[MAP.lead] + 0.9, 4.0)
    assert (rows[:, 0] <= upper + np.deg2rad(1.0)).all()


def test_hands_that_are_too_near_stop_the_place():
    away_m = [1.1 * MIDDLE_M]
    one = guide(lambda _q: away_m[0])
    lead_to(one, START[MAP.lead], 2.5)
    assert one.waited_s == 0.0
    away_m[0] = 0.9 * MIDDLE_M
    lead_to(one, START[MAP.lead], LOOK_TICKS * DT)
    rows = lead_to(one, START[MAP.lead] + 0.3, 2.0)
    assert rows[-1, 0] == pytest.approx(START[MAP.follow], abs=1e-6)
    assert one.waited_s == pytest.approx(2.0, abs=2.0 * LOOK_TICKS * DT)


def test_a_jerk_of_the_leading_arm_ends_it():
    one = guide()
    lead_to(one, START[MAP.lead], 2.5)
    v = np.zeros(8)
    v[MAP.lead[0]] = 2.5
    one(START, v)
    assert one.state is GripOutcome.RUSHED
    lead_to(one, START[MAP.lead], DROP_S + DT)
    assert one.has_let_go
    assert not one.tau.any()


def test_an_arm_left_too_far_behind_is_let_go():
    one = guide()
    lead_to(one, START[MAP.lead], 2.5)
    lead_to(one, START[MAP.lead] + BEHIND_RAD + 0.1, 0.05)
    assert one.state is GripOutcome.LOST


def test_who_holds_the_following_arm_is_let_go():
    one = guide()
    lead_to(one, START[MAP.lead], 2.5)
    lead_to(one, START[MAP.lead] + np.deg2rad(20.0), 4.0, held=START[MAP.follow])
    assert one.state is GripOutcome.OVERRULED
    assert one.has_let_go


def test_the_leading_arm_is_not_pulled_wherever_it_is_and_however_it_moves():
    one = guide()
    lead_to(one, START[MAP.lead] + 0.2, 2.5, held=START[MAP.follow] - 0.1)
    assert one.tau[MAP.follow].any()
    assert not one.tau[MAP.lead].any()
