"""The screen feels a finger where it touches, and only then. A room that is not touched changes no motion."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from exograv.model.description import RigDescription
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.rig.twin.world.surroundings import FINGER_RADIUS, Surroundings, fingertip_of
from exograv.signals import Command

NONE = Disturbances.at_level(0)
FAR = Surroundings(np.array([3.0, 0.0, 0.4]), 0.1, -1.0)
TICKS = 40
CONTACT_MM = 2.0
"""Tolerance of a touched position [mm]:

a soft contact lets the finger in a little, and the arm swings while it settles.
"""


def stepped(twin: Twin, ticks: int = TICKS) -> np.ndarray:
    for k in range(ticks):
        twin.write(Command(twin.t, k, twin.t + 1.0, np.zeros(4), np.zeros(4), np.zeros(4)))
    return twin.truth.q_arm


def before_the_finger(rig: RigDescription, tilt: float, gap: float) -> tuple[Surroundings, np.ndarray]:
    """Screen with its glass `gap` [m] before the fingertip, which is 30 mm right of and above its centre."""
    wearer = draw_wearer(NONE, 0)
    own = ArmInverseDynamics(rig, draw_machine(rig, NONE, 0), wearer)
    tip = own.fingertip(rig.arm_donning_posture)
    axes = Surroundings(np.zeros(3), tilt, 0.0).screen_axes
    return Surroundings(tip - axes @ np.array([0.03, 0.03, gap]), tilt, -1.0), tip


def test_the_screens_axes_are_right_up_and_towards_the_person():
    for tilt in (-0.3, 0.0, 0.3):
        axes = replace(FAR, screen_tilt=tilt).screen_axes
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        assert axes[1, 0] == -1.0
        assert axes[0, 2] < 0.0


def test_the_fingertip_is_a_hands_length_beyond_the_wrist_of_either_kind_of_arm():
    for kind in ("shoulder_elbow", "whole"):
        skeleton = draw_wearer(NONE, 3, kind=kind).arms[0].skeleton
        bone, tip = fingertip_of(skeleton)
        assert bone == skeleton.grip[0]
        from_wrist = skeleton.lengths["hand"]
        along = tip[2] if kind == "whole" else tip[2] + skeleton.lengths["forearm"]
        assert along == pytest.approx(-from_wrist)


def test_a_room_that_nobody_touches_changes_no_motion(make_twin: Callable[..., Twin]):
    alone, in_a_room = make_twin(NONE), make_twin(NONE, surroundings=FAR)
    np.testing.assert_array_equal(stepped(alone), stepped(in_a_room))
    assert in_a_room.finger_on_screen() is None
    assert alone.finger_on_screen() is None


@pytest.mark.parametrize("tilt", [-0.2, 0.0, 0.2])
def test_a_finger_on_the_glass_is_felt_where_it_is(rig: RigDescription, make_twin: Callable[..., Twin], tilt: float):
    surroundings, _ = before_the_finger(rig, tilt, gap=0.9 * FINGER_RADIUS)
    twin = make_twin(NONE, surroundings=surroundings)
    stepped(twin, 2)
    finger = twin.finger_on_screen()
    assert finger is not None
    assert 1e3 * np.abs(finger - 0.03).max() < CONTACT_MM


def test_a_finger_before_the_glass_or_a_screen_that_is_away_is_not_felt(
    rig: RigDescription, make_twin: Callable[..., Twin]
):
    surroundings, _ = before_the_finger(rig, 0.0, gap=3.0 * FINGER_RADIUS)
    twin = make_twin(NONE, surroundings=surroundings)
    stepped(twin, 2)
    assert twin.finger_on_screen() is None
    surroundings, _ = before_the_finger(rig, 0.0, gap=0.9 * FINGER_RADIUS)
    twin = make_twin(NONE, surroundings=surroundings)
    twin.put_surroundings(False)
    stepped(twin, 2)
    assert twin.finger_on_screen() is None


def test_the_support_carries_the_hand(rig: RigDescription, make_twin: Callable[..., Twin]):
    _, tip = before_the_finger(rig, 0.0, gap=1.0)
    lap = replace(FAR, support_z=float(tip[2]) - 0.05)
    falls, lies = make_twin(NONE), make_twin(NONE, surroundings=lap)
    own = ArmInverseDynamics(rig, falls.truth.machine, draw_wearer(NONE, 0))
    heights = [own.fingertip(stepped(twin, 1500))[2] for twin in (falls, lies)]
    assert heights[1] > lap.support_z - 0.01
    assert heights[0] < heights[1]


def test_in_an_aircraft_the_arm_falls_as_much_as_g_says(make_twin: Callable[..., Twin]):
    sinks = []
    for g in (0.0, 1.0, 1.8):
        twin = make_twin(NONE)
        start = twin.truth.q_arm
        twin.fly(np.array([0.0, 0.0, g]))
        sinks.append(float(np.abs(stepped(twin, 100) - start).max()))
    assert sinks[0] < 0.3 * sinks[1]
    assert sinks[2] > sinks[1]


def test_on_the_ground_an_aircraft_changes_nothing(make_twin: Callable[..., Twin]):
    stands, flies = (make_twin(Disturbances.at_level(2)) for _ in range(2))
    flies.fly(np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(stepped(flies), stepped(stands), atol=1e-12)
