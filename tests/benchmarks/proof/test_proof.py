"""The proof is honest: the guard that ships passes, a guard with a wrong line is refuted by a run of that guard."""

# ruff: noqa: E402 - without z3 the file is skipped before it imports the prover

import ast
from collections.abc import Callable

import numpy as np
import pytest

z3 = pytest.importorskip("z3", reason="needs z3-solver: `make prove` installs it")

from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.safety.native import core
from proof.bridge import bridge_ends
from proof.execute import Run, UnknownPythonError
from proof.judge import Verdict, judged
from proof.properties import HOLDS, PROPERTIES, Property
from proof.source import CORE, Source
from proof.state import Record, State

pytestmark = pytest.mark.long  # `make prove` runs them too

EFFORT = 20_000_000
"""Steps of z3 for one claim about missed ticks."""

WRONG = {
    "a removed clamp": (
        "torque limits",
        "within(within(r[TAU + j], -bound, bound), last - step, last + step)",
        "within(r[TAU + j], last - step, last + step)",
    ),
    "a removed rate limit": (
        "torque limits",
        "within(within(r[TAU + j], -bound, bound), last - step, last + step)",
        "within(r[TAU + j], -bound, bound)",
    ),
    "a flipped comparison": (
        "torque limits",
        "return low if value < low else high",
        "return low if value > low else high",
    ),
    "a forgotten latch": ("stop", "if r[STOP] == 0.0:\n        r[STOP] = reason", "if True:\n        r[STOP] = reason"),
    "a negated test for NaN": ("first torque", "if math.isfinite(tau) else 0.0", "if not math.isfinite(tau) else 0.0"),
    "a ramp in one step": (
        "level",
        "math.copysign(r[LEVEL_STEP], r[LEVEL_WANTED] - r[LEVEL])",
        "r[LEVEL_WANTED] - r[LEVEL]",
    ),
    "a push without consent": ("level", "if r[CONSENT] == 0.0 and most(", "if r[CONSENT] < 0.0 and most("),
    "a push in a wall": ("level", "is_free and r[IN_WALL] == 0.0 and", "is_free and"),
    "a push that goes on in a stop": ("level", "not (is_free and r[IN_WALL]", "not (r[IN_WALL]"),
    "a descent that stands": ("duration of the descent", "r[SINCE_STOP] += r[DT]", "r[SINCE_STOP] += 0.0"),
    "a descent that rises": ("descent", "most(0.0, 1.0 - r[SINCE_STOP]", "most(0.0, 1.0 + r[SINCE_STOP]"),
    "a reset in the descent": ("reset", "r[SINCE_STOP] < r[DESCENT_S] or ", ""),
}
"""Property, text of the guard, and the wrong text that breaks the property."""


def guard(change: Callable[[str], str] = str) -> Source:
    return Source(ast.parse(change(CORE.read_text(encoding="utf-8"))))


def property_of(name: str) -> Property:
    return next(one for one in PROPERTIES if one.name == name)


def verdict_on(name: str, right: str = "", wrong: str = "") -> Verdict:
    def change(text: str) -> str:
        assert right in text
        return text.replace(right, wrong) if right else text

    return judged(guard(change), property_of(name))


@pytest.mark.parametrize("name", sorted({name for name, _, _ in WRONG.values()}))
def test_the_guard_that_ships_is_proved(name: str):
    verdict = verdict_on(name)
    assert verdict.is_good, verdict


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_guard_is_refuted_by_a_run_of_itself(what: str):
    verdict = verdict_on(*WRONG[what])
    assert verdict.is_refuted, verdict
    assert "→" in verdict.example


def test_a_bridge_that_does_not_count_its_ticks_is_not_proved():
    wrong = guard(lambda text: text.replace("ago < r[WINDOW]", "ago > r[WINDOW]").replace("ago < r[SECOND]", "False"))
    assert "undecided" in bridge_ends(wrong, EFFORT).values()


def test_python_that_the_prover_does_not_know_is_an_error_and_no_proof():
    source = guard(
        lambda text: text + '\n\ndef other(r: Record) -> None:\n    """Do it."""\n    r[TAU] = r[TAU] ** 2.0\n'
    )
    with pytest.raises(UnknownPythonError, match="is not known to the prover"):
        Run(source).call(State({}), "other", [Record("r")])


def test_every_function_that_the_package_calls_is_covered_by_a_property():
    package, functions = CORE.parents[2], guard().functions
    called = set[str]()
    for file in package.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            match node:
                case ast.Attribute(value=ast.Name(id="core"), attr=name) if name in functions:
                    called.add(name)
    # These write no torque, stop, descent or level: they read, or write what belongs to the person's bounds.
    reading = {"is_past_a_stop", "bounded", "carried", "look"}
    proved = {name for one in PROPERTIES if set(HOLDS) <= set(one.promises) for name in one.calls}
    assert called - reading <= proved


def test_a_new_guard_begins_with_the_claims_that_its_calls_keep():
    source = guard()
    envelope = Envelope(Limits(np.array([30.0, 20.0]), np.array([10.0, 4.0])), 1e-3, library=None)
    record = envelope.record.numbers
    for name in (*HOLDS, "setting_of_machine"):
        assert all(source.run[name](record, joint) for joint in range(2)), name


def test_a_guard_that_writes_a_setting_is_not_proved():
    verdict = verdict_on("end of a stop", "r[STOP] = r[SINCE_STOP] = ", "r[RATE] = r[STOP] = r[SINCE_STOP] = ")
    assert not verdict.is_good


def test_what_is_written_after_or_is_written_only_if_it_is_asked():
    text = '''

def writes(r: Record) -> bool:
    """Write a stop."""
    r[STOP] = 1.0
    return True


def asks(r: Record) -> bool:
    """Ask for it only without power."""
    return r[WORN] != 0.0 or writes(r)
'''
    run, state = Run(guard(lambda one: one + text)), State({})
    run.call(state, "asks", [Record("r")])
    stop, worn = state.read(("r", core.STOP, ""), run.numbers, ""), state.read(("r", core.WORN, ""), run.numbers, "")
    assert run.proves(z3.Implies(z3.fpIsZero(worn), stop == 1.0))
    assert not run.proves(stop == 1.0)
