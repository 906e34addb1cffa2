"""Streams of a test are invisible to others: one session of LSL per test process, on this computer only."""

import pytest
from tests.lsl_network import VARIABLE, own_network

pytest.importorskip("pylsl")

SOON_S = 20.0
"""Time limit for a slow computer; no tested event takes so long."""


@pytest.fixture(scope="session", autouse=True)
def network(tmp_path_factory: pytest.TempPathFactory):
    """Write the configuration that liblsl reads at its first use, here and in each process that is started."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, own_network(tmp_path_factory.mktemp("lsl")))
        yield
