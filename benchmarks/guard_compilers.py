"""Time of the guard's tick when numba compiles `core.py`, beside the C that we ship, on the same record.

    python3 -m venv out/numba && out/numba/bin/pip install numba
    python benchmarks/guard_compilers.py --numba out/numba/bin/python

Numba has an environment of its own, because it pins another llvmlite. Both run a floating arm's tick (first and second
half) from Python and from native code; least mean of seven rounds.
"""

import argparse
import ast
import ctypes
import os
import subprocess
import sys
import tempfile
import time
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "exograv" / "safety" / "native" / "core.py"
ROUNDS, TICKS, FROM_PYTHON = 7, 20_000, 5_000
MANY = """
void many(void (*see)(double *), void (*decide)(double *, double *), double *r, double *w, long n)
{
    for (long k = 0; k < n; k++) {
        see(r);
        decide(r, w);
    }
}
"""


def least_us(work: Callable[[], object], ticks: int) -> float:
    """Return the least mean time of a tick [µs]."""
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / ticks


def repeated(see: Callable[[], object], decide: Callable[[], object]) -> None:
    """Run ticks from Python."""
    for _ in range(FROM_PYTHON):
        see()
        decide()


def floating() -> Any:
    """Return the record of a random worn machine after thirty ticks without a stop."""
    sys.path.insert(0, str(ROOT))
    import numpy as np
    from tests.safety.random_machines import draw_history, draw_machines, first_guard, first_step

    rng = np.random.default_rng(4)
    machines = draw_machines(rng, 20, 4)
    with np.errstate(all="ignore"):
        history = draw_history(rng, machines, 30)
        for b in np.flatnonzero(machines.worn).tolist():
            guard, _ = first_guard(machines, b)
            for k in range(30):
                first_step(guard, history, k, b)
            if guard.envelope.stop is None:
                return guard.envelope.record
    raise SystemExit("No machine floats.")


def time_c(folder: Path) -> None:
    """Time the shipped guard, and write its record for the other compiler."""
    import numpy as np

    record = floating()
    np.savez(folder / "record.npz", r=record.view, w=np.array(record._table))
    if record.library is None:
        raise SystemExit("The guard is not compiled on this computer. Install a C compiler, then exograv again.")
    (folder / "many.c").write_text(MANY, encoding="utf-8")
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", folder / "many.so", folder / "many.c"], check=True)
    many = ctypes.CDLL(str(folder / "many.so")).many
    halves = [ctypes.cast(getattr(record.library, f"guard_{name}"), ctypes.c_void_p) for name in ("see", "decide")]
    memory = [ctypes.c_void_p(address) for address in record.memory()]
    tick = record.tick
    native = least_us(lambda: many(*halves, *memory, ctypes.c_long(TICKS)), TICKS)
    from_python = least_us(lambda: repeated(tick.see, tick.decide), FROM_PYTHON)
    print(f"C: {native:.2f} µs in native code, {from_python:.2f} µs from Python")


def time_numba(folder: Path) -> None:
    """Time the same source compiled by numba; runs in numba's own environment."""
    import numba  # type: ignore[import-not-found] - only in numba's own environment
    import numpy as np

    tree = ast.parse(SOURCE.read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            node.returns, node.decorator_list = None, [ast.Name("compiled", ast.Load())]
            for argument in node.args.args:
                argument.annotation = None
    module = types.ModuleType("core")
    vars(module)["compiled"] = numba.njit
    exec(compile(ast.fix_missing_locations(tree), "core", "exec"), vars(module))
    see, decide = vars(module)["see"], vars(module)["decide"]

    @numba.njit
    def many(r, w, n):
        for _ in range(n):
            see(r)
            decide(r, w)

    given = np.load(folder / "record.npz")
    r, w = given["r"].copy(), given["w"].copy()
    start = time.perf_counter()
    many(r, w, 1)
    see(r)
    decide(r, w)
    took = time.perf_counter() - start
    native = least_us(lambda: many(r, w, TICKS), TICKS)
    from_python = least_us(lambda: repeated(lambda: see(r), lambda: decide(r, w)), FROM_PYTHON)
    print(f"numba: {native:.2f} µs in native code, {from_python:.2f} µs from Python, {took:.1f} s to compile")


def main() -> None:
    """Time both, in one run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--numba", type=Path, required=True, help="Python interpreter with numba")
    parser.add_argument("--in-numba", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.in_numba is not None:
        time_numba(options.in_numba)
        return
    with tempfile.TemporaryDirectory() as spare:
        time_c(Path(spare))
        words = [options.numba, __file__, "--numba", options.numba, "--in-numba", spare]
        subprocess.run(words, check=True)


if __name__ == "__main__":
    main()
