"""Control loop over `exograv dev drive-sim moteus` in another process: cost of our tick, and of the maker's asyncio.

python benchmarks/moteus_loop.py --seconds 20
python benchmarks/moteus_loop.py --seconds 2 --lock-step   # on a busy computer: only our own work is meaningful
"""

import argparse
import asyncio
import contextlib
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import moteus
import numpy as np

from exograv.errors import RigError
from exograv.model.description import load_rig
from exograv.rig.drives.moteus import MoteusRig
from exograv.rig.drives.settings import load_drives
from exograv.signals import Command

ROOT = Path(__file__).parents[1]
CURRENT, LIFE_S, DEADLINE_S = 0.2, 0.02, 0.2


@contextlib.contextmanager
def device(is_lock_step: bool) -> Iterator[Path]:
    """Start a simulated device in another process; yield the path of its `drives.toml`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drives.toml"
        text = (ROOT / "examples" / "drives" / "moteus.toml").read_text(encoding="utf-8")
        path.write_text(text.replace('path = "', f'path = "{folder}/'), encoding="utf-8")
        words = [sys.executable, "-m", "exograv.cli", "drive-sim", "moteus", "--drives", str(path)]
        words += ["--lock-step"] if is_lock_step else []
        pipe = subprocess.PIPE
        with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True) as process:
            assert process.stdout is not None
            print(process.stdout.readline().rstrip())
            try:
                yield path
            finally:
                process.kill()


def percentiles(seconds: list[float]) -> dict[str, float]:
    """Return percentiles [µs]."""
    values = np.percentile(1e6 * np.array(seconds), [50.0, 99.0, 99.9, 100.0]).tolist()
    return {name: round(value, 1) for name, value in zip(("p50", "p99", "p999", "max"), values, strict=True)}


def ours(rig: MoteusRig, seconds: float, is_lock_step: bool) -> dict[str, Any]:
    """Read and write at absolute deadlines for `seconds`; return the figures of our driver."""
    n, reads, writes, cpu = len(rig.joints), [], [], []
    nothing, current = np.zeros(n), np.full(n, CURRENT)
    trips, due, ticks = 0, time.monotonic(), round(seconds / rig.period_s)
    for _ in range(ticks):
        due = max(due + rig.period_s, time.monotonic() - 0.01)
        time.sleep(0.0 if is_lock_step else max(due - time.monotonic(), 0.0))
        begun, worked = time.perf_counter(), time.thread_time()
        state = rig.read()
        read = time.perf_counter()
        rig.write(Command(rig.t, state.sequence, rig.t + LIFE_S, nothing, current, nothing))
        writes.append(time.perf_counter() - read)
        reads.append(read - begun)
        cpu.append(time.thread_time() - worked)
        if state.faulty:
            trips += 1
            with contextlib.suppress(RigError):
                rig.enable()
    took = {"read_us": percentiles(reads), "write_us": percentiles(writes), "own_work_us": percentiles(cpu)}
    return {"ticks": ticks, **took, "stalls": trips, "counts": dict(rig.counts)}


async def makers(path: str, numbers: list[int], ticks: int) -> dict[str, Any]:
    """Run the library's own cycle as fast as possible: torque and query of all drives in one transaction."""
    transport, spent, cpu, lost = moteus.Fdcanusb(path), [], [], 0
    controllers = [moteus.Controller(id=number, transport=transport) for number in numbers]
    try:
        for _ in range(ticks):
            begun, worked = time.perf_counter(), time.thread_time()
            told = [
                one.make_position(
                    position=math.nan, feedforward_torque=0.1, kp_scale=0.0, kd_scale=0.0, watchdog_timeout=1.0,
                    query=True,
                )
                for one in controllers
            ]  # fmt: skip
            try:
                answers = await asyncio.wait_for(transport.cycle(told), DEADLINE_S)
            except (TimeoutError, RuntimeError):
                answers = []
            lost += len(answers) < len(numbers)
            spent.append(time.perf_counter() - begun)
            cpu.append(time.thread_time() - worked)
        await transport.cycle([one.make_stop() for one in controllers])
    finally:
        transport.close()
    return {"ticks": ticks, "cycle_us": percentiles(spent), "own_work_us": percentiles(cpu), "incomplete": lost}


def main() -> None:
    """Measure, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--lock-step", action="store_true")
    options = parser.parse_args()
    with device(options.lock_step) as path:
        drives = load_drives(path, load_rig("recupera_like"))
        assert drives.settings.moteus is not None
        with MoteusRig(drives, lock_step=options.lock_step) as rig:
            rig.enable()
            figures = {"ours": ours(rig, options.seconds, options.lock_step)}
        numbers = [drive.node for drive in drives.each]
        ticks = round(options.seconds / drives.period_s)
        figures["makers"] = asyncio.run(makers(drives.settings.moteus.path, numbers, ticks))
    print(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
