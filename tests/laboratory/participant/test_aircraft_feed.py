"""An emulated flight accelerates the room by its profile, and the arrived datagrams open and close windows."""

import numpy as np
import pytest
from tests.experiment.sensor_file.made_up_flights import CORNERS_S, acceleration

from exograv.experiment.sensor_file.series import Series, flown_samples
from exograv.laboratory.participant.aircraft_feed import AircraftFeed, upright
from exograv.task.events import CloseWindow, OpenWindow
from exograv.task.protocol import first_windows, load_protocol

PROTOCOL = first_windows(load_protocol("flight"), 2).settings
STEP_S = 0.02
RESIDUAL_G = 0.06
"""Tolerance for peaks of 0.05 g, and for noise across."""


class Room:
    """Room that stores its accelerations instead of a twin."""

    t: float = 100.0

    def __init__(self):
        self.g = np.array([0.0, 0.0, 1.0])

    def fly(self, g: np.ndarray) -> None:
        self.g = g


@pytest.fixture(scope="module")
def flight():
    room, heard = Room(), []
    feed = AircraftFeed(PROTOCOL, room, 1014, lambda t, sample: heard.append((t, sample)))
    said, flown = [], []
    for k in range(round(2 * feed.profile.cycle_s / STEP_S)):
        said += feed(room.t + STEP_S * k)
        flown.append((STEP_S * k, room.g.copy()))
    return feed, said, flown, heard


def test_two_windows_open_and_close(flight):
    feed, said, _, _ = flight
    assert [type(one) for one in said] == [OpenWindow, CloseWindow] * 2
    for window, (opened, closed) in zip(feed.profile.windows_s, zip(said[::2], said[1::2], strict=True), strict=True):
        assert window[0] - 0.5 < opened.t - Room.t < window[0] + 2.0
        assert window[1] < closed.t - Room.t < window[1] + 2.0


def test_the_room_is_weightless_in_a_window_and_heavy_before_it(flight):
    feed, _, flown, _ = flight
    opens, closes = feed.profile.windows_s[0]
    inside = [np.linalg.norm(g) for t, g in flown if opens + 0.2 < t < closes]
    before = [g for t, g in flown if opens - 20.0 < t < opens - 6.0]
    assert max(inside) < 2.0 * RESIDUAL_G
    np.testing.assert_allclose(np.mean(before, axis=0), [0.0, 0.0, 1.8], atol=0.02)


def test_what_arrives_is_heard(flight):
    feed, _, _, heard = flight
    assert len(heard) == pytest.approx(2 * feed.profile.cycle_s * 10.0, rel=0.05)


def test_a_recorded_flight_makes_the_room_weightless_however_the_sensor_was_mounted():
    room, said, flown = Room(), [], []
    recorded = list(flown_samples(Series(*acceleration()), PROTOCOL.aircraft, 0.0))
    feed = AircraftFeed(PROTOCOL, room, 1014, lambda _t, _sample: None, recorded)
    for k in range(round(2 * CORNERS_S[-1] / STEP_S)):
        said += feed(room.t + STEP_S * k)
        flown.append((STEP_S * k, room.g.copy()))
    assert [type(one) for one in said] == [OpenWindow, CloseWindow] * 2
    level = np.mean([g for at, g in flown if 14.0 < at < 29.0], axis=0)
    np.testing.assert_allclose(level, [0.0, 0.0, 1.8], atol=0.05)


def test_the_axes_of_the_room_are_those_of_a_right_handed_frame_with_the_third_up():
    for up in np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.6, -0.48, 0.64], [0.0, -9.8, 0.1]]):
        axes = upright(up)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        np.testing.assert_allclose(axes @ up, np.array([0.0, 0.0, np.linalg.norm(up)]), atol=1e-12)
