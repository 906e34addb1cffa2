"""Benefit of a participant's file on a later day: identification from the file against a cold start, same samples.

    python benchmarks/donning.py --seeds 0-9 --level 2 --save donning.json
    python benchmarks/donning.py --load donning.json

For each seed: stage 0 once (a calibration is valid for 30 days), then the first donning is identified and kept. The
second donning of the same wearer in the same machine starts from that file. A second method starts cold on the same
samples. The method with the file gives the feed-forward torque. Nothing was tuned on the reported seeds.
"""

import argparse
import json
import tempfile
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ExogravError
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.result_rows import time_to_target
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.procedures.identification.options import ParticipantOptions
from exograv.procedures.identification.participant_session import ParticipantRun
from exograv.results import json_value
from exograv.rig.twin import day_seed
from exograv.study.targets import TARGET_NM
from seeds import loaded, seed_range

ASKED_S = (10.0, 20.0, 60.0)
SECONDS = 61.0  # the sample filter settles within the first second
NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)


def silent(_text: str, _share: float) -> None:
    """Ignore progress: one line per seed is enough."""


def run(rig: str, level: int, seed: int) -> dict[str, Any]:
    """Identify one wearer on both days; return the figures of the second."""
    first = draw_laboratory(rig, None, level, seed)
    calibration, t0 = Preparation(first, seed).calibrate()
    machine = calibration.machine
    targets = [TARGET_NM[place] for place in first.description.places]
    result: dict[str, Any] = {"seed": seed, "level": level}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "participant.toml"
        for donning, files in enumerate((ParticipantOptions(keep=file), ParticipantOptions(participant=file))):
            laboratory = draw_laboratory(rig, None, level, seed, donning=donning)
            assembly = laboratory.assembly()
            person = ParticipantRun(files, assembly, "benchmark", laboratory.body, NOON + timedelta(days=donning))
            preparation = Preparation(laboratory, day_seed(seed, donning))
            worn = preparation.worn(preparation.known(calibration, t0, assembly))

            def note(_t, estimate, predicted, _outcome, person=person) -> None:
                person.note(estimate, predicted)

            identifier = worn.identifier(listener=note, belief=person.belief(machine))
            person.listen(identifier)
            found = worn.identify(identifier, SECONDS)
            kept = person.keep(found, machine, "of the machine's description", "")
            if kept is not None and kept["file"] is None:
                return result | {"broke_off": kept["why"]}
            result["file_bytes"] = file.stat().st_size
            if person.returning is not None:
                examination = worn.examination()
                result |= json_value(person.returning.figures)
                for name, estimates in (("from_file", found.estimates), ("cold", person.returning.cold_estimates)):
                    scores = {e.t: examination.score(e.x) for e in estimates}
                    result[f"{name}_true"] = {
                        "time_to_target_s": time_to_target(scores, targets),
                        "left_over_Nm": {f"{t:g}": _at(scores, t) for t in ASKED_S},
                    }
    return result


def _at(scores: dict[float, Any], t: float) -> list[float]:
    """Torque left over by the last estimate up to time `t` (joint,) [N·m]."""
    return [round(value, 4) for value in scores[max(s for s in scores if s <= t)].total.tolist()]


def show(results: list[dict[str, Any]]) -> None:
    """Print medians over the seeds, cold start and file side by side."""
    done = [r for r in results if "broke_off" not in r]
    print(f"{len(done)} of {len(results)} seeds completed: {[r['seed'] for r in done]}")
    for name in ("from_file", "cold"):
        times = [r[f"{name}_true"]["time_to_target_s"] for r in done]
        reached = [t for t in times if t is not None]
        median = np.median([np.inf if t is None else t for t in times])
        print(f"{name:9}: targets reached by {len(reached)} of {len(times)}, median time {median:.0f} s; each {times}")
        for t in ASKED_S:
            values = np.array([r[f"{name}_true"]["left_over_Nm"][f"{t:g}"] for r in done])
            median, worst = (" ".join(f"{v:.3f}" for v in f(values, axis=0)) for f in (np.median, np.max))
            print(f"  after {t:2g} s: median {median} N·m, worst {worst}")
        predicted = [r[name]["predicted_target_s"] for r in done]
        print(f"  by its own prediction within the stop rule's target from {predicted} s; stops at", end=" ")
        print([r[name]["stop_s"] and round(r[name]["stop_s"]) for r in done])
    print("log evidence of the file over the table:", [list(r["log_evidence_over_table"].values()) for r in done])


def main() -> None:
    """Run or load, then print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig", default="recupera_like")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="0-9")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path, nargs="*")
    options = parser.parse_args()
    if options.load:
        show(loaded(options.load))
        return
    results = []
    for seed in seed_range(options.seeds):
        start = time.perf_counter()
        try:
            results.append(run(options.rig, options.level, seed))
        except ExogravError as error:
            results.append({"seed": seed, "level": options.level, "broke_off": str(error)})
        print(f"seed {seed}: {time.perf_counter() - start:.0f} s, {results[-1]}", flush=True)
        if options.save:
            options.save.write_text(json.dumps(results, indent=1))
    show(results)


if __name__ == "__main__":
    main()
