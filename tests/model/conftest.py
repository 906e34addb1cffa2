"""Fixture: a wearer in the machine, for tests of the connection between both."""

import pytest

from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble


@pytest.fixture(scope="session")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))
