"""Memory of a report, of a session, of the console's processes, and of any command.

    python benchmarks/memory.py report --ticks 1000000 4000000    # peak of a report, by the length of the recording
    python benchmarks/memory.py train --windows 6                 # memory of a session while it runs, and its growth
    python benchmarks/memory.py console --calibration out/calibration.toml    # share of each process (PSS)
    python benchmarks/memory.py command data replay out/demo.mcap    # peak of a command

A process's PSS counts a page of memory that several processes share in equal parts, so that the sum is what the
computer loses. Linux only.
"""

import argparse
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from exograv.recording import RecordingWriter
from exograv.recording.encoding import empty_ticks

JOINTS = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")
BLOCK = 100  # ticks between two skeletons, as in a session
FLOAT_SHARE = 0.2
SAMPLE_S = 0.5
REPORT = """
import sys
from pathlib import Path
from exograv.report.of_recording.recording_report import write_report
write_report(Path(sys.argv[1]), Path(sys.argv[2]))
for line in open("/proc/self/status"):
    if line.startswith("VmHWM"):
        print(line.split()[1])
"""


def write_long(path: Path, ticks: int, packed: bool = False) -> None:
    """Write a recording of a made-up session: noisy ticks, skeletons at 10 Hz, estimates at 5 Hz, a float phase."""
    rng = np.random.default_rng(0)
    with RecordingWriter(path, JOINTS, {"rig": "made up", "side": "right"}, packed=packed) as recording:
        recording.phase(0.0, "identify")
        begins = int((1.0 - FLOAT_SHARE) * ticks) // BLOCK * BLOCK
        for start in range(0, ticks, BLOCK):
            t = 1e-3 * start
            if start == begins:
                recording.phase(t, "float")
            recording.write("/skeleton", t, _skeleton(rng))
            if start % (2 * BLOCK) == 0 and start < begins:
                recording.write("/estimate", t, _estimate(t, rng))
            recording.ticks(_rows(start, min(BLOCK, ticks - start), 1 + (start >= begins), rng))


def _rows(start: int, n: int, phase: int, rng: np.random.Generator) -> np.ndarray:
    rows = empty_ticks(n, len(JOINTS))
    rows["t"] = 1e-3 * (start + np.arange(n))
    rows["phase"], rows["sequence"] = phase, start + np.arange(n)
    rows["tick_us"] = 1e-3 * np.rint(rng.lognormal(10.6, 0.2, n))  # whole nanoseconds
    for name in ("q_measured", "current", "tau_measured", "tau_feedforward", "tau_desired"):
        rows[name] = np.sin(rows["t"][:, None] + np.arange(len(JOINTS))) + 0.01 * rng.normal(size=(n, len(JOINTS)))
    rows["tau_commanded"] = np.clip(rows["tau_desired"], -1.0, 1.0)
    return rows


def _skeleton(rng: np.random.Generator) -> dict[str, list]:
    return {name: rng.normal(size=(points, 3)).tolist() for name, points in (("exo", 6), ("arm", 3))}


def _estimate(t: float, rng: np.random.Generator) -> dict[str, object]:
    parameters = [
        {"name": f"arm.mx{k}", "unit": "kg·m", "prior": 1.0, "estimate": value, "ci95": [value - 0.1, value + 0.1]}
        for k, value in enumerate(rng.normal(size=24).tolist())
    ]
    left = (1.0 / (1.0 + t) + 0.01 * rng.random(len(JOINTS))).tolist()
    return {"motion_s": t, "parameters": parameters, "predicted_left_over_Nm": left, "outcome": "made up"}


def peak_of_report_MB(recording: Path) -> float:
    """Return the largest resident memory of a process that writes the report of a recording."""
    page = recording.with_suffix(".html")
    told = subprocess.run(
        [sys.executable, "-c", REPORT, recording, page], check=True, capture_output=True, text=True
    ).stdout
    return 1024e-6 * int(told)


def pss_MB(pid: int) -> float:
    """Return the proportional share of memory of a process; 0 if it has ended."""
    try:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="utf-8")
    except OSError:
        return 0.0
    found = re.search(r"^Pss:\s+(\d+)", text, re.MULTILINE)
    return 1024e-6 * int(found[1]) if found else 0.0


def family(pid: int) -> Iterator[int]:
    """Yield a process and all that it has started."""
    yield pid
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in children.read_text(encoding="utf-8").split():
            yield from family(int(child))


def report(options: argparse.Namespace) -> None:
    """Print the peak of a report by the length of its recording."""
    print(f"{'ticks':>10} {'file [MB]':>10} {'peak [MB]':>10}")
    for ticks in options.ticks:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "long.mcap"
            write_long(path, ticks, options.packed)
            print(f"{ticks:10} {1e-6 * path.stat().st_size:10.0f} {peak_of_report_MB(path):10.0f}", flush=True)


def train(options: argparse.Namespace) -> None:
    """Print the memory of `exograv run train` while it runs."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["run", "train", "--participant", "P-01", "--protocol", options.protocol]
        process = subprocess.Popen(
            [sys.executable, "-m", "exograv.cli", *command, "--windows", str(options.windows), "--out", folder],
            stdout=subprocess.DEVNULL,
        )
        rows = list(_course(process, Path(folder)))
    print(f"{'recording [MB]':>14} {'memory [MB]':>12}")
    for size, memory in rows[:: max(1, len(rows) // 20)]:
        print(f"{size:14.1f} {memory:12.1f}")
    print(f"largest {max(memory for _, memory in rows):.0f} MB")


def _course(process: subprocess.Popen, folder: Path) -> Iterator[tuple[float, float]]:
    while process.poll() is None:
        yield 1e-6 * sum(path.stat().st_size for path in folder.glob("*.mcap")), pss_MB(process.pid)
        time.sleep(SAMPLE_S)


def console(options: argparse.Namespace) -> None:
    """Print the share of each process of a console."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["run", "console", "--no-browser", "--port", "0", "--out", folder]
        if options.calibration:
            command += ["--calibration", str(options.calibration)]
        process = subprocess.Popen(
            [sys.executable, "-m", "exograv.cli", *command], stdout=subprocess.DEVNULL, start_new_session=True
        )
        try:
            while process.poll() is None and len(list(family(process.pid))) < options.processes:
                time.sleep(SAMPLE_S)
            time.sleep(options.settle)
            _print_shares(process.pid)
        finally:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def command(options: argparse.Namespace) -> None:
    """Print the peak of a command of exograv."""
    status = subprocess.run([sys.executable, "-m", "exograv.cli", *options.words], check=False).returncode
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    print(f"exit status {status}, peak {1024e-6 * peak:.0f} MB")


def _print_shares(pid: int) -> None:
    shares = {each: pss_MB(each) for each in family(pid)}
    for each, share in shares.items():
        print(f"{_name(each):24} {share:8.1f} MB")
    print(f"{'sum':24} {sum(shares.values()):8.1f} MB")


def _name(pid: int) -> str:
    parts = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
    words = " ".join(part.decode(errors="replace") for part in parts[1:])
    return "resource tracker" if "resource_tracker" in words else f"process {pid} {words[:30]}"


def main() -> None:
    """Measure one part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(required=True)
    one = parts.add_parser("report", help=report.__doc__)
    one.add_argument("--ticks", type=int, nargs="+", default=[500_000, 2_000_000])
    one.add_argument("--packed", action="store_true", help="pack the ticks by column")
    one.set_defaults(run=report)
    one = parts.add_parser("train", help=train.__doc__)
    one.add_argument("--windows", type=int, default=6)
    one.add_argument("--protocol", default="familiarisation")
    one.set_defaults(run=train)
    one = parts.add_parser("console", help=console.__doc__)
    one.add_argument("--calibration", type=Path)
    one.add_argument("--processes", type=int, default=6, help="number of processes to wait for")
    one.add_argument("--settle", type=float, default=30.0, help="time before the measurement [s]")
    one.set_defaults(run=console)
    one = parts.add_parser("command", help=command.__doc__)
    one.add_argument("words", nargs=argparse.REMAINDER)
    one.set_defaults(run=command)
    options = parser.parse_args()
    options.run(options)


if __name__ == "__main__":
    main()
