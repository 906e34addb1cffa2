"""A batch gives each state the bits of a single call, for any size, number of lanes and neighbours."""

import gc

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.kernel import batch, compilation

SINGLE_PRECISION = 2e-6
"""Relative tolerance: a dozen roundings of 6e-8."""


def small_function() -> ca.Function:
    A, x, s = ca.SX.sym("A", 2, 3), ca.SX.sym("x", 3), ca.SX.sym("s")
    y = A @ ca.sin(x) * s + 0.25
    results = [y, ca.tanh(A), ca.fmax(s, x[0]) + ca.atan2(x[1], 2.0)]
    return ca.Function("small", [A, x, s], results, ["A", "x", "s"], ["y", "B", "m"])


def states(size: int, seed: int = 1000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(2, 3, size)), rng.normal(size=(3, size)), rng.normal(size=(1, size))


def one_by_one(A: np.ndarray, x: np.ndarray, s: np.ndarray) -> list[np.ndarray]:
    single = kernel.compile(small_function())
    each = [single.of(A[..., i], x[..., i], s[..., i]) for i in range(x.shape[-1])]
    return [np.stack([results[k] for results in each], axis=-1) for k in range(3)]


@pytest.mark.parametrize("lanes", [0, 2, 4, 8, 16])
@pytest.mark.parametrize("size", [1, 7, 8, 9, 100])
def test_a_batch_has_the_bits_of_single_states(lanes: int, size: int):
    values = states(size)
    for got, expected in zip(
        kernel.compile(small_function(), lanes=lanes).of(*values), one_by_one(*values), strict=True
    ):
        np.testing.assert_array_equal(got, expected)


def test_the_callable_outlives_its_batch():
    evaluate = kernel.compile(small_function(), lanes=8).bind(100_000).evaluate
    gc.collect()
    evaluate()


def test_a_shared_argument_is_the_same_for_every_state():
    A, x, s = states(50)
    compiled = kernel.compile(small_function(), lanes=4, shared=["A", "s"])
    got = compiled.of(A[..., 0], x, s[..., 0])
    bound = compiled.bind(50)
    assert [bound.inputs[name].shape for name in "Axs"] == [(2, 3), (3, 50), (1,)]
    same = np.repeat(A[..., :1], 50, axis=-1), x, np.repeat(s[:, :1], 50, axis=-1)
    for result, expected in zip(got, kernel.compile(small_function(), lanes=4).of(*same), strict=True):
        np.testing.assert_array_equal(result, expected)


def test_single_precision_is_right_within_its_rounding():
    values = states(64)
    compiled = kernel.compile(small_function(), lanes=0, dtype=np.float32)
    for got, expected in zip(compiled.of(*values), one_by_one(*values), strict=True):
        assert got.dtype == np.float32
        np.testing.assert_allclose(got, expected, rtol=SINGLE_PRECISION, atol=SINGLE_PRECISION)


def test_a_bad_state_stays_alone():
    A, x, s = states(64)
    expected = kernel.compile(small_function(), lanes=8).of(A, x, s)[0]
    x[1, 13] = np.nan
    got = kernel.compile(small_function(), lanes=8).of(A, x, s)[0]
    assert np.isnan(got[:, 13]).all()
    np.testing.assert_array_equal(np.delete(got, 13, axis=-1), np.delete(expected, 13, axis=-1))


def test_the_virtual_machine_stands_in_for_lanes(monkeypatch: pytest.MonkeyPatch):
    values = states(9)
    expected = kernel.compile(small_function(), lanes=0).of(*values)
    monkeypatch.setattr(compilation, "native_is_possible", lambda: False)
    compiled = kernel.compile(small_function(), lanes=0)
    assert compiled.engine == "virtual machine"
    for got, desired in zip(compiled.of(*values), expected, strict=True):
        # Sine and cosine of the C library may differ in the last bit.
        np.testing.assert_allclose(got, desired, rtol=1e-14, atol=1e-15)


def test_the_virtual_machine_shares_arguments_too(monkeypatch: pytest.MonkeyPatch):
    A, x, s = states(5)
    expected = kernel.compile(small_function(), lanes=0, shared=["A"]).of(A[..., 0], x, s)
    monkeypatch.setattr(compilation, "native_is_possible", lambda: False)
    for got, desired in zip(
        kernel.compile(small_function(), lanes=0, shared=["A"]).of(A[..., 0], x, s), expected, strict=True
    ):
        np.testing.assert_allclose(got, desired, rtol=1e-14, atol=1e-15)


def test_single_precision_has_twice_the_lanes():
    wide, single = (kernel.compile(small_function(), lanes=0, dtype=dtype) for dtype in (np.float64, np.float32))
    assert single.lanes == 2 * wide.lanes


def test_invalid_settings_of_a_batch_are_refused():
    with pytest.raises(ValueError, match="has 2, 4, 8, 16, 32 lanes, not 3"):
        kernel.compile(small_function(), lanes=3)
    with pytest.raises(ValueError, match="float64 or float32 elements, not int64"):
        kernel.compile(small_function(), lanes=4, dtype=np.int64)
    with pytest.raises(ValueError, match=r"shared is a list of names; write \[\"x\"\]"):
        kernel.compile(small_function(), lanes=4, shared="x")
    with pytest.raises(ValueError, match="are for batches"):
        kernel.compile(small_function(), shared=["x"])  # pyright: ignore[reportCallIssue] - this is refused
    with pytest.raises(ValueError, match="no argument z to share"):
        kernel.compile(small_function(), lanes=4, shared=["z"])
    compiled = kernel.compile(small_function(), lanes=4)
    with pytest.raises(ValueError, match="needs at least 1 state, not 0"):
        compiled.bind(0)
    with pytest.raises(TypeError, match="takes A, x, s; 1 values were given"):
        compiled.of(np.zeros((2, 3, 4)))
    with pytest.raises(ValueError, match="All arguments of small are shared"):
        kernel.compile(small_function(), lanes=4, shared=["A", "x", "s"]).of(np.zeros((2, 3)), np.zeros(3), np.zeros(1))


def test_rows_of_a_batch_lie_an_odd_number_of_blocks_apart():
    bound = kernel.compile(small_function(), lanes=8).bind(1024)
    blocks = bound.inputs["x"].strides[0] / (8 * 8)
    assert blocks % 2 == 1
    assert bound.inputs["x"].ctypes.data % batch.ALIGNMENT_BYTES == 0
