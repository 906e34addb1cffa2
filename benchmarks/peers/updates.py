"""Cost of one identification update, native and on the virtual machine: the whole method, including NumPy."""

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Method, Sample
from exograv.identification.core.prior import prior
from exograv.identification.core.sample_pace import BATCH_PERIOD_S
from exograv.kernel import compilation
from exograv.procedures.identification.estimator_session import build_method
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.identification.method_names import MethodName
from peers.opponents import Native, VirtualMachine
from peers.tasks.arm_tasks import SEED, machine_and_assembly

from .measurement import Report, row
from .rounds import clock_ns, quiet
from .statistics import percentiles_us

METHODS: tuple[MethodName, ...] = ("recursive", "gradient")
RESIDUAL_SD, CORRELATION_S = 0.1, 0.1
"""Residual torque SD [N·m] and correlation time [s], about those of a calibrated machine on the twin."""

HEAVIER, OFFSET = 1.15, np.array([0.01, -0.008, 0.012])
"""Truth of the learned arm: factor on the table's inertial parameters, and offset of its shoulder centre from the
machine's [m]."""


def time_updates(seconds: float, report: Report) -> None:
    """Report rows `update_<method>` from `seconds` of motion; both engines take turns at every sample."""
    for name in METHODS:
        report({"at": [f"update_{name}", None]})
        methods = {VirtualMachine.name: _method(name, "virtual-machine")}
        if compilation.native_is_possible():
            methods = {Native.name: _method(name, None), **methods}
        else:
            reason = "no native code on this computer"
            report({"missing": {"implementation": Native.name, "row": f"update_{name}", "reason": reason}})
        samples = _samples(seconds)
        times = _taken_in_turns(methods, samples)
        found = {who: method.estimate().x for who, method in methods.items()}
        scale = np.abs(found[VirtualMachine.name]).max()
        for who, durations in times.items():
            error = float(np.abs(found[who] - found[VirtualMachine.name]).max() / scale)
            report({"row": row(f"update_{name}", who, True, percentiles_us(durations), len(durations), error)})


def _method(name: MethodName, engine: str | None) -> Method:
    with _engine(engine):
        machine, assembly = machine_and_assembly(4)
        calibrated = replace(
            machine, residual_sd=np.full(assembly.n, RESIDUAL_SD), correlation_s=np.full(assembly.n, CORRELATION_S)
        )
        return build_method(name, assembly, calibrated)


def _samples(seconds: float) -> list[Sample]:
    """Return samples of the machine's own excitation at the filter's period, with noise."""
    machine, assembly = machine_and_assembly(4)
    layout, (x, _) = ParameterLayout.of(assembly), prior(assembly, machine)
    x[layout.phi] *= HEAVIER
    x[layout.fit][: len(OFFSET)] += OFFSET
    model, noise = ArmModel(assembly, machine), np.random.default_rng(SEED)
    path = identification_motion(assembly, seconds, BATCH_PERIOD_S)
    samples = []
    for i, (q, v, a) in enumerate(zip(path.q, path.v, path.a, strict=True)):
        sample = Sample(BATCH_PERIOD_S * i, q, v, a, np.zeros(assembly.n))
        sample.tau = model.linearise(sample, x)[0] + noise.normal(0.0, RESIDUAL_SD, assembly.n)
        samples.append(sample)
    return samples


def _taken_in_turns(methods: Mapping[str, Method], samples: list[Sample]) -> dict[str, Float[np.ndarray, " update"]]:
    names, clock = list(methods), time.perf_counter_ns
    times: dict[str, list[int]] = {name: [] for name in names}
    with quiet():
        own = clock_ns()
        for i, sample in enumerate(samples):
            for name in names if i % 2 else reversed(names):
                start = clock()
                methods[name].update(sample)
                times[name].append(clock() - start)
    return {name: np.array(values, float) - own for name, values in times.items()}


@contextmanager
def _engine(engine: str | None) -> Iterator[None]:
    """Run kernels that are compiled within on this engine, as the environment variable would."""
    before = os.environ.get(compilation.ENGINE_VARIABLE)
    os.environ.pop(compilation.ENGINE_VARIABLE, None)
    if engine is not None:
        os.environ[compilation.ENGINE_VARIABLE] = engine
    compilation.native_is_possible.cache_clear()
    try:
        yield
    finally:
        os.environ.pop(compilation.ENGINE_VARIABLE, None)
        if before is not None:
            os.environ[compilation.ENGINE_VARIABLE] = before
        compilation.native_is_possible.cache_clear()
