"""Time of a guard per tick, with no wearer and with a wearer's table and energy tank, and of the table alone.

    python benchmarks/guard_time.py
    python benchmarks/guard_time.py --joints 9         # instead of four
    python benchmarks/guard_time.py --beside FOLDER     # also another version of safety/, tick by tick in the same
                                                        # run; on a busy computer only the ratio is meaningful

The joints swing, with encoder counts and motor lag: the signals of a healthy machine in a session.
"""

import argparse
import importlib
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from exograv.loop.plausible_table import MOST_FACTORS, row_factors
from exograv.signals import JointState, TorqueSource

DT, COUNT = 0.001, 2.0 * np.pi / 2**17
PACKAGE = "exograv.safety"


def table(package: str, rng: np.random.Generator, joints: int) -> Any:
    """Return a table as the program makes it for a limb of so many joints, with random numbers."""
    plausible = importlib.import_module(f"{package}.plausible")
    # A version without potentials has all products in the rows.
    most = row_factors(joints) if hasattr(plausible.LimbTable, "potential_factors") else min(joints, MOST_FACTORS)
    rows = rng.normal(0.0, 0.3, (2, joints, plausible.Features(joints, most).count))
    further = []
    if most < min(joints, MOST_FACTORS):
        count = plausible.Features(joints, MOST_FACTORS, most + 1).count
        further = [MOST_FACTORS, rng.normal(0.0, 0.3, (2, count))]
    chain = plausible.LimbTable(tuple(range(joints)), most, *rows, *further)
    return plausible.PlausibleTable((chain,), *(np.full(joints, each) for each in (0.1, 1.0, 0.3)))


def guard(package: str, worn: bool, joints: int) -> Any:
    """Return the guard of a machine with two encoders per joint and torque from current."""
    envelopes, guards, persons = (
        importlib.import_module(f"{package}.{name}") for name in ("envelope", "guard", "person")
    )
    envelope = envelopes.Envelope(envelopes.Limits(np.full(joints, 30.0), np.full(joints, 10.0)), DT)
    if worn:
        stops = np.full(joints, 2.0)
        limits = persons.PersonLimits(table(package, np.random.default_rng(0), joints), 4.0 * stops, -stops, stops)
        envelope.person = persons.GuardedPerson(limits)
    return guards.Guard.of_machine(envelope, DT, [2.0] * joints)


def table_time(package: str, joints: int, calls: int) -> float:
    """Median time of a table per tick, with the call from Python [µs]."""
    record = importlib.import_module(f"{package}.record").GuardRecord(joints, DT)
    packed, taken = table(package, np.random.default_rng(0), joints).packed(), np.empty(calls)
    for k in range(calls):
        start = time.perf_counter_ns()
        record.carried(packed, 1.0)
        taken[k] = 1e-3 * (time.perf_counter_ns() - start)
    return float(np.median(taken))


def swinging(guards: dict[str, Any], submitted: dict[str, Any], ticks: int, joints: int) -> dict[str, np.ndarray]:
    """Time of each guard for `see` and `decide` together in each tick (tick,) [µs]."""
    taken = {name: np.empty(ticks) for name in guards}
    told = {name: np.zeros(joints) for name in guards}
    phase = np.arange(joints)
    for k in range(ticks):
        now = DT * k
        q = np.round(0.8 * np.sin(1.3 * now + phase) / COUNT) * COUNT
        wanted = 5.0 * np.cos(1.3 * now + phase)
        for name, one in list(guards.items())[:: 1 - 2 * (k % 2)]:  # the second guard finds warm caches
            state = JointState(now, k, q, told[name] / 2.0, wanted, TorqueSource.CURRENT, q + 0.001)
            start = time.perf_counter_ns()
            one.see(state, now)
            out = one.decide(submitted[name](k, now + 0.005, wanted), now)
            taken[name][k] = 1e-3 * (time.perf_counter_ns() - start)
            told[name] = out.tau
            assert one.envelope.stop is None, one.envelope.stop
    return taken


def main() -> None:
    """Print one line per guard."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ticks", type=int, default=20_000)
    parser.add_argument("--joints", type=int, default=4)
    parser.add_argument("--beside", type=Path, help="folder of another version of safety/")
    options = parser.parse_args()
    packages = {"": PACKAGE}
    if options.beside is not None:
        sys.path.insert(0, str(options.beside.resolve().parent))
        packages[f"{options.beside.name}: "] = options.beside.name
    kinds = {"no wearer": False, "a wearer": True}
    names = [(label + kind, package, worn) for kind, worn in kinds.items() for label, package in packages.items()]
    guards = {name: guard(package, worn, options.joints) for name, package, worn in names}
    submitted = {name: importlib.import_module(f"{package}.guard").ControlRequest for name, package, _ in names}
    taken = swinging(guards, submitted, options.ticks, options.joints)
    for name, one in taken.items():
        p50, p99, p999 = np.percentile(one, [50, 99, 99.9])
        print(f"{name:28} median {p50:6.1f} µs, p99 {p99:6.1f}, p99.9 {p999:6.1f}")
    for other in list(packages)[1:]:
        for kind in kinds:
            share = np.median(taken[kind] / taken[other + kind])
            print(f"{kind}: {share:.2f} of the time of {other[:-2]}, median over ticks")
    for label, package in packages.items():
        print(f"{label + 'the table alone':28} median {table_time(package, options.joints, options.ticks):6.2f} µs")


if __name__ == "__main__":
    main()
