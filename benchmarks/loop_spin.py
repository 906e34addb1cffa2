"""Effect of busy-waiting in the live loop: the sleep ends early, and the loop polls the clock for the rest.

    python benchmarks/loop_spin.py --rounds 7 --seconds 4

Each round runs the general tick at 1 kHz with every length of busy-waiting in turn, without and with real-time
scheduling. Other load on the computer thus affects all alike. Medians over the rounds (docs/explanation/realtime.md).
"""

import argparse
import platform
from collections import defaultdict

import numpy as np

from exograv.procedures.self_test.nominal_tick import MovingTick
from exograv.runtime.clock.host import loop_cpus, read_host
from exograv.runtime.clock.real_time_loop import run_loop
from exograv.runtime.clock.realtime import realtime
from exograv.runtime.clock.timing import PERIOD_NS, Timing

STRETCHES_US = (0, 50, 100, 200)
WARM_UP_TICKS = 500
HEADINGS = ("p50", "p99", "p99.9", "worst", "missed")


def figures(timing: Timing) -> list[float]:
    """Return percentiles of the wake-up lateness [µs], and the number of missed periods."""
    late = timing.lateness_ns
    return [*(1e-3 * np.percentile(late, [50, 99, 99.9])), 1e-3 * late.max(), timing.missed]


def main() -> None:
    """Print one line per case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=4.0)
    options = parser.parse_args()
    periods = round(1e9 * options.seconds / PERIOD_NS)
    tick, found = MovingTick(1e-9 * PERIOD_NS), defaultdict(list)
    for period in range(WARM_UP_TICKS):
        tick(period)
    host, granted = read_host(), []
    for _ in range(options.rounds):
        for stretch in STRETCHES_US:
            found["ordinary", stretch].append(figures(run_loop(tick, periods, spin_ns=1000 * stretch)))
        with realtime(loop_cpus(host).guard) as rights:
            granted = rights.granted
            for stretch in STRETCHES_US:
                found["real-time", stretch].append(figures(run_loop(tick, periods, spin_ns=1000 * stretch)))
    print(f"{platform.platform()}, {len(host.cpus)} processors; granted: {', '.join(granted)}")
    print(f"{'scheduling':10s} {'watched µs':>10s} " + " ".join(f"{heading:>8s}" for heading in HEADINGS))
    for (scheduling, stretch), rows in sorted(found.items()):
        values = " ".join(f"{value:8.1f}" for value in np.median(rows, axis=0))
        print(f"{scheduling:10s} {stretch:10d} {values}")


if __name__ == "__main__":
    main()
