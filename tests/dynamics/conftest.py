"""Fixtures: a wearer whose shoulder, length and cuffs differ from the machine's assumptions."""

import numpy as np
import pytest
from tests.shoulder_path import FURTHER_PATH

from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble


@pytest.fixture(scope="session")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))


@pytest.fixture(scope="session")
def fit() -> np.ndarray:
    return np.array([0.02, -0.015, 0.01, 0.02, 0.006, 0.2, -0.3, 0.12, 0.08, 0.008, -0.006, *FURTHER_PATH])
