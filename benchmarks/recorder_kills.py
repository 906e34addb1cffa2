"""Cost of a killed recorder, and time of forcing ticks to the disk (docs/explanation/realtime.md).

    python benchmarks/recorder_kills.py --kills 100 --syncs 240

The recorder is killed by SIGKILL at random moments while ticks arrive, each fifth time just after its start. Its file
is then compared with the ticks that the recorder had acknowledged, and at the end with all ticks put in. Afterwards a
quarter of a second of ticks is written and synced `--syncs` times, and each sync is timed. Nothing is paced: the disk
is as busy as it can be.
"""

import argparse
import contextlib
import json
import os
import platform
import signal
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from exograv.recording import RecordingWriter, read_recording
from exograv.recording.encoding import tick_dtype
from exograv.runtime.recorder.recorder import Recorder

JOINTS = ("rotation", "abduction", "flexion", "elbow")
SYNC_S = 0.02
"""Sync period [s], a tenth of that of a run: a kill then meets a write or a sync ten times as often."""

RUN_S = 600.0
TICKS = 250
"""Ticks per block: a quarter of a second."""


@dataclass
class Kills:
    """Result of all kills."""

    kills: int
    restarts: int = 0

    put: int = 0
    """Ticks put into the ring."""

    recorded: int = 0
    """Ticks in the file if they are in order and each once, else -1."""

    acknowledged_and_missing: int = 0
    """Acknowledged ticks that the file lacks, over all kills."""

    lost: int = 0
    """Ticks that found the ring full."""

    back_s: tuple[float, float] = (0.0, 0.0)
    """Time from the start of another recorder to its first acknowledgement [s]: median and longest."""

    put_us: tuple[float, ...] = ()
    """Time of a put [µs]: median, 99 %, 99.9 %, longest."""


def ticks(first: int, count: int) -> np.ndarray:
    """Return numbered ticks of noise, which compresses worst."""
    rows = np.zeros(count, tick_dtype(len(JOINTS)))
    rows["sequence"] = np.arange(first, first + count)
    rows["t"] = 1e-3 * rows["sequence"]
    rng = np.random.default_rng(first)
    for name in ("q_measured", "q_reference", "v", "current", "tau_measured", "tau_desired", "tau_commanded"):
        rows[name] = rng.normal(size=(count, len(JOINTS)))
    return rows


def kill_at_random(path: Path, kills: int, seed: int) -> Kills:
    """Kill the recorder `kills` times; five ticks arrive every five milliseconds."""
    rng, found, put_us, back_s = np.random.default_rng(seed), Kills(kills), [], []
    with Recorder(path, JOINTS, {}, RUN_S, SYNC_S) as recorder, contextlib.closing(recorder.inlet.ticks()) as ring:

        def put() -> int:
            for row in ticks(found.put, 5):
                start = time.perf_counter_ns()
                ring.put(row)
                put_us.append(1e-3 * (time.perf_counter_ns() - start))
            found.put += 5
            time.sleep(0.005)
            return recorder.check().acknowledged

        for kill in range(kills):
            start, before = time.monotonic(), ring.acknowledged
            while kill % 5 and put() == before:
                pass
            back_s.append(time.monotonic() - start)
            until = time.monotonic() + rng.uniform(0.0, 4.0 * SYNC_S)
            while time.monotonic() < until:
                put()
            pid, restarts = recorder.pid, recorder.check().restarts
            os.kill(pid, signal.SIGKILL)
            os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
            in_file = sequence(path) if ring.acknowledged else []
            found.acknowledged_and_missing += len(set(range(ring.acknowledged)) - set(in_file))
            while recorder.check().restarts == restarts:
                pass
        report = recorder.finish()
    found.restarts, found.lost = report.restarts, report.lost
    kept = sequence(path)
    found.recorded = len(kept) if kept == list(range(len(kept))) else -1
    used = [back for kill, back in enumerate(back_s) if kill % 5 and kill]
    found.back_s = (float(np.median(used)), max(used)) if used else (0.0, 0.0)
    found.put_us = tuple(float(value) for value in np.percentile(put_us, [50, 99, 99.9, 100]))
    return found


def sequence(path: Path) -> list[int]:
    """Numbers of the ticks in the file, in their order."""
    return read_recording(path).ticks["sequence"].tolist()


def sync_times(path: Path, count: int) -> tuple[np.ndarray, float, float]:
    """Return the time of each sync [ms], the processor time of all [s], and bytes per tick."""
    found, blocks = [], [ticks(TICKS * k, TICKS) for k in range(count)]
    with RecordingWriter(path, JOINTS, {}) as recording:
        recording.sync()
        empty, busy = path.stat().st_size, time.process_time()
        for block in blocks:
            start = time.perf_counter()
            recording.ticks(block)
            recording.sync()
            found.append(1e3 * (time.perf_counter() - start))
        return np.array(found), time.process_time() - busy, (path.stat().st_size - empty) / (TICKS * count)


def main() -> None:
    """Measure, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--syncs", type=int, default=240)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--folder", type=Path, help="folder on the disk to measure; default: temporary folder")
    parser.add_argument("--json", action="store_true", help="figures of the kills only, for a test")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        kills = kill_at_random(Path(folder) / "kills.mcap", options.kills, options.seed)
        if options.json:
            print(json.dumps(asdict(kills)))
            return
        print(f"{platform.platform()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
        for name, value in asdict(kills).items():
            print(f"{name:26s} {value if isinstance(value, int) else ', '.join(f'{one:.3g}' for one in value)}")
        times, busy_s, bytes_a_tick = sync_times(Path(folder) / "syncs.mcap", options.syncs)
        p50, p99, worst = np.percentile(times, [50, 99, 100])
        share = 100.0 * busy_s / (1e-3 * TICKS * options.syncs)
        print(f"{options.syncs} syncs of {TICKS} ticks, {bytes_a_tick:.0f} bytes a tick: ", end="")
        print(f"median {p50:.1f} ms, 99 % {p99:.1f} ms, worst {worst:.1f} ms; {share:.2f} % of a processor at 1 kHz")


if __name__ == "__main__":
    main()
