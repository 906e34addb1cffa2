r"""Coverage of the intervals on unloaded logs of a robot: torque of other logs, and mass of virtual loads.

    python benchmarks/log_coverage.py A.csv B.csv C.csv --urdf ur10e.urdf --payload-frame wrist_3_link \
        --gains 13.56,12.09,10.15,9.69,10.06,10.46

Each log identifies the robot and predicts the torque of each other log. The first table states the share of samples in
clear motion whose torque lies within the 95 % interval of the prediction.

Then each other log carries a virtual load of 0.5, 1, 2 and 4 kg. The torque of the load is that of a robot which is
drawn from the posterior of the carrying log, gain errors and friction under load included. The second table states the
error and the interval of the mass, for the whole log and for pieces of it.
"""

import argparse
from pathlib import Path

import numpy as np

from exograv.identification.core.arm_model import SLOW_V
from exograv.identification.core.interface import Sample
from exograv.identification.methods import built
from exograv.identification.payload.first_fit import first_fit
from exograv.identification.payload.payload import PAYLOAD, PayloadModel
from exograv.identification.payload.payload_outcome import QUANTILE_95
from exograv.identification.payload.payload_samples import samples_of_log
from exograv.identification.payload.payload_setting import payload_setting
from exograv.identification.payload.robot_from_log import RobotFromLog, robot_from_log, thinned
from exograv.model.tree import inertial_parameters
from exograv.model.urdf import read_urdf
from exograv.recording import read_log

MASSES_KG = (0.5, 1.0, 2.0, 4.0)
PIECES_S = (10.0, 20.0, np.inf)
CENTRE_SD_M = 0.1


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", type=Path, nargs="+")
    parser.add_argument("--urdf", type=Path, required=True)
    parser.add_argument("--payload-frame", required=True)
    parser.add_argument("--gains", required=True)
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--method", default="recursive")
    options = parser.parse_args()
    tree = read_urdf(options.urdf)
    model = PayloadModel(tree, options.payload_frame)
    gains = np.array([float(gain) for gain in options.gains.split(",")])
    logs = {path.stem: samples_of_log(read_log(path, tree.joint_names), gains) for path in options.logs}
    robots = {name: robot_from_log(model, samples) for name, samples in logs.items()}
    pairs = [(a, b) for a in logs for b in logs if a != b]
    print("| robot from | torque of | " + " | ".join(tree.joint_names) + " |")
    print("|---" * (2 + len(tree.joints)) + "|")
    for a, b in pairs:
        shares = _torque_coverage(model, robots[a], logs[b])
        print(f"| {a} | {b} | " + " | ".join(f"{100 * share:.0f} %" for share in shares) + " |", flush=True)
    print("\n| robot from | load on | piece s | holds the mass | RMS error % | mean half width % |")
    print("|---|---|---|---|---|---|")
    rng, found = np.random.default_rng(0), []
    for a, b in pairs:
        for piece_s in PIECES_S:
            cases = [
                _virtual(model, (robots[a], logs[a]), (robots[b], logs[b]), piece_s, mass, options.method, rng)
                for mass in MASSES_KG
                for _ in range(options.draws)
            ]
            found += cases
            print(f"| {a} | {b} | {piece_s:g} | {_figures(cases)} |", flush=True)
    print(f"| all | all | all | {_figures(found)} |")


def _figures(cases: list[tuple[float, float]]) -> str:
    error, half = np.array(cases).T
    held = int(np.count_nonzero(np.abs(error) <= half))
    return f"{held} of {len(cases)} | {100 * np.sqrt(np.mean(error**2)):.1f} | {100 * half.mean():.1f}"


def _torque_coverage(model: PayloadModel, robot: RobotFromLog, other: list[Sample]) -> np.ndarray:
    """Share of samples in clear motion whose torque the interval of the prediction holds, per joint."""
    inside, clear = [], []
    for sample in thinned(other):
        tau, H = model.linearise(sample, robot.x)
        variance = np.einsum("jp,pq,jq->j", H, robot.covariance, H) + robot.residual_sd**2
        inside.append(np.abs(sample.tau - tau) <= QUANTILE_95 * np.sqrt(variance))
        clear.append(np.abs(sample.v) > SLOW_V)
    return np.sum(np.array(inside) & np.array(clear), axis=0) / np.sum(clear, axis=0)


def _virtual(
    model: PayloadModel,
    known: tuple[RobotFromLog, list[Sample]],
    carrier: tuple[RobotFromLog, list[Sample]],
    piece_s: float,
    mass: float,
    method: str,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Relative error of the mass of one virtual load, and half of its relative 95 % interval."""
    robot, samples = carrier
    x = rng.multivariate_normal(robot.x, robot.covariance, method="eigh")
    loaded, bare = x.copy(), x.copy()
    loaded[PAYLOAD] = inertial_parameters(mass, rng.normal(0.0, CENTRE_SD_M, 3), 0.01 * mass * np.eye(3))
    bare[PAYLOAD] = 0.0
    start = rng.uniform(0.0, max(samples[-1].t - piece_s, 0.0))
    piece = [s for s in samples if start <= s.t <= start + piece_s]
    carried = [
        Sample(s.t, s.q, s.v, s.a, s.tau + model.linearise(s, loaded)[0].copy() - model.linearise(s, bare)[0])
        for s in piece
    ]
    first = first_fit(model, known[0], carried)
    identifier = built(method, payload_setting(model, known[0], known[1] + carried, first.x))
    for sample in carried:
        identifier.update(sample)
    estimate = identifier.estimate()
    return estimate.x[0] / mass - 1.0, QUANTILE_95 * estimate.sd[0] / mass


if __name__ == "__main__":
    main()
