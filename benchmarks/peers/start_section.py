"""Time of an engine from a task to its first answer, and the memory that it adds: one process each."""

import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from peers.opponents import GeneratedC, JaxByHand, JaxTranslated, Native, VirtualMachine

from .measurement import Report, row
from .statistics import percentiles_us

ASKED = {
    "tick_aligned_7": (Native.name, VirtualMachine.name, GeneratedC.name, JaxByHand.name),
    "tick_general_4": (Native.name, VirtualMachine.name, GeneratedC.name, JaxTranslated.name),
}
"""Implementations that start each task."""

KEEPERS = (Native.name, JaxByHand.name, JaxTranslated.name)
"""Implementations that keep compiled code on disk for the next start."""


def start_section(order: dict[str, Any], report: Report) -> None:
    """Measure one start; `order` names task, implementation, row and the folder of the files kept on disk."""
    folder = Path(order["folder"])
    os.environ["XDG_CACHE_HOME"] = str(folder)
    os.environ["JAX_COMPILATION_CACHE_DIR"] = str(folder / "jax")
    os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
    os.environ["JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES"] = "-1"
    # The states are drawn without the compiler, because its start belongs to the measurement.
    os.environ["EXOGRAV_KERNEL"] = "virtual-machine"
    from peers.opponents import OPPONENTS
    from peers.tasks.interface import Missing

    from .agreement import Reference
    from .plan import task

    (opponent,) = (each for each in OPPONENTS if each.name == order["implementation"])
    started = task(order["task"])
    reference = Reference(started)
    before, start = _resident_bytes(), time.perf_counter()
    try:
        call = opponent.build(started, None)
        call.load(started.states[0])
        call.run()
        seconds, after = time.perf_counter() - start, _resident_bytes()
        error = reference.error_of(call, None)
    except Missing as missing:
        report({"missing": {"implementation": opponent.name, "row": order["name"], "reason": str(missing)}})
        return
    figures = percentiles_us(np.array([1e9 * seconds]))
    report({"row": row(order["name"], opponent.name, True, figures, 1, error)})
    if before is not None and after is not None:
        added = round((after - before) / 1e6, 1)
        report({"memory": {"name": order["name"], "implementation": opponent.name, "rss_added_MB": added,
                           "code_bytes": call.code_bytes}})  # fmt: skip


def _resident_bytes() -> int | None:
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return None
    return pages * os.sysconf("SC_PAGE_SIZE")
