"""Agreement of the guard with a second, independent guard on random ticks.

    python benchmarks/second_guard.py --ticks 1000000

Half of the ticks go to whole guards, half to envelopes alone, which also see input that an ingress check would reject.
The script runs batches of machines until there are enough ticks. The seed of a batch reproduces it.
"""

import argparse
import os
import sys
import time
from collections import Counter
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from tests.safety.random_machines import (
    Comparison,
    compare,
    draw_history,
    draw_machines,
    first_envelopes,
    first_guards,
    second,
)

MACHINES, TICKS = 25, 4000
"""Machines and ticks of a batch: more than three seconds each, so that a descent ends."""


def batch(seed: int) -> list[Comparison]:
    """Compare guards, then envelopes alone."""
    rng = np.random.default_rng(seed)
    m, results = draw_machines(rng, MACHINES, (2, 4)[seed % 2]), []
    with np.errstate(all="ignore"):
        history = draw_history(rng, m, TICKS)
        for has_guard in (True, False):
            first = (first_guards if has_guard else first_envelopes)(m, history)
            results.append(compare(first, second(m, history, has_guard, first)))
    return results


def main() -> None:
    """Print a line per batch that differs, and the sums."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ticks", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    started, ticks, wrong, largest, covered, seed = time.monotonic(), 0, 0, 0.0, Counter(), options.seed
    while ticks < options.ticks:
        for name, result in zip(("guards", "envelopes"), batch(seed), strict=True):
            ticks, wrong = ticks + result.ticks, wrong + result.disagreements
            largest = max(largest, result.largest_Nm)
            covered.update(result.covered if name == "guards" else {})
            for line in result.first:
                print(f"seed {seed}, {name}: {line}")
        seed += 1
    print(f"{ticks} ticks, {wrong} disagreements, largest difference {largest:.3g} N·m")
    print("guards: " + ", ".join(f"{name} {count}" for name, count in sorted(covered.items())))
    print(f"{time.monotonic() - started:.0f} s, seeds {options.seed} to {seed - 1}")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
