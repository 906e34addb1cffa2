"""A kernel computes its function on fixed memory, hides no NaN, and refuses memory that does not fit."""

import gc

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.kernel import native, virtual_machine


@pytest.fixture(autouse=True, params=["native", "virtual machine"])
def engine(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Run each test with both engines."""
    chosen = {"native": native, "virtual machine": virtual_machine}[request.param]

    def compile_by_it(function: ca.Function, bindings=None, *, carry=None) -> kernel.Kernel:
        return chosen.compile(function, bindings, carry)

    monkeypatch.setattr(kernel, "compile", compile_by_it)
    return request.param


def product_function() -> ca.Function:
    A, x = ca.SX.sym("A", 2, 3), ca.SX.sym("x", 3)
    return ca.Function("product", [A, x], [A @ x, 2 * A], ["A", "x"], ["y", "twice"])


def test_a_kernel_computes_its_function():
    A, x = np.arange(6.0).reshape(2, 3), np.array([1.0, -2.0, 0.5])
    y, twice = kernel.compile(product_function()).of(A, x)
    np.testing.assert_array_equal(y, A @ x)
    np.testing.assert_array_equal(twice, 2 * A)


def test_a_call_reads_the_inputs_and_writes_to_the_same_outputs():
    compiled = kernel.compile(product_function())
    y, before = compiled.outputs["y"], {name: array.ctypes.data for name, array in compiled.outputs.items()}
    for scale in (1.0, 2.0):
        compiled.inputs["A"][...] = scale * np.ones((2, 3))
        compiled.inputs["x"][:] = 1.0
        outputs = compiled()
        assert outputs["y"] is y
        np.testing.assert_array_equal(y, 3.0 * scale)
    assert before == {name: array.ctypes.data for name, array in compiled.outputs.items()}


def test_bound_memory_is_used_without_a_copy():
    A, x, y = np.ones((2, 3), order="F"), np.array([1.0, 2.0, 3.0]), np.empty(2)
    compiled = kernel.compile(product_function(), {"A": A, "x": x, "y": y})
    assert compiled.inputs["x"] is x
    assert compiled.outputs["y"] is y
    compiled()
    np.testing.assert_array_equal(y, 6.0)
    x[0] = 101.0
    compiled()
    np.testing.assert_array_equal(y, 106.0)


def test_two_kernels_can_share_memory():
    x = ca.SX.sym("x", 2)
    middle = np.zeros(2)
    first = kernel.compile(ca.Function("first", [x], [x + 1], ["x"], ["y"]), {"y": middle})
    second = kernel.compile(ca.Function("second", [x], [3 * x], ["x"], ["y"]), {"x": middle})
    first.inputs["x"][:] = [1.0, 2.0]
    first()
    np.testing.assert_array_equal(second()["y"], [6.0, 9.0])


def test_a_copy_of_the_outputs_survives_the_next_call():
    compiled = kernel.compile(product_function())
    first, _ = compiled.of(np.ones((2, 3)), np.ones(3))
    compiled.of(np.zeros((2, 3)), np.zeros(3))
    np.testing.assert_array_equal(first, 3.0)


def test_structural_zeros_are_in_their_places():
    x = ca.SX.sym("x", 2)
    sparse = ca.diag(x)
    assert sparse.nnz() == 2
    (D,) = kernel.compile(ca.Function("sparse", [x], [sparse])).of([5.0, 7.0])
    np.testing.assert_array_equal(D, np.diag([5.0, 7.0]))


def test_a_result_that_is_always_zero_is_overwritten_with_zero():
    x = ca.SX.sym("x", 2)
    compiled = kernel.compile(ca.Function("nothing", [x], [ca.SX(2, 2)], ["x"], ["zero"]))
    compiled.outputs["zero"][...] = 9.0
    compiled()
    np.testing.assert_array_equal(compiled.outputs["zero"], 0.0)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_non_finite_values_pass_through(value: float):
    y, twice = kernel.compile(product_function()).of(np.ones((2, 3)), [1.0, value, 1.0])
    np.testing.assert_array_equal(y, value)
    np.testing.assert_array_equal(twice, 2.0)


def test_a_matrix_keeps_rows_and_columns_apart():
    A = np.arange(6.0).reshape(2, 3)
    assert not np.array_equal(A.ravel(), A.ravel(order="F"))
    compiled = kernel.compile(product_function())
    compiled.inputs["A"][...] = A
    np.testing.assert_array_equal(compiled()["twice"], 2 * A)


@pytest.mark.parametrize(
    ("memory", "shown"),
    [
        (np.zeros(2), "x needs 3 contiguous writable float64"),
        (np.zeros(3, dtype=np.float32), "float32"),
        (np.zeros(6)[::2], "x needs 3 contiguous writable float64"),
    ],
    ids=["too short", "single precision", "with gaps"],
)
def test_memory_that_does_not_fit_is_refused(memory: np.ndarray, shown: str):
    with pytest.raises(ValueError, match=shown):
        kernel.compile(product_function(), {"x": memory})


def test_memory_that_must_not_be_written_is_refused_for_results():
    y = np.zeros(2)
    y.flags.writeable = False
    with pytest.raises(ValueError, match="writable"):
        kernel.compile(product_function(), {"y": y})


def test_a_matrix_in_c_order_is_refused_because_its_entries_would_be_permuted():
    with pytest.raises(ValueError, match=r"A is a matrix \(2, 3\) in C order; bind \(2, 3\) in Fortran"):
        kernel.compile(product_function(), {"A": np.zeros((2, 3))})


@pytest.mark.parametrize(
    "memory", [np.zeros((2, 2)), np.zeros((1, 4)), np.zeros((1, 4, 1))], ids=["square in C order", "a row", "deeper"]
)
def test_a_shape_that_can_be_read_in_two_ways_is_refused(memory: np.ndarray):
    A = ca.SX.sym("A", 2, 2)
    with pytest.raises(ValueError, match="order; bind"):
        kernel.compile(ca.Function("turned", [A], [A.T], ["A"], ["B"]), {"A": memory})


def test_a_result_on_an_arguments_memory_is_refused():
    memory = np.zeros(4)
    x = ca.SX.sym("x", 3)
    function = ca.Function("turn", [x], [ca.vertcat(x[1], x[2], x[0])], ["x"], ["y"])
    with pytest.raises(ValueError, match="y of turn lies on x; carry it"):
        kernel.compile(function, {"x": memory[:3], "y": memory[1:]})


def test_a_carried_argument_has_the_layout_of_its_binding():
    A, B = ca.SX.sym("A", 2, 3), np.arange(6.0).reshape(3, 2)
    bound = B.copy()
    function = ca.Function("doubled", [A], [2 * A], ["A"], ["twice"])
    kernel.compile(function, {"A": bound}, carry={"A": "twice"}).evaluate()
    np.testing.assert_array_equal(bound, 2 * B)


def test_a_transposed_matrix_in_c_order_is_taken_as_it_is():
    A = np.arange(6.0).reshape(2, 3)
    compiled = kernel.compile(product_function(), {"A": np.ascontiguousarray(A.T)})
    compiled.inputs["x"][:] = [1.0, -2.0, 0.5]
    np.testing.assert_array_equal(compiled()["y"], A @ [1.0, -2.0, 0.5])


def test_a_binding_to_an_unknown_name_is_refused():
    with pytest.raises(ValueError, match="product has no argument or result z"):
        kernel.compile(product_function(), {"z": np.zeros(3)})


def test_a_wrong_number_of_values_is_refused_with_the_names():
    with pytest.raises(TypeError, match="product takes A, x; 1 values were given"):
        kernel.compile(product_function()).of(np.ones((2, 3)))


def test_a_kernel_outlives_the_function_it_came_from():
    function = product_function()
    compiled = kernel.compile(function)
    del function
    np.testing.assert_array_equal(compiled.of(np.ones((2, 3)), np.ones(3))[0], 3.0)


def test_the_callable_outlives_its_kernel():
    compiled = kernel.compile(product_function())
    compiled.inputs["A"][...] = compiled.inputs["x"][...] = 1.0
    evaluate, outputs = compiled.evaluate, compiled.outputs
    del compiled
    gc.collect()
    evaluate()
    np.testing.assert_array_equal(outputs["y"], 3.0)


def test_a_kernel_states_the_length_of_its_program_and_its_engine(engine: str):
    compiled = kernel.compile(product_function())
    assert compiled.engine == engine
    assert compiled.n_instructions == 33
    assert (compiled.code_bytes > 0) == (engine == "native")
    assert 0.0 < compiled.build_s < 60.0


def counting_function() -> ca.Function:
    n, step = ca.SX.sym("n", 2), ca.SX.sym("step", 2)
    return ca.Function("counting", [n, step], [n + step, 2 * step], ["n", "step"], ["next", "twice"])


def test_a_carried_value_is_the_argument_of_the_next_call():
    compiled = kernel.compile(counting_function(), carry={"n": "next"})
    compiled.inputs["step"][:] = [1.0, 2.0]
    for calls in (1.0, 2.0, 3.0):
        np.testing.assert_array_equal(compiled()["next"], [calls, 2 * calls])


def test_a_whole_matrix_is_carried():
    A, B = ca.SX.sym("A", 3, 2), np.arange(6.0).reshape(3, 2)
    compiled = kernel.compile(ca.Function("doubled", [A], [2 * A], ["A"], ["twice"]), carry={"A": "twice"})
    compiled.inputs["A"][...] = B
    compiled()
    np.testing.assert_array_equal(compiled()["twice"], 4 * B)
    np.testing.assert_array_equal(compiled.inputs["A"], 4 * B)


def test_an_argument_can_be_carried_to_another():
    compiled = kernel.compile(counting_function(), carry={"n": "step"})
    compiled.inputs["step"][:] = [5.0, 6.0]
    compiled()
    np.testing.assert_array_equal(compiled.inputs["n"], [5.0, 6.0])


@pytest.mark.parametrize("carry", [{"m": "next"}, {"n": "last"}, {"twice": "next"}])
def test_an_invalid_carry_is_refused_with_the_names(carry: dict[str, str]):
    with pytest.raises(ValueError, match="it has n, step, next, twice"):
        kernel.compile(counting_function(), carry=carry)


def test_carrying_to_another_shape_is_refused():
    x, y = ca.SX.sym("x", 2), ca.SX.sym("y", 3)
    with pytest.raises(ValueError, match=r"x \(2, 1\) does not fit y \(3, 1\)"):
        kernel.compile(ca.Function("odd", [x, y], [x], ["x", "y"], ["z"]), carry={"y": "x"})


def test_matrix_expressions_are_written_out():
    x = ca.MX.sym("x", 2)
    (y,) = kernel.compile(ca.Function("norm", [x], [ca.norm_2(x)])).of([3.0, 4.0])
    assert y[0] == 5.0


def test_another_kernel_of_the_same_program_has_memory_of_its_own():
    first = kernel.compile(counting_function(), carry={"n": "next"})
    second = first.again()
    first.inputs["step"][:], second.inputs["step"][:] = 1.0, 10.0
    for _ in range(2):
        first.evaluate()
        second.evaluate()
    np.testing.assert_array_equal(first.outputs["next"], 2.0)
    np.testing.assert_array_equal(second.outputs["next"], 20.0)
