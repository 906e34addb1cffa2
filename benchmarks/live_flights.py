"""Live identifications under load, over the twin and over simulated drives on UDP and CAN, beside a bare loop in C.

    python benchmarks/live_flights.py --flights 10            # 10 seeds of each of the three, an hour and a half
    python benchmarks/live_flights.py --flights 2 --kinds udp # a short look

Each flight is `exograv run live --identify 20` in real time while the computer is busy: eight endless loops and disk
writes. On each processor, a bare loop (absolute sleep once per millisecond, no work) runs with the highest priority. It
shows the pauses of the computer itself. A stop is excused if one of them started so late in the second before it that
the guard misses too many ticks by that alone.

The goal: 10 of 10 flights of each kind end without a stop that is not excused, and the left over (residual gravity
torque) is within 20 % of a flight in which the drives wait for the computer (for the twin: `exograv arm identify`).
Finished flights are kept in `--out`; the same command goes on after them. With `--prepare` nothing flies in real time:
the computer then need not be free.
"""

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exograv.files import append_rows
from exograv.laboratory.simulated_drives.drive_sim import DRIVES_PRIORITY
from exograv.recording import read_recording
from exograv.safety.guard import IN_WINDOW_MAX_MS
from live_loop import BARE, ROOT, compiled, load

DRIVES = {"twin": None, "udp": "udp.toml", "can": "canopen.toml"}
IDENTIFY_S, FLOATS_S = 20, 10
BARE_TICKS = 600_000
WATCH_PRIORITY = DRIVES_PRIORITY + 5
EXCUSE_MS = IN_WINDOW_MAX_MS
"""Lateness of the bare loop from which the guard misses more ticks than it bridges, at any period [ms]."""

STOPPED = 2
"""Smallest `safe_state` of a tick in a descent."""


@dataclass(frozen=True)
class Flight:
    """Figures of one flight."""

    kind: str
    seed: int
    stop: str
    """Cause of the first stop; empty without one."""
    bare_late_ms: float
    """Largest lateness of a bare loop in the second before the first stop, or in the whole flight [ms]."""
    is_excused: bool
    left_over: tuple[float, ...]
    """Residual gravity torque per joint [N·m]; empty if no arm was identified."""
    waiting: tuple[float, ...]
    """The same where the drives wait [N·m]."""
    loop: str
    seconds: float


def command(*words: str, folder: Path) -> dict[str, Any]:
    """Run a command of exograv, and return its figures; empty if it wrote none."""
    figures = folder / "figures.json"
    figures.unlink(missing_ok=True)
    whole = [sys.executable, "-m", "exograv", *words, "--json", str(figures), "--out", str(folder)]
    done = subprocess.run(whole, capture_output=True, text=True, check=False, cwd=ROOT)
    if not figures.exists():
        print(f"exograv {' '.join(words)}: exit status {done.returncode}\n{done.stdout[-600:]}{done.stderr[-600:]}")
        return {}
    return json.loads(figures.read_text(encoding="utf-8"))


def drive_words(kind: str) -> list[str]:
    """Return the options of simulated drives; none for the twin."""
    file = DRIVES[kind]
    return [] if file is None else ["--simulate", "--drives", str(ROOT / "examples" / "drives" / file)]


def left_over(figures: dict[str, Any]) -> tuple[float, ...]:
    """Return the left over of a live run; empty if no arm was identified."""
    identified = figures.get("identified") or {}
    return tuple(identified.get("left_over_Nm") or ())


def fly_waiting(kind: str, seed: int, folder: Path) -> tuple[float, ...]:
    """Identify the same arm while the drives wait for the computer; return what is left over."""
    seconds = str(IDENTIFY_S)
    if kind == "twin":
        figures = command("arm", "identify", "--seed", str(seed), "--seconds", seconds, folder=folder)
        return tuple((figures.get("left_over_rms_Nm") or {}).get("total", {}).get("identified") or ())
    words = ["run", "live", *drive_words(kind), "--seed", str(seed), "--identify", seconds, "--seconds", "1"]
    return left_over(command(*words, folder=folder))


def prepared(kind: str, seed: int, folder: Path) -> tuple[float, ...]:
    """Calibrate the drives, pass the self-test and identify while the drives wait; return what is left over there.

    The result is kept in the folder, and nothing is done twice.
    """
    kept = folder / "waiting.json"
    if not kept.exists():
        if DRIVES[kind] is not None:
            for step in ("calibrate", "self-test"):
                command("rig", step, *drive_words(kind), "--seed", str(seed), folder=folder)
        found = fly_waiting(kind, seed, folder)
        if not found:
            return ()  # what failed is tried again
        kept.write_text(json.dumps(found), encoding="utf-8")
    return tuple(json.loads(kept.read_text(encoding="utf-8")))


@contextlib.contextmanager
def watched(bare: str) -> Iterator[list[tuple[np.ndarray, np.ndarray]]]:
    """Run a bare loop on each processor; the list has their times [s] and lateness [ns] at the end."""
    found: list[tuple[np.ndarray, np.ndarray]] = []
    with contextlib.ExitStack() as stack:
        loops = [
            stack.enter_context(
                subprocess.Popen([bare, str(BARE_TICKS), str(WATCH_PRIORITY), str(cpu), "0"], stdout=subprocess.PIPE)
            )
            for cpu in sorted(os.sched_getaffinity(0))
        ]
        try:
            yield found
        finally:
            for loop in loops:
                loop.terminate()
            for loop in loops:
                written = np.frombuffer(loop.communicate()[0], np.int64)
                late_ns = written[1:].reshape(2, -1)[0]
                found.append((1e-9 * written[0] + 1e-3 * np.arange(len(late_ns)), late_ns))


def fly(kind: str, seed: int, folder: Path, bare: str, waiting: tuple[float, ...]) -> Flight:
    """Fly in real time under load beside the bare loops."""
    words = ["run", "live", "--seed", str(seed), "--identify", str(IDENTIFY_S), "--seconds", str(FLOATS_S)]
    words += [] if DRIVES[kind] is None else [*drive_words(kind), "--real-time"]
    begun = time.monotonic()
    with watched(bare) as lateness:
        figures = command(*words, folder=folder)
    stops = figures.get("latches") or []
    stop_s = np.inf
    if stops:
        ticks = read_recording(Path(figures["recording"])).ticks
        stop_s = float(ticks["monotonic"][np.argmax(ticks["safe_state"] >= STOPPED)])
    late_ms = 0.0
    for at_s, late_ns in lateness:
        near = late_ns[(at_s <= stop_s + 0.1) & ((at_s >= stop_s - 1.0) | (not stops))]
        late_ms = max(late_ms, 1e-6 * float(near.max(initial=0)))
    stop = stops[0]["cause"] if stops else "" if figures else "The command failed."
    loop = "C" if "loop in C" in figures.get("granted", ()) else "Python"
    return Flight(
        kind,
        seed,
        stop,
        round(late_ms, 2),
        bool(stops) and late_ms > EXCUSE_MS,
        left_over(figures),
        waiting,
        loop,
        round(time.monotonic() - begun, 1),
    )


def is_near(flight: Flight) -> bool:
    """Return True if the left over is within 20 % of the flight that waits, or below it, in each joint."""
    if not flight.left_over or len(flight.left_over) != len(flight.waiting):
        return False
    return bool(np.all(np.array(flight.left_over) <= 1.2 * np.array(flight.waiting)))


def show(flights: list[Flight]) -> None:
    """Print a line per flight, and the sums."""
    for one in flights:
        values = " ".join(f"{value:.2f}" for value in one.left_over) or "–"
        waits = " ".join(f"{value:.2f}" for value in one.waiting) or "–"
        print(
            f"{one.kind} {one.seed} (loop in {one.loop}, {one.seconds:.0f} s): {one.stop or 'complete.'} "
            f"Bare loop late by up to {one.bare_late_ms} ms. Left over {values}; waiting {waits}."
        )
    for kind in DRIVES:
        of_kind = [one for one in flights if one.kind == kind]
        if of_kind:
            stopped = [one for one in of_kind if one.stop]
            print(
                f"{kind}: {len(of_kind) - len(stopped)} of {len(of_kind)} without a stop, "
                f"{sum(one.is_excused for one in stopped)} of {len(stopped)} stops excused, "
                f"{sum(map(is_near, of_kind))} within 20 % of the waiting flight"
            )


def main() -> None:
    """Fly all flights that are not kept yet, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", default=list(DRIVES), choices=list(DRIVES))
    parser.add_argument("--load", default="busy", choices=["idle", "busy", "browser"])
    parser.add_argument("--prepare", action="store_true", help="only calibrate, test and identify without real time")
    parser.add_argument("--out", type=Path, default=Path("out/live_flights"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    kept = options.out / "flights.jsonl"
    lines = kept.read_text(encoding="utf-8").splitlines() if kept.exists() else []
    flights = [Flight(**json.loads(line)) for line in lines]
    done = {(one.kind, one.seed) for one in flights}
    with tempfile.TemporaryDirectory() as spare:
        bare = compiled(BARE, Path(spare))
        for seed in range(options.first_seed, options.first_seed + options.flights):
            for kind in options.kinds:
                if (kind, seed) in done:
                    continue
                folder = options.out / f"{kind}{seed}"
                folder.mkdir(exist_ok=True)
                waiting = prepared(kind, seed, folder)
                if options.prepare:
                    continue
                with contextlib.nullcontext() if options.load == "idle" else load(options.load, Path(spare)):
                    flights.append(fly(kind, seed, folder, bare, waiting))
                append_rows(kept, [asdict(flights[-1])])
                show(flights[-1:])
    show(flights)


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    main()
