"""Coverage of the intervals of `exograv twin fit` on the simulated machine, in its own world and with foreign drives.

    python benchmarks/twin_coverage.py out/coverage --world home drives --machines 12

Each machine is drawn, calibrated empty, recorded, and fitted; recordings and fits that exist are used again. The table
says how many true values are inside the 95 % intervals, by the noise of the residuals alone and with the discrepancy of
the model, and the median and largest error in standard deviations.
"""

import argparse
from pathlib import Path

import numpy as np

from exograv.identification.machine_twin.machine_fit import MachineFit, fit_machine
from exograv.laboratory.result_rows import still_to_rub
from exograv.laboratory.twin_calibration import EmptyTwin, pilots
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.calibration.segment_lengths import settings_of_lengths
from exograv.procedures.machine_twin.read_motions import read_motions
from exograv.recording import RecordingWriter
from exograv.rig.twin import Disturbances, Machine, draw_machine

RIG = load_rig("recupera_like")
LENGTHS = settings_of_lengths(RIG, ())
NAMES = ("inverse_gain", "coulomb", "viscous", "breakaway", "rotor", "offset")
INTERVAL = 1.96
"""Half of a 95 % interval, in standard deviations."""


def recorded(path: Path, machine: Machine, seed: int) -> None:
    """Record the calibration of a machine, unless the recording exists."""
    if path.exists():
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    with RecordingWriter(part, RIG.joints, {"rig": RIG.name, "side": RIG.side, "seed": seed}, packed=True) as recording:
        EmptyTwin(RIG, machine, seed, LENGTHS).calibrate(pilots(RIG, lambda _text, _share: None, recording))
    part.rename(path)


def fitted(path: Path) -> tuple[MachineFit, float]:
    """Fit a recording; return the fit and the length of the recording [s]."""
    recordings = read_motions(RIG, [path], {}, is_torque=False)
    motions = tuple(motion for one in recordings for motion in one.motions)
    tree = adjusted(read_exoskeleton(RIG), RIG, LENGTHS)
    return fit_machine(RIG, tree, motions), recordings[0].seconds


def errors(machine: Machine, found: MachineFit, t: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Errors of each parameter (joint,) in standard deviations: by the noise alone, and with the discrepancy."""
    still, friction = still_to_rub(machine, t), machine.friction
    truth = {
        "inverse_gain": RIG.nominal_gain / machine.drives.gain,
        "coulomb": still * friction.coulomb,
        "viscous": still * friction.viscous,
        "breakaway": friction.breakaway,
        "rotor": machine.drives.rotor_inertia,
        "offset": machine.sensors.encoder_offset,
    }
    layout, theta = found.fit.prior.layout, found.fit.theta
    by_noise, after = (np.sqrt(np.diag(one)) for one in (found.noise_covariance, found.fit.covariance))
    off = {name: theta[layout.of(name)] - truth[name] for name in NAMES}
    return {name: (off[name] / by_noise[layout.of(name)], off[name] / after[layout.of(name)]) for name in NAMES}


def main() -> None:
    """Draw, record, fit, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--world", nargs="+", default=["home", "drives"])
    parser.add_argument("--machines", type=int, default=12)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--level", type=int, default=2)
    options = parser.parse_args()
    print(
        "world    parameter     machines  inside by noise  inside  median SD by noise, after  largest by noise, after"
    )
    for world in options.world:
        rows: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {name: [] for name in NAMES}
        for seed in range(options.first_seed, options.first_seed + options.machines):
            machine = draw_machine(RIG, Disturbances.at_level(options.level, world), seed)
            path = options.folder / f"{world}_{seed}.mcap"
            recorded(path, machine, seed)
            for name, both in errors(machine, *fitted(path)).items():
                rows[name].append(both)
        for name, values in rows.items():
            before, after = (np.abs(np.concatenate([pair[k] for pair in values])) for k in (0, 1))
            inside = [f"{np.mean(one < INTERVAL):9.0%}" for one in (before, after)]
            middle, most = ([f"{of(one):10.1f}" for one in (before, after)] for of in (np.median, np.max))
            print(f"{world:8} {name:13} {len(values):8}", *inside, *middle, *most, flush=True)


if __name__ == "__main__":
    main()
