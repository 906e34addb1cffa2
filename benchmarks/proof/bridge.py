"""A void or missing answer is held for a bounded number of ticks: the missed ticks in a row, counted by the guard."""

import time
from fractions import Fraction

import z3

from .execute import Run
from .judge import Verdict
from .rounded import Rounded
from .source import Source
from .state import Record, State

MISSED = "missed ticks in a row"
EFFORT = 20_000_000
"""Steps of z3 for one claim."""


def bridge_verdict(source: Source) -> Verdict:
    """Return the verdict on the length of a bridge."""
    started = time.process_time()
    promises = bridge_ends(source, EFFORT)
    return Verdict(MISSED, promises, seconds=time.process_time() - started)


def bridge_ends(source: Source, effort: int) -> dict[str, str]:
    """Prove that of missed ticks in a row one of the first `IN_WINDOW + 1`, and of the first 11, ends the bridge.

    It holds from any history of misses, for machine and control, and for any state of the ring. Numbers of ticks are
    whole and below 2⁵³, so their sums are exact.
    """
    places, most = source.constants, int(source.constants["IN_SECOND_MAX"])
    results = dict[str, str]()
    for block in ("MACHINE_MISSES", "CONTROL_MISSES"):
        is_proved = True
        for newest in range(int(places["MISSES"])):
            run = Run(source, joints=1, numbers=Rounded(Fraction(0)))
            state, at = State({}), int(places[block])
            state.cells[("r", at + 1, "")] = float(newest)
            tick = state.read(("r", at, ""), run.numbers, "tick")
            window, most_in = (
                state.read(("r", int(places[one]), ""), run.numbers, one) for one in ("WINDOW", "IN_WINDOW")
            )
            second = state.read(("r", int(places["SECOND"]), ""), run.numbers, "SECOND")
            ends = [
                run.numbers.truth(run.call(state, "misses_too_many", [Record("r"), at, True])) for _ in range(most + 1)
            ]
            allowed = z3.And(tick >= 0, most_in >= 0, most_in < window, second > most)
            # The case of the setting is a number in each claim: z3 then needs no arithmetic of products.
            claims = [z3.Implies(most_in == k, z3.Or(ends[: k + 1])) for k in range(most)] + [z3.Or(ends)]
            is_proved = is_proved and all(
                run.check(z3.Implies(allowed, one), effort, ((1000, True),))[0] == z3.unsat for one in claims
            )
        results[f"bridge of {block.split('_')[0].lower()}"] = "proved" if is_proved else "undecided"
    return results
