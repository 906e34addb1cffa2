"""An implementation is timed only if it agrees with the reference, and every installed one agrees."""

from dataclasses import replace

import numpy as np
import pytest

from peers import plan
from peers.agreement import TOLERANCE, Reference
from peers.opponents import OPPONENTS, Native, VirtualMachine
from peers.tasks.arm_tasks import stacked
from peers.tasks.interface import BatchShape, Call, Missing

QUICK_TO_BUILD = ("rnea_4", "rnea_7", "regressor_7", "torque_gradient_4", "tick_aligned_4", "tick_aligned_7")
SHAPES = [BatchShape(size, dtype) for size in (1, 13, 100) for dtype in ("float64", "float32")]
NOT_JAX = [opponent for opponent in OPPONENTS if "JAX" not in opponent.name and opponent.name != "frax"]


@pytest.mark.parametrize("opponent", NOT_JAX, ids=lambda opponent: opponent.name)
@pytest.mark.parametrize("name", QUICK_TO_BUILD)
def test_whoever_can_do_it_computes_the_reference(name: str, opponent):
    task = plan.task(name)
    try:
        call = opponent.build(task, None)
    except Missing as missing:
        pytest.skip(str(missing))
    assert Reference(task).error_of(call, None) <= TOLERANCE["float64"]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.suffix)
@pytest.mark.parametrize("opponent", NOT_JAX, ids=lambda opponent: opponent.name)
def test_batches_of_any_size_compute_the_reference(opponent, shape: BatchShape):
    task = plan.task("torque_gradient_4")
    try:
        call = opponent.build(task, shape)
    except Missing as missing:
        pytest.skip(str(missing))
    assert Reference(task).error_of(call, shape) <= TOLERANCE[shape.dtype]


@pytest.mark.parametrize("opponent", NOT_JAX, ids=lambda opponent: opponent.name)
def test_no_opponent_flushes_subnormal_numbers_to_zero_in_the_whole_process(opponent):
    try:
        opponent.build(plan.task("rnea_4"), BatchShape(13, "float64"))
    except Missing as missing:
        pytest.skip(str(missing))
    assert np.float64(1e-310) * np.float64(0.5) > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("opponent", OPPONENTS, ids=lambda opponent: opponent.name)
@pytest.mark.parametrize("name", ["rnea_7", "torque_gradient_7", "tick_aligned_7"])
def test_every_installed_opponent_computes_the_reference(name: str, opponent):
    task = plan.task(name)
    try:
        call = opponent.build(task, None)
    except Missing as missing:
        pytest.skip(str(missing))
    assert Reference(task).error_of(call, None) <= TOLERANCE["float64"]


def test_the_general_tick_agrees_natively_with_four_and_seven_joints():
    for name in ("tick_general_4", "tick_general_7"):
        task = plan.task(name)
        assert Reference(task).error_of(Native().build(task, None), None) <= TOLERANCE["float64"]


@pytest.mark.parametrize("spoilt", [1e-6, np.nan, np.inf])
def test_an_implementation_that_is_a_little_off_is_refused(spoilt: float):
    task = plan.task("rnea_4")
    right = VirtualMachine().build(task, None)

    def read() -> dict[str, np.ndarray]:
        return {name: values * (1.0 + spoilt) for name, values in right.read().items()}

    with pytest.raises(Missing, match="disagrees with the reference"):
        Reference(task).error_of(replace(right, read=read), None)


@pytest.mark.parametrize("place", [0, 99])
def test_a_batch_that_is_wrong_at_one_end_is_refused(place: int):
    task, shape = plan.task("rnea_4"), BatchShape(100, "float64")
    right = Native().build(task, shape)

    def read() -> dict[str, np.ndarray]:
        tau = right.read()["tau"].copy()
        tau[0, place] += 1e-3
        return {"tau": tau}

    with pytest.raises(Missing, match="disagrees"):
        Reference(task).error_of(Call(right.load, right.run, read, right.keep), shape)


def test_states_of_a_batch_are_the_tasks_states_side_by_side():
    task = plan.task("torque_gradient_4")
    state = stacked(task, 70, 3)
    assert state["q"].shape == (4, 70)
    np.testing.assert_array_equal(state["q"][:, 0], task.states[3]["q"])
    np.testing.assert_array_equal(state["q"][:, 64], task.states[3]["q"])
    np.testing.assert_array_equal(state["x"], task.states[0]["x"])


def test_the_same_seed_draws_the_same_states():
    first, second = plan.task.__wrapped__("tick_aligned_4"), plan.task.__wrapped__("tick_aligned_4")
    for one, other in zip(first.states, second.states, strict=True):
        for name in one:
            np.testing.assert_array_equal(one[name], other[name])
