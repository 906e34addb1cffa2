"""Time of the parts of a lock-step tick: twin, guard, control, recording, and the rest of the pilot.

    python benchmarks/tick_parts.py
    python benchmarks/tick_parts.py --rig lego_like --seconds 5
    python benchmarks/tick_parts.py --beside FOLDER   # also the source tree in FOLDER/src, round by round in the same
                                                      # run; on a busy computer only the ratio is meaningful

An arm floats in the twin, and the run is recorded. Each part is timed by a wrapper around its function, whose
own time (0.1 µs) is in the part. "Rest" is the whole tick without the parts. The parts are those of a tick in Python;
"whole tick in C" is the same tick in native code, with its record.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

PARTS = ("twin: read", "twin: write", "guard: see", "guard: decide", "control", "recording")


def timed(taken: list[int], function: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a function so that it appends the time of each call [ns]."""

    def wrapper(*args: Any, **kwargs: Any) -> Any:
        start = time.perf_counter_ns()
        result = function(*args, **kwargs)
        taken.append(time.perf_counter_ns() - start)
        return result

    return wrapper


def measure(rig: str, arm: str | None, seconds: float, share: float, folder: Path) -> dict[str, float]:
    """Return this percentile of the time of each part of a recorded tick of a worn machine [µs]."""
    from exograv import motion
    from exograv.laboratory.virtual_laboratory import draw_laboratory
    from exograv.loop.arm_controller import ArmController
    from exograv.loop.machine_limits import limits
    from exograv.loop.person_limits_manager import PersonLimitsManager
    from exograv.loop.pilot import Pilot
    from exograv.procedures.calibration.nominal_machine import nominal_machine
    from exograv.procedures.identification.estimator_session import table_guess
    from exograv.recording import RecordingWriter
    from exograv.rig.twin import Twin
    from exograv.safety.envelope import Envelope

    laboratory = draw_laboratory(rig, arm, 2, 0)
    assembly = laboratory.assembly()
    nominal = nominal_machine(laboratory.description, assembly.exo.phi)
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, 0)
    x = table_guess(assembly, nominal)
    controller = ArmController(assembly, nominal, x, twin.period_s)
    controller.mode.drive = 1.0
    envelope = Envelope(limits(laboratory.description), twin.period_s)
    PersonLimitsManager(envelope, assembly, nominal, x).know(x)
    settings = {"rig": rig}
    recording = RecordingWriter(folder / "a.mcap", twin.joints, settings, packed=True)
    pilot = Pilot(twin, nominal.actuators, envelope, recording)
    taken: dict[str, list[int]] = {name: [] for name in PARTS}
    wrap = {
        "twin: read": (twin, "read"),
        "twin: write": (twin, "write"),
        "guard: see": (pilot.guard, "see"),
        "guard: decide": (pilot.guard, "decide"),
        "control": (pilot.feedback, "answer"),
    }
    for name, (owner, attribute) in wrap.items():
        setattr(owner, attribute, timed(taken[name], getattr(owner, attribute)))
    recorded = "_record" if hasattr(pilot, "_record") else "recording.tick"
    owner, attribute = (pilot, "_record") if recorded == "_record" else (recording, "tick")
    setattr(owner, attribute, timed(taken["recording"], getattr(owner, attribute)))
    whole: list[int] = []
    in_python, in_c = pilot._tick, getattr(pilot, "_native_tick", None)
    native, pilot._native = getattr(pilot, "_native", None), None
    pilot._tick = timed(whole, in_python)
    still = motion.hold(pilot.q.copy(), seconds, twin.period_s)
    pilot.run(controller, still, "")
    found = {name: float(np.percentile(one, share)) * 1e-3 for name, one in taken.items()}
    found["rest"] = float(np.percentile(whole, share)) * 1e-3 - sum(found.values())
    found["whole tick"] = float(np.percentile(whole, share)) * 1e-3
    if native is not None and in_c is not None:
        pilot._native, of_native = native, list[int]()
        pilot._native_tick = timed(of_native, in_c)
        pilot.run(controller, still, "")
        found["whole tick in C"] = float(np.percentile(of_native, share)) * 1e-3
    recording.close()
    return found


def main() -> None:
    """Print one line per part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig", default="recupera_like")
    parser.add_argument("--arm", help="kind of arm; the rig's own if absent")
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--percentile", type=float, default=50.0, help="10 shows more on a busy computer")
    parser.add_argument("--beside", type=Path, help="another source tree")
    parser.add_argument("--as-json", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.as_json:
        with tempfile.TemporaryDirectory() as folder:
            print(json.dumps(measure(options.rig, options.arm, options.seconds, options.percentile, Path(folder))))
        return
    trees = {"this": Path(__file__).parents[1]} | ({"beside": options.beside} if options.beside else {})
    rounds: dict[str, list[dict[str, float]]] = {name: [] for name in trees}
    for _ in range(options.rounds):
        for name, tree in trees.items():
            command = [sys.executable, __file__, "--as-json", "--rig", options.rig, "--seconds", str(options.seconds)]
            command += ["--percentile", str(options.percentile)]
            command += ["--arm", options.arm] if options.arm else []
            environment = os.environ | {"PYTHONPATH": str(tree.resolve() / "src"), "OPENBLAS_NUM_THREADS": "1"}
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
            if done.returncode:
                sys.exit(done.stderr)
            rounds[name].append(json.loads(done.stdout.splitlines()[-1]))
    print(f"{options.rig}: least of {options.rounds} rounds, percentile {options.percentile:g} [µs]")
    print(f"{'':16}" + "".join(f"{name:>10}" for name in trees) + ("     ratio" if len(trees) > 1 else ""))
    for part in (*PARTS, "rest", "whole tick", "whole tick in C"):
        least = [min(one.get(part, float("nan")) for one in found) for found in rounds.values()]
        ratio = f"{least[0] / least[1]:10.2f}" if len(least) > 1 else ""
        print(f"{part:16}" + "".join(f"{value:10.1f}" for value in least) + ratio)


if __name__ == "__main__":
    main()
