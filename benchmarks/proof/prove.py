"""Proof of the guard's promises on its own source, with z3.

    python benchmarks/proof/prove.py                          # all, and exit 1 if one is refuted or undecided
    python benchmarks/proof/prove.py --only rate --only latch
    python benchmarks/proof/prove.py --save docs/results/proof.md
    python benchmarks/proof/prove.py --undecided              # also what z3 has not decided yet

Each property is proved in a process of its own with a time limit. Method and limits: docs/explanation/guard.md.
"""

import argparse
import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from proof.bridge import MISSED, bridge_verdict
from proof.judge import Verdict, judged
from proof.properties import PROPERTIES
from proof.report import page, row
from proof.source import CORE, read

LIMIT_S = 240.0
"""Processor time of a property, after which it is undecided [s]."""
LONGEST = ("second half of a tick", "first half of a tick", "envelope")


def _judge(name: str, tries_all: bool) -> Verdict:
    if name == MISSED:
        return bridge_verdict(read(CORE))
    return judged(read(CORE), next(one for one in PROPERTIES if one.name == name), LIMIT_S, tries_all=tries_all)


def main() -> None:
    """Print a line per property, and write the report if asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", default=[], help="part of the name of a property")
    parser.add_argument("--save", type=Path, help="write the report to this file")
    parser.add_argument("--undecided", action="store_true", help="also try what is known to stay undecided")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    # The longest first, so that both processes end at the same time.
    order = [*sorted((one.name for one in PROPERTIES), key=lambda name: name not in LONGEST), MISSED]
    names = [name for name in order if not options.only or any(part in name for part in options.only)]
    started, verdicts = time.monotonic(), list[Verdict]()
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.workers, mp_context=context) as pool:
        for verdict in pool.map(partial(_judge, tries_all=options.undecided), names):
            verdicts.append(verdict)
            print(row(verdict), flush=True)
    print(f"{time.monotonic() - started:.0f} s")
    if options.save:
        options.save.write_text(page(verdicts), encoding="utf-8")
    sys.exit(any(not one.is_good for one in verdicts))


if __name__ == "__main__":
    main()
