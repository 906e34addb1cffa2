"""Search the motion that tells most about an arm: prints the `[excitation]` block of a machine's rig.toml.

    python benchmarks/design_excitation.py recupera_like --seconds 600

Random search from the motion in force. It sees no twin: a nominal person by the table, the estimator's own prior and
noise, and the predicted left over after 60 s over the task workspace. Minimised is the worst joint against its target.
"""

import argparse
import time

import numpy as np

from exograv import motion
from exograv.identification.arm_model import ArmModel
from exograv.identification.interface import Sample
from exograv.identification.left_over import TARGET_NM, LeftOverPrediction
from exograv.identification.prior import disturbance_sd, prior
from exograv.identification.square_root import FilterBank
from exograv.model.anthropometry import Body
from exograv.model.description import RigDescription, load_rig
from exograv.model.support import assemble
from exograv.session.nominal import nominal_machine

MOTION_S, STEP_S = 60.0, 0.16
V_MAX, A_MAX = 1.2, 4.0  # rad/s, rad/s²: gentle for a relaxed arm
MARGIN_DEG = {"shoulder": 12.0, "elbow": 12.0, "wrist": 6.0}  # beyond the workspace, to tell elasticity from weight
DISCOMFORT = 20.0  # times how far the arm's angles leave their comfortable range on average [1/rad]
HARMONICS = 5
RESIDUAL_SD = 0.12  # N·m per sample, as stage 0 leaves it


class Design:
    """Scores a motion for a nominal person."""

    def __init__(self, description: RigDescription):
        self.description = description
        self.assembly = assemble(description, Body(1.70, 70.0, "female"))
        machine = nominal_machine(description, self.assembly.exo.phi)
        self.model = ArmModel(self.assembly, machine)
        self.mean, self.covariance = prior(self.assembly, machine)
        self.left_over = LeftOverPrediction(self.model, self.mean)
        values, vectors = np.linalg.eigh(self.covariance)
        self.unwhiten = vectors * np.sqrt(np.maximum(values, 0.0))
        places = description.places
        self.disturbance = disturbance_sd(places)[None, :]
        self.target = np.array([TARGET_NM[place] for place in places])
        margin = np.deg2rad([MARGIN_DEG[place] for place in places])
        lower, upper = description.workspace
        joints = self.assembly.exo.joints
        hard = np.deg2rad(8.0)  # off the machine's own limits
        self.lower = np.maximum(lower - margin, [j.lower + hard for j in joints])
        self.upper = np.minimum(upper + margin, [j.upper - hard for j in joints])

    def trajectory(self, coefficients: np.ndarray, period: float) -> motion.Trajectory:
        """Centre, sines, cosines (1 + 2 · harmonic, joint) [rad], squeezed into the box of allowed postures."""
        centre, sine, cosine = coefficients[0], coefficients[1 : 1 + HARMONICS], coefficients[1 + HARMONICS :]
        return motion.fourier(centre, sine, cosine, period, MOTION_S, STEP_S)

    def fitted(self, coefficients: np.ndarray, period: float) -> np.ndarray:
        """The same shape, scaled and shifted to respect posture, speed and acceleration."""
        path = self.trajectory(coefficients, period)
        low, high = path.q.min(axis=0), path.q.max(axis=0)
        squeeze = np.minimum(1.0, (self.upper - self.lower) / (high - low))
        squeeze = np.minimum(squeeze, V_MAX / np.abs(path.v).max(axis=0))
        squeeze = np.minimum(squeeze, A_MAX / np.abs(path.a).max(axis=0))
        fitted = coefficients.copy()
        fitted[1:] *= squeeze
        low, high = (coefficients[0] + squeeze * (edge - coefficients[0]) for edge in (low, high))
        fitted[0] += np.maximum(self.lower - low, 0.0) - np.maximum(high - self.upper, 0.0)
        return fitted

    def score(self, coefficients: np.ndarray, period: float) -> float:
        """Predicted left over against its target, worst joint; with a share of the mean to keep a slope."""
        path = self.trajectory(coefficients, period)
        bank, n, discomfort = FilterBank(len(self.mean), self.disturbance, 3.0), self.assembly.n, 0.0
        self.model.restart()
        for k in range(len(path)):
            sample = Sample(k * STEP_S, path.q[k], path.v[k], path.a[k], np.zeros(n))
            _, derivative = self.model.linearise(sample, self.mean)
            noise = np.hypot(RESIDUAL_SD, self.model.direction_uncertainty(sample.v))
            bank.update(STEP_S, derivative @ self.unwhiten, np.zeros(n), noise)
            discomfort += self.assembly.arm.discomfort(self.model.z) / len(path)
        covariance = self.unwhiten @ bank.covariance() @ self.unwhiten.T
        ratio = self.left_over.rms(covariance) / self.target
        return float(ratio.max() + 0.3 * ratio.mean()) + DISCOMFORT * discomfort


def main() -> None:
    """Search for the given time, then print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rig")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--period", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    description = load_rig(options.rig)
    design, generator = Design(description), np.random.default_rng(options.seed)
    excitation = description.excitation
    best = np.zeros((1 + 2 * HARMONICS, len(description.joints)))
    best[0] = np.deg2rad(excitation.centre_deg)
    for row, values in ((1, excitation.sine_deg), (1 + HARMONICS, excitation.cosine_deg)):
        best[row : row + len(values)] = np.deg2rad(values)
    best = design.fitted(best, options.period)
    value, end = design.score(best, options.period), time.monotonic() + options.seconds
    size = 0.15  # rad
    while time.monotonic() < end:
        mask = generator.random(best.shape) < 0.3
        trial = design.fitted(best + size * mask * generator.standard_normal(best.shape), options.period)
        trial_value = design.score(trial, options.period)
        if trial_value < value:
            best, value, size = trial, trial_value, min(0.3, size * 1.2)
            print(f"# {value:.3f}", flush=True)
        else:
            size = max(0.02, size * 0.98)
    degrees = np.rad2deg(best).round(1).tolist()
    print(f"[excitation]\nperiod_s = {options.period}\ncentre_deg = {degrees[0]}")
    print(f"sine_deg = {degrees[1 : 1 + HARMONICS]}\ncosine_deg = {degrees[1 + HARMONICS :]}")


if __name__ == "__main__":
    main()
