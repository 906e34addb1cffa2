"""CPU time of everything a user waits for, by part, of this tree and of another one in turns in the same run.

    python benchmarks/waits.py identification                  # 60 s of motion, four and seven joints
    python benchmarks/waits.py demo --beside FOLDER            # also the tree in FOLDER; ratios are fair under load
    python benchmarks/waits.py demo --rounds 3
    python benchmarks/waits.py whole-session                   # 31 windows, by part
    python benchmarks/waits.py session --beside FOLDER         # or faults, benchmark, sweep, study

Each measurement is a process of its own, with its tree first in PYTHONPATH and warm caches: its first run is left out.
CPU seconds count all threads of the process. Wall seconds are those of a possibly busy computer.
"""

import argparse
import collections
import contextlib
import ctypes
import functools
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent.parent
RIGS = ("recupera_like", "recupera_like_7")
MOTION_S = 60.0
OFF_SD = 0.2
"""Distance of the true arm from the prior [standard deviations]; the loops close along the whole motion."""

SAMPLE_S = 0.005
"""CPU time between two looks at the stack [s]."""

Parts = Sequence[tuple[str, str]]

PARTS = (
    ("report", "recording_report.py:write_report"),
    ("table of the guard", "person_limits_manager.py:"),
    ("import", "importlib"),
    ("expressions and kernels", "kernel/compilation.py:compile"),
    ("expressions and kernels", "_function"),
    ("ticks of the calibration", "twin_calibration.py:EmptyTwin.calibrate+pilot.py:Pilot._tick"),
    ("ticks of the calibration", "twin_calibration.py:EmptyTwin.calibrate+pilot.py:Pilot._native_tick"),
    ("listeners of the calibration", "twin_calibration.py:EmptyTwin.calibrate+pilot.py:Pilot.run"),
    ("fit of the calibration", "twin_calibration.py:EmptyTwin.calibrate"),
    ("ticks of the worn machine", "pilot.py:Pilot._tick"),
    ("ticks of the worn machine", "pilot.py:Pilot._native_tick"),
    ("identification", "identify.py:Identifier.__call__"),
    ("listeners of the worn machine", "pilot.py:Pilot.run"),
    ("estimator of the weight", "weight_estimator.py:"),
    ("examiner", "truth_score.py:"),
)
"""Parts of a demonstration by the functions on the stack; the first that fits counts."""

SESSION_PARTS = (
    ("import", "importlib"),
    ("preparation", "train_command.py:_Training._ready"),
    ("report and result", "train_command.py:_Training._result"),
    ("participant", "twin_seat.py:TwinSeat"),
    ("task and level", "lockstep_screen.py:LockstepScreen._listen"),
    ("ticks in C", "lockstep_screen.py:LockstepScreen.advance+native_ticks.py:NativeTicks.run"),
    ("loop in Python", "lockstep_screen.py:LockstepScreen.advance+pilot.py:Pilot.run"),
)
"""Parts of a session, likewise. "Ticks in C" contains the few lines of Python around each call."""


def main() -> None:
    """Measure in turns, and print the medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=list(MEASUREMENTS))
    parser.add_argument("--beside", type=Path, help="Folder of another tree of this project.")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--out", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.out is not None:
        Path(options.out).write_text(json.dumps(MEASUREMENTS[options.what]()))
        return
    trees = {"this tree": HERE} | ({str(options.beside): options.beside.resolve()} if options.beside else {})
    found: dict[str, list[dict[str, float]]] = {name: [] for name in trees}
    for turn in range(options.rounds + 1):
        for name, folder in trees.items():
            parts = _measured(options.what, folder)
            if turn:
                found[name].append(parts)
    _print(found)


def _measured(what: str, folder: Path) -> dict[str, float]:
    with tempfile.TemporaryDirectory() as place:
        out = Path(place, "parts.json")
        environment = os.environ | {"PYTHONPATH": f"{folder / 'src'}:{folder}", "OPENBLAS_NUM_THREADS": "1"}
        command = [sys.executable, str(Path(__file__).resolve()), what, "--out", str(out)]
        start = time.perf_counter()
        subprocess.run(command, env=environment, cwd=place, check=True, stdout=subprocess.DEVNULL)
        return json.loads(out.read_text()) | {"wall": time.perf_counter() - start}


def _print(found: dict[str, list[dict[str, float]]]) -> None:
    names = list(dict.fromkeys(part for rounds in found.values() for parts in rounds for part in parts))
    print(f"{'seconds of CPU, medians':40s}" + "".join(f"{name[-20:]:>22s}" for name in found))
    for part in names:
        medians = [statistics.median(parts.get(part, 0.0) for parts in rounds) for rounds in found.values()]
        ratio = f"   {medians[1] / medians[0]:.2f} x" if len(medians) > 1 and medians[0] > 0.0 else ""
        print(f"{part:40s}" + "".join(f"{value:22.3f}" for value in medians) + ratio)


def parts_of(parts: Parts, *words: str) -> dict[str, float]:
    """CPU of a command by part [s], by looking at the stack every `SAMPLE_S` of CPU time."""
    looks: collections.Counter[str] = collections.Counter()

    def look(_signal: int, frame: Any) -> None:
        names = []
        while frame is not None:
            names.append(f"{frame.f_code.co_filename}:{frame.f_code.co_qualname}")
            frame = frame.f_back
        stack = " ".join(names)
        fitting = (part for part, marks in parts if all(mark in stack for mark in marks.split("+")))
        looks[next(fitting, "rest")] += 1

    signal.signal(signal.SIGPROF, look)
    signal.setitimer(signal.ITIMER_PROF, SAMPLE_S, SAMPLE_S)
    from exograv.cli import main as command_line

    sys.argv = ["exograv", *words]
    try:
        command_line()
    except SystemExit as end:
        if end.code:
            raise
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    cpu_s, all_looks = time.process_time(), sum(looks.values())
    found = {part: cpu_s * looks[part] / all_looks for part in dict.fromkeys([*(part for part, _ in parts), "rest"])}
    children = os.times().children_user + os.times().children_system
    return found | {"other processes": children, "all": cpu_s + children}


def identification() -> dict[str, float]:
    """CPU of the recursive method on `MOTION_S` of motion at 1 kHz, by rig and part [s]."""
    found = {}
    for rig in RIGS:
        for part, value in _identification(rig).items():
            found[f"{rig}: {part}"] = value
    return found


def _identification(rig: str) -> dict[str, float]:
    from exograv.identification.core.arm_model import ArmModel
    from exograv.identification.core.interface import Sample
    from exograv.identification.core.prior import prior
    from exograv.laboratory.virtual_laboratory import draw_laboratory
    from exograv.procedures.calibration.nominal_machine import nominal_machine
    from exograv.procedures.identification.estimator_session import EstimatorSession
    from exograv.procedures.identification.identify import identification_motion

    laboratory = draw_laboratory(rig, None, 2, 0)
    assembly = laboratory.assembly()
    machine = nominal_machine(laboratory.description, np.asarray(assembly.exo.phi))
    path, (mean, covariance) = identification_motion(assembly, MOTION_S, 1e-3), prior(assembly, machine)
    generator, model = np.random.default_rng(0), ArmModel(assembly, machine)
    x = mean + OFF_SD * np.sqrt(np.diag(covariance)) * generator.standard_normal(len(mean))
    every = slice(None, None, 10)
    moments = zip(path.q[every], path.v[every], path.a[every], strict=True)
    exact = np.array([model.linearise(Sample(0.0, q, v, a, q), x)[0] for q, v, a in moments])
    t = np.arange(len(path)) * 1e-3
    tau = np.array([np.interp(t, t[every], of_joint) for of_joint in exact.T]).T
    tau += 0.2 * generator.standard_normal(tau.shape)
    start = time.process_time()
    session = EstimatorSession(assembly, machine, "recursive", 1e-3)
    prepared = time.process_time()
    for k in range(len(path)):
        found = session.take(path.q[k], tau[k], path.q[k])
        if found is not None and session.is_to_note:
            session.judge(getattr(session, "estimate", lambda found=found: found)())  # another tree gives it at once
    moved = time.process_time()
    last = session.last()
    session.judge(last)
    end = time.process_time()
    return {
        "prepare": prepared - start,
        "60 s of motion": moved - prepared,
        "last estimate": end - moved,
        "all": end - start,
        "estimate, norm of x": float(np.linalg.norm(last.x)),
        "estimate, norm of SD": float(np.sqrt(np.trace(np.asarray(last.covariance)))),
    }


SESSION = "run", "train", "--participant", "P-01", "--seed", "3"

COMMANDS = {
    "session": ("run", "train", "--participant", "P-01", "--windows", "4"),
    "faults": ("dev", "faults", "--scenarios", "100", "--strikes", "0", "--processes", "1"),
    "benchmark": ("dev", "benchmark-identification", "--wearers", "1", "--streams", "1", "--processes", "1"),
    "sweep": ("dev", "sweep", str(HERE / "benchmarks" / "waits_sweep.toml")),
    "study": (
        *("study", "simulate", "--participants", "1,1", "--sessions", "1,1", "--windows", "2"),
        *("--flight-windows", "2", "--processes", "1"),
    ),
}
"""Commands that run for minutes, in a size for a comparison of two trees that both have them."""

PR_SET_CHILD_SUBREAPER = 36


def command(*words: str) -> dict[str, float]:
    """CPU of a command and of all processes that it begins [s]."""
    # Processes of a fork server outlive the command, and count only if this process waits for them.
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    code = "import sys; from exograv.cli import main; sys.argv[0] = 'exograv'; main()"
    done = subprocess.run([sys.executable, "-c", code, *words], check=False, capture_output=True, text=True)
    if "--simulate" in done.stderr and "--simulate" not in words:
        return command(*words, "--simulate")  # a tree in which the fast session had this option
    if done.returncode:
        sys.exit(f"exograv {' '.join(words)}: exit status {done.returncode}\n{done.stdout}{done.stderr}")
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()
    children = os.times()
    return {"all": children.children_user + children.children_system}


MEASUREMENTS: dict[str, Callable[[], dict[str, float]]] = {
    "demo": functools.partial(parts_of, PARTS, "demo"),
    "whole-session": functools.partial(parts_of, SESSION_PARTS, *SESSION, "--windows", "31"),
    "identification": identification,
    **{name: functools.partial(command, *words) for name, words in COMMANDS.items()},
}

if __name__ == "__main__":
    main()
