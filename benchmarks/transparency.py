"""Muscle effort of one movement in six conditions, over machines of both drives: docs/explanation/transparency.md.

    python benchmarks/transparency.py --seeds 0-4 --processes 2 --save transparency.json
    python benchmarks/transparency.py --load transparency.json

The script does the work of `exograv dev transparency`, one process per machine. `--load` reads that command's JSON too.
"""

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from seeds import seed_range

STEPS = {
    "zero_g": "own inertia and elasticity",
    "dam_ideal_no_friction": "+ inertia of the machine",
    "dam_ideal": "+ friction",
    "dam": "+ what is not known",
    "gcm": "+ weight of the arm",
    "uncompensated": "+ weight of the machine",
}
"""Burden that each condition adds to the one before."""


def run(rig: str, level: int, seed: int, movement: str) -> dict[str, Any]:
    """Return the effort of one machine, by condition."""
    from exograv.laboratory.transparency import movement_for
    from exograv.laboratory.transparency_trial import TransparencyTrial, run_trial
    from exograv.model.description import load_rig

    description = load_rig(rig)
    wanted = movement_for(movement, description)  # pyright: ignore[reportArgumentType] - checked by the parser
    return dict(run_trial(TransparencyTrial(description, level, seed), wanted, lambda _text, _share: None))


def merged(rig: str, level: int, seeds: list[int], movement: str, runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the result for one kind of machine, in the form of `exograv dev transparency --json`."""
    from exograv.laboratory.options import TransparencyOptions
    from exograv.laboratory.transparency import movement_for
    from exograv.laboratory.transparency_summary import rig_result
    from exograv.model.description import load_rig
    from exograv.results import json_value

    description = load_rig(rig)
    wanted = movement_for(movement, description)  # pyright: ignore[reportArgumentType] - checked by the parser
    efforts = {condition: [one[condition] for one in runs] for condition in runs[0]}
    return json_value(rig_result(description, TransparencyOptions(level=level), seeds, wanted, efforts))


def show(result: dict[str, Any]) -> None:
    """Print tables in Markdown: conditions by joint, then the part of each burden."""
    print(f"\n{result['rig']}, {result['movement']}, level {result['disturbance_level']}, seeds {result['seeds']}\n")
    joints = " | ".join(result["joints"])
    print(f"| condition | effort N·m·s | {joints} | range over machines | squared | path error ° |")
    print("|---|" + "---|" * (len(result["joints"]) + 4))
    for name, row in result["conditions"].items():
        totals = [machine["effort_Nms"] for machine in row["machines"]]
        values = " | ".join(f"{value:.1f}" for value in row["by_joint_Nms"])
        print(
            f"| `{name}` | {row['effort_Nms']:.1f} | {values} | {min(totals):.0f}–{max(totals):.0f} | "
            f"{row['squared_N2m2s']:.0f} | {row['tracking_error_deg']:.2f} |"
        )
    print()
    before = None
    for name, words in STEPS.items():
        machines = np.array([machine["by_joint_Nms"] for machine in result["conditions"][name]["machines"]])
        added = machines if before is None else machines - before
        print(
            f"| {words} | {np.median(added.sum(axis=1)):.1f} | {' | '.join(f'{v:.1f}' for v in np.median(added, 0))} |"
        )
        before = machines
    print(f"\nDAM over GCM: {result['dam_over_gcm']}; DAM minus ideal {result['dam_minus_ideal_Nms']} N·m·s")
    print(f"off the path: {result['off_path'] or 'none'}")


def main() -> None:
    """Run or load, then print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rigs", default="recupera_like,recupera_like_qdd")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="0-4")
    parser.add_argument("--movement", choices=("pointing", "recorded"), default="pointing")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path)
    options = parser.parse_args()
    if options.load:
        loaded = json.loads(options.load.read_text())
        for result in loaded.get("profiles", {"": loaded}).values():
            show(result)
        return
    seeds, rigs = seed_range(options.seeds), options.rigs.split(",")
    jobs = [(rig, options.level, seed, options.movement) for rig in rigs for seed in seeds]
    with ProcessPoolExecutor(options.processes) as pool:
        runs = list(pool.map(run, *zip(*jobs, strict=True)))
    profiles = {}
    for k, rig in enumerate(rigs):
        of_rig = runs[k * len(seeds) : (k + 1) * len(seeds)]
        profiles[rig] = merged(rig, options.level, seeds, options.movement, of_rig)
    if options.save:
        options.save.write_text(json.dumps({"profiles": profiles}, indent=1))
    for result in profiles.values():
        show(result)


if __name__ == "__main__":
    main()
