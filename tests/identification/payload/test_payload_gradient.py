"""Plain descent lowers the error, and the tuning of a method does not use the log of the evaluation."""

import numpy as np
import pytest

from exograv.identification.core.interface import Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.setting import Setting
from exograv.identification.methods import CANDIDATES, built
from exograv.identification.payload.payload import NOTHING, PAYLOAD, PayloadModel, payload_prior
from exograv.identification.payload.payload_gradient import PayloadGradient, rehearsed_step
from exograv.identification.payload.trial_load import TRIAL_LOAD, found_after, rehearsed, with_trial_load
from exograv.model.tree import inertial_parameters, is_physical
from exograv.model.urdf import read_urdf

URDF = """<robot name="one"><link name="base"/>
<joint name="lift" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="50" velocity="3"/></joint>
<link name="rod"><inertial><origin xyz="0.2 0 0"/><mass value="3"/>
<inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="mount" type="fixed"><parent link="rod"/><child link="tool"/><origin xyz="0.4 0 0"/></joint>
<link name="tool"/></robot>"""
BODY = inertial_parameters(2.0, np.array([0.05, 0.0, 0.02]), 0.01 * np.eye(3))
NOISE_SD = 0.5  # N·m


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> PayloadModel:
    path = tmp_path_factory.mktemp("one") / "one.urdf"
    path.write_text(URDF)
    return PayloadModel(read_urdf(path), "tool")


@pytest.fixture(scope="module")
def x(model: PayloadModel) -> np.ndarray:
    values = np.zeros(model.n_parameters)
    values[model.blocks.links] = model.tree.phi.ravel()
    return values


def setting_of(model: PayloadModel, x: np.ndarray) -> Setting:
    """Setting of an unknown payload on a known robot."""
    mean, covariance = x.copy(), np.zeros((len(x), len(x)))
    mean[PAYLOAD], covariance[PAYLOAD, PAYLOAD] = payload_prior()
    payload = np.arange(len(x)) < PAYLOAD.stop
    noise = Noise(np.full(1, NOISE_SD), np.full(1, 0.02), np.full(1, NOISE_SD))
    return Setting(model, mean, covariance, noise, (PAYLOAD,), payload, ~payload)


def swing(model: PayloadModel, x: np.ndarray, phi: np.ndarray, seed: int) -> list[Sample]:
    """Samples of one joint over ten seconds, with noise on the torque."""
    noise = np.random.default_rng(seed).normal(0.0, NOISE_SD, 1000)
    loaded = x.copy()
    loaded[PAYLOAD] = phi
    samples = []
    for k in range(1000):
        t = 0.01 * k
        q, v, a = np.sin(2 * t), 2 * np.cos(2 * t), -4 * np.sin(2 * t)
        s = Sample(t, np.array([q]), np.array([v]), np.array([a]), np.zeros(1))
        s.tau = model.linearise(s, loaded)[0] + noise[k]
        samples.append(s)
    return samples


def test_a_short_step_lowers_the_error_that_it_was_taken_for(model: PayloadModel, x: np.ndarray):
    sample = swing(model, x, BODY, seed=0)[10]
    descent = PayloadGradient(model, x, step=1e-6)
    before = sample.tau - model.linearise(sample, descent.estimate().x)[0]
    descent.update(sample)
    after = sample.tau - model.linearise(sample, descent.estimate().x)[0]
    assert np.abs(after) < np.abs(before)


def test_the_slope_is_that_of_finite_differences(model: PayloadModel, x: np.ndarray):
    sample = swing(model, x, BODY, seed=0)[10]
    descent, step = PayloadGradient(model, x, step=1e-7), 1e-7
    before = descent.estimate().x
    slope = descent.slope_at(sample).copy()
    descent.update(sample)
    errors = [0.5 * np.sum((sample.tau - model.linearise(sample, p)[0]) ** 2) for p in (before, descent.estimate().x)]
    np.testing.assert_allclose(errors[1] - errors[0], -step * slope @ slope, rtol=0.01)


def test_the_rehearsed_step_finds_another_load_and_stays_possible(model: PayloadModel, x: np.ndarray):
    step = rehearsed_step(setting_of(model, x), swing(model, x, np.zeros(10), seed=1))
    descent = PayloadGradient(model, x, step)
    for sample in swing(model, x, BODY, seed=2):
        descent.update(sample)
        assert is_physical(descent.estimate().x[PAYLOAD])
    held = Sample(0.0, np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(1))
    true = x.copy()
    true[PAYLOAD] = BODY
    # One joint shows the payload's moment, not its mass. The tolerance is a tenth: noise keeps plain descent moving.
    np.testing.assert_allclose(model.linearise(held, descent.estimate().x)[0], model.linearise(held, true)[0], rtol=0.1)


def test_without_a_sample_it_knows_nothing_and_says_so(model: PayloadModel, x: np.ndarray):
    estimate = PayloadGradient(model, x, step=1e-3).estimate()
    np.testing.assert_allclose(estimate.x[PAYLOAD], NOTHING, atol=1e-12)
    assert estimate.covariance is None


def test_the_rehearsal_is_the_unloaded_log_with_a_load_that_is_known(model: PayloadModel, x: np.ndarray):
    setting, unloaded = setting_of(model, x), swing(model, x, np.zeros(10), seed=1)
    for real, trial in zip(unloaded[::100], with_trial_load(setting, unloaded)[::100], strict=True):
        loaded = x.copy()
        loaded[PAYLOAD] = TRIAL_LOAD
        added = model.linearise(real, loaded)[0].copy()
        np.testing.assert_allclose(trial.tau - real.tau, added - model.linearise(real, x)[0], atol=1e-12)


def test_the_setting_that_finds_the_trial_load_soonest_is_taken(model: PayloadModel, x: np.ndarray):
    setting, unloaded = setting_of(model, x), swing(model, x, np.zeros(10), seed=1)[:300]
    shares: list[float] = []
    chosen = rehearsed("nlms", setting, unloaded, shares.append)
    assert chosen in CANDIDATES["nlms"]
    assert len(shares) == len(CANDIDATES["nlms"])
    rehearsal = with_trial_load(setting, unloaded)
    results = {tuning["share"]: found_after(built("nlms", setting, tuning), rehearsal) for tuning in CANDIDATES["nlms"]}
    assert results[chosen["share"]] == min(results.values())


def test_a_method_with_nothing_to_tune_rehearses_nothing(model: PayloadModel, x: np.ndarray):
    unloaded = swing(model, x, np.zeros(10), seed=1)[:10]
    assert dict(rehearsed("recursive", setting_of(model, x), unloaded, lambda _share: None)) == {}
