"""Equality of the compiled guard and its Python source on random and adversarial ticks, to the last bit.

    python benchmarks/guard_equality.py --ticks 10000000

Both run the same random machines, histories and faults (`tests/safety/random_machines.py`). After each tick the whole
record is compared by a hash of its bits; every NaN counts alike. The seed of a batch reproduces it.
"""

import argparse
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from tests.safety.random_machines import draw_history, draw_machines, first_guards

from exograv.safety.native import core
from exograv.safety.native.library import LIBRARY

JOINTS = 2, 4, 7
"""Joints of the machines, from batch to batch."""

MACHINES, TICKS = 25, 4000
"""Machines and ticks of a batch: more than three seconds each, so that a descent ends."""

SAID_TICKS = 10 * MACHINES * TICKS
"""Ticks between two lines of progress."""


def differing(seed: int) -> list[int]:
    """Machines of a batch whose records differ."""
    rng = np.random.default_rng(seed)
    machines = draw_machines(rng, MACHINES, JOINTS[seed % len(JOINTS)])
    hashes = np.zeros((2, MACHINES, core.SIZE), dtype=np.int64)
    with np.errstate(all="ignore"):
        history = draw_history(rng, machines, TICKS)
        for library, into in zip((LIBRARY, None), hashes, strict=True):
            first_guards(machines, history, library, into)
    return np.flatnonzero((hashes[0] != hashes[1]).any(axis=1)).tolist()


def main() -> None:
    """Print a line per machine that differs, and the sum."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ticks", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    if LIBRARY is None:
        sys.exit("The guard is not compiled on this computer. Install a C compiler, then exograv again.")
    started, ticks, wrong, seed = time.monotonic(), 0, 0, options.seed
    while ticks < options.ticks:
        for machine in differing(seed):
            print(f"seed {seed}, machine {machine}: the records differ")
            wrong += 1
        ticks, seed = ticks + MACHINES * TICKS, seed + 1
        if ticks % SAID_TICKS == 0:
            print(f"{ticks} ticks, {wrong} machines differ so far", flush=True)
    print(
        f"{ticks} ticks, {wrong} machines differ, {time.monotonic() - started:.0f} s, seeds {options.seed}–{seed - 1}"
    )
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
