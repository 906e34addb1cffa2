"""An emulated flight accelerates the room by its profile, and the arrived datagrams open and close windows."""

import numpy as np
import pytest

from exograv.laboratory.participant.aircraft_feed import AircraftFeed
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
