"""An arm is identified from arrays as it is online, and an estimate survives its file."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import exograv
from exograv.identification.core.sample_filter import SampleFilter

DATA = Path("examples/data")
PERSON = exograv.Person(1.708, 80.5, "male", {"upper_arm": 0.2536, "forearm": 0.2692, "hand": 0.177})
DT = 0.005


@pytest.fixture(scope="module")
def rig():
    return exograv.load_rig("recupera_like")


@pytest.fixture(scope="module")
def arrays(rig) -> tuple[np.ndarray, np.ndarray]:
    table = pd.read_csv(DATA / "relaxed_arm.csv")
    q, tau = (table[[f"{name}_{joint}_{unit}" for joint in rig.joints]].to_numpy()
              for name, unit in (("q", "rad"), ("tau", "Nm")))  # fmt: skip
    return q, tau


@pytest.fixture(scope="module")
def calibration(rig):
    return exograv.load_calibration(DATA / "calibration.toml", rig)


@pytest.fixture(scope="module")
def estimate(rig, arrays, calibration) -> exograv.Estimate:
    q, tau = arrays
    return exograv.identify(rig, PERSON, q, tau, DT, calibration=calibration)


def test_twenty_seconds_of_motion_leave_less_than_half_of_what_the_table_leaves(rig, estimate):
    twin = exograv.Twin(rig, level=2, seed=1003)
    table = exograv.identify(rig, PERSON, *_short(), DT, method="anthropometric")
    assert (twin.left_over_true(estimate) < 0.5 * twin.left_over_true(table))[:2].all()


def _short() -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((500, 4)), np.zeros((500, 4))


def test_the_file_of_an_estimate_gives_the_same_arm(rig, calibration, estimate, tmp_path):
    again = exograv.Estimate.load(estimate.save(tmp_path / "p.toml", "P-07"), rig, calibration)
    kept = ~estimate.to_pandas().index.str.contains("rotor|coulomb|viscous")
    np.testing.assert_allclose(again.x[kept], estimate.x[kept], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(again.left_over(), estimate.left_over(), rtol=1e-3)


def test_a_measured_velocity_of_the_same_motion_gives_a_filtered_sample_like_the_position():
    dt = 0.001
    t = np.arange(0.0, 4.0, dt)
    q, v = np.sin(3.0 * t)[:, None], 3.0 * np.cos(3.0 * t)[:, None]
    by_position, by_velocity = SampleFilter(1, dt), SampleFilter(1, dt)
    for k in range(len(t)):
        by_position.update(q[k], q[k])
        by_velocity.update(q[k], q[k], None, v[k])
    one, other = by_position.sample, by_velocity.sample
    np.testing.assert_allclose([one.q, one.v, one.a], [other.q, other.v, other.a], atol=0.1)  # of 9 rad/s²


def test_a_measured_velocity_is_used(rig, arrays, calibration, estimate):
    q, tau = arrays
    still = exograv.identify(rig, PERSON, q, tau, DT, v=np.zeros_like(q), calibration=calibration)
    damping = estimate.to_pandas().index.get_loc("rotation.damping")
    assert still.sd[damping] > 1.2 * estimate.sd[damping]  # motion at rest contains no information about damping


def test_a_measured_velocity_that_is_the_derivative_of_the_position_gives_the_same_arm(
    rig, arrays, calibration, estimate
):
    q, tau = arrays
    with_v = exograv.identify(rig, PERSON, q, tau, DT, v=np.gradient(q, DT, axis=0), calibration=calibration)
    assert (np.abs(with_v.x - estimate.x) < 0.5 * estimate.sd + 1e-9).all()


def test_a_change_of_one_array_is_seen(rig, arrays, calibration, estimate):
    q, tau = arrays
    heavier = exograv.identify(rig, PERSON, q, 1.2 * tau, DT, calibration=calibration)
    mass = estimate.to_pandas().index.get_loc("forearm.mz")
    assert heavier.x[mass] < estimate.x[mass] - 0.03


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda q, tau: (q[:, :3], tau, DT), r"q has shape \(\d+, 3\); it must be \(sample, 4\)"),
        (lambda q, tau: (q, tau[:-1], DT), "give arrays of one length"),
        (lambda q, tau: (np.where(q == q[7, 1], np.nan, q), tau, DT), "must be finite"),
        (lambda q, tau: (q, tau, 5.0), "dt is 5.0 s; allowed: 0.0002 to 0.01 s"),
        (lambda q, tau: (q[:100], tau[:100], DT), "at least 2 s of motion"),
    ],
)
def test_wrong_arrays_are_refused_with_what_is_allowed(rig, arrays, change, words):
    q, tau, dt = change(*arrays)
    with pytest.raises(exograv.ExogravError, match=words):
        exograv.identify(rig, PERSON, q, tau, dt)


def test_a_calibration_of_another_machine_is_refused():
    with pytest.raises(exograv.ExogravError, match="another machine"):
        exograv.load_calibration(DATA / "calibration.toml", exograv.load_rig("recupera_like_qdd"))


@pytest.mark.long
def test_signals_of_muscles_that_stay_silent_change_nothing(rig, arrays, calibration, estimate):
    q, tau = arrays
    found = exograv.identify(rig, PERSON, q, tau, DT, muscles=np.zeros((len(q), 3)), calibration=calibration)
    np.testing.assert_allclose(found.x, estimate.x, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("muscles", "method", "text"),
    [
        (np.zeros(500), "recursive", "must be \\(sample, channel\\)"),
        (np.full((500, 2), np.nan), "recursive", "muscles\\[0, 0\\] is nan"),
        (np.full((500, 2), 40.0), "recursive", "not in microvolts"),
        (np.zeros((400, 2)), "recursive", "muscles has 400 samples"),
        (np.zeros((500, 2)), "rls", "has no use for them"),
    ],
)
def test_signals_of_muscles_that_cannot_be_are_refused_with_what_is_allowed(rig, muscles, method, text):
    with pytest.raises(exograv.ExogravError, match=text):
        exograv.identify(rig, PERSON, *_short(), DT, muscles=muscles, method=method)
