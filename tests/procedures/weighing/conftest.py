"""Fixtures: one person in one machine, and simulated motions that need no rig."""

from collections.abc import Callable

import numpy as np
import pytest

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.prior import disturbance_sd, prior
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.motion import Trajectory
from exograv.procedures.calibration.nominal_machine import nominal_machine

PERSON = Body(1.75, 75.0, "male")
DT = 0.08
CORRELATION_S = 3.0


@pytest.fixture(scope="session")
def model() -> ArmModel:
    description = load_rig("recupera_like")
    assembly = assemble(description, PERSON)
    return ArmModel(assembly, nominal_machine(description, assembly.exo.phi))


@pytest.fixture(scope="session")
def believed_arm(model) -> tuple[np.ndarray, np.ndarray]:
    return prior(model.assembly, model.machine)


@pytest.fixture(scope="session")
def heard(model) -> Callable[..., list[Sample]]:
    """Return a function that simulates a motion of an arm `x`, with a restless wearer's slow torque of a seed."""

    def samples(path: Trajectory, x: np.ndarray, seed: int, restless: float = 1.0) -> list[Sample]:
        random = np.random.default_rng(seed)
        sd, keep = restless * disturbance_sd(model.assembly.description.places), np.exp(-DT / CORRELATION_S)
        slow = sd * random.standard_normal(4)
        arm, found = model.again(), []
        every = round(DT / path.dt)
        for k in range(0, len(path), every):
            sample = Sample(k * path.dt, path.q[k], path.v[k], path.a[k], np.zeros(4))
            slow = keep * slow + np.sqrt(1.0 - keep**2) * sd * random.standard_normal(4)
            sample.tau = arm.linearise(sample, x)[0] + slow + 0.02 * random.standard_normal(4)
            found.append(sample)
        return found

    return samples
