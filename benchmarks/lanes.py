"""Cost of a batch of one state by the number of lanes, beside a single call: the general tick of four joints.

    python benchmarks/lanes.py

Medians of interleaved calls from Python, µs.
"""

from functools import partial

import numpy as np

from exograv import kernel
from peers.opponents.native import Native
from peers.plan import task
from peers.rounds import Effort, timed
from peers.tasks.arm_tasks import stacked
from peers.tasks.interface import Call, State, copy_into

LANES = (2, 4, 8)
EFFORT = Effort(40, 0.005)


def main() -> None:
    """Time all variants and print one line."""
    asked = task("tick_general_4")
    single = Native().build(asked, None)
    calls = {"single call": Call(lambda state: single.load(unstacked(state)), single.run, single.read, (single,))}
    for lanes in LANES:
        bound = kernel.compile(asked.function, lanes=lanes, shared=asked.shared).bind(1)
        calls[f"{lanes} lanes"] = Call(partial(copy_into, bound.inputs), bound.evaluate, dict, (bound,))
    times = timed(calls, lambda turn: stacked(asked, 1, turn), EFFORT)

    print(", ".join(f"{label} {np.median(values) / 1e3:.2f}" for label, values in times.items()))


def unstacked(state: State) -> State:
    """Return the single state of a batch."""
    return {name: values if name in ("x", "mode") else values[..., 0] for name, values in state.items()}


if __name__ == "__main__":
    main()
