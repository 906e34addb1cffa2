"""Fixtures: measurements of a machine of the fit's own model with hidden parameters, and a linear model."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from exograv.identification.calibration.empty_fit import EmptyMachine
from exograv.identification.calibration.empty_machine import SAMPLE_PERIOD_S, V_START, Sweeps
from exograv.identification.core.interface import Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.setting import Setting
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.tree import Tree, inertial_parameters
from exograv.motion import go_to, joined, sweep

NOISE_SD = 0.1  # N·m
HIDDEN: Mapping[str, np.ndarray] = {
    "inverse_gain": 1.0 / np.array([1.05, 0.96, 1.02, 0.97]),
    "coulomb": np.array([1.8, 2.6, 3.1, 2.0]),
    "breakaway": np.array([1.3, 1.2, 1.4, 1.3]),
    "coulomb_warming": np.array([0.1, 0.05, 0.15, 0.0]),
    "ripple_sine": np.array([0.1, -0.05, 0.0, 0.1]),
}


@dataclass(frozen=True)
class Exo:
    """Machine with its model for the fit."""

    description: RigDescription
    tree: Tree
    model: EmptyMachine


@pytest.fixture(scope="session")
def exo() -> Exo:
    description = load_rig("recupera_like")
    tree = adjusted(read_exoskeleton(description), description, {"upper_arm": 0.29})
    return Exo(description, tree, EmptyMachine(description, tree))


@pytest.fixture(scope="session")
def make_sweeps(exo: Exo) -> Callable[..., Sweeps]:
    """Function that makes sweeps of a machine with `hidden` unknowns; `shares` are true over stated weights."""

    def make(shares: tuple[float, float] = (1.0, 1.0), **hidden: np.ndarray) -> Sweeps:
        layout = exo.model.prior.layout
        theta = exo.model.prior.mean.copy()
        for name, values in {**HIDDEN, **hidden}.items():
            theta[getattr(layout, name) if name in ("tilt", "links") else layout.of(name)] = values
        theta[layout.weight] = shares
        return _measured(exo, theta)

    return make


def _measured(exo: Exo, theta: np.ndarray) -> Sweeps:
    rows: list[tuple] = []
    t = 0.0
    for _ in range(2):
        for plan in exo.description.calibration.sweeps:
            joint = exo.description.joints.index(plan.joint)
            start = np.deg2rad(plan.posture_deg)
            start[joint] = np.deg2rad(plan.from_deg)
            goal = start.copy()
            goal[joint] = np.deg2rad(plan.to_deg)
            passes = [sweep(start, joint, float(goal[joint]), speed, SAMPLE_PERIOD_S) for speed in (0.3, 0.9)]
            path = joined([*passes, go_to(start, goal, 0.16, SAMPLE_PERIOD_S)])
            for hung in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)):
                for q, v, a in zip(path.q, path.v, path.a, strict=True):
                    rows.append((t, q, v, a, hung, False))
                    t += SAMPLE_PERIOD_S
            for sign in (1.0, -1.0, 1.0, -1.0):
                v = np.zeros(4)
                v[joint] = sign * V_START
                rows.append((t, start, v, np.zeros(4), (0.0, 0.0), True))
    times, q, v, a, hung, start = (np.array(column) for column in zip(*rows, strict=True))
    age = (times[-1] - times)[None, :] / 600.0
    tau = exo.model.batch.of(q.T, v.T, a.T, age, hung.T, np.zeros((6, len(q))), theta)[0].T
    noisy = tau + np.random.default_rng(0).normal(0.0, NOISE_SD, tau.shape)
    return Sweeps(times, q, v, a, noisy / exo.description.nominal_gain, hung, start)


@dataclass
class LinearModel:
    """Torque model of two joints, linear in one body and one more parameter; `scale` multiplies all torques."""

    scale: float = 1.0
    n_joints: int = 2
    n_parameters: int = 11

    def linearise(self, sample: Sample, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        c, s, a = np.cos(sample.q), np.sin(sample.q), sample.a
        derivative = np.zeros((2, 11))
        derivative[0] = [0, 9.81 * c[0], 9.81 * s[1], 9.81 * s[0], a[0], a[1], a[0] * c[1], a[1] * s[0], 0, 0, c[1]]
        derivative[1] = [c[1], 0, 9.81 * c[1], 9.81 * s[1], a[1], 0, 0, a[0] * s[1], a[1], a[0], s[0]]
        derivative *= self.scale
        return derivative @ x, derivative

    def restart(self) -> None:
        pass

    def direction_uncertainty(self, v: np.ndarray) -> np.ndarray:
        return np.zeros(2)


LINEAR_MEAN = np.append(inertial_parameters(2.0, np.array([0.02, 0.0, -0.15]), 0.5 * np.eye(3)), 0.0)
LINEAR_SD = np.append(0.15 * np.array([2.0, *[0.3] * 3, *[0.05] * 6]), 1.0)


@pytest.fixture
def linear_setting() -> Callable[..., Setting]:
    """Function that makes the setting of the linear model, with or without a body among its parameters."""

    def make(scale: float = 1.0, has_body: bool = True) -> Setting:
        return Setting(
            model=LinearModel(scale),
            mean=LINEAR_MEAN,
            covariance=np.diag(LINEAR_SD**2),
            noise=Noise(np.array([0.1, 0.05]), np.array([0.2, 0.2]), np.array([0.1, 0.05])),
            bodies=(slice(0, 10),) if has_body else (),
            learned=np.ones(11, dtype=bool),
            machine=np.zeros(11, dtype=bool),
        )

    return make


@pytest.fixture
def linear_stream() -> Callable[..., list[Sample]]:
    """Function that makes samples of a linear model; `off` is the distance from the mean in standard deviations."""

    def make(setting: Setting, off: np.ndarray, seconds: float = 8.0, noise_seed: int | None = None) -> list[Sample]:
        samples = []
        rng = np.random.default_rng(noise_seed)
        for t in np.arange(1, round(seconds / 0.08)) * 0.08:
            w, phase = np.array([1.1, 1.7]), np.array([0.0, 0.5])
            q, v, a = np.sin(w * t + phase), w * np.cos(w * t + phase), -(w**2) * np.sin(w * t + phase)
            sample = Sample(float(t), q, v, a, np.zeros(2))
            sample.tau = setting.model.linearise(sample, setting.mean + off * LINEAR_SD)[0]
            if noise_seed is not None:
                sample.tau = sample.tau + setting.noise.sd * rng.standard_normal(2)
            samples.append(sample)
        return samples

    return make


@pytest.fixture
def posterior() -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    """Function that computes mean and covariance after weighted samples of a linear model, by the batch formula."""

    def of(setting: Setting, samples: list[Sample], weights: np.ndarray, prior_weight: float = 1.0):
        information = prior_weight * np.linalg.inv(setting.covariance)
        slope = np.zeros(len(setting.mean))
        for sample, weight in zip(samples, weights, strict=True):
            tau, derivative = setting.model.linearise(sample, setting.mean)
            H = derivative / setting.noise.sd[:, None]
            information = information + weight * H.T @ H
            slope += weight * H.T @ ((sample.tau - tau) / setting.noise.sd)
        covariance = np.linalg.inv(information)
        return setting.mean + covariance @ slope, covariance

    return of
