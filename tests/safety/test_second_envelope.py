"""Two independent implementations decide the same about the output, for any machine and any control.

A million ticks: `python benchmarks/second_guard.py`.
"""

import numpy as np
import pytest

from .random_machines import Comparison, compare, draw_history, draw_machines, first_envelopes, first_guards, second


def compared(seed: int, machines: int, joints: int, ticks: int, has_guard: bool) -> Comparison:
    rng = np.random.default_rng(seed)
    m = draw_machines(rng, machines, joints)
    with np.errstate(all="ignore"):
        history = draw_history(rng, m, ticks)
        first = (first_guards if has_guard else first_envelopes)(m, history)
    return compare(first, second(m, history, has_guard, first))


@pytest.mark.parametrize("joints", [2, 4])
@pytest.mark.parametrize("has_guard", [True, False])
def test_both_implementations_have_the_same_outputs_and_states(joints: int, has_guard: bool):
    result = compared(joints, 8, joints, 250, has_guard)
    assert result.first == []
    assert result.ticks == 2000


def test_the_comparison_finds_a_wrong_implementation():
    rng = np.random.default_rng(3)
    m = draw_machines(rng, 6, 2)
    with np.errstate(all="ignore"):
        history = draw_history(rng, m, 100)
        first = first_guards(m, history)
    m.rate = m.rate * 1.01
    assert compare(first, second(m, history, True, first)).disagreements > 0
