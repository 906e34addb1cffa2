"""Counterexamples: records with which the guard itself, run as Python, breaks a promise.

The prover's own counterexample may be spurious, because products are known by laws only. A promise counts as refuted
only after a run of the real functions. Records are drawn at random first, from the edges of all numbers. If none
breaks the promise, z3 looks for one with exact arithmetic and one joint.
"""

import math
import random
from array import array
from collections.abc import Callable, Iterator

import z3

from .arithmetic import Arithmetic
from .execute import Run
from .fields import Fields
from .properties import Property
from .source import Source
from .state import Record, State

TRIALS = 2000
EFFORT = 20_000_000
EDGES = (0.0, -0.0, 1.0, -1.0, 1e-3, 1e3, 1e308, -1e308, 5e-324, math.nan, math.inf, -math.inf)
FLAGS = ("STOP", "WITHOUT_MODEL", "LEVEL_MOVES", "DRIVEN", "IN_WALL", "USABLE", "CAME", "SPOKE", "HAS_MOTOR", "WORN",
         "ISOLATED", "POWERLESS", "IGNORED", "JUMPED", "DEAD", "BROKEN", "PARTED", "WRONG", "FAULTY", "HAS_SPEED",
         "IN_CURRENT", "COMPARES", "BY_GAIN", "FAULTY_IN", "BRIDGES")  # fmt: skip
ONE_MS = {"N": 1.0, "DT": 1e-3, "RATE": 150.0, "V_DAMPING": 4.0, "V_TRIP": 5.0, "DESCENT_S": 3.0, "WALL": 0.2,
          "MOVING": 5.0, "USED_SLOTS": 26.0, "LATELY": 12.0, "SLOWEST": 30.0, "IN_A_ROW": 10.0, "SPEED": 8.0,
          "STILL_MOST": 20.0, "BIAS_SHARE": 0.01, "REFUSED_MOST": 300.0, "LEAST_OPPOSITE": 1e-3, "WINDOW": 20.0,
          "IN_WINDOW": 3.0, "SECOND": 1000.0, "TORQUE_MAX": 30.0, "DAMPING": 4.0, "ACTIVE": 4.0, "LEAST_ACTIVE": 3.0,
          "LOWER": -1.0, "FREE_LOWER": -0.8, "FREE_UPPER": 0.8, "UPPER": 1.0, "PAST_STOP": 0.1, "V_TRIP_PERSON": 3.0,
          "DRY": 0.5, "VISCOUS": 0.2, "ERROR": 0.1, "GAIN": 1.0, "WAY": 5e-3}  # fmt: skip
"""Settings of a machine with a period of 1 ms."""
KEPT = ("USED_AT", "TOLD_AT", "BEFORE_AT", "TOLD_COUNT", "BEFORE_COUNT")
"""Places of the rings, which the guard keeps in range."""


def failing_record(source: Source, one: Property, promise: str, is_quick: bool = False) -> str:
    """Return a record with which a run of the guard breaks a promise, as text; empty if none was found."""
    if promise not in source.functions:  # a promise about a call, which no record of numbers can show broken
        return ""
    records = _solved(source, one, promise)
    if is_quick:
        records = (_drawn(source, random.Random(seed), one) for seed in range(TRIALS))
    for record in records:
        for joint in range(int(record[int(source.constants["N"])])):
            if text := broken(source, one, promise, record, joint):
                return text
    return ""


def broken(source: Source, one: Property, promise: str, record: "array[float]", joint: int) -> str:
    """Run the guard from a record, and return what it does if it breaks the promise for a joint."""
    run, count = source.run, int(record[source.constants["N"]])
    try:
        for name in (*one.settings, *one.holds, *one.extra):
            if not all(run[name](record, j) for j in range(count)):
                return ""
        first = before = array("d", record)
        table = array("d", [0.0, 0.0])
        for k, name in enumerate(one.calls):
            if one.before_last and k == len(one.calls) - 1:
                before = array("d", record)
            run[name](*_arguments(source, name, record, table, joint))
        given = {"b": before, "r": record, "j": joint}
        is_kept = run[promise](*(given[one.arg] for one in source.functions[promise].args.args))
    except (ZeroDivisionError, ValueError, OverflowError, IndexError) as error:
        return _text(source, one, f"{type(error).__name__}: {error}", first, record)
    return "" if is_kept else _text(source, one, f"{promise} is False for joint {joint}", first, record)


def _arguments(source: Source, name: str, record: "array[float]", table: "array[float]", joint: int) -> Iterator:
    reasons = {"r": record, "w": table, "j": joint, "reason": 1}
    for one in source.functions[name].args.args:
        yield reasons.get(one.arg, True)


def _text(source: Source, one: Property, what: str, first: "array[float]", last: "array[float]") -> str:
    about = Fields(source.constants)
    # The torque is shown also where it stays: that may be what is wrong.
    shown = [int(source.constants[name]) for name in ("TAU", "LAST_TAU")]
    places = shown + [k for k in range(about.used) if repr(first[k]) != repr(last[k]) and k not in shown]
    named = [f"{about.place_name(k)} {first[k]!r} → {last[k]!r}" for k in places]
    return f"{', '.join(one.calls)}: {what}; " + ", ".join(named[:12])


def _drawn(source: Source, chance: random.Random, one: Property) -> "array[float]":
    """Return a record of random numbers, many of them at the edges, with settings that Python accepts."""
    places, about = source.constants, Fields(source.constants)
    record = array("d", bytes(8 * about.size))
    edge = chance.choice((0.0, 0.05, 0.3))
    for k in range(about.used):
        record[k] = chance.choice(EDGES) if chance.random() < edge else chance.choice((1.0, 10.0)) * chance.gauss(0, 1)
    for name, value in ONE_MS.items():
        _put(about, record, int(places[name]), lambda value=value: value)
    for name in FLAGS:
        _put(about, record, int(places[name]), lambda: float(chance.random() < 0.4))
    record[places["N"]] = chance.choice((1.0, 2.0, 3.0))
    _draw_state(places, about, record, chance)
    for k in range(about.used, about.size):
        record[k] = math.nan if edge else 0.0
    return record


def _draw_state(places: dict, about: Fields, record: "array[float]", chance: random.Random) -> None:
    """Draw the state of a guard that works, near the edges of its conditions."""
    record[places["STOP"]] *= chance.randint(1, 15)
    for name in KEPT:
        record[places[name]] = float(chance.randint(0, 8))
    for block in about.blocks:
        record[block], record[block + 1] = float(chance.randint(0, 2000)), float(chance.randint(0, 10))
        for k in range(about.misses):
            record[block + 2 + k] = record[block] - chance.choice((1, 2, 3, 30, 1e18))
    record[places["SINCE_STOP"]] = chance.choice((0.0, 1.0, 2.9995, 3.0, 4.0)) if record[places["STOP"]] else 0.0
    record[places["ANSWERS"]] = record[places["SEQUENCE_IN"]] + chance.choice((0.0, 0.0, 1.0))
    record[places["VALID_UNTIL"]] = record[places["NOW"]] + chance.choice((0.0, 0.004, -0.001))
    record[places["T_IN"]] = record[places["NOW"]] - chance.choice((0.0, 0.001, 0.0031))
    record[places["LEVEL_STEP"]] = 2e-4
    record[places["LEVEL"]] = chance.choice((0.0, 0.5, 1.0, 1.3))
    record[places["CONSENT"]] = chance.choice((0.0, 60.0))
    record[places["LEVEL_WANTED"]] = record[places["LEVEL"]] + chance.choice((0.0, 1e-4, 0.4, -0.4))
    for name in ("TAU", "LAST_TAU", "TAU_AT_STOP", "CARRIED"):
        _put(about, record, int(places[name]), lambda: 30.0 * chance.choice((-1.0, 1.0, 2.0 * chance.random() - 1.0)))
    if chance.random() < 0.2:  # a demand beyond the drive's limit, where a function gets one in the place of the torque
        _put(about, record, int(places["TAU"]), lambda: chance.choice((-60.0, 60.0)))
    for name in ("Q", "V", "KNOWN", "V_SEEN", "Q_GIVEN", "V_GIVEN", "Q_IN"):
        if chance.random() < 0.8:
            _put(about, record, int(places[name]), lambda: chance.choice((0.01, 1.0, 6.0)) * chance.gauss(0, 1))
    for name in ("LOW", "HIGH"):
        _put(about, record, int(places[name]), lambda name=name: (8.0 if name == "HIGH" else -8.0) * chance.random())


def _put(about: Fields, record: "array[float]", place: int, value: Callable[[], float]) -> None:
    for k in range(about.joints if about.is_field(place) else 1):
        record[place + k] = value()


def _solved(source: Source, one: Property, promise: str) -> Iterator["array[float]"]:
    """Yield the record that z3 finds for one joint with exact arithmetic, if it finds one."""
    run = Run(source, joints=1, numbers=Arithmetic(exact=True))
    state, numbers = State({}), run.numbers
    for place, value in ((0, 0.0), (1, 0.0)):
        state.initial[("w", place, "")] = value
    assumed = [numbers.truth(run.claim(state, name, run.joint)) for name in (*one.settings, *one.holds, *one.extra)]
    before = state.copy()
    for k, name in enumerate(one.calls):
        if one.before_last and k == len(one.calls) - 1:
            before = state.copy()
        given = {"r": Record("r"), "w": Record("w"), "j": run.joint, "reason": 1.0}
        run.call(state, name, [given.get(each.arg, True) for each in source.functions[name].args.args])
    run.snapshots["b"] = before
    claim = z3.Implies(z3.And(assumed), numbers.truth(run.claim(state, promise, run.joint)))
    _, model = run.check(claim, EFFORT, ((1000, True),))
    if model is None:
        return
    record = _drawn(source, random.Random(0), one)
    record[source.constants["N"]] = 1.0
    for (name, place, joint), term in state.initial.items():
        if name == "r" and isinstance(term, z3.FPRef):
            record[place + int(joint or 0)] = _double(model.eval(term, model_completion=True))
    yield record


def _double(value: z3.FPRef) -> float:
    """Return a double of z3 as one of Python."""
    if z3.fpIsNaN(value) is not None and z3.is_true(z3.simplify(z3.fpIsNaN(value))):
        return math.nan
    bits = z3.simplify(z3.fpToIEEEBV(value)).as_long()
    return array("d", array("Q", [bits]).tobytes())[0]
