"""Section of a run in its own process: an engine that crashes ends this process and not the run.

    python -m peers.section_process '{"section": "single", "quick": true, "done": [], "without": []}'

Reports go to standard output, one line of JSON each; prints of an engine go to standard error.
"""

import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TextIO

SINGLE_THREAD = "--xla_cpu_multi_thread_eigen=false --xla_cpu_scheduler_type=CPU_SCHEDULER_TYPE_MEMORY_OPTIMIZED"
"""XLA flags for single states and for one core, as frax's authors recommend them."""

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables that hold an engine to one thread when they are 1; they overwrite the caller's values."""


def main() -> None:
    """Run the section of the command line."""
    order, output = json.loads(sys.argv[1]), _own_output()

    def report(what: dict[str, Any]) -> None:
        print(json.dumps(what, allow_nan=False), file=output, flush=True)

    _prepare(order["section"])
    _section(order["section"])(order, report)


def _own_output() -> TextIO:
    """Return the real standard output; standard output of the process goes to standard error from now on."""
    output = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    return output


def _prepare(section: str) -> None:
    """Set cores and environment before any engine is imported: each engine reads the number of cores when it starts."""
    if section == "batch" and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {SINGLE_THREAD}".strip()
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    os.environ["JAX_ENABLE_X64"] = "1"
    os.environ["JAX_PLATFORMS"] = "cpu"


def _section(name: str) -> Callable[[dict[str, Any], Callable[[dict[str, Any]], None]], None]:
    if name in ("single", "batch"):
        return _contests
    from .kernel_section import own_section
    from .start_section import start_section

    return {"own": own_section, "start": start_section}[name]


def _contests(order: dict[str, Any], report: Callable[[dict[str, Any]], None]) -> None:
    from .measurement import hold, versions
    from .plan import measurements

    if order["section"] == "single" and not order["done"]:
        report({"versions": versions(report)})
    planned = measurements(order["section"], order["quick"])
    without = {(row, implementation): reason for row, implementation, reason in order["without"]}
    for i, measurement in enumerate(planned):
        if measurement.name in order["done"]:
            continue
        report({"share": i / len(planned), "text": measurement.name})
        crashed = {who: reason for (row, who), reason in without.items() if row in (measurement.name, "*")}
        hold(replace(measurement, left_out={**measurement.left_out, **crashed}), report)
        report({"done": measurement.name})


if __name__ == "__main__":
    main()
