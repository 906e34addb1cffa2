"""Speed of native code for each part of exograv that calls a kernel: the same work on both engines.

    python benchmarks/engines.py

Each engine runs in its own process. The two take turns, so that other load on the computer affects both alike.
Updates of the identification methods on both engines are rows of `make bench`.
"""

import argparse
import json
import os
import subprocess
import sys
import timeit
from collections.abc import Callable

import numpy as np

from exograv.control.observer import Observer
from exograv.control.resting import RestingTorque
from exograv.control.tick import Tick
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.prior import prior
from exograv.kernel.compilation import ENGINE_VARIABLE
from exograv.laboratory.posterior_torque import posterior_torque
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble, sample_postures
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.signals import Reference

ENGINES = {"native": "", "virtual machine": "virtual-machine"}
HELD_OUT = 200


def tasks() -> dict[str, tuple[Callable[[], object], int]]:
    """Return the timed call of each task, and the number of calls per measurement."""
    description = load_rig("recupera_like")
    assembly = assemble(description, Body(1.75, 75.0, "male"))
    machine = nominal_machine(description, assembly.exo.phi)
    x, still = table_guess(assembly, machine), np.zeros(assembly.n)
    q = description.donning_posture
    reference = Reference(q, still, still)
    tick, observer, model = Tick(assembly, machine), Observer(assembly.n, 1e-3), ArmModel(assembly, machine)
    mean, covariance = prior(assembly, machine)
    resting = RestingTorque(assembly, machine)
    postures = sample_postures(description, 256)[:HELD_OUT]
    arms, z = np.tile(x, (HELD_OUT, 1)), resting.cold_start(postures, x)
    estimate = Estimate(0.0, mean, 0.05 * covariance, 0.0, 1.0)
    sample = Sample(0.0, q, still, still, still)
    return {
        "tick (kernel and its buffers)": (lambda: tick.step(q, still, reference, x), 200),
        "observer": (lambda: observer.update(q), 200),
        "torque and derivative by all parameters": (lambda: model.linearise(sample, x), 20),
        "stop rule's prediction (33 postures)": (lambda: LeftOverPrediction(model, mean), 1),
        f"held-out check ({HELD_OUT} postures)": (lambda: resting(postures, arms, z), 1),
        "uncertainty (512 arms, 33 postures)": (lambda: posterior_torque(resting, assembly, estimate), 1),
    }


def measure() -> None:
    """Answer each line of input with a round of measurements [µs]; runs in the process of one engine."""
    rows = tasks()
    for action, _ in rows.values():
        action()
    for _ in sys.stdin:
        row = {name: 1e6 * timeit.timeit(action, number=count) / count for name, (action, count) in rows.items()}
        print(json.dumps(row), flush=True)


def main() -> None:
    """Print one line per task: medians on both engines, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--measure", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        measure()
        return
    workers = {
        engine: subprocess.Popen(
            [sys.executable, __file__, "--measure"],
            env={**os.environ, ENGINE_VARIABLE: value},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for engine, value in ENGINES.items()
    }
    rounds: dict[str, list[dict[str, float]]] = {engine: [] for engine in ENGINES}
    for _ in range(options.rounds):
        for engine, worker in workers.items():
            if worker.stdin is None or worker.stdout is None:
                raise SystemExit("a worker has no pipes")
            worker.stdin.write("\n")
            worker.stdin.flush()
            rounds[engine].append(json.loads(worker.stdout.readline()))
    for worker in workers.values():
        worker.communicate()
    print(f"{'medians, µs':42s}{'native':>10s}{'virtual machine':>17s}{'ratio':>8s}")
    for name in rounds["native"][0]:
        native, virtual = (float(np.median([row[name] for row in rounds[engine]])) for engine in ENGINES)
        print(f"{name:42s}{native:10.1f}{virtual:17.1f}{virtual / native:8.1f}")


if __name__ == "__main__":
    main()
