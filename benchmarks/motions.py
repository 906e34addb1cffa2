"""Comparison of excitation motions: the same wearers in the same machines, identified by `recursive`.

    python benchmarks/motions.py --seeds 1000-1005 --motions designed,fourier,fixed,adaptive --save motions.json
    python benchmarks/motions.py --seeds 1000-1005 --motions designed,new.json    # from `exograv rig motion --json`
    python benchmarks/motions.py --load motions.json

A machine is calibrated once and has three wearers, as in `exograv dev benchmark-identification`. The controller's
model stays fixed meanwhile. Tune on seeds from 1000 on; report seeds from 0 on.
"""

import argparse
import json
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from exograv import motion
from exograv.campaigns.benchmark_identification.cases import Case, by_machine, population
from exograv.campaigns.benchmark_identification.streams import Calibrated, calibrate
from exograv.errors import ExogravError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Method
from exograv.identification.core.sample_filter import SampleFilter
from exograv.laboratory.truth_score import Examination
from exograv.loop.phases import TRAVEL_RAD_S
from exograv.loop.tick_sample import TickSample
from exograv.model.rig_settings import Excitation
from exograv.motion import Trajectory
from exograv.procedures.identification.estimator_session import build_method
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.identification.motions import motion_parts
from exograv.study.targets import TARGET_NM
from seeds import seed_range

AT_S = (20, 60, 120)


def silent(_text: str, _share: float) -> None:
    """Ignore progress: one line per run is enough."""


class Listener:
    """Follower that feeds the method, and scores it once a second on the twin's truth, hidden from the method."""

    def __init__(self, method: Method, sample_filter: SampleFilter, examination: Examination):
        self._method, self._filter, self._examination = method, sample_filter, examination
        self.left_over: dict[int, list[float]] = {}

    def __call__(self, moment: TickSample) -> None:
        """Take one tick."""
        sample = self._filter.update(moment.state.q, moment.tau_measured)
        if not self._filter.settled:
            return
        self._method.update(sample)
        second = int(sample.t + 1e-6)
        if second > len(self.left_over):
            estimate = self._method.estimate()
            self.left_over[second] = self._examination.score(estimate.x).total.tolist()


def parts_of(name: str, subject: Any, method: Method, seconds: float, dt: float) -> Iterator[Trajectory]:
    """Return the motion by its name, or from the file that `exograv rig motion --json` wrote."""
    assembly, machine = subject
    if not name.endswith(".json"):
        return motion_parts(name, assembly, machine, method, seconds, dt)  # pyright: ignore[reportArgumentType] - checked there
    block = Excitation(**json.loads(Path(name).read_text())["excitation"])
    return iter([identification_motion(assembly, seconds, dt, block)])


def run(case: Case, calibrated: Calibrated, name: str, seconds: float) -> dict[str, Any]:
    """Identify one wearer with one motion."""
    worn = calibrated.worn(case, case.laboratory(), silent)
    assembly, machine = worn.known.assembly, worn.known.machine
    twin, pilot, controller = worn.twin, worn.pilot, worn.controller
    controller.mode.drive = 1.0
    method = build_method("recursive", assembly, machine, ArmModel(assembly, machine))
    listener = Listener(method, SampleFilter(assembly.n, twin.period_s), worn.examination())
    parts = parts_of(name, (assembly, machine), method, seconds, twin.period_s)
    first = next(parts)
    approach = [motion.go_to(pilot.q, first.q[0], TRAVEL_RAD_S, first.dt), motion.hold(first.q[0], 0.5, first.dt)]
    pilot.run(controller, motion.joined(approach), "Moving to the start")
    for part in chain([first], parts):
        pilot.run(controller, part, "Identifying", listener)
    places = worn.laboratory.description.places
    # The first filtered sample comes some ticks after the motion's start: the last whole second may be missing.
    last = max(listener.left_over)
    at = {str(t): listener.left_over[min(t, last)] for t in AT_S if t <= seconds}
    return {
        "seed": case.wearer_seed,
        "motion": name,
        "left_over_Nm": at,
        "time_to_target_s": reached(listener.left_over, np.array([TARGET_NM[place] for place in places])),
        "target_Nm": [TARGET_NM[place] for place in places],
    }


def reached(left_over: dict[int, list[float]], target: np.ndarray) -> int | None:
    """Time from which the torque left over stays within the target to the end [s]; None if never."""
    since = None
    for second, values in left_over.items():
        within = bool((np.array(values) <= target).all())
        since = (since if since is not None else second) if within else None
    return since


def show(results: list[dict[str, Any]]) -> None:
    """Print one line per motion: medians over the wearers, of all joints and of the worst joint against its target."""
    motions = list(dict.fromkeys(result["motion"] for result in results))
    base = {r["seed"]: r for r in results if r["motion"] == motions[0]}
    for name in motions:
        runs = [r for r in results if r["motion"] == name and "broke_off" not in r]
        times = [np.inf if r["time_to_target_s"] is None else r["time_to_target_s"] for r in runs]
        count = np.isfinite(times).sum()
        print(f"{name}: {len(runs)} runs, target reached by {count}, median {np.median(times):.0f} s")
        for t in runs[0]["left_over_Nm"] if runs else []:
            values = np.array([r["left_over_Nm"][t] for r in runs])
            worst = (values / runs[0]["target_Nm"]).max(axis=1)
            pairs = [_worst(r, t) / _worst(base[r["seed"]], t) for r in runs if "broke_off" not in base[r["seed"]]]
            print(
                f"  {t:>4} s  median {' '.join(f'{x:.3f}' for x in np.median(values, axis=0))} N·m, "
                f"worst/target {np.median(worst):.2f} (mean {worst.mean():.2f}), "
                f"to {motions[0]} ×{np.exp(np.mean(np.log(pairs))):.2f}"
            )


def _worst(result: dict[str, Any], t: str) -> float:
    return float((np.array(result["left_over_Nm"][t]) / result["target_Nm"]).max())


def measure(cases: list[Case], names: list[str], seconds: float, save: Path | None) -> list[dict[str, Any]]:
    """Run all wearers with all motions; save after each, so that a long run may be interrupted."""
    results: list[dict[str, Any]] = []
    for group in by_machine(cases):
        calibrated = calibrate(group[0], silent)
        for case in group:
            for name in names:
                try:
                    result = run(case, calibrated, name, seconds)
                except ExogravError as error:
                    result = {"seed": case.wearer_seed, "motion": name, "broke_off": str(error)}
                results.append(result)
                print(json.dumps(result), flush=True)
                if save is not None:
                    save.write_text(json.dumps(results, indent=1) + "\n")
    return results


def main() -> None:
    """Measure or load, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1000-1005")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--profile", choices=("harmonic", "qdd"), default="harmonic")
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--motions", default="designed,adaptive,fourier,fixed")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path)
    options = parser.parse_args()
    if options.load is not None:
        show(json.loads(options.load.read_text()))
        return
    seeds = seed_range(options.seeds)
    cases = population(options.profile, options.level, len(seeds), seeds[0])
    show(measure(cases, options.motions.split(","), options.seconds, options.save))


if __name__ == "__main__":
    main()
