"""The leading arm in a machine for two arms floats, at any drive of the other arm."""

import numpy as np
import pytest

from exograv.control.tick import ControlMode, Tick
from exograv.dynamics import parameters
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.friction import Friction
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.machine import CalibratedMachine
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.signals import Reference

Q = np.tile([0.8, 0.3, -0.2, 1.3], 2)
V = np.tile([0.5, -0.4, 0.3, 1.0], 2)
RIGHT, LEFT = slice(0, 4), slice(4, 8)
WAYS = 12
"""Ticks in which the joints move on, so that friction is compensated and the loops are closed."""

PARITY_NM = 1e-9


@pytest.fixture(scope="module")
def two_arms() -> tuple[Tick, np.ndarray]:
    """Controller of a machine for both arms, and parameters of arms with elastic joints."""
    assembly = assemble(load_rig("recupera_like_dual"), Body(1.75, 75.0, "male"))
    none, one = np.zeros(8), np.ones(8)
    friction = Friction(2.0 * one, one, none, none, none, none, 0.02)
    known = Friction(none, none, none, none, none, none, 0.02)
    gain = ActuatorGain(assembly.description.nominal_gain, none)
    machine = CalibratedMachine(gain, friction, known, assembly.exo.phi, GRAVITY, 0.2 * one, none, none)
    x = parameters.table_parameters(assembly.arm, 0.2 * one, 2.0 * one, one)
    layout = parameters.ParameterLayout.of(assembly)
    x[layout.stiffness], x[layout.spring_offset], x[layout.damping] = 1.5, 0.8, 0.4
    return Tick(assembly, machine), x


def torque(two_arms: tuple[Tick, np.ndarray], drive: float, led: list[float]) -> np.ndarray:
    """Desired torque after some ticks of motion, with a reference at another posture."""
    tick, x = two_arms[0].again(), two_arms[1]
    tick.mode, tick.led[:] = ControlMode(drive), led
    for k in range(WAYS):
        tick.step(Q + k * 1e-3 * V, V, Reference(Q + 0.2, 0.5 * V, 2.0 * V), x)
    return tick.tau_desired.copy()


def test_the_leading_arm_is_neither_pulled_nor_loses_the_elasticity_of_its_joints(two_arms):
    floating, driven = torque(two_arms, 0.0, [1.0, 1.0]), torque(two_arms, 1.0, [1.0, 1.0])
    led = torque(two_arms, 1.0, [0.0, 1.0])
    np.testing.assert_allclose(led[RIGHT], floating[RIGHT], atol=PARITY_NM)
    np.testing.assert_allclose(led[LEFT], driven[LEFT], atol=PARITY_NM)
    assert np.abs(floating - driven).max() > 1.0


def test_either_arm_may_lead(two_arms):
    floating, led = torque(two_arms, 0.0, [1.0, 1.0]), torque(two_arms, 1.0, [1.0, 0.0])
    np.testing.assert_allclose(led[LEFT], floating[LEFT], atol=PARITY_NM)
