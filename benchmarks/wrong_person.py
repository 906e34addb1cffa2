"""Check of the person: each person's second donning against every file; right files are kept, wrong ones refused.

    python benchmarks/wrong_person.py --seeds 0-9 --level 2
    python benchmarks/wrong_person.py --seeds 0-9 --level 2 --no-run

Every person is identified and kept on a first day, and moves for 20 s on a second day with the right file in use. The
script then checks that motion against every file (`procedures/identification/person_check.py`). This check leaves body
data out: body data alone refuse most wrong files before any motion (`storage/participant_file.py`). The last lines
count those, and the verdict of the motion on the others. Nothing was tuned on the reported seeds.
"""

import argparse
import pickle
import time
from pathlib import Path
from typing import Any

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.errors import ExogravError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.prior import prior
from exograv.identification.recursive.previous_session import carried_over, kept_part
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.procedures.identification.estimator_session import Belief
from exograv.procedures.identification.person_check import PersonCheck
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.rig.twin import day_seed
from exograv.storage.participant_file import other_body
from exograv.storage.participant_schema import StoredPerson
from seeds import seed_range

FIRST_S = 61.0
KEPT_EVERY_S = 0.004


def record(rig: str, level: int, seed: int) -> dict[str, Any]:
    """Return both days of one person: the estimate of the first, the samples of the second."""
    first = draw_laboratory(rig, None, level, seed)
    calibration, t0 = Preparation(first, seed).calibrate()
    machine = calibration.machine

    def day(donning: int, seconds: float, belief: Belief | None) -> tuple[Estimate, list[Sample]]:
        laboratory = draw_laboratory(rig, None, level, seed, donning=donning)
        preparation = Preparation(laboratory, day_seed(seed, donning))
        worn = preparation.worn(preparation.known(calibration, t0))
        identifier = worn.identifier(belief=belief)
        samples = list[Sample]()

        def listen(sample: Sample) -> None:
            if not samples or sample.t - samples[-1].t > KEPT_EVERY_S - 1e-9:
                samples.append(Sample(sample.t, *(a.copy() for a in (sample.q, sample.v, sample.a, sample.tau))))

        identifier.followers.append(listen)
        return worn.identify(identifier, seconds).last, samples

    found, _ = day(0, FIRST_S, None)
    assembly = first.assembly()
    layout, covariance = ParameterLayout.of(assembly), found.covariance
    assert covariance is not None, "the recursive method states one"
    kept = kept_part(layout)
    whole: dict[str, Any] = {"mean": found.x[kept], "covariance": covariance[kept, kept]}
    _, samples = day(1, FROM_FILE_S, today(whole, layout, prior(assembly, machine)))
    return whole | {"seed": seed, "machine": machine, "samples": samples, "rig": rig, "level": level}


def today(whole: dict[str, Any], layout: ParameterLayout, table: Belief) -> Belief:
    """Return the belief from a file, a day later."""
    return carried_over(layout, (whole["mean"], whole["covariance"]), table, 1.0)


def asked(person: dict[str, Any], files: list[dict[str, Any]]) -> list[PersonCheck]:
    """Check one person's second day against each file."""
    machine: CalibratedMachine = person["machine"]
    assembly = draw_laboratory(person["rig"], None, person["level"], person["seed"], donning=1).assembly()
    model, table, layout = ArmModel(assembly, machine), prior(assembly, machine), ParameterLayout.of(assembly)
    checks = [PersonCheck(model.again(), machine, today(file, layout, table), table) for file in files]
    for check in checks:
        for sample in person["samples"]:
            if check.take(sample) and check.is_contradicted:
                break
    return checks


def is_alike(person: dict[str, Any], file: dict[str, Any]) -> bool:
    """Return True if the body data of the second day pass for those of the file, given on the first day."""
    stored, told = (
        draw_laboratory(one["rig"], None, one["level"], one["seed"], donning=day).body
        for one, day in ((file, 0), (person, 1))
    )
    return other_body(StoredPerson.of("P-0", stored), told) is None


def main() -> None:
    """Run the missing seeds, then check all files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig", default="recupera_like")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="0-9")
    parser.add_argument("--save", type=Path, default=Path("out/persons"))
    parser.add_argument("--no-run", action="store_true", help="use only persons that are already in the folder")
    options = parser.parse_args()
    options.save.mkdir(parents=True, exist_ok=True)
    people = []
    for seed in seed_range(options.seeds):
        path = options.save / f"{options.rig}_{options.level}_{seed}.pickle"
        if not path.exists() and not options.no_run:
            start = time.perf_counter()
            try:
                path.write_bytes(pickle.dumps(record(options.rig, options.level, seed)))
            except ExogravError as error:
                print(f"seed {seed}: {error}")
                continue
            print(f"seed {seed}: {time.perf_counter() - start:.0f} s", flush=True)
        if path.exists():
            people.append(pickle.loads(path.read_bytes()))
    show(people)


def show(people: list[dict[str, Any]]) -> None:
    """Print refused files, right and wrong, and the last evidence."""
    refused, last = np.zeros((len(people),) * 2, dtype=bool), np.zeros((len(people),) * 2)
    for p, person in enumerate(people):
        checks = asked(person, people)
        refused[p] = [check.is_contradicted for check in checks]
        last[p] = [list(check.evidence.values())[-1] for check in checks]
        own = {t: round(value, 1) for t, value in checks[p].evidence.items()}
        wrong = int(refused[p].sum() - refused[p, p])
        print(f"seed {person['seed']}: own file {own}; of {len(people) - 1} others refused: {wrong}", flush=True)
    right = np.eye(len(people), dtype=bool)
    alike = np.array([[is_alike(person, file) for file in people] for person in people])
    print(f"right files refused: {refused[right].sum()} of {right.sum()}, least evidence {last[right].min():+.1f}")
    print(f"wrong files refused: {refused[~right].sum()} of {(~right).sum()}, down to {last[~right].min():+.0f}")
    print(f"of these, body data alone refuse {(~alike & ~right).sum()}, before any motion")
    print(f"of the {(alike & ~right).sum()} whose body data pass, motion refuses {refused[alike & ~right].sum()}")
    print(f"right files that body data refuse: {(~alike & right).sum()} of {right.sum()}")


if __name__ == "__main__":
    main()
