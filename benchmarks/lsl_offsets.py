"""Accuracy of LSL streams between processes (docs/howto/lsl.md): error of the stamps, delay, lost samples.

    python benchmarks/lsl_offsets.py --minutes 10

A loop puts 1000 ticks a second into the rings of a recorder, which publishes and records them. A consumer in another
process, plain pylsl, notes each sample's stamp, corrected by LSL, and its time of arrival. Two devices in further
processes send 250 samples a second, each with the true time. One device has a clock that is shifted and runs fast
(a library replaces its clock); the other uses the computer's clock. The recorder records both, and the result of
`exograv data sync` is compared with the truth. All processes run on one computer: these figures contain no network.
"""

import argparse
import contextlib
import json
import os
import secrets
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from exograv.recording import Recording, read_recording
from exograv.recording.encoding import tick_dtype
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.lsl.outlets import OutletsJob
from exograv.runtime.recorder.recorder import Recorder
from exograv.study.sync import stream_figures

JOINTS = ("rotation", "abduction", "flexion", "elbow")
PERIOD_S = 0.001
SHIFT_S, DRIFT = 1234.5, 50e-6
"""Offset of the one device's clock at its start [s], and its rate error against the computer's clock."""

DEVICE_HZ = 250.0
PROGRAMS = Path(__file__).parent / "lsl_programs"
NETWORK = "[ports]\nIPv6 = disable\n[multicast]\nResolveScope = machine\n[lab]\nSessionID = {}\n[log]\nlevel = -3\n"


def percentiles_us(seconds: np.ndarray) -> dict[str, float]:
    """Return median, 99 %, 99.9 % and largest of the absolute values [µs]."""
    names, values = ("p50", "p99", "p999", "max"), np.percentile(np.abs(seconds), [50, 99, 99.9, 100])
    return {name: round(1e6 * float(value), 1) for name, value in zip(names, values, strict=True)}


@contextlib.contextmanager
def program(name: str, *words: str, environment: dict[str, str] | None = None) -> Iterator[subprocess.Popen[bytes]]:
    """Run another process; it has printed that it is ready."""
    command = [sys.executable, str(PROGRAMS / f"{name}.py"), *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env={**os.environ, **(environment or {})}) as process:
        assert process.stdout is not None
        process.stdout.readline()
        try:
            yield process
        finally:
            process.terminate()


def other_clock(folder: Path) -> dict[str, str] | None:
    """Environment of a process whose CLOCK_MONOTONIC is shifted and fast; None if there is no C compiler."""
    library = folder / "other_clock.so"
    source = str(PROGRAMS / "other_clock.c")
    try:
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", str(library), source, "-ldl"], check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    start = time.monotonic()
    return {
        "LD_PRELOAD": str(library),
        "CLOCK_SHIFT_NS": str(round(1e9 * SHIFT_S)),
        "CLOCK_DRIFT_PPB": str(round(1e9 * DRIFT)),
        "CLOCK_START_NS": str(round(1e9 * start)),
    }


def put_ticks(recorder: Recorder, listening: Listening, seconds: float) -> int:
    """Put a thousand ticks a second, each stamped when it is put in; return their number."""
    row = np.zeros((), tick_dtype(len(JOINTS)))
    row["cdr_header"] = (0, 1, 0, 0)
    ticks, count, begun = recorder.inlet.ticks(), 0, time.monotonic()
    while count < seconds / PERIOD_S:
        time.sleep(max(0.0, begun + PERIOD_S * count - time.monotonic()))
        row["monotonic"] = time.monotonic()
        row["t"] = row["now"] = PERIOD_S * count
        row["sequence"] = count = count + 1
        ticks.put(row)
        if count % 100 == 0:
            listening.check()
            recorder.check()
    time.sleep(1.0)
    ticks.close()
    return count


def measure(seconds: float, folder: Path) -> dict[str, Any]:
    """Run all processes together; return the figures."""
    outlets = OutletsJob("benchmark", JOINTS, PERIOD_S)
    path, noted = folder / "a.mcap", folder / "consumer.npy"
    faked = other_clock(folder)
    with contextlib.ExitStack() as stack:
        names = ["own-clock"] + (["other-clock"] if faked else [])
        for name in names:
            environment = faked if name == "other-clock" else None
            stack.enter_context(program("device", name, str(DEVICE_HZ), environment=environment))
        listening = stack.enter_context(Listening(names))
        recorder = stack.enter_context(
            Recorder(path, JOINTS, {}, seconds, outlets=outlets, devices=listening.devices),
        )
        consumer = stack.enter_context(program("consumer", f"exograv-{outlets.token}-jointstate", str(noted)))
        listening.begin(recorder.write)
        count = put_ticks(recorder, listening, seconds)
        consumer.terminate()
        consumer.wait()
        listening.finish()
        report = recorder.finish()
    recording = read_recording(path)
    return {
        "seconds": seconds,
        "ticks_put": count,
        "ticks_recorded": len(recording.ticks),
        "ticks_lost": report.lost,
        **consumer_figures(np.load(noted), recording, count),
        "devices": [device_figures(recording, name) for name in names],
    }


def consumer_figures(noted: np.ndarray, recording: Recording, count: int) -> dict[str, Any]:
    """Figures of the consumer from `noted` (sample, 4): sequence, stamp, LSL's correction, time of arrival [s]."""
    true = dict(zip(recording.ticks["sequence"].tolist(), recording.ticks["monotonic"].tolist(), strict=True))
    sequence, stamp, correction, came = noted.T
    truth = np.array([true[int(number)] for number in sequence])
    return {
        "received": len(sequence),
        "missing_after_first": int(count - sequence[0] + 1 - len(np.unique(sequence))),
        "stamp_error_us": percentiles_us(stamp - truth),
        "stamp_error_corrected_us": percentiles_us(stamp + correction - truth),
        "delay_us": percentiles_us(came - truth),
    }


def device_figures(recording: Recording, name: str) -> dict[str, Any]:
    """Figures of a device whose samples hold the true time and a count."""
    stream = next(one for one in recording.streams if one.name == name)
    figures, true = stream_figures(stream), stream.values[:, 0] - slept_s()
    (clock,) = figures["clocks"]
    lacks = true - stream.stamps
    drift, _ = np.polyfit(stream.stamps - stream.stamps.mean(), lacks, 1)
    missing = int(stream.values[-1, 1] - stream.values[0, 1] + 1 - len(stream.stamps))
    return {
        "name": name,
        "samples": len(stream.stamps),
        "missing": missing,
        "offset_true_s": float(np.median(lacks)),
        "drift_true_ppm": 1e6 * float(drift),
        **{key: clock[key] for key in ("drift_ppm", "drift_ci95_ppm", "measured", "round_trip_us", "certain_to_us")},
        "error_us": percentiles_us(stream.monotonic - true),
        "raw_error_s": float(np.median(np.abs(lacks))),
    }


def slept_s() -> float:
    """Offset of a device's true clock from CLOCK_MONOTONIC [s]: the time that the computer was suspended."""
    ahead = time.clock_gettime(time.CLOCK_BOOTTIME) - time.monotonic()
    return ahead if ahead > 0.01 else 0.0


def main() -> None:
    """Measure, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        network = Path(folder) / "lsl_api.cfg"
        network.write_text(NETWORK.format(f"benchmark-{secrets.token_hex(4)}"))
        os.environ["LSLAPICFG"] = str(network)
        figures = measure(60.0 * options.minutes, Path(folder))
    text = json.dumps(figures, indent=1)
    print(text)
    if options.json:
        options.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
