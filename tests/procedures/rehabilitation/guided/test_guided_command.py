"""Guided commands: wrong options are refused before motion, and the mirror's error is separated from its delay."""

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.procedures.rehabilitation.guided.mirror_following import followed
from exograv.procedures.rehabilitation.guided.options import MirrorOptions, RepeatOptions

DT = 0.001


@pytest.mark.parametrize("speed", [0.0, 0.09, 1.01, float("nan")])
def test_a_speed_beyond_the_paths_own_is_refused(speed: float):
    with pytest.raises(ConfigError, match=r"0\.1 to 1"):
        RepeatOptions(speed=speed)


@pytest.mark.parametrize("number", [0, 101])
def test_so_many_repetitions_are_refused(number: int):
    with pytest.raises(ConfigError, match="--repetitions"):
        RepeatOptions(repetitions=number)


def test_a_mirror_of_no_time_is_refused():
    with pytest.raises(ConfigError, match="--seconds"):
        MirrorOptions(seconds=0.0)


def test_an_arm_that_is_only_late_is_off_by_nothing_once_that_is_known():
    t = np.arange(0.0, 10.0, DT)[:, None]
    image, own = np.sin(t), np.sin(t - 0.15)
    found = followed(np.hstack([image, own]), DT)
    assert found.late_s == pytest.approx(0.15)
    assert found.late_rms_deg[0] < 0.01
    assert found.tracking_rms_deg[0] > 5.0


def test_a_session_that_is_too_short_is_not_judged():
    assert followed(np.zeros((100, 8)), DT).late_s is None
