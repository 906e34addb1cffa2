"""Torque left over at the held-out postures, over seeds, levels and methods.

    python benchmarks/left_over.py --level 2 --seeds 0-9 --methods recursive,gradient --processes 2 --save level2.json
    python benchmarks/left_over.py --load level2.json

Each run is `exograv arm identify` with that seed: stage 0, then 60 s of motion on its own wearer and machine.
"""

import argparse
import json
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ExogravError
from exograv.results import json_value
from seeds import loaded, seed_range

COARSE = 2.5  # ratio of the coarse target to the fine one: 0.5 and 0.25 N·m


def run(rig: str, level: int, seed: int, method: str, seconds: float) -> dict[str, Any]:
    """Run one identification; a run that broke off is a result too."""
    from exograv.laboratory.demo import DemoOptions, run_demo

    options = DemoOptions(rig=rig, level=level, seed=seed, method=method, seconds=seconds, only_identify=True)  # pyright: ignore[reportArgumentType] - checked by the sessions
    with tempfile.TemporaryDirectory() as folder:
        try:
            return json_value(run_demo(options, Path(folder), lambda _text, _share: None))
        except ExogravError as error:
            return {"disturbance_level": level, "seed": seed, "method": method, "broke_off": str(error)}


def show(results: list[dict[str, Any]]) -> None:
    """Print medians over the seeds per method and level, and how often and when the target was reached."""
    keys = sorted({(result["disturbance_level"], result["method"]) for result in results})
    for level, method in keys:
        runs = [r for r in results if (r["disturbance_level"], r["method"]) == (level, method)]
        done = [r for r in runs if "broke_off" not in r]
        print(f"level {level}, {method}: {len(done)} of {len(runs)} runs completed")
        if not done:
            continue
        for score in ("total", "arm"):
            for stage in ("exo_only", "table", "identified"):
                values = [r["left_over_rms_Nm"][score].get(stage) for r in done]
                if values[0] is not None:
                    median, worst = np.median(values, axis=0), np.max(values, axis=0)
                    print(f"  {score:5} {stage:10} median {_row(median)}   worst {_row(worst)}")
        times = [r["identification"]["time_to_target_s"] for r in done]
        reached = sorted(t for t in times if t is not None)
        median = np.median([np.inf if t is None else t for t in times])
        print(f"  targets reached by {len(reached)} of {len(done)}, median time {median:.0f} s")
        _show_coverage(done)


def _row(values: np.ndarray) -> str:
    return " ".join(f"{value:6.3f}" for value in values)


def _show_coverage(runs: list[dict[str, Any]]) -> None:
    rows = [row for r in runs for row in r["parameters"] if row["ci95"] is not None]
    if rows:
        inside = sum(row["ci95"][0] <= row["truth"] <= row["ci95"][1] for row in rows)
        print(f"  95 % intervals hold the truth: {inside} of {len(rows)} ({inside / len(rows):.0%})")
    pairs = [
        pair
        for r in runs
        if r.get("possible_left_over_Nm")
        for pair in zip(r["left_over_rms_Nm"]["total"]["identified"], r["possible_left_over_Nm"]["p95"], strict=True)
    ]
    if pairs:
        below = sum(left_over <= p95 for left_over, p95 in pairs)
        print(f"  possible left over (95 %) not exceeded by the true one: {below} of {len(pairs)} joints")


def main() -> None:
    """Run or load, then print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig", default="recupera_like")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="0-9")
    parser.add_argument("--methods", default="recursive,gradient")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path, nargs="*")
    options = parser.parse_args()
    if options.load:
        show(loaded(options.load))
        return
    seeds = seed_range(options.seeds)
    methods, common = options.methods.split(","), (options.rig, options.level)
    jobs = [(*common, seed, method, options.seconds) for method in methods for seed in seeds]
    with ProcessPoolExecutor(options.processes) as pool:
        results = list(pool.map(run, *zip(*jobs, strict=True)))
    if options.save:
        options.save.write_text(json.dumps(results, indent=1))
    show(results)


if __name__ == "__main__":
    main()
