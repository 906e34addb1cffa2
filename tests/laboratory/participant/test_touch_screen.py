"""The simulated screen is where the participant's finger reaches the target, and converts pixels to millimetres."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.laboratory.movements import TARGET_DEG
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.rig.twin.world.surroundings import FINGER_RADIUS
from exograv.task.protocol import load_protocol

ROOM, TARGET = SimulatedRoom(), load_protocol("training").settings.target
NEAR_MM = 1.0
"""Assembly of a machine at level 0, where the controller's model of the arm is exact."""

pixels = st.tuples(st.floats(0.0, ROOM.width_px), st.floats(0.0, ROOM.height_px))


@given(pixel=pixels)
def test_a_pixel_is_where_its_place_is(pixel: tuple[float, float]):
    place = ROOM.on_panel(*pixel)
    inside = 0.999 * place
    found = ROOM.pixel_of(inside)
    assert found is not None
    np.testing.assert_allclose(ROOM.on_panel(*found), inside, atol=1e-9)


@given(pixel=pixels)
def test_right_is_right_and_down_is_down(pixel: tuple[float, float]):
    x, y = ROOM.on_panel(*pixel)
    further = ROOM.on_panel(pixel[0] + 10.0, pixel[1] + 10.0)
    assert further[0] - x == pytest.approx(1e-2 * ROOM.pitch_mm)
    assert further[1] - y == pytest.approx(-1e-2 * ROOM.pitch_mm)


def test_beside_the_panel_there_is_no_pixel():
    half = ROOM.on_panel(float(ROOM.width_px), 0.0)
    assert ROOM.pixel_of(1.001 * half) is None
    assert ROOM.pixel_of(-1.001 * half) is None


def test_the_finger_of_a_usual_reach_meets_the_glass_at_the_target():
    laboratory = draw_laboratory("recupera_like", "right", 0, 1014)
    around = ROOM.around(laboratory.assembly(), TARGET)
    own = ArmInverseDynamics(laboratory.description, laboratory.machine, laboratory.wearer)
    tip = around.screen_axes.T @ (own.fingertip(np.deg2rad(TARGET_DEG)) - around.screen_centre)
    off = tip - np.append(ROOM.on_panel(*ROOM.target_px(TARGET)), FINGER_RADIUS)
    assert 1e3 * np.abs(off).max() < NEAR_MM
