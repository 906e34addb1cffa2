"""A twin and a machine on drives run with the same lines; wrong arguments are refused before any motion."""

import numpy as np
import pytest

import exograv
from exograv.api.arm_in_machine import arm_in_machine
from exograv.identification.core.interface import Outcome
from exograv.procedures.identification.estimator_session import table_guess


@pytest.fixture(scope="module")
def rig():
    return exograv.load_rig("recupera_like")


def test_the_same_seed_gives_the_same_steps(rig):
    runs = []
    for _ in range(2):
        twin = exograv.Twin(rig, level=2, seed=5)
        carrying = exograv.Compensator(rig, twin.person).torque(twin.read().q)
        runs.append([twin.step(carrying).q for _ in range(50)])
    np.testing.assert_array_equal(*runs)


def test_a_reset_puts_the_wearer_back_to_the_start(rig):
    twin = exograv.Twin(rig, seed=5)
    start, t = twin.read().q.copy(), twin.t
    twin.step(np.zeros(4))
    assert twin.t == pytest.approx(t + twin.period_s)
    twin.reset()
    np.testing.assert_array_equal(twin.read().q, start)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda rig: exograv.Twin(rig, level=5), "level 0 to 4"),
        (lambda rig: exograv.Twin(rig, seed=-1), "seed 0 and above"),
        (lambda rig: exograv.Twin(exograv.load_rig("recupera_like_passive")), "motor"),
        (lambda rig: exograv.Twin(rig).step(np.zeros(3)), "4 finite torques"),
        (lambda rig: exograv.float_arm(exograv.Twin(rig), identify_s=5.0), "identify_s is 5.0; allowed: 10 to 600"),
        (lambda rig: exograv.float_arm(exograv.Twin(rig), gravity_level=1.8), "allowed: 0 to 1"),
        (exograv.Drives, "give the drives.toml"),
        (lambda rig: exograv.Drives(rig, "drives.toml"), "give the body data"),
    ],
)
def test_wrong_arguments_are_refused_with_what_is_allowed(rig, wrong, words):
    with pytest.raises(exograv.ExogravError, match=words):
        wrong(rig)


@pytest.mark.slow
def test_simulated_drives_in_another_process_float_an_arm_like_the_twin(rig, tmp_path):
    machine = exograv.Drives(rig, folder=tmp_path, simulate=True, level=1, seed=1001)
    machine.prepare()
    flight = exograv.float_arm(machine, identify_s=20.0, seconds=3.0, path=tmp_path / "flight.mcap")
    assert flight.left_over_true is not None
    assert (flight.left_over_true < 0.6).all()
    assert flight.recording().is_simulated


@pytest.mark.slow
def test_a_law_moves_the_floating_arm_and_one_that_returns_nan_is_stopped_by_the_guard(rig, tmp_path):
    twin = exograv.Twin(rig, level=1, seed=1001)
    first = exograv.float_arm(twin, identify_s=10.0, seconds=1.0, path=tmp_path / "first.mcap")
    assert first.drift_deg is not None
    flight = exograv.float_arm(
        twin, first.estimate, seconds=3.0, path=tmp_path / "law.mcap",
        law=lambda q, v, t: np.array([0.0, 0.0, 0.0, np.sin(2.0 * t)]),
    )  # fmt: skip
    ticks = flight.recording().ticks
    moved = np.ptp(ticks["q_measured"][ticks["phase"] == ticks["phase"].max()], axis=0)
    assert moved[3] > np.deg2rad(5.0) > np.deg2rad(first.drift_deg[3])
    with pytest.raises(exograv.ExogravError, match="not a number"):
        exograv.float_arm(twin, first.estimate, seconds=1.0, path=tmp_path / "nan.mcap", law=lambda q, v, t: q * np.nan)


def test_an_estimate_that_disagreed_with_its_check_is_not_floated(rig):
    twin = exograv.Twin(rig)
    assembly, machine = arm_in_machine(rig, twin.person, None)
    x = table_guess(assembly, machine)
    estimate = exograv.Estimate(twin.person, assembly, machine, x, None, Outcome.DISAGREES.value)
    with pytest.raises(exograv.ExogravError, match="disagreed with its check"):
        exograv.float_arm(twin, estimate)
