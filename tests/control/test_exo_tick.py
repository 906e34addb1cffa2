"""The controller carries the empty machine with a known weight, and pulls it to its reference."""

import numpy as np
import pytest

from exograv.control.exo_tick import STIFFER_KD, STIFFER_KP, STIFFNESS_RATE, ExoTick, empty_gains
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
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
    kp, kd = empty_gains(assembly.description, assembly.exo)
    held = tick.step(Q, STILL, Reference(Q, STILL, STILL)).copy()
    pulled = tick.step(Q, STILL, Reference(Q + 0.01, STILL, STILL)).copy()
    np.testing.assert_allclose(pulled - held, 0.01 * kp, atol=PARITY)
    braked = tick.step(Q, STILL + 0.1, Reference(Q, STILL, STILL)).copy()
    np.testing.assert_allclose(held - braked, 0.1 * kd, atol=PARITY)
    np.testing.assert_allclose(kp, STIFFER_KP * assembly.description.per_actuator("weak_kp_Nm_per_rad"))
    assert (kd <= STIFFER_KD * assembly.description.per_actuator("weak_kd_Nms_per_rad")).all()


def test_feed_forward_holds_no_feedback(tick):
    tick.step(Q, STILL, Reference(Q, STILL, STILL))
    held = tick.tau_feedforward.copy()
    tick.step(Q, STILL + 0.3, Reference(Q + 0.2, STILL, STILL))
    np.testing.assert_array_equal(tick.tau_feedforward, held)


def test_rotors_cost_torque_when_the_reference_accelerates(tick, assembly):
    none = tick.step(Q, STILL, Reference(Q, STILL, STILL)).copy()
    accelerated = tick.step(Q, STILL, Reference(Q, STILL, np.array([0.0, 0.0, 0.0, 1.0]))).copy()
    assert (accelerated - none)[3] > assembly.description.per_actuator("rotor_inertia_kgm2")[3]


@pytest.mark.parametrize("name", ["recupera_like", "recupera_like_qdd", "recupera_like_7"])
def test_damping_stays_slower_than_drives_and_delays_however_light_the_joint(name: str):
    """The damping is compared with the inertia of the lightest joint with its rotor, while all others are free."""
    description = load_rig(name)
    tree = read_exoskeleton(description)
    kp, kd = empty_gains(description, tree)
    least = tree.phi[-1, [4, 6, 9]].min() + description.per_actuator("rotor_inertia_kgm2")[-1]
    assert kd[-1] / least < 60.0
    assert (kp <= STIFFNESS_RATE * kd + PARITY).all()


def test_weights_hang_where_they_hang():
    """A weight on one arm of a machine for two arms changes no torque of the other arm."""
    description = load_rig("recupera_like_dual")
    tree = read_exoskeleton(description)
    tick, q = ExoTick(description, tree), np.zeros(8)
    q[[3, 7]] = np.pi / 2
    held = Reference(q, np.zeros(8), np.zeros(8))
    bare = tick.step(q, np.zeros(8), held).copy()
    tick.hang(description.mounts[1], 3.0)
    added = tick.step(q, np.zeros(8), held) - bare
    assert np.abs(added[:4]).max() < PARITY
    assert added[7] > 1.0
