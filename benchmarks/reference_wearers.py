"""Left over of thirty simulated wearers, with which a demo compares its own run.

    nice -n 19 python benchmarks/reference_wearers.py --seeds 100-129
    python benchmarks/reference_wearers.py --check-seed 0 --recording demo.mcap

Each wearer has an own machine and runs as in `exograv arm identify` with that seed: calibration, then 60 s of motion.
The file is saved after each wearer, and a second call continues it. It ships with the package, so commit it. One wearer
takes about 100 s of computing time. `--check-seed` runs one wearer, and compares it with the recording of a demo.
"""

import argparse
import json
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import exograv
from exograv.errors import ExogravError
from exograv.laboratory.options import DemoOptions
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.reference_wearers import ReferenceKey, reference_path
from exograv.laboratory.result_rows import time_to_target
from exograv.laboratory.truth_score import TruthScore
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.procedures.identification.identify import identify_arm
from exograv.procedures.identification.motions import motion_parts
from exograv.recording import read_recording
from exograv.recording.rounding import rounded
from exograv.rig.twin import day_seed
from exograv.study.targets import TARGET_NM
from seeds import seed_range


def wearer_row(options: DemoOptions) -> dict[str, Any]:
    """Calibrate, identify and score one wearer, in the steps of the demo and without a recording."""
    laboratory = draw_laboratory(options.rig, options.side, options.level, options.seed)
    preparation = Preparation(laboratory, day_seed(options.seed, options.donning))
    known = preparation.calibrated()
    worn = preparation.worn(known)
    examination = worn.examination()
    scores: dict[float, TruthScore] = {}
    identifier = worn.identifier(
        options.method,
        options.torque_source,
        lambda _t, estimate, *_: scores.update({estimate.t: examination.score(estimate.x)}),
    )
    method = identifier.result.method
    parts = motion_parts(options.motion, known.assembly, known.machine, method, options.seconds, worn.twin.period_s)
    found = identify_arm(worn.pilot, worn.controller, identifier, options.seconds, parts)
    targets = [TARGET_NM[place] for place in laboratory.description.places]
    return {
        "seed": options.seed,
        "left_over_Nm": rounded(scores[found.last.t].total),
        "time_to_target_s": time_to_target(scores, targets),
    }


def extend(path: Path, options: DemoOptions, seeds: range) -> None:
    """Run the wearers that the file lacks, and save it after each."""
    key, laboratory = ReferenceKey.of(options), draw_laboratory(options.rig, options.side, options.level, 0)
    content: dict[str, Any] = {
        "about": "True left over after identification of simulated wearers, each in a machine of its own.",
        "source": f"benchmarks/reference_wearers.py --level {options.level} --seeds {seeds[0]}-{seeds[-1]}",
        "exograv": exograv.__version__,
        "key": asdict(key),
        "joints": list(laboratory.description.joints),
        "wearers": [],
    }
    if path.exists():
        content["wearers"] = json.loads(path.read_text(encoding="utf-8"))["wearers"]
    done = {row["seed"] for row in content["wearers"]}
    for seed in seeds:
        if seed in done:
            continue
        try:
            row = wearer_row(DemoOptions(rig=options.rig, level=options.level, seed=seed))
        except ExogravError as error:
            row = {"seed": seed, "broke_off": str(error)}
        content["wearers"].append(row)
        content["date"] = f"{datetime.now(UTC):%Y-%m-%d}"
        path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        print(json.dumps(row), flush=True)


def main() -> None:
    """Extend the file, or check one wearer."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig", default="recupera_like")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="100-129", help="100 or more, so that the demo's own seed is not among them")
    parser.add_argument("--check-seed", type=int)
    parser.add_argument("--recording", type=Path)
    given = parser.parse_args()
    if given.check_seed is not None:
        row = wearer_row(DemoOptions(rig=given.rig, level=given.level, seed=given.check_seed))
        demo = read_recording(given.recording).last("/result")["left_over_rms_Nm"]["total"]["identified"]
        print(f"here {row['left_over_Nm']}, demo {demo}: {'the same' if row['left_over_Nm'] == demo else 'DIFFERENT'}")
        return
    seeds = seed_range(given.seeds)
    if seeds[0] < 100:
        parser.error(f"--seeds {given.seeds}: take 100 or more; lower seeds are for demos.")
    options = DemoOptions(rig=given.rig, level=given.level)
    extend(reference_path(ReferenceKey.of(options)), options, seeds)


if __name__ == "__main__":
    main()
