"""Pointing shows the weight of an arm only as far as something is assumed about the muscles of its wearer."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from tests.identification.conftest import LINEAR_SD

from exograv.identification.active.active_wearer import ActiveWearer, TouchWindow
from exograv.identification.active.muscle_torque import FREE_NM, MuscleTorque, touch_phase
from exograv.identification.core.interface import Sample
from exograv.identification.core.setting import Setting

USUAL_S, PERIOD_S = 2.75, 0.08
OFF = np.array([0.0, 0.8, -0.6, 0.9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
SILENT = MuscleTorque(0.0, 0.0)

Windows = Callable[..., list[TouchWindow]]


@pytest.fixture
def setting(linear_setting: Callable[..., Setting]) -> Setting:
    return linear_setting(has_body=False)


@pytest.fixture
def windows(setting: Setting) -> Windows:
    """Function that makes windows of eight touches; the muscle torque is a function of phase and window."""

    def make(muscles: Callable[[float, int], np.ndarray], count: int = 6, conditions: Sequence[str] = ("",)):
        rng = np.random.default_rng(4)
        return [
            TouchWindow(
                [_sample(setting, t, muscles(t / USUAL_S % 1.0, k), rng) for t in np.arange(0.0, 22.0, PERIOD_S)],
                [USUAL_S * n for n in range(1, 8)],
                conditions[k % len(conditions)],
            )
            for k in range(count)
        ]

    return make


def _sample(setting: Setting, t: float, tau_muscle: np.ndarray, rng: np.random.Generator) -> Sample:
    w, phase = 2.0 * np.pi / USUAL_S, np.array([0.3, 1.1])
    q, v, a = np.sin(w * t + phase), w * np.cos(w * t + phase), -(w**2) * np.sin(w * t + phase)
    sample = Sample(t, q, v, a, np.zeros(2))
    expected = setting.model.linearise(sample, setting.mean + OFF * LINEAR_SD)[0]
    sample.tau = expected - tau_muscle + setting.noise.sd * rng.standard_normal(2)
    return sample


def _none(_phase: float, _window: int) -> np.ndarray:
    return np.zeros(2)


def _estimated(setting: Setting, windows: Sequence[TouchWindow], muscle: MuscleTorque | None = None):
    method = ActiveWearer(setting, muscle)
    for window in windows:
        method.add(window)
    return method.estimate()


def test_without_windows_the_estimate_is_the_start(setting: Setting):
    found = ActiveWearer(setting).estimate()
    assert np.allclose(found.x, setting.mean)
    assert np.allclose(found.sd, LINEAR_SD)


def test_a_wearer_known_to_be_silent_is_identified(setting: Setting, windows: Windows):
    found = _estimated(setting, windows(_none), SILENT)
    error = (found.x - setting.mean) / LINEAR_SD - OFF
    assert np.abs(error[1:4]).max() < 0.5
    assert (found.sd[1:4] < 0.6 * LINEAR_SD[1:4]).all()
    assert (np.abs(found.x - setting.mean - OFF * LINEAR_SD) < 3.0 * found.sd).all()


def test_a_muscle_torque_that_repeats_at_every_touch_cancels(setting: Setting, windows: Windows):
    pushing = windows(
        lambda phase, _k: np.array([8.0 * np.sin(2 * np.pi * phase), 3.0 + 4.0 * np.cos(4 * np.pi * phase)])
    )
    silent, pushed = _estimated(setting, windows(_none)), _estimated(setting, pushing)
    assert np.abs((pushed.x - silent.x) / LINEAR_SD).max() < 0.1
    assert np.allclose(pushed.sd, silent.sd, rtol=0.02)


def test_repetition_alone_leaves_the_intervals_as_wide_as_before(setting: Setting, windows: Windows):
    found = _estimated(setting, windows(_none, count=14))
    assert (found.sd > 0.95 * LINEAR_SD).all()


def test_more_effort_that_is_allowed_for_never_narrows_an_interval(setting: Setting, windows: Windows):
    method = ActiveWearer(setting)
    for window in windows(_none):
        method.add(window)
    sd = [
        np.sqrt(np.diag(P)) for P in method.bounds([MuscleTorque(effort) for effort in (0.0, 0.3, 1.0, 3.0, FREE_NM)])
    ]
    assert (np.diff(sd, axis=0) >= -1e-9).all()


def _by_level(level: float) -> Callable[[float, int], np.ndarray]:
    """Muscles that take over what the machine gives up in every second window."""
    return lambda phase, k: (k % 2) * level * np.array([9.0 + np.sin(2 * np.pi * phase), 4.0])


def test_a_change_of_the_support_that_muscles_answer_adds_no_information(setting: Setting, windows: Windows):
    constant = _estimated(setting, windows(_by_level(0.0)))
    changed = _estimated(setting, windows(_by_level(0.3), conditions=("0", "0.3")))
    assert np.abs((changed.x - constant.x) / LINEAR_SD).max() < 0.1
    assert (changed.sd > 0.95 * constant.sd).all()


def test_a_shuffled_level_gains_nothing(setting: Setting, windows: Windows):
    given = _estimated(setting, windows(_by_level(0.02), conditions=("0", "0.02")))
    shuffled = _estimated(setting, windows(_by_level(0.02), conditions=("0", "0.02", "0.02", "0", "0", "0.02")))
    assert (shuffled.sd > 0.95 * given.sd).all()
    assert (shuffled.sd > 0.95 * LINEAR_SD).all()


def test_samples_at_standstill_and_in_contact_are_not_used(setting: Setting, windows: Windows):
    window = windows(_none, count=1)[0]
    still = [Sample(s.t, s.q, np.zeros(2), s.a, s.tau + 50.0) for s in window.samples]
    assert np.allclose(_estimated(setting, [TouchWindow(still, window.touches)], SILENT).x, setting.mean)
    everywhere = [s.t for s in window.samples]
    assert np.allclose(_estimated(setting, [TouchWindow(window.samples, everywhere)], SILENT).x, setting.mean)


def test_the_phase_goes_from_touch_to_touch_and_at_the_usual_pace_outside():
    phase = touch_phase(np.array([0.5, 1.0, 2.0, 4.0, 4.9, 5.5]), [1.0, 3.0, 5.0], 2.0)
    assert np.allclose(phase, [0.75, 0.0, 0.5, 0.5, 0.95, 0.25])
