"""Streams of a test are invisible to others: one session of LSL per test process, on this computer only."""

import os
import secrets
from pathlib import Path

import pytest

pytest.importorskip("pylsl")

NETWORK = """\
[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
[lab]
SessionID = {session}
"""

SOON_S = 20.0
"""Time limit for a slow computer; no tested event takes so long."""


@pytest.fixture(scope="session", autouse=True)
def network(tmp_path_factory: pytest.TempPathFactory):
    """Write the configuration that liblsl reads at its first use, here and in each process that is started."""
    file: Path = tmp_path_factory.mktemp("lsl") / "lsl_api.cfg"
    file.write_text(NETWORK.format(session=f"test-{os.getpid()}-{secrets.token_hex(4)}"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LSLAPICFG", str(file))
        yield
