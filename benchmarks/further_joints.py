"""Cost of each joint beyond the elbow: the same people in machines of 4, 5, 6 and 7 joints.

    python benchmarks/further_joints.py --seeds 1000-1004 --save further_joints.json
    python benchmarks/further_joints.py --load further_joints.json
    python benchmarks/further_joints.py --joints 4,7 --without centre_off_axis,slow_bias

The machines are `recupera_like_7` with the distal joints fixed at zero: the same links, drives, cuffs and motion. The
twin's person has the same body and the same joints; the distal ones are held straight as by a splint. With four and
five joints the hand is part of the forearm, and its cuff is left off. Each run calibrates, identifies the person,
floats the arm for 10 s, and gives the person half a kilogram to hold. Scores are taken at the same 200 postures of
shoulder and elbow, which no estimator sees. `--without` switches disturbances of the twin off, to find the source of
a joint's share.
"""

import argparse
import json
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exograv.cli.shell.terminal import bars
from exograv.control.tick import ControlMode
from exograv.dynamics.parameters import ParameterLayout
from exograv.errors import ExogravError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Sample
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.result_rows import parameter_rows
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.moved_machine import PilotedArm
from exograv.loop.pilot import Progress
from exograv.model.arm import held_weight
from exograv.model.description import RigDescription, load_rig
from exograv.model.rig_settings import FREEDOMS_OF_ARM, HAND_APART, RigSettings
from exograv.procedures.identification.estimator_session import build_method
from exograv.procedures.identification.float_arm import float_arm
from exograv.procedures.weighing.known_weight import weigh
from exograv.procedures.weighing.motion_samples import SampleCollector
from exograv.recording.rounding import percentiles, rounded
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer
from exograv.rig.twin.examiner import held_out_postures, rms
from exograv.study.targets import TARGET_NM
from seeds import loaded, seed_range

RIG = "recupera_like_7"
LEAST, MOST = 4, 7
WEIGHT_KG = 0.5
FLOAT_S = 10.0


def with_joints(whole: RigDescription, n: int, folder: Path) -> RigDescription:
    """Return the machine with its first `n` joints, distal joints fixed at zero; its URDF is written to `folder`."""
    kept, fixed = whole.joints[:n], whole.joints[n:]
    for file in (name for name in (whole.settings.urdf.right, whole.settings.urdf.left) if name is not None):
        robot = ElementTree.parse(whole.folder / file)
        for joint in robot.iterfind("joint"):
            if joint.get("name") in fixed:
                joint.set("type", "fixed")
        robot.write(folder / file)
    told = whole.settings.model_dump()
    kind = next(kind for kind, freedoms in FREEDOMS_OF_ARM.items() if freedoms == n)
    told["name"], told["wearer"]["arm"] = f"{whole.name} with {n} joints", kind
    for name in ("adjustments", "actuators"):
        told[name] = [row for row in told[name] if row["joint"] in kept]
    told["cuffs"] = [cuff for cuff in told["cuffs"] if cuff["segment"] != "hand" or kind in HAND_APART]
    calibration, motion = told["calibration"], told["excitation"]
    calibration["sweeps"] = [sweep for sweep in calibration["sweeps"] if sweep["joint"] in kept]
    for place in (told["donning"], *calibration["sweeps"]):
        place["posture_deg"] = place["posture_deg"][:n]
    for key in ("lower_deg", "upper_deg"):
        told["task_workspace"][key] = told["task_workspace"][key][:n]
    motion["centre_deg"] = motion["centre_deg"][:n]
    for key in ("sine_deg", "cosine_deg"):
        motion[key] = [row[:n] for row in motion[key]]
    return RigDescription(RigSettings.model_validate(told), whole.side, folder)


@dataclass(frozen=True)
class Job:
    """Task of one person in one machine."""

    joints: int
    seed: int
    level: int
    seconds: float
    without: tuple[str, ...]


def run(job: Job, progress: Progress) -> dict[str, Any]:
    """Calibrate, identify, float and weigh; a run that broke off is a result too."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            return _figures(job, Path(folder), progress)
        except ExogravError as error:
            return {"joints": job.joints, "seed": job.seed, "broke_off": str(error)}


def _figures(job: Job, folder: Path, progress: Progress) -> dict[str, Any]:
    whole = load_rig(RIG)
    description = with_joints(whole, job.joints, folder)
    disturbances = Disturbances.at_level(job.level).without(*job.without)
    wearer = draw_wearer(disturbances, job.seed, whole.side, kind=description.settings.wearer.arm)
    laboratory = VirtualLaboratory(description, draw_machine(description, disturbances, job.seed), wearer)
    preparation = Preparation(laboratory, job.seed, progress)
    known = preparation.calibrated()
    worn = preparation.worn(known)
    assembly, machine = known.assembly, known.machine
    twin, pilot, controller = worn.twin, worn.pilot, worn.controller
    examination = worn.examination(held_out_postures(whole)[:, : job.joints])
    left: dict[float, np.ndarray] = {}

    def note(_t: float, estimate: Estimate, *_judged: object) -> None:
        left[estimate.t] = rms(examination.at_postures(estimate.x, ControlMode()))

    identifier, kept = worn.identifier(listener=note), SampleCollector()
    identifier.followers.append(kept)
    found = worn.identify(identifier, job.seconds)
    tick_us = percentiles(pilot.tick_us)
    at_postures, arm = examination.at_postures(found.last.x, ControlMode()), examination.arm_error(found.last.x)
    possible = examination.posterior_torque(found.last)
    lower, upper = description.workspace
    middle = 0.5 * (lower + upper)
    drift = float_arm(pilot, controller, middle, 0.0, FLOAT_S).drift_deg
    held = weigh(PilotedArm(pilot, controller), ArmModel(assembly, machine), found.floated, _hanging(twin))
    loaded = found.last.x.copy()
    loaded[ParameterLayout.of(assembly).phi] += held_weight(assembly.arm, held.mass)
    rows = parameter_rows(assembly, found.prior, found.last, wearer)
    intervals = {row.name: row.ci95[0] <= row.truth <= row.ci95[1] for row in rows if row.ci95}
    targets = np.array([TARGET_NM[place] for place in description.places])
    return {
        "joints": job.joints, "seed": job.seed, "names": list(description.joints), "targets_Nm": targets.tolist(),
        "left_over_rms_Nm": rounded(left[found.last.t]), "left_over_max_Nm": rounded(np.abs(at_postures).max(axis=0)),
        "machine_rms_Nm": rounded(rms(at_postures - arm)), "arm_rms_Nm": rounded(rms(arm)),
        "weight_rms_Nm": rounded(examination.score(found.last.x).arm),
        "by_table_rms_Nm": rounded(rms(examination.at_postures(known.x, ControlMode()))),
        "possible_p95_Nm": None if possible is None else rounded(possible.p95),
        "intervals_missed": [name for name, holds in intervals.items() if not holds], "intervals": len(intervals),
        "to_target_s": _until({t: bool((one <= targets).all()) for t, one in left.items()}),
        "to_target_shoulder_elbow_s": _until({t: bool((one <= targets)[:LEAST].all()) for t, one in left.items()}),
        "parameters": ParameterLayout.of(assembly).count, "learned": int((np.diag(found.prior_covariance) > 0.0).sum()),
        "tick_us": tick_us, **_learning_times(controller, kept.samples),
        "float_at_deg": rounded(np.rad2deg(middle)), "drift_deg": rounded(drift), "relaxed": found.restless_s is None,
        "weight_kg": held.mass, "weight_ci95_kg": list(held.ci95),
        "left_over_with_weight_Nm": rounded(examination.score(loaded, WEIGHT_KG).total),
    }  # fmt: skip


def _hanging(twin: Twin) -> Callable[[bool], None]:
    """Return the function that hangs the weight on the twin: the software has no access to the mass."""
    return lambda is_there: twin.hang("hand", WEIGHT_KG if is_there else 0.0)


def _until(reached: dict[float, bool]) -> float | None:
    """Seconds of motion after which a target is held to the end; None if never."""
    late = [t for t, is_reached in reached.items() if not is_reached]
    after = [t for t in reached if t > max(late, default=-1.0)]
    return round(min(after), 2) if after else None


def _learning_times(controller: ArmController, samples: list[Sample]) -> dict[str, Any]:
    """Return computing times of a filter alone on the same samples: one step, the last relinearisation, the whole."""
    method = build_method("recursive", controller.assembly, controller.machine)
    steps = []
    for sample in samples:
        start = time.perf_counter()
        method.update(sample)
        steps.append(time.perf_counter() - start)
    start = time.perf_counter()
    method.relinearise()  # pyright: ignore[reportAttributeAccessIssue] - it is `recursive`
    last = time.perf_counter() - start
    return {
        "step_ms": 1e3 * float(np.median(steps)), "look_at_all_ms": 1e3 * last,
        "learning_wall_s": sum(steps) + last, "motion_s": round(samples[-1].t, 2),
    }  # fmt: skip


def show(results: list[dict[str, Any]]) -> None:
    """Print tables in Markdown: torque left over with a column per joint, then all other figures."""
    for result in (r for r in results if "broke_off" in r):
        print(f"{result['joints']} joints, seed {result['seed']} broke off: {result['broke_off']}")
    done = [r for r in results if "broke_off" not in r]
    groups = {n: rows for n in range(LEAST, MOST + 1) if (rows := [r for r in done if r["joints"] == n])}
    if not groups:
        return
    names = max((rows[0]["names"] for rows in groups.values()), key=len)
    print("\nleft over, N·m: RMS over postures, mean of the people (least–most); largest at any posture\n")
    print("| joints | " + " | ".join(name.replace("_", " ") for name in names) + " |")
    print("|---" * (len(names) + 1) + "|")
    for n, rows in groups.items():
        of_rms, most = (np.array([r[key] for r in rows]) for key in ("left_over_rms_Nm", "left_over_max_Nm"))
        cells = [
            f"{of_rms[:, j].mean():.3f} ({of_rms[:, j].min():.3f}–{of_rms[:, j].max():.3f}); {most[:, j].max():.2f}"
            for j in range(n)
        ]
        print(f"| {n} | " + " | ".join(cells + ["–"] * (len(names) - n)) + " |")
    for key, title in SHARES.items():
        print(f"\n{title}, N·m: RMS over postures, mean of the people")
        for n, rows in groups.items():
            print(f"  {n} joints: " + " ".join(f"{value:.3f}" for value in np.mean([r[key] for r in rows], axis=0)))
    print("\n| " + " | ".join(COLUMNS) + " |")
    print("|---" * len(COLUMNS) + "|")
    for n, rows in groups.items():
        print("| " + " | ".join(str(cell) for cell in (n, *_row(rows))) + " |")


SHARES = {
    "by_table_rms_Nm": "before any motion, by the anthropometric table",
    "machine_rms_Nm": "left over: part of the empty machine, from its calibration",
    "arm_rms_Nm": "left over: part of the arm, its weight and the strain of the cuffs",
    "weight_rms_Nm": "the arm's weight alone",
}

COLUMNS = (
    "joints", "people", "parameters (learned)", "95 % intervals that hold", "left over within its stated 95 %",
    "on target", "from, s", "shoulder and elbow from, s", "learning, s of computing", "step, ms", "look at all, ms",
    "tick, µs: median, p99", "0.5 kg: off, g (mean, worst)", "interval, ± g", "holds", "with it left over",
)  # fmt: skip


def _row(rows: list[dict[str, Any]]) -> list[str]:
    holding = sum(r["intervals"] - len(r["intervals_missed"]) for r in rows)
    within = [np.array(r["left_over_rms_Nm"]) <= np.array(r["possible_p95_Nm"]) for r in rows if r["possible_p95_Nm"]]
    times = [r["to_target_s"] for r in rows]
    off = np.array([r["weight_kg"] - WEIGHT_KG for r in rows])
    half = np.array([0.5 * (r["weight_ci95_kg"][1] - r["weight_ci95_kg"][0]) for r in rows])
    with_weight = np.mean([r["left_over_with_weight_Nm"] for r in rows], axis=0)
    step, last, wall = (np.median([r[key] for r in rows]) for key in ("step_ms", "look_at_all_ms", "learning_wall_s"))
    p50, p99 = (np.median([r["tick_us"][key] for r in rows]) for key in ("p50", "p99"))
    return [
        str(len(rows)), f"{rows[0]['parameters']} ({rows[0]['learned']})",
        f"{holding} of {sum(r['intervals'] for r in rows)}", f"{sum(map(np.sum, within))} of {sum(map(len, within))}",
        f"{sum(t is not None for t in times)} of {len(rows)}", _median(times),
        _median([r["to_target_shoulder_elbow_s"] for r in rows]),
        f"{wall:.1f}", f"{step:.2f}", f"{last:.0f}", f"{p50:.0f}, {p99:.0f}",
        f"{1e3 * np.abs(off).mean():.0f}, {1e3 * np.abs(off).max():.0f}", f"{1e3 * np.median(half):.0f}",
        f"{int((np.abs(off) <= half).sum())} of {len(rows)}", " ".join(f"{value:.2f}" for value in with_weight),
    ]  # fmt: skip


def _median(times: list[float | None]) -> str:
    middle = float(np.median([np.inf if t is None else t for t in times]))
    return "never" if np.isinf(middle) else f"{middle:.0f}"


def main() -> None:
    """Run or load, then print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1000-1004")
    parser.add_argument("--joints", default="4,5,6,7")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--without", default="", help="rows of docs/explanation/disturbances.md to switch off")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path, nargs="*")
    options = parser.parse_args()
    if options.load:
        show(loaded(options.load))
        return
    without = tuple(filter(None, options.without.split(",")))
    jobs = [
        Job(n, seed, options.level, options.seconds, without)
        for seed in seed_range(options.seeds)
        for n in map(int, options.joints.split(","))
    ]
    results = []
    with bars() as progress:
        for i, job in enumerate(jobs):
            title = f"{i + 1} of {len(jobs)}: {job.joints} joints, seed {job.seed}. "
            results.append(run(job, lambda text, share, title=title: progress(title + text, share)))
            if options.save:
                options.save.write_text(json.dumps(results, indent=1) + "\n")
    show(results)


if __name__ == "__main__":
    main()
