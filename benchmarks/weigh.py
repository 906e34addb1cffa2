"""Known weights and the first twenty seconds over seeds, levels and machines: errors, coverage, true and false alarms.

    python benchmarks/weigh.py --rigs recupera_like,recupera_like_qdd --levels 2 --seeds 0-19 --save weigh.json
    python benchmarks/weigh.py --check-only --levels 0,1,2,3,4 --seeds 0-29 --save check.json
    python benchmarks/weigh.py --load weigh.json check.json

Each run is `exograv arm weigh` with that seed, which draws machine and wearer. `--check-only` runs three forms: the
right one, pounds typed for kilograms, and the reverse. A mass that the form itself refuses, because it is implausible
for this height, is counted separately.
"""

import argparse
import json
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ExogravError
from exograv.results import json_value
from seeds import loaded, seed_range

POUNDS_PER_KG = 2.2046
PAIRS_KG = ((0.5, 1.0), (1.0, 0.5), (1.5, 0.0), (2.0, 0.0), (0.0, 2.0))
"""Weights in the hand and at the forearm; the second is weighed while the first is carried."""


def run(rig: str, level: int, seed: int, hand: float, forearm: float, factor: float) -> dict[str, Any]:
    """Run one `exograv arm weigh`; a run that broke off is a result too."""
    from exograv.laboratory.virtual_laboratory import draw_laboratory
    from exograv.laboratory.weighing_command import run_weighing
    from exograv.procedures.weighing.options import WeighOptions

    job = {"rig": rig, "level": level, "seed": seed, "factor": factor}
    try:
        typed = factor * draw_laboratory(rig, None, level, seed).body.mass_kg
        options = WeighOptions(
            rig=rig, level=level, seed=seed, hand_weight_kg=hand, forearm_weight_kg=forearm, body_mass_kg=typed
        )
        return {**job, **json_value(run_weighing(options, lambda _text, _share: None))}
    except ExogravError as error:
        return {**job, "broke_off": str(error)}


def jobs(options: argparse.Namespace) -> Iterator[tuple[str, int, int, float, float, float]]:
    """Yield every run of the command line."""
    for seed in seed_range(options.seeds):
        for level in map(int, options.levels.split(",")):
            for rig in options.rigs.split(","):
                if options.check_only:
                    yield from ((rig, level, seed, 0.0, 0.0, f) for f in (1.0, POUNDS_PER_KG, 1.0 / POUNDS_PER_KG))
                else:
                    yield from ((rig, level, seed, *pair, 1.0) for pair in PAIRS_KG[: options.pairs])


def show(results: list[dict[str, Any]]) -> None:
    """Print one line per weight, machine and level; then one per form."""
    done = [r for r in results if "broke_off" not in r]
    print(f"{len(done)} of {len(results)} runs completed")
    for rig, level in sorted({(r["rig"], r["level"]) for r in done}):
        runs = [r for r in done if (r["rig"], r["level"]) == (rig, level)]
        print(f"{rig}, level {level}")
        rows = [row for r in runs for row in r["weights"]]
        for place, kg in sorted({(row["place"], row["true_kg"]) for row in rows}, reverse=True):
            _show_weight(place, kg, [row for row in rows if (row["place"], row["true_kg"]) == (place, kg)])
        for factor, name in ((1.0, "right form"), (POUNDS_PER_KG, "pounds"), (1.0 / POUNDS_PER_KG, "kilograms twice")):
            _show_form(name, [r for r in runs if abs(r["factor"] - factor) < 1e-6])


def _show_weight(place: str, kg: float, found: list[dict[str, Any]]) -> None:
    error = np.abs([row["estimated_kg"] - kg for row in found])
    inside = sum(row["ci95_kg"][0] <= kg <= row["ci95_kg"][1] for row in found)
    half = np.median([0.5 * (row["ci95_kg"][1] - row["ci95_kg"][0]) for row in found])
    promise, aim = np.mean(error <= max(0.05 * kg, 0.030)), np.mean(error <= max(0.02 * kg, 0.015))
    size = f"error median {1e3 * np.median(error):3.0f} g, worst {1e3 * error.max():3.0f} g"
    share = f"within 5 %/30 g {promise:.0%}, 2 %/15 g {aim:.0%}"
    print(f"  {place:8} {kg:g} kg: {size}; {share}; interval ±{1e3 * half:.0f} g holds {inside} of {len(found)}")


def _show_form(name: str, runs: list[dict[str, Any]]) -> None:
    if not runs:
        return
    measured = [r for r in runs if r["arm_mass_kg"] is not None]
    refused = sum(r["refused"] for r in measured)
    inside = sum(r["ci95_kg"][0] <= r["true_arm_mass_kg"] <= r["ci95_kg"][1] for r in measured)
    print(
        f"  {name:15}: {len(runs) - len(measured)} refused by the form itself; of the others {refused} of "
        f"{len(measured)} after the first motion; the arm's interval holds {inside}"
    )


def main() -> None:
    """Run or load, then print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rigs", default="recupera_like,recupera_like_qdd")
    parser.add_argument("--levels", default="2")
    parser.add_argument("--seeds", default="0-19")
    parser.add_argument("--pairs", type=int, default=len(PAIRS_KG), help="number of pairs of weights")
    parser.add_argument("--check-only", action="store_true")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path, nargs="*")
    options = parser.parse_args()
    if options.load:
        show(loaded(options.load))
        return
    results = []
    with ProcessPoolExecutor(options.processes) as pool:
        for result in pool.map(run, *zip(*jobs(options), strict=True)):
            results.append(result)
            if options.save:
                options.save.write_text(json.dumps(results, indent=1))
    show(results)


if __name__ == "__main__":
    main()
