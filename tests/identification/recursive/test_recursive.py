"""The recursive method finds the true parameters, states correct intervals, and publishes only possible bodies."""

from dataclasses import dataclass

import numpy as np
import pytest

from exograv.identification.core import square_root
from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.interface import Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.path_discrepancy import PathDiscrepancy
from exograv.identification.core.sample_pace import BATCH_PERIOD_S
from exograv.identification.core.square_root import FilterBank
from exograv.identification.recursive import recursive
from exograv.identification.recursive.recursive import DISTURBANCE_SCALES, Recursive
from exograv.model.tree import inertial_parameters, is_physical

JOINTS, BODY = 2, slice(0, 10)
NOISE = Noise(np.array([0.1, 0.05]), np.zeros(JOINTS), np.array([0.1, 0.05]))
MEAN = np.append(inertial_parameters(2.0, np.array([0.02, 0.0, -0.15]), 0.5 * np.eye(3)), 0.0)
SD = np.append(0.15 * np.array([2.0, *[0.3] * 3, *[0.05] * 6]), 1.0)
CREDIBLE = 0.1  # of the inertia's standard deviation: so that every body drawn from the prior is physically possible
SAME_SUMS = 1e-8
"""Relative difference of two estimates whose sums are rounded in another order."""

COVERED_EACH = 0.86
"""Lowest coverage of a single parameter: 90 % minus two standard errors of 200 streams."""


@dataclass
class Toy:
    """Torque model: linear in one body, and one more parameter that enters as sin(bend · x)/bend."""

    bend: float = 0.0
    n_joints: int = JOINTS
    n_parameters: int = 11

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        c, s, a = np.cos(sample.q), np.sin(sample.q), sample.a
        derivative = np.zeros((JOINTS, 11))
        derivative[0] = [0, 9.81 * c[0], 9.81 * s[1], 9.81 * s[0], a[0], a[1], a[0] * c[1], a[1] * s[0], 0, 0, c[1]]
        derivative[1] = [c[1], 0, 9.81 * c[1], 9.81 * s[1], a[1], 0, 0, a[0] * s[1], a[1], a[0], s[0]]
        tau = derivative @ x
        if self.bend:
            tau += derivative[:, 10] * (np.sin(self.bend * x[10]) / self.bend - x[10])
            derivative[:, 10] *= np.cos(self.bend * x[10])
        return tau, derivative

    def restart(self) -> None:
        pass

    def direction_uncertainty(self, v: np.ndarray) -> np.ndarray:
        return np.zeros(JOINTS)


def motion(seconds: float, period_s: float = BATCH_PERIOD_S) -> list[Sample]:
    """Motion of two joints on incommensurable sines."""
    samples = []
    for t in np.arange(0.0, seconds, period_s):
        w, phase = np.array([1.1, 1.7]), np.array([0.0, 0.5])
        q, v, a = np.sin(w * t + phase), w * np.cos(w * t + phase), -(w**2) * np.sin(w * t + phase)
        samples.append(Sample(float(t), q, v, a, np.zeros(JOINTS)))
    return samples


def stream(
    x: np.ndarray,
    seed: int,
    seconds: float = 10.0,
    model: Toy | None = None,
    scale: float = 1.0,
    period_s: float = BATCH_PERIOD_S,
) -> list[Sample]:
    """Samples of the model: torque of `x`, a slow disturbance of `scale` times the assumed size, and white noise."""
    generator, samples = np.random.default_rng(seed), motion(seconds, period_s)
    keep = np.exp(-period_s / NOISE.disturbance_correlation_s)
    b = scale * NOISE.disturbance_sd * generator.standard_normal(JOINTS)
    for sample in samples:
        fresh = scale * NOISE.disturbance_sd * generator.standard_normal(JOINTS)
        b = keep * b + np.sqrt(1 - keep**2) * fresh
        white = NOISE.sd * generator.standard_normal(JOINTS)
        sample.tau = (model or Toy()).linearise(sample, x)[0] + b + white
    return samples


def prior_covariance() -> np.ndarray:
    sd = SD.copy()
    sd[4:10] *= CREDIBLE
    return np.diag(sd**2)


def drawn(seed: int) -> np.ndarray:
    """Draw true parameters from the prior."""
    return MEAN + np.sqrt(np.diag(prior_covariance())) * np.random.default_rng([seed, 1]).standard_normal(11)


def taught(samples: list[Sample], model: Toy | None = None, discrepancy: Discrepancy | None = None) -> Recursive:
    method = Recursive(model or Toy(), MEAN, prior_covariance(), NOISE, (BODY,), discrepancy)
    for sample in samples:
        method.update(sample)
    return method


def test_the_truth_is_found_where_the_motion_shows_it():
    x = drawn(0)
    estimate = taught(stream(x, 0, seconds=60.0, scale=0.1)).estimate()
    shown = [1, 2, 3, 10]
    np.testing.assert_array_less(np.abs(estimate.x - x)[shown], 4 * estimate.sd[shown])
    assert (estimate.sd[shown] < 0.1 * SD[shown]).all()


@pytest.mark.parametrize("seconds", [4.0, pytest.param(8.0, marks=pytest.mark.slow)])
def test_stated_intervals_cover_the_truth_in_90_to_98_of_streams(seconds: float):
    streams, inside = 200, []
    for seed in range(streams):
        x = drawn(seed)
        scale = float(DISTURBANCE_SCALES[seed % len(DISTURBANCE_SCALES)])
        estimate = taught(stream(x, seed, seconds, scale=scale)).estimate()
        inside.append(np.abs(estimate.x - x) <= 1.96 * estimate.sd)
    assert 0.90 <= np.mean(inside) <= 0.98
    assert np.mean(inside, axis=0).min() >= COVERED_EACH


def test_an_error_that_repeats_with_the_posture_is_covered_only_where_it_is_considered():
    field = Discrepancy(np.full(JOINTS, 0.4), 0.5, 16)
    covered = {True: [], False: []}
    for seed in range(16):
        x, generator = drawn(seed), np.random.default_rng([seed, 2])
        error = generator.standard_normal(field.count)
        samples = stream(x, seed, 20.0, scale=0.3)
        for sample in samples:
            sample.tau = sample.tau + field.errors(sample.q, sample.v) @ error
        for is_considered in covered:
            estimate = taught(samples, discrepancy=field if is_considered else None).estimate()
            covered[is_considered].append((np.abs(estimate.x - x) <= 1.96 * estimate.sd)[[1, 2, 3, 10]])
    assert np.mean(covered[True]) >= 0.90
    assert np.mean(covered[False]) < 0.85


def test_considered_errors_of_a_path_widen_the_intervals_and_leave_the_estimate():
    samples = stream(drawn(1), 1, 12.0, scale=0.3)
    path = PathDiscrepancy([slice(1, 4)], JOINTS, sd_m=0.1)
    plain, wide = (Recursive(Toy(), MEAN, prior_covariance(), NOISE, (BODY,), path=one) for one in (None, path))
    for sample in samples:
        plain.update(sample)
        wide.update(sample)
    np.testing.assert_allclose(wide._bank.mean(), plain._bank.mean(), rtol=SAME_SUMS, atol=SAME_SUMS)
    added = wide.covariance() - plain.covariance()
    assert np.linalg.eigvalsh(added).min() >= -1e-9 * np.trace(added)
    assert (np.diag(added)[1:4] > 0.2 * np.diag(plain.covariance())[1:4]).all()


def test_only_the_last_pass_over_the_samples_carries_the_considered_errors(monkeypatch: pytest.MonkeyPatch):
    field, samples = Discrepancy(np.full(JOINTS, 0.4), 0.5, 16), stream(drawn(1), 1, 12.0, scale=0.3)
    carried: list[bool] = []
    alone = Recursive._empty_bank

    def noted(self: Recursive, of_sizes: np.ndarray, considers: bool = True) -> FilterBank:
        carried.append(considers)
        return alone(self, of_sizes, considers)

    monkeypatch.setattr(Recursive, "_empty_bank", noted)
    quick = taught(samples, discrepancy=field).estimate()
    assert carried.count(True) == 1 + (len(carried) - 1) / recursive.REWEIGHTINGS
    monkeypatch.setattr(Recursive, "_empty_bank", lambda self, of_sizes, _considers=True: alone(self, of_sizes, True))
    complete = taught(samples, discrepancy=field).estimate()
    np.testing.assert_allclose(quick.x, complete.x, rtol=SAME_SUMS)
    assert np.isfinite(quick.sd).all()
    np.testing.assert_allclose(quick.sd, complete.sd, rtol=SAME_SUMS)


def test_a_motion_leaves_the_covariance_that_was_foreseen_and_foreseeing_changes_nothing(
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.setattr(recursive, "DISTURBANCE_SCALES", np.array([1.0]))
    samples, field = motion(24.0), Discrepancy(np.full(JOINTS, 0.4), 0.5, 16)
    for sample in samples:
        sample.tau = Toy().linearise(sample, MEAN)[0]
    method = taught([], discrepancy=field)
    half, whole = method.foresee(samples, [len(samples) // 2, len(samples)])
    for end, foreseen in ((len(samples) // 2, half), (len(samples), whole)):
        flown = taught(samples[:end], discrepancy=field)
        flown.relinearise()
        np.testing.assert_allclose(flown.covariance(), foreseen, rtol=SAME_SUMS, atol=SAME_SUMS * foreseen.max())
    less, more = (np.diag(one) for one in taught([]).foresee(samples, [len(samples) // 2, len(samples)]))
    assert (more < less).all()
    np.testing.assert_array_equal(method.covariance(), taught([], discrepancy=field).covariance())


def test_the_restlessness_that_is_there_is_found():
    calm, restless = (taught(stream(drawn(0), 0, 40.0, scale=s)).estimate().noise_scale for s in (0.3, 4.8))
    assert calm < 0.6
    assert restless > 2.4


def test_a_burst_moves_the_estimate_less_than_without_the_gate(monkeypatch: pytest.MonkeyPatch):
    x = drawn(0)
    calm, burst = stream(x, 0, scale=0.3), stream(x, 0, scale=0.3)
    for sample in burst[60:68]:
        sample.tau = sample.tau + np.array([4.0, 0.0])
    moved = []
    for gate in (square_root.GATE, 1e9):
        monkeypatch.setattr(square_root, "GATE", gate)
        moved.append(np.abs(taught(burst).estimate().x - taught(calm).estimate().x)[[1, 2, 3, 10]])
    assert (moved[0] < 0.5 * moved[1]).all()


def test_a_burst_is_counted_and_a_relaxed_arm_is_not():
    samples = stream(drawn(0), 0, scale=0.3)
    assert taught(samples).estimate().rejected_share < 0.02
    for sample in samples[::4]:
        sample.tau = sample.tau + np.array([4.0, 0.0])
    assert taught(samples).estimate().rejected_share > 0.1


def test_every_published_body_is_possible_whatever_the_torques_say():
    generator = np.random.default_rng(0)
    method = Recursive(Toy(), MEAN, 100.0 * np.diag(SD**2), NOISE, (BODY,))
    is_raw_possible = []
    for sample in motion(8.0):
        sample.tau = generator.normal(0.0, 5.0, JOINTS)
        method.update(sample)
        assert is_physical(method.estimate().x[BODY])
        is_raw_possible.append(is_physical((method._mean + method._unwhiten @ method._bank.mean())[BODY]))
    assert not all(is_raw_possible)


def test_what_was_learned_at_a_wrong_place_is_forgotten():
    bent = Toy(bend=1.5)
    x = MEAN.copy()
    x[10] = 0.9  # sin(1.5 · 0.9) is 28 % less than its linearisation at zero
    method = taught(stream(x, 0, 10.0, bent, scale=0.3), bent)
    for _ in range(5):
        method.relinearise()
    again = method.estimate()
    assert abs(again.x[10] - x[10]) < 3 * again.sd[10] < 0.3
    method.relinearise()
    np.testing.assert_allclose(method.estimate().x, again.x, atol=0.05 * again.sd.max())


def test_on_a_linear_model_running_over_all_samples_again_changes_nothing_but_the_gate(monkeypatch):
    monkeypatch.setattr(square_root, "GATE", np.inf)
    samples = stream(drawn(3), 3, 6.0, scale=0.3)
    method = taught(samples)
    before = method.estimate()
    method.relinearise()
    np.testing.assert_allclose(method.estimate().x, before.x, atol=1e-6)
    np.testing.assert_allclose(method.estimate().sd, before.sd, atol=1e-8)


def test_an_estimate_far_from_the_prior_is_fitted_once_more_from_there_and_the_better_one_kept():
    x, bent = drawn(0), Toy(bend=2.0)
    x[10] = 0.3
    method = taught(stream(x, 0, 20.0, bent, scale=0.3), bent)
    right = method.estimate().x[10]
    assert abs(right - x[10]) < 0.1
    # The first seconds may lead the estimate to the next branch of the sine.
    wrong = method._mean.copy()
    wrong[10] = np.pi - x[10]
    method._x = wrong
    method._step()
    assert abs(method.estimate().x[10] - x[10]) > 1.0
    evidence = method._bank.log_evidence
    method._doubt()
    assert abs(method.estimate().x[10] - x[10]) < 0.1
    assert method._bank.log_evidence > evidence
    method._doubt()
    assert abs(method.estimate().x[10] - x[10]) < 0.1


class Astray(Toy):
    """Model that predicts torques of no arm: every fit with it has a lower likelihood."""

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        tau, derivative = super().linearise(sample, x)
        return tau + np.sin(40.0 * sample.q), derivative


def test_an_estimate_that_explains_more_than_a_fresh_one_stays():
    method = taught(stream(drawn(0), 0, 6.0, scale=0.3))
    method.relinearise()
    before, kept = method.estimate(), method._bank
    method._model = Astray()
    method._doubt()
    assert method._bank is kept
    np.testing.assert_array_equal(method.estimate().x, before.x)
    method._step()
    worse, method._model = method._bank, Toy()
    method._doubt()
    assert method._bank.log_evidence > worse.log_evidence


def test_a_ripple_that_beats_with_the_period_of_the_updates_changes_nothing():
    calm = stream(drawn(0), 0, 10.0, period_s=BATCH_PERIOD_S / 4)
    rippled = [Sample(s.t, s.q, s.v, s.a, s.tau + np.cos(2 * np.pi * s.t / BATCH_PERIOD_S)) for s in calm[1:]]
    np.testing.assert_allclose(taught([calm[0], *rippled]).estimate().x, taught(calm).estimate().x, atol=1e-6)


def test_the_mean_of_many_samples_says_what_one_of_their_length_would():
    slow = [Sample(s.t, s.q, s.v, s.a, s.tau) for s in stream(drawn(0), 0, 10.0)]
    often = [Sample(s.t + k * 1e-4, s.q, s.v, s.a, s.tau) for s in slow for k in range(40)]
    np.testing.assert_allclose(taught(often).estimate().x, taught(slow).estimate().x, rtol=0.02, atol=0.02)


def test_what_the_prior_knows_for_certain_is_never_moved():
    covariance = prior_covariance()
    covariance[10] = covariance[:, 10] = 0.0
    method = Recursive(Toy(), MEAN, covariance, NOISE, (BODY,))
    for sample in stream(drawn(0), 0, 4.0):
        method.update(sample)
    assert method.estimate().x[10] == MEAN[10]
    assert method.estimate().sd[10] == 0.0


def test_a_residual_that_lasts_longer_says_less(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(recursive, "DISTURBANCE_SCALES", np.ones(1))
    samples = stream(drawn(0), 0)
    sds = []
    for correlation_s in (0.0, 0.8):
        noise = Noise(NOISE.sd, np.full(JOINTS, correlation_s), NOISE.disturbance_sd)
        method = Recursive(Toy(), MEAN, prior_covariance(), noise, (BODY,))
        for sample in samples:
            method.update(sample)
        sds.append(method.estimate().sd[[1, 2, 3, 10]])
    assert (sds[1] > sds[0]).all()


@pytest.mark.parametrize("seconds", [2.0, 20.0])
def test_parameters_for_a_controller_are_those_of_the_estimate(seconds: float):
    for seed in range(3):
        method = taught(stream(drawn(seed), seed, seconds))
        np.testing.assert_array_equal(method.parameters(), method.estimate().x)


def checked(change: float) -> Recursive:
    """Method after 40 s of motion and a check of 8 s, in which the first joint's torque differs by `change` [N·m]."""
    samples, method = stream(drawn(0), 4, seconds=48.0), Recursive(Toy(), MEAN, prior_covariance(), NOISE, (BODY,))
    for k, sample in enumerate(samples):
        if k == round(40.0 / BATCH_PERIOD_S):
            method.hold_out(np.array([[0.8, 0.8], [-0.8, 0.8], [0.0, -0.8]]))
        if sample.t >= 40.0:
            sample.tau[0] += change
        method.update(sample)
    return method


def test_held_out_samples_agree_with_a_right_estimate_and_not_with_a_changed_arm():
    agrees, disagrees = checked(0.0).agreement(), checked(0.8).agreement()
    assert agrees is not None
    assert agrees.holds
    assert disagrees is not None
    assert not disagrees.holds
    assert disagrees.p.argmin() == 0


def test_a_check_changes_nothing_about_the_estimate_but_the_time_of_a_linearisation():
    method, plain = checked(0.0), taught(stream(drawn(0), 4, seconds=48.0))
    method.agreement()
    for one in (method, plain):
        one.relinearise()
    np.testing.assert_allclose(method.estimate().x, plain.estimate().x, atol=1e-3)


def test_without_held_out_samples_there_is_no_agreement():
    method = taught(stream(drawn(0), 4, seconds=20.0))
    assert method.agreement() is None
    method.hold_out(np.zeros((1, JOINTS)))
    assert method.agreement() is None
