"""Signals of the muscles tell their torque from the weight of an arm; signals that say nothing gain nothing."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from exograv.identification import methods
from exograv.identification.core import muscle_signals
from exograv.identification.core.interface import Estimate, RequestedMotion, Sample
from exograv.identification.core.muscle_signals import MuscleModel, MuscleSignals, with_slow_parts
from exograv.identification.core.noise import Noise
from exograv.identification.core.setting import Setting
from exograv.identification.recursive import recursive

TRUTH, MEAN, SD = np.array([12.0, 2.0]), np.array([10.0, 1.5]), np.array([3.0, 1.0])
MUSCLE_SD_NM, NOISE_SD_NM, LASTS_S, PER_UNIT = 2.0, 0.1, 3.0, 0.5
SIGNALS = MuscleSignals(2, PER_UNIT)
SEEDS = range(6)
FAST_S = 0.02
"""Correlation time of an error that is faster than the samples [s]."""


class Lever:
    """Joint with a lever weight and a spring."""

    n_joints, n_parameters = 1, 2

    def __init__(self) -> None:
        self.is_lost = False

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        derivative = np.array([[np.sin(sample.q[0]), sample.q[0]]]) * (not self.is_lost)
        return derivative @ x, derivative

    def restart(self) -> None:
        pass

    def direction_uncertainty(self, v: np.ndarray) -> np.ndarray:
        return np.zeros(1)


def restless(
    seed: int, error_Nm: float, drift: float = 0.0, error_lasts_s: float = LASTS_S, seconds: float = 80.0
) -> list[Sample]:
    """Motion of a wearer whose muscles pull slowly; a channel shows each direction, with an error.

    The gains rise and fall by the share `drift` at the end of the motion.
    """
    rng, samples, own, error, dt = np.random.default_rng(seed), [], 0.0, 0.0, 0.16
    keeps, error_keeps = np.exp(-dt / LASTS_S), np.exp(-dt / error_lasts_s)
    gains = 2.0 * np.exp(0.4 * rng.standard_normal(2))
    for t in np.arange(0.0, seconds, dt):
        own = keeps * own + MUSCLE_SD_NM * np.sqrt(1.0 - keeps**2) * rng.standard_normal()
        error = error_keeps * error + error_Nm * np.sqrt(1.0 - error_keeps**2) * rng.standard_normal()
        q = np.array([1.5 * np.sin(0.6 * t)])
        tau = Lever().linearise(Sample(0.0, q, q, q, q), TRUTH)[0] - own + NOISE_SD_NM * rng.standard_normal(1)
        shown = own + error
        now = gains * (1.0 + drift * t / seconds * np.array([1.0, -1.0]))
        muscles = now * np.array([max(shown, 0.0), max(-shown, 0.0)])
        samples.append(Sample(float(t), q, np.zeros(1), np.zeros(1), tau, muscles=muscles))
    return samples


def identified(samples: list[Sample], signals: MuscleSignals | None) -> Estimate:
    noise = Noise(np.array([NOISE_SD_NM]), np.array([0.0]), np.array([0.3]), LASTS_S)
    learned, machine = np.ones(2, dtype=bool), np.zeros(2, dtype=bool)
    setting = Setting(Lever(), MEAN, np.diag(SD**2), noise, (), learned, machine, muscles=signals)
    method = methods.built("recursive", setting)
    for sample in samples:
        method.update(sample)
    return method.estimate()


@cache
def errors(
    error_Nm: float,
    signals: MuscleSignals | None,
    shift: int = 0,
    drift: float = 0.0,
    error_lasts_s: float = LASTS_S,
    seeds: range = SEEDS,
) -> np.ndarray:
    """Errors of weight and spring for all seeds; signals may come `shift` samples late."""
    found = []
    for seed in seeds:
        samples = restless(seed, error_Nm, drift, error_lasts_s)
        shown = np.roll(np.array([sample.muscles for sample in samples]), shift, axis=0)
        late = [replace(sample, muscles=one) for sample, one in zip(samples, shown, strict=True)]
        found.append(identified(late, signals).x - TRUTH)
    return np.array(found)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values[:, 0] ** 2)))


@pytest.mark.long
def test_signals_with_an_unknown_map_make_the_weight_of_a_restless_arm_at_least_twice_as_exact():
    assert rms(errors(0.3, SIGNALS)) < 0.5 * rms(errors(0.3, None))


@pytest.mark.long
@pytest.mark.parametrize("drift", [0.0, 0.5])
def test_signals_of_another_time_gain_nothing(drift: float):
    late = errors(0.3, SIGNALS, len(restless(0, 0.0)) // 3, drift)
    assert rms(late) > 0.8 * rms(errors(0.3, None))


@pytest.mark.long
def test_gains_that_drift_by_half_cost_little(monkeypatch: pytest.MonkeyPatch):
    followed = rms(errors(0.1, SIGNALS, drift=0.5))
    monkeypatch.setattr(muscle_signals, "DRIFT_SHARE", 1e-6)
    assert followed < 0.7 * rms(errors.__wrapped__(0.1, SIGNALS, drift=0.5))


@pytest.mark.long
def test_a_fast_error_of_the_signals_costs_less_if_their_slow_part_is_known(monkeypatch: pytest.MonkeyPatch):
    found = rms(errors(1.5, SIGNALS, error_lasts_s=FAST_S, seeds=range(12)))
    monkeypatch.setattr(recursive, "with_slow_parts", list)
    whole = rms(errors.__wrapped__(1.5, SIGNALS, error_lasts_s=FAST_S, seeds=range(12)))
    assert found < 0.9 * whole


@pytest.mark.long
def test_a_larger_error_of_the_signals_leaves_a_larger_error_of_the_weight():
    small, large = (rms(errors(error_Nm, SIGNALS)) for error_Nm in (0.1, 2.0))
    assert small < 0.7 * large


@pytest.mark.long
def test_an_estimate_with_signals_holds_the_truth_within_its_interval():
    inside = []
    for seed in SEEDS:
        found = identified(restless(seed, 0.5), SIGNALS)
        inside.append(np.abs(found.x - TRUTH) <= 1.96 * found.sd)
    assert np.mean(inside) >= 0.8


def test_an_estimate_does_not_contain_the_map():
    assert identified(restless(0, 0.3)[:100], SIGNALS).x.shape == TRUTH.shape


def test_the_derivative_is_that_of_the_torque():
    model, rng = MuscleModel(Lever(), None, SIGNALS), np.random.default_rng(0)
    sample, x = with_slow_parts(restless(0, 0.3))[7], rng.standard_normal(model.n_parameters)
    tau, derivative = model.linearise(sample, x)
    for k, step in enumerate(1e-6 * np.eye(model.n_parameters)):
        moved = model.linearise(sample, x + step)[0]
        np.testing.assert_allclose((moved - tau) / 1e-6, derivative[:, k], atol=1e-6)


@pytest.mark.parametrize("is_lost", [False, True])
def test_a_sample_without_signals_or_without_a_posture_says_nothing_about_the_map(is_lost: bool):
    arm = Lever()
    arm.is_lost = is_lost
    model, sample = MuscleModel(arm, None, SIGNALS), restless(0, 0.3)[7]
    seen = sample if is_lost else replace(sample, muscles=None)
    assert not model.linearise(seen, np.ones(model.n_parameters))[1][:, 2:].any()


def test_rows_along_the_requested_motion_keep_the_signals():
    setting = Setting(
        Lever(), MEAN, np.diag(SD**2), Noise(np.ones(1), np.zeros(1), np.ones(1)), (), np.ones(2, dtype=bool),
        np.zeros(2, dtype=bool), muscles=SIGNALS, again=Lever,
    )  # fmt: skip
    sample = restless(0, 0.3)[7]
    asked = replace(sample, asked=RequestedMotion(sample.q + 0.01, np.zeros(1), np.zeros(1)))
    model = methods.instrumented(*methods.with_hidden(setting.model, setting), setting)
    rows = model.linearise(asked, np.zeros(model.n_parameters))[1]
    np.testing.assert_array_equal(rows[0, 2:4], -np.asarray(sample.muscles))


def test_the_map_leads_to_the_freedoms_of_the_arm():
    model = MuscleModel(Lever(), None, SIGNALS, slice(0, 2))
    sample, x = restless(0, 0.3)[7], np.append(np.arange(4.0), np.zeros(5))
    tau, rows = model.linearise(sample, np.append(np.zeros(2), x))
    at_joint = rows[:, :2]
    np.testing.assert_allclose(rows[0, 2:6], np.outer(at_joint, np.asarray(sample.muscles)).ravel())
    np.testing.assert_allclose(tau, rows[0, 2:6] @ x[:4])


def test_the_slow_part_of_constant_signals_is_the_signals_and_a_pause_parts_two_motions():
    before, after = restless(0, 0.3)[:20], [replace(one, t=one.t + 60.0) for one in restless(1, 0.3)[:20]]
    still = [replace(one, muscles=np.array([0.2, 0.1])) for one in before]
    both = with_slow_parts([*still, *(replace(one, muscles=np.array([0.5, 0.0])) for one in after)])
    slow = np.array([one.muscles_slow for one in both])
    np.testing.assert_allclose(slow, np.repeat([[0.2, 0.1], [0.5, 0.0]], 20, axis=0))


def test_samples_without_signals_have_no_slow_part():
    silent = [replace(one, muscles=None) for one in restless(0, 0.3)[:5]]
    seen = restless(0, 0.3)[5:10]
    assert [one.muscles_slow is None for one in with_slow_parts([*silent, *seen])] == [True] * 5 + [False] * 5
