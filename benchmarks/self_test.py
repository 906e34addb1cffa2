"""Test the start-up self-test: it must find faults, and accept healthy machines (docs/explanation/safety.md).

    python benchmarks/self_test.py --seeds 0-19 --faults 0-0 --calibrations calibrations --save self_test.json
    python benchmarks/self_test.py --load self_test.json

Every machine is calibrated while healthy. Calibrations are kept in the folder of `--calibrations` and reused. The
self-test then runs as on another day: with other noise, cold. The machines of --seeds are healthy; those of --faults
have each fault once, at a randomly drawn joint. Runs that are already in the file of --save are not repeated.
"""

import argparse
import json
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from seeds import seed_range

RIGS = "recupera_like,recupera_like_qdd"
NOTHING = "nothing"
RUN_SEED = 50_000
"""Offset from the machine's seed: the noise of the day of the test."""


def calibrated(rig: str, level: int, seed: int, folder: Path) -> Path | None:
    """Return the machine's calibration; None if stage 0 refuses the machine."""
    from exograv.api.rig_factory import run_calibration
    from exograv.errors import ExogravError
    from exograv.procedures.calibration.options import CalibrateOptions

    file = folder / f"{rig}_{level}_{seed}.toml"
    if not file.exists() and not file.with_suffix(".refused").exists():
        folder.mkdir(parents=True, exist_ok=True)
        try:
            options = CalibrateOptions(rig, None, level, seed=seed, calibration=file)
            run_calibration(options, folder, lambda _text, _share: None)
        except ExogravError as error:
            file.with_suffix(".refused").write_text(str(error))
    return file if file.exists() else None


def run(rig: str, level: int, seed: int, fault: str, file: Path) -> dict[str, Any]:
    """Run one self-test; return its figures."""
    from dataclasses import replace

    from exograv.laboratory.twin_calibration import EmptyTwin
    from exograv.model.description import load_rig
    from exograv.procedures.self_test.machine_test import test_machine
    from exograv.rig.twin import Disturbances, draw_machine
    from exograv.storage.calibration_file import take_calibration, twin_identity
    from self_test_faults import HIDDEN

    description = load_rig(rig)
    machine = draw_machine(description, Disturbances.at_level(level), seed)
    taken = take_calibration(file, description, twin_identity(level, seed), datetime.now(UTC))
    joint, driver = 0, None
    if fault != NOTHING:
        joint = int(np.random.default_rng([seed, level, list(HIDDEN).index(fault)]).integers(len(description.joints)))
        machine = HIDDEN[fault].machine(machine, joint)
    whole = taken.whole
    lengths = whole.measured.lengths_m
    subject = EmptyTwin(description, machine, RUN_SEED + seed, lengths).under_test(whole.calibration())
    if fault != NOTHING:
        driver = HIDDEN[fault].driver(subject.rig, joint, description.nominal_gain)
        subject = replace(subject, rig=driver, press=driver.press)
    started = time.perf_counter()
    steps, busy_s = test_machine(subject, lambda _text, _share: None)
    failed = [step for step in steps if step.passed is False]
    return {
        "joint": description.joints[joint],
        "refused": bool(failed),
        "named": bool(failed) and description.joints[joint] in failed[0].what_to_do,
        "by": failed[0].name if failed else "",
        "why": failed[0].what_to_do if failed else "",
        "figures": {step.name: step.measured for step in steps if isinstance(step.measured, float)},
        "machine_s": round(busy_s, 2),
        "wall_s": round(time.perf_counter() - started, 2),
    }


def wanted(options: argparse.Namespace) -> Iterator[tuple[str, int, int, str]]:
    """Yield the tasks: each fault, then healthy machines."""
    from self_test_faults import HIDDEN

    machines = [(rig, level) for level in seed_range(options.levels) for rig in options.rigs.split(",")]
    for seed in seed_range(options.faults):
        for fault in HIDDEN:
            for rig, level in machines:
                yield rig, level, seed, fault
    for seed in seed_range(options.seeds):
        for rig, level in machines:
            yield rig, level, seed, NOTHING


def show(results: dict[str, dict[str, Any]]) -> None:
    """Print one row per fault, then the healthy machines by drive and level."""
    rows: dict[str, list[tuple[str, dict[str, Any]]]] = {}
    for key, result in results.items():
        rows.setdefault(key.split("|")[3], []).append((key, result))
    print(f"{'fault':34}{'tested':>7}{'refused':>8}{'joint named':>12}  found by")
    for fault, runs in rows.items():
        if fault != NOTHING:
            by = sorted({result["by"] for _, result in runs if result["refused"]})
            named = sum(r.get("named", False) for _, r in runs)
            print(f"{fault:34}{len(runs):7}{sum(r['refused'] for _, r in runs):8}{named:12}  {'; '.join(by)}")
            for key, result in runs:
                if not result["refused"]:
                    print(f"    not found: {key} {result['joint']} {result['figures']}")
    healthy = rows.get(NOTHING, [])
    print(f"\nin good order: {len(healthy)} tested, {sum(r['refused'] for _, r in healthy)} refused")
    for group in sorted({tuple(key.split("|")[:2]) for key, _ in healthy}):
        runs = [result for key, result in healthy if tuple(key.split("|")[:2]) == group]
        busy = [result["machine_s"] for result in runs]
        print(
            f"  {group[0]}, level {group[1]}: {len(runs)} tested, {sum(r['refused'] for r in runs)} refused; "
            f"machine {np.median(busy):.0f} s, at most {max(busy):.0f} s"
        )
    for key, result in healthy:
        if result["refused"]:
            print(f"    refused: {key} {result['by']}: {result['why']}")
    for name in sorted({name for _, result in healthy for name in result["figures"]}):
        values = np.abs([result["figures"][name] for _, result in healthy if name in result["figures"]])
        print(f"  {name:42} median {np.median(values):.3g}, worst {values.max():.3g}, least {values.min():.3g}")


def main() -> None:
    """Run or load, then print. Each result is saved as soon as it exists."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rigs", default=RIGS)
    parser.add_argument("--levels", default="0-4")
    parser.add_argument("--seeds", default="0-19")
    parser.add_argument("--faults", default="0-0")
    parser.add_argument("--calibrations", type=Path, default=Path("calibrations"))
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path)
    options = parser.parse_args()
    if options.load:
        show(json.loads(options.load.read_text()))
        return
    results = json.loads(options.save.read_text()) if options.save and options.save.exists() else {}
    for rig, level, seed, fault in wanted(options):
        key = f"{rig}|{level}|{seed}|{fault}"
        if key in results or (file := calibrated(rig, level, seed, options.calibrations)) is None:
            continue
        results[key] = run(rig, level, seed, fault, file)
        print(key, results[key]["by"] or "passed", results[key]["wall_s"], flush=True)
        if options.save:
            options.save.write_text(json.dumps(results, indent=1))
    show(results)


if __name__ == "__main__":
    main()
