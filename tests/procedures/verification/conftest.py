"""Fixtures: one person in one machine, and simulated passes that need no rig."""

from collections.abc import Callable

import numpy as np
import pytest

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.prior import disturbance_sd, prior
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.verification.postures import ROUNDS, SPEED_RAD_S, both_ways, unseen_postures
from exograv.procedures.verification.slow_passes import SAMPLE_S, SLIDING, PassSample

PERSON = Body(1.75, 75.0, "male")
DT = 0.01
CORRELATION_S = 3.0
TRAVEL_S = 2.5
SURE = 0.05
"""Standard deviations after an identification, as a share of the table's [-]."""


@pytest.fixture(scope="session")
def model() -> ArmModel:
    description = load_rig("recupera_like")
    assembly = assemble(description, PERSON)
    return ArmModel(assembly, nominal_machine(description, assembly.exo.phi))


@pytest.fixture(scope="session")
def arm(model) -> Estimate:
    """Return the estimate of a good identification."""
    mean, covariance = prior(model.assembly, model.machine)
    return Estimate(60.0, mean, SURE**2 * covariance, 0.0, 1.0)


@pytest.fixture(scope="session")
def postures(model, arm) -> np.ndarray:
    return unseen_postures(model.again(), arm.x, np.full((1, 4), 9.0), seed=1000)


@pytest.fixture(scope="session")
def heard(model, postures) -> Callable[..., list[PassSample]]:
    """Return a function that simulates passes of an arm `x`, with slow torque and a friction error `turning`."""

    def samples(x: np.ndarray, seed: int, restless: float = 1.0, turning: float = 0.0) -> list[PassSample]:
        random = np.random.default_rng(seed)
        sd, keep = restless * disturbance_sd(model.assembly.description.places), np.exp(-SAMPLE_S / CORRELATION_S)
        slow, found, t = sd * random.standard_normal(4), [], 0.0
        true = model.again()
        for visit in range(ROUNDS * len(postures)):
            k = visit % len(postures)
            path = both_ways(postures[k], random.choice([-1.0, 1.0], 4), DT)
            t += TRAVEL_S
            slow = sd * random.standard_normal(4)
            true.restart()
            for i in range(0, len(path), round(SAMPLE_S / DT)):
                slow = keep * slow + np.sqrt(1.0 - keep**2) * sd * random.standard_normal(4)
                t += SAMPLE_S
                if (np.abs(path.v[i]) < SLIDING * SPEED_RAD_S).any():
                    continue
                sample = Sample(t, path.q[i], path.v[i], np.zeros(4), np.zeros(4))
                tau, _ = true.linearise(sample, x)
                sample.tau = tau + slow + turning * np.sign(sample.v) + 0.02 * random.standard_normal(4)
                found.append(PassSample(k, sample))
        return found

    return samples
