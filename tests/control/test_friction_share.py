"""The returned friction follows the motion, is nothing at rest, and never more than what friction takes."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.control.friction_share import V_FULL, V_OFF, friction_share_torque
from exograv.control.tick import FRICTION_SHARE

COULOMB, VISCOUS = 2.5, 1.4
SHARE_MAX = 0.8  # safety.md, F: friction compensation
SPEEDS = st.floats(-10.0, 10.0)


SYMBOL = ca.SX.sym("v")
FUNCTION = ca.Function("returned", [SYMBOL], [friction_share_torque(ca.SX(COULOMB), ca.SX(VISCOUS), SYMBOL)])


def returned(v: float) -> float:
    return float(FUNCTION(v))


@given(v=st.floats(-V_OFF, V_OFF))
def test_nothing_is_returned_where_the_direction_is_unknown(v: float):
    assert returned(v) == 0.0


@given(v=SPEEDS)
def test_what_is_returned_never_exceeds_what_friction_takes(v: float):
    taken = COULOMB * np.sign(v) + VISCOUS * v
    assert 0.0 <= returned(v) * v <= taken * v
    assert FRICTION_SHARE <= SHARE_MAX


@given(v=SPEEDS)
def test_it_is_odd_in_velocity(v: float):
    assert returned(-v) == -returned(v)


@given(speed=st.floats(V_FULL, 10.0))
def test_clear_motion_gets_the_whole(speed: float):
    assert returned(speed) == pytest.approx(COULOMB + VISCOUS * speed)


def test_it_rises_without_a_step():
    v = np.linspace(0.0, 0.15, 3001)
    torque = np.array([returned(x) for x in v])
    assert np.abs(np.diff(torque)).max() < 0.01
    assert (np.diff(torque) >= 0.0).all()


@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_a_broken_velocity_is_not_hidden(broken: float):
    assert not np.isfinite(returned(broken))


def test_noise_at_rest_feeds_no_energy():
    generator = np.random.default_rng(0)
    v = generator.normal(0.0, 0.01, 1000)  # a tenth of it is what the observer makes of a 17-bit encoder at rest
    assert sum(returned(x) * x for x in v) == 0.0
