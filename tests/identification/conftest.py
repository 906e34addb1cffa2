"""What the machine of the fit's own model measures, with whatever is hidden in it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pytest

from exograv.identification.empty_fit import EmptyMachine
from exograv.identification.empty_machine import SAMPLE_PERIOD_S, V_START, Sweeps
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.tree import Tree
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
    """A machine, and its model for the fit."""

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
    """Sweeps of a machine with `hidden` unknowns; weights hang as `shares` of what they are said to be."""

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
    tau = exo.model.batch.of(q.T, v.T, a.T, age, hung.T, theta)[0].T
    noisy = tau + np.random.default_rng(0).normal(0.0, NOISE_SD, tau.shape)
    return Sweeps(times, q, v, a, noisy / exo.description.nominal_gain, hung, start)
