"""Control loop over UDP against `exograv dev drive-sim udp` in another process: rate, round trips, losses, reactions.

python benchmarks/udp_loop.py --seconds 60
python benchmarks/udp_loop.py --seconds 60 --device "python examples/udp_peer/peer.py {port}"   # or a compiled peer.c
"""

import argparse
import contextlib
import gc
import json
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from exograv.model.description import load_rig
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated.address import free_port
from exograv.rig.drives.udp import UdpRig
from exograv.runtime.clock.host import loop_cpus
from exograv.runtime.clock.realtime import realtime
from exograv.signals import Command

ROOT = Path(__file__).parents[1]
CURRENT, LIFE_S = 0.2, 0.005
REACTIONS = 10
TOLD = re.compile(r"WATCHDOG; last command ([\d.]+) ms before")


@contextlib.contextmanager
def device(command: str | None, is_realtime: bool) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """Start a device in another process; yield the process and the `drives.toml` with its port."""
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        path = Path(folder) / "drives.toml"
        text = (ROOT / "examples" / "drives" / "udp.toml").read_text(encoding="utf-8")
        path.write_text(text.replace("port = 47100", f"port = {port}"), encoding="utf-8")
        ours = [sys.executable, "-m", "exograv.cli", "drive-sim", "udp", "--drives", str(path)]
        words = ours if command is None else shlex.split(command.format(port=port))
        words = ["chrt", "-f", "50", *words] if is_realtime else words
        pipe = subprocess.PIPE
        with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True) as process:
            assert process.stdout is not None
            print(process.stdout.readline().rstrip())
            try:
                yield process, path
            finally:
                process.kill()


def percentiles(seconds: list[float]) -> dict[str, float]:
    """Return percentiles [µs]."""
    values = 1e6 * np.array(seconds)
    shares = np.percentile(values, [50.0, 99.0, 99.9, 100.0]).tolist()
    return {name: round(value, 1) for name, value in zip(("p50", "p99", "p999", "max"), shares, strict=True)}


class Loop:
    """Loop that reads and writes at absolute deadlines."""

    def __init__(self, rig: UdpRig):
        self._rig, self._nothing = rig, np.zeros(len(rig.joints))
        self._current, self._damping = np.full(len(rig.joints), CURRENT), np.zeros(len(rig.joints))
        self.read_s: list[float] = []
        self.write_s: list[float] = []
        self.late_s: list[float] = []
        self.lost = 0

    def tick(self, due: float) -> Any:
        """Run one period; return its state."""
        rig = self._rig
        time.sleep(max(due - time.monotonic(), 0.0))
        woken = time.monotonic()
        state = rig.read()
        read = time.monotonic()
        t = rig.t
        rig.write(Command(t, state.sequence, t + LIFE_S, self._nothing, self._current, self._damping))
        self.late_s.append(woken - due)
        self.read_s.append(read - woken)
        self.write_s.append(time.monotonic() - read)
        return state

    def run(self, seconds: float) -> dict[str, Any]:
        """Run for `seconds`; return the figures."""
        rig, ticks = self._rig, round(seconds / self._rig.period_s)
        rig.enable()
        begun = due = time.monotonic()
        before, trips = rig.read().sequence, 0
        for _ in range(ticks):
            due = max(due + rig.period_s, time.monotonic() - 0.01)
            state = self.tick(due)
            self.lost += state.sequence <= before
            before = state.sequence
            if state.faulty:
                trips += 1
                rig.enable()
        took = time.monotonic() - begun
        return {
            "seconds": round(took, 1),
            "rate_Hz": round(ticks / took, 1),
            "late_us": percentiles(self.late_s),
            "round_trip_us": percentiles(self.read_s),
            "write_us": percentiles(self.write_s),
            "lost_or_late": self.lost,
            "of_ticks": ticks,
            "watchdogs_by_stalls": trips,
            "counts": dict(rig.counts),
        }


def reactions(rig: UdpRig, process: subprocess.Popen[str]) -> dict[str, Any]:
    """Reaction times [ms]: the drives' watchdogs by their own report; our driver to a lost drive and controller."""
    assert process.stdin is not None
    assert process.stdout is not None
    figures: dict[str, list[float]] = {"watchdog_ms": [], "lost_drive_ms": [], "lost_controller_ms": []}
    for _ in range(REACTIONS):
        rig.enable()
        _until_heard(rig, 50)
        line = process.stdout.readline()  # no commands are sent meanwhile
        while not (match := TOLD.search(line)):
            line = process.stdout.readline()
        figures["watchdog_ms"].append(float(match[1]))
        for name, order, back in (
            ("lost_drive_ms", "unplug elbow_flexion", "plug elbow_flexion"),
            ("lost_controller_ms", "cut", "mend"),
        ):
            rig.enable()
            _until_heard(rig, 50)
            process.stdin.write(order + "\n")
            process.stdin.flush()
            figures[name].append(1e3 * _until_faulty(rig))
            process.stdin.write(back + "\n")
            process.stdin.flush()
            _until_heard(rig, 100)
    return {name: {"median": float(np.median(x)), "max": max(x)} for name, x in figures.items()}


def _until_heard(rig: UdpRig, ticks: int) -> None:
    loop, due = Loop(rig), time.monotonic()
    for _ in range(ticks):
        due = max(due + rig.period_s, time.monotonic() - 0.01)
        loop.tick(due)


def _until_faulty(rig: UdpRig) -> float:
    """Time from the last poll with a good answer to the reported fault [s]."""
    loop, due, good = Loop(rig), time.monotonic(), rig.t
    while True:
        due = max(due + rig.period_s, time.monotonic() - 0.01)
        state = loop.tick(due)
        if state.faulty:
            return rig.t - good
        good = state.t


def main() -> None:
    """Run, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--device", help="command in place of drive-sim; {port} is filled in")
    parser.add_argument("--realtime", action="store_true", help="real-time scheduling on both sides, as in `run live`")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    gc.disable()
    rights = realtime(loop_cpus().guard) if options.realtime else contextlib.nullcontext()
    with device(options.device, options.realtime) as (process, path), rights:
        drives = load_drives(path, load_rig("recupera_like"))
        with UdpRig(drives) as rig:
            figures = Loop(rig).run(options.seconds)
            if options.device is None:
                figures |= reactions(rig, process)
    for name, value in figures.items():
        print(f"{name}: {value}")
    if options.json is not None:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
