"""Verdict on a property: proved, refuted by a run of the guard itself, or undecided."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import z3

from .arithmetic import Arithmetic, Value, Whole
from .execute import DEPTHS, Run
from .properties import HOLDS, PERSON, Property
from .replay import failing_record
from .rounded import Rounded
from .source import Source
from .state import Record, State

EFFORT = 40_000_000
"""Steps of z3 for one promise at one depth."""
DUTY_EFFORT = 4_000_000
"""The same for a division."""


@dataclass
class Verdict:
    """Result of one property."""

    name: str
    promises: dict[str, str] = field(default_factory=dict)
    """Promise and its result: proved, refuted, undecided."""
    duties: dict[str, str] = field(default_factory=dict)
    """Divisions that must not be by zero, and their result."""
    allowed: tuple[str, ...] = ()
    """Promises that may stay undecided; they are listed."""
    seconds: float = 0.0
    example: str = ""
    """Places of the record with which the guard itself breaks a promise."""

    @property
    def is_good(self) -> bool:
        """True if all is proved but what is known to stay undecided."""
        results = [*self.promises.items(), *self.duties.items()]
        return all(one == "proved" or (one == "undecided" and name in self.allowed) for name, one in results)

    @property
    def is_refuted(self) -> bool:
        """True if a run of the guard breaks a promise."""
        return "refuted" in self.promises.values()


def judged(
    source: Source,
    one: Property,
    limit_s: float = 240.0,
    looks: Callable[..., str] = failing_record,
    tries_all: bool = False,
) -> Verdict:
    """Return the verdict on one property of a source.

    Args:
        source: Guard to judge, as it ships or with a wrong line.
        one: Property.
        limit_s: Processor time after which what is left is undecided [s].
        looks: Search for a record with which the guard breaks a promise.
        tries_all: True to try what is known to stay undecided; otherwise only the guard is run on random records.
    """
    started = time.process_time()
    verdict = Verdict(one.name, allowed=one.undecided)
    run, before, state, assumed = _prepared(source, one)
    for k, name in enumerate(one.calls):
        if one.before_last and k == len(one.calls) - 1:
            before = state.copy()
        run.call(state, name, _arguments(run, source, name, one.always))
    run.snapshots["b"] = before
    for name in (*one.promises, *one.settings):  # that settings are not written is proved too
        if time.process_time() - started > limit_s:
            verdict.promises[name] = "undecided"
            continue
        claim = z3.Implies(assumed, run.numbers.truth(_claim(run, state, name)))
        search = partial(looks, source, one, name)
        if name in one.undecided and not tries_all:
            example = search(is_quick=True)
            result = "refuted" if example else "undecided"
        else:
            result, example = _result(run, claim, search, is_hard=name in one.undecided)
        verdict.promises[name], verdict.example = result, example or verdict.example
    for path, claim, where in run.duties:
        if where in one.undecided and not tries_all:
            verdict.duties[where] = "undecided"
            continue
        found, _ = run.check(z3.Implies(z3.And(assumed, path), claim), DUTY_EFFORT)
        verdict.duties[where] = "proved" if found == z3.unsat else "undecided"
    verdict.seconds = time.process_time() - started
    return verdict


def _result(run: Run, claim: z3.BoolRef, search: Callable[..., str], is_hard: bool) -> tuple[str, str]:
    """Try a claim by laws, then by random runs of the guard, which find a wrong guard, then bit by bit.

    Returns:
        Result, and a record with which the guard breaks the promise.
    """
    if run.check(claim, EFFORT, DEPTHS[:3])[0] == z3.unsat:
        return "proved", ""
    if example := search(is_quick=True):
        return "refuted", example
    if run.check(claim, EFFORT, DEPTHS[3:])[0] == z3.unsat:
        return "proved", ""
    example = "" if is_hard else search()
    return ("refuted" if example else "undecided"), example


def _prepared(source: Source, one: Property) -> tuple[Run, State, State, z3.BoolRef]:
    """Return a run, its state before, the state that changes, and what is assumed of it."""
    numbers = {"ieee": Arithmetic, "rounded": Rounded}[one.numbers]()
    run = Run(source, joints=one.joints, numbers=numbers)
    run.assumed_of_others = list(one.settings)
    run.kept_claims = list(HOLDS) if one.joints is None else []
    state = State({})
    if PERSON in one.settings:
        table = "state_of_table"
        run.after_call["carried"] = lambda after: numbers.facts.add(numbers.truth(run.claim(after, table, run.joint)))
    if one.joints is None:
        count, joint = run.numbers.integer(run.count).term(), Whole(0, run.tracked).term()
        numbers.facts.add(z3.And(count >= 1, count <= run.about.joints, joint >= 0, joint < count))
    assumed = [numbers.truth(run.claim(state, name, run.joint)) for name in (*one.settings, *one.holds, *one.extra)]
    return run, state.copy(), state, z3.And(assumed)


def _claim(run: Run, state: State, name: str) -> Value:
    """Return a promise; one is about a call: if it says that too many ticks are missed, a descent starts."""
    if name != "missed ticks stop":
        return run.claim(state, name, run.joint)
    says = [run.numbers.truth(one) for one in run.returned["misses_too_many"]]
    return z3.Implies(z3.Or(says), run.claim(state, "promise_stopped", run.joint))


def _arguments(run: Run, source: Source, name: str, always: tuple[str, ...]) -> list:
    given = []
    for one in source.functions[name].args.args:
        if one.arg in ("r", "w"):
            given.append(Record(one.arg))
        elif one.arg == "j":
            given.append(run.joint)
        elif one.arg == "reason":
            reason = run.numbers.fresh("reason")
            run.numbers.facts.add(z3.And(reason >= 1.0, reason <= 15.0), reason)
            given.append(reason)
        else:
            given.append(True if one.arg in always else run.numbers.fresh(one.arg, True))
    return given
