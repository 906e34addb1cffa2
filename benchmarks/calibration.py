"""Errors and coverage of calibration on random virtual machines, and torque left over with and without it.

    python benchmarks/calibration.py --rigs recupera_like,recupera_like_qdd --seeds 0-19 --save calibration.json
    python benchmarks/calibration.py --rigs recupera_like --seeds 0-2 --worn --save worn.json
    python benchmarks/calibration.py --load calibration.json worn.json
Each run is `exograv rig calibrate` on the machine of that seed. With --worn each run adds `exograv arm identify` with
a wearer, once with that calibration and once with the data sheets in its place (docs/howto/calibration.md).
once with that calibration and once with the data sheets in its place.
"""

import argparse
import json
import tempfile
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ExogravError
from seeds import loaded, seed_range

FRICTION = ("coulomb_Nm", "viscous", "breakaway", "load_share", "asymmetry_Nm", "v_stribeck_rad_per_s")
RELATIVE = ("gain", "coulomb_Nm", "viscous", "breakaway", "v_stribeck_rad_per_s")
"""Names with errors in percent of the truth; the others are in their own unit."""


def run(rig: str, level: int, seed: int, worn: bool) -> dict[str, Any]:
    """Calibrate one machine; a refused machine is a result too."""
    from exograv.api.rig_factory import run_calibration
    from exograv.procedures.calibration.options import CalibrateOptions
    from exograv.results import json_value

    key = {"rig": rig, "level": level, "seed": seed}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "calibration.toml"
        options = CalibrateOptions(rig, None, level, seed=seed, calibration=file)
        try:
            found = run_calibration(options, Path(folder), lambda _text, _share: None)
        except ExogravError as error:
            return key | {"refused": str(error)}
        result = key | {"found": json_value(found), "empty": empty_left_over(rig, level, seed, file)}
        return result | {"worn": worn_left_over(rig, level, seed, file)} if worn else result


def empty_left_over(rig: str, level: int, seed: int, file: Path) -> dict[str, list[float]]:
    """RMS torque left over (joint,) [N·m] on the empty machine at held-out postures, calibrated and by data sheet."""
    import casadi as ca

    from exograv.dynamics.loop_torque import GRAVITY
    from exograv.dynamics.rnea import rnea
    from exograv.model.assembly import adjusted, read_exoskeleton
    from exograv.model.description import load_rig
    from exograv.rig.twin import Disturbances, Examiner, draw_machine
    from exograv.rig.twin.examiner import rms
    from exograv.storage.calibration_file import read_calibration

    description = load_rig(rig)
    whole = read_calibration(file)
    machine, lengths = whole.calibration().machine, whole.measured.lengths_m
    tree = adjusted(read_exoskeleton(description), description, lengths)
    n = len(tree.joints)
    q, phi, gravity = ca.SX.sym("q", n), ca.SX.sym("phi", 10, n), ca.SX.sym("gravity", 3)
    still = ca.SX.zeros(n)
    weight = ca.Function("weight", [q, phi, gravity], [rnea(tree, q, still, still, phi, gravity)])
    examiner = Examiner(description, draw_machine(description, Disturbances.at_level(level), seed), None, lengths)

    def score(links: np.ndarray, pull: np.ndarray, gain: np.ndarray) -> list[float]:
        left = examiner.left_over(lambda qs: np.array(weight(qs.T, links.T, pull)).T / gain)
        return rms(left).round(5).tolist()

    return {
        "calibrated": score(machine.phi, machine.gravity, machine.actuators.gain),
        "nominal": score(tree.phi, GRAVITY, description.nominal_gain),
    }


def worn_left_over(rig: str, level: int, seed: int, file: Path) -> dict[str, list[float]]:
    """RMS torque left over (joint,) [N·m] at held-out postures after 60 s with a wearer, calibrated and nominal."""
    from exograv.laboratory.demo import DemoOptions, run_demo

    scores = {}
    for name, path in (("calibrated", file), ("nominal", uncalibrated(rig, file))):
        options = DemoOptions(rig=rig, level=level, seed=seed, only_identify=True, calibration=path)
        result = run_demo(options, path.parent, lambda _text, _share: None)
        scores[name] = result.findings.arm.left_over_rms_Nm.total.identified
    return scores


def uncalibrated(rig: str, file: Path) -> Path:
    """Write a calibration file with data-sheet values, each as uncertain as before a calibration; return its path."""
    from exograv.dynamics.actuator import ActuatorGain
    from exograv.dynamics.loop_torque import GRAVITY
    from exograv.identification.calibration.empty_prior import COULOMB, GAIN_SD, VISCOUS, usual_friction
    from exograv.model.assembly import read_exoskeleton
    from exograv.model.description import load_rig
    from exograv.procedures.calibration.nominal_machine import nominal_machine
    from exograv.storage.calibration_file import read_calibration, write_calibration
    from exograv.storage.calibration_schema import stored

    description, whole = load_rig(rig), read_calibration(file)
    measured = whole.calibration()
    nominal = nominal_machine(description, read_exoskeleton(description).phi)
    coulomb_sd, viscous_sd = (usual_friction(description, table)[1] for table in (COULOMB, VISCOUS))
    machine = replace(
        nominal,
        actuators=ActuatorGain(description.nominal_gain, GAIN_SD * description.nominal_gain),
        friction_sd=replace(nominal.friction_sd, coulomb=coulomb_sd, viscous=viscous_sd),
        residual_sd=measured.machine.residual_sd,
        correlation_s=measured.machine.correlation_s,
        gravity=GRAVITY,
    )
    told = replace(measured, machine=machine, tilt=np.zeros(2))
    now = whole.measured.model_copy(update={"friction_at_utc": datetime.now(UTC).replace(microsecond=0)})
    path = file.with_name("nominal.toml")
    write_calibration(path, stored(told, whole.identity, now, description.joints))
    return path


def show(results: list[dict[str, Any]]) -> None:
    """Print one table per machine and level: error, coverage, torque left over."""
    for rig, level in sorted({(result["rig"], result["level"]) for result in results}):
        runs = [result for result in results if (result["rig"], result["level"]) == (rig, level)]
        done = [result for result in runs if "refused" not in result]
        print(f"\n{rig}, level {level}: {len(done)} of {len(runs)} machines calibrated")
        for result in runs:
            if "refused" in result:
                print(f"  seed {result['seed']} refused: {result['refused']}")
        if done:
            _show_errors(done)
        for what in ("empty", "worn"):
            for name in ("nominal", "calibrated"):
                values = [result[what][name] for result in done if what in result]
                if values:
                    print(f"  left over, {what:5} {name:10}  median {_row(np.median(values, axis=0))}"
                          f"   worst {_row(np.max(values, axis=0))}")  # fmt: skip


def _show_errors(runs: list[dict[str, Any]]) -> None:
    print(f"  {'':22}{'median':>9}{'worst':>9}  95 % intervals hold the truth")
    for name in ("gain", *FRICTION, "encoder_offset_deg", "tilt_deg"):
        rows = [row for result in runs for row in _values(result["found"], name)]
        errors = np.array(
            [abs(value - truth) / (0.01 * truth if name in RELATIVE else 1.0) for value, truth, _ in rows]
        )
        inside = np.array([low <= truth <= high for _, truth, (low, high) in rows])
        unit = " %" if name in RELATIVE else ""
        print(f"  {name:22}{np.median(errors):9.2g}{errors.max():9.2g}{unit:2}  {inside.sum()} of {len(rows)}")


def _values(found: dict[str, Any], name: str) -> list[tuple[float, float, list[float]]]:
    """Return estimate, truth and interval of each joint."""
    if name in FRICTION:
        return [(row[name], row[f"{name}_true"], row[f"{name}_ci95"]) for row in found["friction"]]
    return [(row["estimate"], row["true"], row["ci95"]) for row in found[name]]


def _row(values: np.ndarray) -> str:
    return " ".join(f"{value:6.3f}" for value in values)


def main() -> None:
    """Run or load, then print. Each result is saved as soon as it exists."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rigs", default="recupera_like,recupera_like_qdd")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="0-19")
    parser.add_argument("--worn", action="store_true")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path, nargs="*")
    options = parser.parse_args()
    if options.load:
        show(loaded(options.load))
        return
    results = []
    for seed in seed_range(options.seeds):
        for rig in options.rigs.split(","):
            results.append(run(rig, options.level, seed, options.worn))
            if options.save:
                options.save.write_text(json.dumps(results, indent=1))
    show(results)


if __name__ == "__main__":
    main()
