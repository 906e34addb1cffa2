"""The empty machine is carried with the weight that hangs on it, and pulled to its reference."""

import numpy as np
import pytest

from exograv.control.exo_tick import STIFFER_KD, STIFFER_KP, ExoTick
from exograv.signals import Reference

Q, STILL = np.array([0.0, 0.0, 0.0, np.pi / 2]), np.zeros(4)
PARITY = 1e-9


@pytest.fixture
def tick(assembly) -> ExoTick:
    return ExoTick(assembly.description, assembly.exo)


def test_a_known_weight_on_the_mount_adds_its_weight_times_its_lever(tick, assembly):
    held = Reference(Q, STILL, STILL)
    bare = tick.step(Q, STILL, held).copy()
    tick.hang("calibration_mount", 3.0)
    loaded = tick.step(Q, STILL, held).copy()
    lever = -assembly.exo.frame("calibration_mount").p_body_frame[2]
    np.testing.assert_allclose((loaded - bare)[[0, 3]], 3.0 * 9.81 * lever, atol=PARITY)


def test_the_pull_is_stiffer_than_on_a_wearer(tick, assembly):
    held = tick.step(Q, STILL, Reference(Q, STILL, STILL)).copy()
    pulled = tick.step(Q, STILL, Reference(Q + 0.01, STILL, STILL)).copy()
    np.testing.assert_allclose(
        pulled - held, STIFFER_KP * 0.01 * assembly.description.per_actuator("weak_kp_Nm_per_rad"), atol=PARITY
    )
    braked = tick.step(Q, STILL + 0.1, Reference(Q, STILL, STILL)).copy()
    np.testing.assert_allclose(
        held - braked, STIFFER_KD * 0.1 * assembly.description.per_actuator("weak_kd_Nms_per_rad"), atol=PARITY
    )


def test_feed_forward_holds_no_feedback(tick):
    tick.step(Q, STILL, Reference(Q, STILL, STILL))
    held = tick.tau_feedforward.copy()
    tick.step(Q, STILL + 0.3, Reference(Q + 0.2, STILL, STILL))
    np.testing.assert_array_equal(tick.tau_feedforward, held)


def test_rotors_cost_torque_when_the_reference_accelerates(tick, assembly):
    none = tick.step(Q, STILL, Reference(Q, STILL, STILL)).copy()
    accelerated = tick.step(Q, STILL, Reference(Q, STILL, np.array([0.0, 0.0, 0.0, 1.0]))).copy()
    assert (accelerated - none)[3] > assembly.description.per_actuator("rotor_inertia_kgm2")[3]
