"""Phases of a session are described once, and both clocks read them."""

import re
from pathlib import Path

import numpy as np
import pytest

import exograv
from exograv.loop.phases import (
    BY_MODE,
    FLOATING,
    IDENTIFICATION,
    RAMPS_S,
    TRAVEL_RAD_S,
    VERIFICATION,
    Drive,
    next_drive,
    phases_of_unknown_arm,
)
from exograv.safety.modes import WORN, Mode

DT = 0.001


def test_every_worn_mode_says_what_drives_the_arm():
    assert set(BY_MODE) == WORN


@pytest.mark.parametrize(
    ("drive", "unknown", "known"), [(Drive.NEVER, 0.0, 0.0), (Drive.UNTIL_KNOWN, 1.0, 0.0), (Drive.ALWAYS, 1.0, 1.0)]
)
def test_an_arm_that_is_known_is_driven_only_where_it_always_is(drive: Drive, unknown: float, known: float):
    assert (drive.goal(is_known=False), drive.goal(is_known=True)) == (unknown, known)


@pytest.mark.parametrize("is_known", [False, True])
@pytest.mark.parametrize("mode", [mode for mode in Mode if mode in WORN])
def test_the_live_ramp_lasts_as_long_as_that_in_lock_step(mode: Mode, is_known: bool):
    goal = BY_MODE[mode].goal(is_known)
    drive = 1.0 - goal
    for _ in range(round(RAMPS_S["drive"] / DT) - 1):
        drive = next_drive(drive, mode, is_known, DT)
        assert drive != goal
    for _ in range(2):  # One more tick allows for the rounding of a thousand sums.
        drive = next_drive(drive, mode, is_known, DT)
    assert drive == goal


@pytest.mark.parametrize("mode", [mode for mode in Mode if mode not in WORN])
def test_where_no_arm_is_worn_nothing_drives_at_once(mode: Mode):
    assert next_drive(1.0, mode, is_known=False, period_s=DT) == 0.0


def test_an_approach_ends_at_rest_at_the_first_posture():
    start, posture = np.zeros(2), np.array([0.4, -0.2])
    way = IDENTIFICATION.approach(start, posture, DT)
    assert np.abs(way.v).max() <= TRAVEL_RAD_S + 1e-9
    at_rest = round(IDENTIFICATION.settle_s / DT)
    assert np.abs(way.q[-at_rest:] - posture).max() < 1e-9


def test_an_arm_is_identified_before_it_is_verified_and_floats_last():
    assert phases_of_unknown_arm(is_verified=True) == (IDENTIFICATION, VERIFICATION, FLOATING)
    assert phases_of_unknown_arm(is_verified=False) == (IDENTIFICATION, FLOATING)


def test_no_procedure_has_a_drive_of_its_own():
    """A number in place of a phase's goal would be a second table of goals."""
    literal = re.compile(r'"drive",\s*[0-9]|\.mode\.drive = [0-9]')
    sources = Path(exograv.__file__).parent.rglob("*.py")
    assert [str(path) for path in sources if literal.search(path.read_text(encoding="utf-8"))] == []
