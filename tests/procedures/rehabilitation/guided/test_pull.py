"""Pull: its torque never exceeds the bound, and its spring stores no more energy than stated."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from exograv.control.tick import weak_damping
from exograv.loop.person_limits import ACTIVE_MAX_NM
from exograv.model.description import load_rig
from exograv.procedures.rehabilitation.guided.grip import AWAY
from exograv.procedures.rehabilitation.guided.pull import REACH_RAD, PullStrength
from exograv.signals import Reference

STRENGTH = PullStrength.of(load_rig("recupera_like_qdd"))
DV = ca.SX.sym("dv", 4)
DAMPING = ca.Function("damping", [DV], [weak_damping(ca.DM(STRENGTH.tick_kp), ca.DM(STRENGTH.tick_kd), DV)])
FOUR = arrays(float, 4, elements=st.floats(-10.0, 10.0))
SHARE = st.floats(0.0, 1.0)
ROUNDING_NM = 1e-9


@given(q=FOUR, v=FOUR, q_target=FOUR, v_target=FOUR, grip=SHARE)
def test_no_error_and_no_speed_gets_a_torque_above_the_bound(q, v, q_target, v_target, grip: float):
    tau = STRENGTH.torque(q, v, Reference(q_target, v_target, np.zeros(4)), grip)
    assert (np.abs(tau) <= grip * STRENGTH.bound).all()


@given(q=FOUR, v=FOUR, q_target=FOUR, v_target=FOUR)
def test_the_control_laws_feedback_on_the_reference_is_the_pull_alone(q, v, q_target, v_target):
    target = Reference(q_target, v_target, np.zeros(4))
    tau = STRENGTH.torque(q, v, target, 1.0)
    reference = STRENGTH.reference(q, v, target, tau)
    feedback = STRENGTH.tick_kp * (reference.q - q) + np.array(DAMPING(reference.v - v)).ravel()
    assert feedback == pytest.approx(tau, abs=ROUNDING_NM * 1e3)


@given(error=FOUR)
def test_the_springs_energy_is_the_work_of_its_torque(error):
    shares = (np.arange(2000) + 0.5) / 2000
    still = np.zeros(4)
    power = [
        STRENGTH.torque(still, still, Reference(share * error, still, still), 1.0) @ error for share in shares
    ]  # fmt: skip
    assert STRENGTH.stored(error) == pytest.approx(np.mean(power), rel=1e-2, abs=1e-3)


def test_an_arm_that_is_let_go_for_being_away_had_less_than_four_joules_in_the_spring():
    farthest = np.full(4, AWAY * REACH_RAD)
    assert STRENGTH.stored(farthest) < 4.0


def test_the_bound_is_below_what_a_weak_adult_resists():
    description = load_rig("recupera_like_dual")
    weak = [ACTIVE_MAX_NM[place] for place in description.places]
    assert (PullStrength.of(description).bound <= 0.5 * np.array(weak)).all()
