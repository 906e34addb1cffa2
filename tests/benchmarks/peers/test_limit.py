"""Operations and dependent chains are counted correctly, and no program is faster than its limit."""

import casadi as ca
import pytest

from exograv.kernel.program import straight_line
from peers.limit import critical_path_ns, operation_counts, throughput_ns
from peers.peaks import Peaks

KINDS = ("add", "mul", "div", "sqrt", "sincos", "tanh", "exp", "pow", "atan2")
PEAKS = Peaks(
    call_ns=30.0,
    latency_ns=dict.fromkeys(KINDS, 1.0) | {"div": 10.0},
    single_ns={"muladd": 0.5, "div": 4.0, "sqrt": 5.0},
    batch_ns={"muladd": 0.05, "div": 0.4, "sqrt": 0.5},
)


def program(*expressions: ca.SX, of: ca.SX):
    return straight_line(ca.Function("f", [of], list(expressions)))


def test_sine_and_cosine_of_one_angle_are_one():
    x = ca.SX.sym("x")
    assert operation_counts(program(ca.sin(x) * ca.cos(x), of=x)) == {"sincos": 1, "mul": 1}


def test_the_longest_chain_counts_and_not_the_number_of_operations():
    x = ca.SX.sym("x", 4)
    balanced = program((x[0] + x[1]) + (x[2] + x[3]), of=x)
    in_a_row = program(((x[0] + x[1]) + x[2]) + x[3], of=x)
    assert critical_path_ns(balanced, PEAKS) == 2.0
    assert critical_path_ns(in_a_row, PEAKS) == 3.0


def test_divisions_go_on_beside_additions():
    x = ca.SX.sym("x", 3)
    counts = operation_counts(program(x[0] / x[1], x[0] + x[1], x[1] + x[2], of=x))
    assert throughput_ns(counts, PEAKS.single_ns) == pytest.approx(4.0)


def test_the_limit_of_a_batch_is_below_that_of_a_single_call():
    x = ca.SX.sym("x", 8)
    counts = operation_counts(program(ca.sumsqr(x), of=x))
    assert throughput_ns(counts, PEAKS.batch_ns) < throughput_ns(counts, PEAKS.single_ns)
