"""Coverage and width of verification intervals over seeds, levels and machines.

    nice -n 10 python benchmarks/verify.py --rigs recupera_like --levels 2 --seeds 0-19 --save verify.json
    python benchmarks/verify.py --load verify.json

Each run is `exograv arm verify` with that seed, which draws machine and wearer. Tune on seeds from 1000 on.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binom

from exograv.errors import ExogravError
from seeds import loaded, seed_range


def run(rig: str, level: int, seed: int) -> dict[str, Any]:
    """Run one `exograv arm verify`; a run that broke off is a result too."""
    from exograv.laboratory.verification_command import run_verification
    from exograv.procedures.verification.options import VerifyOptions
    from exograv.results import json_value

    job = {"rig": rig, "level": level, "seed": seed}
    try:
        found = run_verification(VerifyOptions(rig, None, level, seed=seed), lambda _text, _share: None)
        return {**job, **json_value(found)}
    except ExogravError as error:
        return {**job, "broke_off": str(error)}


def jobs(options: argparse.Namespace) -> Iterator[tuple[str, int, int]]:
    """Yield every run of the command line."""
    for rig in options.rigs.split(","):
        for level in map(int, options.levels.split(",")):
            yield from ((rig, level, seed) for seed in seed_range(options.seeds))


def show(results: list[dict[str, Any]]) -> None:
    """Print one line per joint, machine and level, and one for all joints together."""
    done = [r for r in results if "broke_off" not in r]
    print(f"{len(done)} of {len(results)} runs completed")
    for r in results:
        if "broke_off" in r:
            print(f"  {r['rig']}, level {r['level']}, seed {r['seed']} broke off: {r['broke_off']}")
    for rig, level in sorted({(r["rig"], r["level"]) for r in done}):
        runs = [r for r in done if (r["rig"], r["level"]) == (rig, level)]
        seconds = np.median([r["motion_s"] for r in runs])
        relaxed = sum(r["relaxed"] for r in runs)
        print(f"{rig}, level {level}: {len(runs)} twins, {seconds:.0f} s of motion, {relaxed} found relaxed")
        _show_runs(runs)


def _show_runs(runs: list[dict[str, Any]]) -> None:
    low, high = (np.array([r["ci95"] for r in runs])[..., k] for k in (0, 1))
    truth, found = np.array([r["truth_Nm"] for r in runs]), np.array([r["left_over_Nm"] for r in runs])
    inside = (low <= truth) & (truth <= high)
    for j, joint in enumerate(runs[0]["joints"]):
        sides = f"truth below {np.sum(truth[:, j] < low[:, j])}, above {np.sum(truth[:, j] > high[:, j])}"
        print(
            f"  {joint:20} holds {inside[:, j].sum():2} of {len(runs)} ({sides}); medians: width "
            f"{np.median(high[:, j] - low[:, j]):.3f}, found {np.median(found[:, j]):.3f}, "
            f"truth {np.median(truth[:, j]):.3f} N·m"
        )
    count = inside.size
    chance = binom.interval(0.95, count, 0.95)
    moved = np.median([r["fingertip_mm"] for r in runs])
    print(
        f"  all joints           holds {inside.sum()} of {count} ({inside.mean():.0%}); 95 % would be "
        f"{chance[0]:.0f} to {chance[1]:.0f}, were the joints independent; fingertip {moved:.1f} mm"
    )


def main() -> None:
    """Run or load, then print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rigs", default="recupera_like,recupera_like_qdd")
    parser.add_argument("--levels", default="2")
    parser.add_argument("--seeds", default="0-19")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path, nargs="*")
    options = parser.parse_args()
    if options.load:
        show(loaded(options.load))
        return
    results = []
    for job in jobs(options):
        results.append(run(*job))
        if options.save:
            options.save.write_text(json.dumps(results, indent=1))
    show(results)


if __name__ == "__main__":
    main()
