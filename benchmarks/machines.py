"""Cost of a tick and of an estimator update on each machine: medians on one core.

    python benchmarks/machines.py

Times are of the native kernels with their buffers, in the loop of a session. No other program should run.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from exograv.control.tick import Tick
from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig, rig_names
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import build_method
from exograv.procedures.identification.identify import identification_motion
from exograv.signals import Reference

BODY = Body(1.75, 75.0, "male")
CALLS, ROUNDS = 2000, 7
UPDATE_PERIOD_S, UPDATES_S = 0.08, 30.0


def median_us(call: Callable[[], object], calls: int = CALLS) -> float:
    """Median over several rounds of the time per call [µs]."""
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter_ns()
        for _ in range(calls):
            call()
        times.append((time.perf_counter_ns() - start) / calls)
    return 1e-3 * float(np.median(times))


def tick_of(assembly: Assembly) -> tuple[int, float, float]:
    """Return the number of instructions, and the times of the kernel alone and of the whole step [µs]."""
    machine = nominal_machine(assembly.description, assembly.exo.phi)
    tick, (x, _), still = Tick(assembly, machine), prior(assembly, machine), np.zeros(assembly.n)
    q = np.mean(assembly.description.workspace, axis=0)
    reference = Reference(q, still, still)
    tick.step(q, still, reference, x)
    return tick.n_instructions, median_us(tick._evaluate), median_us(lambda: tick.step(q, still, reference, x))


def update_of(assembly: Assembly) -> float:
    """Median time of an update of `recursive` [ms]; updates that relinearise are rare and do not change it."""
    machine = nominal_machine(assembly.description, assembly.exo.phi)
    model, method = ArmModel(assembly, machine), build_method("recursive", assembly, machine)
    x, _ = prior(assembly, machine)
    path = identification_motion(assembly, UPDATES_S, UPDATE_PERIOD_S)
    times = []
    for k, (q, v, a) in enumerate(zip(path.q, path.v, path.a, strict=True)):
        sample = Sample(k * UPDATE_PERIOD_S, q, v, a, np.zeros(assembly.n))
        sample.tau = model.linearise(sample, x)[0]
        start = time.perf_counter_ns()
        method.update(sample)
        times.append(time.perf_counter_ns() - start)
    return 1e-6 * float(np.median(times))


def main() -> None:
    """Print one line per machine."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    sizes = f"{'joints':>7}{'freedoms':>9}{'learned':>8}{'instr.':>8}"
    print(f"{'machine':24}{sizes}{'kernel µs':>10}{'step µs':>8}{'update ms':>10}")
    for name in rig_names():
        description = load_rig(name)
        if description.motorless:
            continue
        assembly = assemble(description, BODY)
        instructions, kernel_us, step_us = tick_of(assembly)
        sizes = f"{assembly.n:7}{assembly.n_freedoms:9}{ParameterLayout.of(assembly).count:8}{instructions:8}"
        print(f"{name:24}{sizes}{kernel_us:10.2f}{step_us:8.2f}{update_of(assembly):10.2f}", flush=True)


if __name__ == "__main__":
    main()
