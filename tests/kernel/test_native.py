"""Native code gives the bits of the virtual machine: for each operation, zero, infinity and NaN, at any length."""

import ctypes
import gc
import sys
from collections.abc import Iterator

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv import kernel
from exograv.errors import KernelError
from exograv.kernel import emission, native, virtual_machine
from exograv.kernel.operations import LIBRARY_OF_TWO, OPERATION_NAMES, PLACED, TRIGONOMETRIC, known_operations
from exograv.kernel.program import Instruction

OF_TWO = {
    ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV, ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR,
    ca.OP_IF_ELSE_ZERO, ca.OP_FMIN, ca.OP_FMAX, ca.OP_COPYSIGN, *LIBRARY_OF_TWO,
}  # fmt: skip
EXACT = sorted(known_operations() - set(PLACED) - set(TRIGONOMETRIC))
"""Operations that are compared bitwise; sine and cosine are our own, and have tests of their last bit."""

STRANGE = [0.0, -0.0, 1.0, -1.0, 0.5, 2.0, np.inf, -np.inf, np.nan, 1e308, -1e308, 5e-324, 1e-308, 1e16, 3.0]
N_INPUTS = 4

numbers = st.one_of(st.sampled_from(STRANGE), st.floats())
steps = st.tuples(st.sampled_from(EXACT), st.integers(0, 10**6), st.integers(0, 10**6))


@pytest.fixture(autouse=True, scope="module")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Use a cache of this module's own, because random programs would crowd out useful ones."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


def expression(operation: int, a: ca.SX, b: ca.SX) -> ca.SX:
    return ca.SX.binary(operation, a, b) if operation in OF_TWO else ca.SX.unary(operation, a)


def program_of(chain: list[tuple[int, int, int]]) -> ca.Function:
    """Return a program in which each step works on two of the values before it; all of them are results."""
    x = ca.SX.sym("x", N_INPUTS)
    values = [*ca.vertsplit(x), ca.SX(1.5)]
    for operation, first, second in chain:
        values.append(expression(operation, values[first % len(values)], values[second % len(values)]))
    return ca.Function("random", [x], [ca.vertcat(*values[N_INPUTS + 1 :])])


def assert_same_bits(actual: np.ndarray, desired: np.ndarray):
    np.testing.assert_array_equal(actual, desired)
    is_number = ~np.isnan(desired)
    np.testing.assert_array_equal(np.signbit(actual[is_number]), np.signbit(desired[is_number]))


@pytest.mark.parametrize("operation", EXACT, ids=lambda code: OPERATION_NAMES[code])
def test_an_operation_has_the_same_bits_on_all_strange_numbers(operation: int):
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("one", [a, b], [expression(operation, a, b)])
    fast, slow = native.compile(function), virtual_machine.compile(function)
    for x in STRANGE:
        for y in STRANGE:
            assert_same_bits(fast.of(x, y)[0], slow.of(x, y)[0])


@settings(max_examples=60)
@given(chain=st.lists(steps, min_size=1, max_size=60), x=st.lists(numbers, min_size=N_INPUTS, max_size=N_INPUTS))
def test_random_programs_have_the_same_bits(chain: list[tuple[int, int, int]], x: list[float]):
    function = program_of(chain)
    assert_same_bits(native.compile(function).of(x)[0], virtual_machine.compile(function).of(x)[0])


@pytest.mark.parametrize("lanes", [1, 8])
def test_products_and_sums_are_rounded_one_by_one(lanes: int):
    a, b, c = (ca.SX.sym(name) for name in "abc")
    function = ca.Function("rounded", [a, b, c], [a * b - c])
    x = 1.0 + 2.0**-30
    values = np.array([[[x] * 9], [[x] * 9], [[x * x] * 9]])
    # Fused into one rounding, the sum would be the rounding error of the product, 2⁻⁶⁰.
    got = native.compile(function).of(*values[:, 0, 0]) if lanes == 1 else kernel.compile(function, lanes=8).of(*values)
    np.testing.assert_array_equal(got[0], 0.0)


def test_sums_keep_their_order():
    a, b, c = (ca.SX.sym(name) for name in "abc")
    function = ca.Function("ordered", [a, b, c], [(a + b) - c])
    np.testing.assert_array_equal(native.compile(function).of(1e16, 1.0, 1e16)[0], 0.0)


@pytest.mark.parametrize("length", [1, 2, 3, 7, 50])
def test_values_survive_from_piece_to_piece(length: int, monkeypatch: pytest.MonkeyPatch):
    rng = np.random.default_rng(1000)
    codes = [ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_SIN, ca.OP_COS, ca.OP_TANH, ca.OP_FMAX]
    chain = [(codes[rng.integers(len(codes))], *rng.integers(0, 10**6, 2).tolist()) for _ in range(300)]
    function, x = program_of(chain), rng.normal(size=N_INPUTS)
    whole = native.compile(function).of(x)[0]
    monkeypatch.setattr(emission, "PIECE", length)
    monkeypatch.setattr(native.cache, "read", lambda _name: None)
    monkeypatch.setattr(native.cache, "write", lambda _name, _code: None)
    assert_same_bits(native.compile(function).of(x)[0], whole)


def test_the_same_program_with_other_constants_is_compiled_once():
    x = ca.SX.sym("x")
    codes = []
    for factor in (2.5, 3.5):
        compiled = native.compile(ca.Function("scaled", [x], [factor * ca.sin(x + 0.25)]))
        assert compiled.of(0.5)[0][0] == pytest.approx(factor * np.sin(0.75), rel=1e-15)
        codes.append(compiled)
    assert codes[1].from_cache


def test_an_operation_that_cannot_be_compiled_is_named():
    x = ca.SX.sym("x")
    with pytest.raises(KernelError, match=r"The operation ERFINV cannot be compiled\. Known operations: .*TANH"):
        native.compile(ca.Function("odd", [x], [ca.erfinv(x)]))
    with pytest.raises(KernelError, match="PRINTME"):
        native.compile(ca.Function("odd", [x], [x.printme(1)]))


def test_a_solver_inside_is_named_as_a_call():
    x = ca.MX.sym("x")
    solve = ca.rootfinder("solve", "newton", ca.Function("residual", [x], [x**2 - 2]))
    with pytest.raises(KernelError, match="The operation CALL cannot be compiled"):
        native.compile(ca.Function("root", [x], [solve(x)]))


def test_a_function_that_is_called_inside_is_named_too():
    x = ca.SX.sym("x")
    inside = ca.Function("inside", [x], [ca.sin(x)], {"never_inline": True})
    with pytest.raises(KernelError, match="The operation CALL cannot be compiled"):
        native.compile(ca.Function("outside", [x], [inside(x) + 1]))


def test_values_that_no_stack_can_hold_are_refused(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(emission, "WORK_BYTES_MAX", 100)
    monkeypatch.setattr(emission, "PIECE", 5)
    x = ca.SX.sym("x", 40)
    with pytest.raises(KernelError, match=r"many keeps \d+ values at once, \d+ bytes on 1 lanes; 100 are allowed"):
        native.compile(ca.Function("many", [x], [ca.sumsqr(ca.sin(x)) * ca.sin(x) * ca.cos(x[::-1])]))


def test_a_compiled_kernel_keeps_no_instructions_and_can_still_be_copied():
    x = ca.SX.sym("x", 3)
    one = native.compile(ca.Function("kept", [x], [ca.sin(x) + 2.0], ["x"], ["y"]))
    assert not [each for each in gc.get_objects() if type(each) is Instruction]
    other = one.again()
    other.inputs["x"][:] = 0.5
    other.evaluate()
    np.testing.assert_allclose(other.outputs["y"], np.sin(0.5) + 2.0)


def test_a_thousand_calls_leave_no_reference_behind():
    x = ca.SX.sym("x")
    compiled = kernel.compile(ca.Function("next", [x], [x + 1]))
    before = sys.getrefcount(None)
    for _ in range(1000):
        compiled.evaluate()
    assert abs(sys.getrefcount(None) - before) < 100


def test_a_caller_in_c_gets_the_bits_of_a_caller_in_python():
    x = ca.SX.sym("x", 3)
    made = native.compile(ca.Function("sums", [x], [x + 0.1, ca.sin(x)], ["x"], ["next", "sine"]), carry={"x": "next"})
    assert made.native is not None
    other = made.again()
    assert other.native is not None
    call = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(other.native.function)
    for _ in range(3):
        made.evaluate()
        call(other.native.memory)
    np.testing.assert_array_equal(other.outputs["sine"], made.outputs["sine"])
    np.testing.assert_array_equal(other.inputs["x"], made.inputs["x"])
    assert virtual_machine.compile(ca.Function("one", [x], [x], ["x"], ["y"])).native is None
