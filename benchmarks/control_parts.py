"""Processor time of the parts of control in a live recording, in a replay that takes the same decisions.

    python benchmarks/control_parts.py out/live.mcap

An answer of control has to reach the guard within the tick; the parts after it must end before the next one. The last
line counts cold starts of the arm model's closure, which take longer than a tick has left.
"""

import argparse
import functools
import os
import sys
import time
from collections import defaultdict
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from exograv.cli import main as command_line
from exograv.identification.core.arm_model import ArmModel
from exograv.live.live_control import LiveControl
from exograv.loop.drift_monitor import DriftMonitor

PARTS = {
    "answer": (LiveControl, "answer"),
    "new estimate in force": (LiveControl, "_publish_found"),
    "drift monitor": (DriftMonitor, "take"),
    "cold start": (ArmModel, "_close"),
}
"""Methods by the names of the parts."""


def timed(owner: type, name: str, into: list[int]) -> None:
    """Let a method note the processor time of each call [ns]."""
    own = getattr(owner, name)

    @functools.wraps(own)
    def watched(*given):
        begun = time.thread_time_ns()
        try:
            return own(*given)
        finally:
            into.append(time.thread_time_ns() - begun)

    setattr(owner, name, watched)


def main() -> None:
    """Replay the recording, and print a line per part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    recording = parser.parse_args().recording
    times = defaultdict[str, list[int]](list)
    for part, (owner, name) in PARTS.items():
        timed(owner, name, times[part])
    sys.argv = ["exograv", "data", "replay", str(recording)]
    try:
        command_line()
    except SystemExit as end:
        if end.code:
            raise
    for part, noted in times.items():
        us = 1e-3 * np.array(noted or [0])
        p50, p99, p999 = np.percentile(us, [50.0, 99.0, 99.9])
        times_us = f"median {p50:.1f} µs, 99 % {p99:.1f}, 99.9 % {p999:.1f}, longest {us.max():.0f}"
        print(f"{part}: {len(noted)} calls; {times_us}")


if __name__ == "__main__":
    main()
