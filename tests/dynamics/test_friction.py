"""Friction opposes motion, vanishes at rest, has a gradient everywhere and cancels when added."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.dynamics.friction import Friction, friction_torque

SPEEDS = st.floats(-10.0, 10.0)
LOADS = st.floats(-60.0, 60.0)

FRICTION = Friction(
    coulomb=np.array([2.5]),
    viscous=np.array([1.4]),
    breakaway=np.array([1.3]),
    load_share=np.array([0.06]),
    asymmetry=np.array([0.2]),
    v_stribeck=np.array([0.05]),
    v_rest=0.02,
)


def torque(v: float, load: float, friction: Friction = FRICTION) -> float:
    return float(ca.DM(ca.evalf(friction_torque(friction, ca.SX(v), ca.SX(load)))))


@given(v=SPEEDS, load=LOADS)
def test_friction_never_feeds_energy_into_the_joint(v: float, load: float):
    assert v * torque(v, load) >= 0.0


@given(load=LOADS)
def test_friction_vanishes_at_rest(load: float):
    assert torque(0.0, load) == 0.0


@given(v=SPEEDS, load=LOADS)
def test_friction_has_a_finite_gradient_everywhere(v: float, load: float):
    x = ca.SX.sym("x", 2)
    slope = ca.Function("slope", [x], [ca.gradient(friction_torque(FRICTION, x[0], x[1]), x)])
    assert np.isfinite(np.array(slope([v, load]))).all()


@given(v=st.floats(0.5, 10.0), load=LOADS)
def test_clear_motion_costs_coulomb_load_and_viscous_friction(v: float, load: float):
    expected = 2.5 + 0.06 * abs(load) + 1.4 * v
    assert torque(v, load) == pytest.approx(expected + 0.2, abs=1e-5)
    assert torque(-v, load) == pytest.approx(-expected + 0.2, abs=1e-5)


def test_breaking_away_costs_more_than_slow_motion():
    assert torque(0.04, 0.0) > torque(0.2, 0.0) - 1.4 * 0.16
    assert torque(0.04, 0.0) == pytest.approx(
        2.5 * (1 + 0.3 * np.exp(-(0.8**1.3))) * np.tanh(2.0) + 0.2 * np.tanh(2.0) ** 2 + 1.4 * 0.04
    )


@given(v=SPEEDS, load=LOADS)
def test_friction_without_asymmetry_is_odd_in_velocity(v: float, load: float):
    even = replace(FRICTION, asymmetry=np.zeros(1))
    assert torque(v, load, even) == pytest.approx(-torque(-v, load, even))


@given(v=SPEEDS, load=LOADS)
def test_friction_added_to_a_command_leaves_the_load(v: float, load: float):
    # The joint receives the command minus its friction.
    commanded = load + torque(v, load)
    assert commanded - torque(v, load) == pytest.approx(load)


def test_friction_can_be_learned():
    coulomb, viscous = ca.SX.sym("coulomb"), ca.SX.sym("viscous")
    learned = replace(FRICTION, coulomb=coulomb, viscous=viscous)
    tau = friction_torque(learned, ca.SX(0.5), ca.SX(0.0))
    rows = ca.Function("rows", [coulomb, viscous], [ca.jacobian(tau, ca.vertcat(coulomb, viscous))])
    np.testing.assert_allclose(np.array(rows(2.0, 1.0)).ravel(), [1.0, 0.5], atol=1e-6)


@pytest.mark.parametrize("broken", [(np.nan, 0.0), (0.5, np.nan)])
def test_a_broken_signal_is_not_hidden(broken: tuple[float, float]):
    assert np.isnan(torque(*broken))
