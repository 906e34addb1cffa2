"""Latency of Stop in a steered session: from the call at the desk to the end of the tick that ramps the torque down.

    python benchmarks/stop_latency.py --calibration out/calibration.toml --presses 3000

Guard, control and recorder run as in a steered session, on the twin, at 1 kHz. The machine is off, and Stop is pressed
at random moments; the guard hears every press. The path between a page and the desk is not included.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from exograv.experiment.steered.live_session import LiveFlight
from exograv.experiment.steered.options import SteeredOptions
from exograv.experiment.steered.prepared_machine import PreparedMachine
from exograv.experiment.steered.requests import Stop
from exograv.experiment.steered.session_controller import SessionController
from exograv.recording import read_recording
from exograv.runtime.control_loop.exchange import STOP_PRESSED

APART_S = (0.004, 0.012)
START_MAX_S = 120.0


def presses(desk: SessionController, count: int) -> np.ndarray:
    """Press Stop `count` times; return the times on CLOCK_MONOTONIC [s]."""
    rng, pressed = np.random.default_rng(0), np.empty(count)
    for k in range(count):
        time.sleep(rng.uniform(*APART_S))
        pressed[k] = time.monotonic()
        desk.act(Stop(id=f"stop-{k:06d}", made_at_s=pressed[k]), "operator")
    return pressed


def main() -> None:
    """Run the session, press Stop, and evaluate the recording."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calibration", type=Path, help="of the twin, level 2, seed 1001; default: calibrate first")
    parser.add_argument("--presses", type=int, default=3000)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        options = SteeredOptions(seed=1001, calibration=arguments.calibration)
        desk = SessionController(LiveFlight(options, Path(folder), lambda side: PreparedMachine(options, side)))
        until = time.monotonic() + START_MAX_S
        while desk.shown().mode != "off" and time.monotonic() < until:
            time.sleep(0.1)
        time.sleep(1.0)
        pressed = presses(desk, arguments.presses)
        time.sleep(1.0)
        desk.close()
        ticks = read_recording(Path(folder) / "steered-1.mcap").ticks
    # The last press is that of the end. A press is heard at the end of a tick, and gives the torque of the next tick.
    heard = ticks[(ticks["acts"] & STOP_PRESSED) > 0]
    done = (heard["monotonic"] + 1e-6 * heard["tick_us"])[: len(pressed)]
    ms = 1e3 * (done - pressed[: len(done)])
    late = ticks["lateness_us"]
    print(f"{len(ms)} presses: p50 {np.percentile(ms, 50):.2f}, p99 {np.percentile(ms, 99):.2f}, "
          f"p99.9 {np.percentile(ms, 99.9):.2f}, most {ms.max():.2f} ms")  # fmt: skip
    print(f"{len(ticks)} ticks: late p99 {np.percentile(late, 99):.0f}, p99.9 {np.percentile(late, 99.9):.0f} µs")


if __name__ == "__main__":
    main()
