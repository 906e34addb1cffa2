"""Streams of a test are seen by nobody else: one session of LSL a test process, on this computer only."""

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
"""For a slow computer; nothing that is tested waits so long."""


@pytest.fixture(scope="session", autouse=True)
def network(tmp_path_factory: pytest.TempPathFactory):
    """Read by liblsl when it is first used, here and in every process that is started."""
    file: Path = tmp_path_factory.mktemp("lsl") / "lsl_api.cfg"
    file.write_text(NETWORK.format(session=f"test-{os.getpid()}-{secrets.token_hex(4)}"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LSLAPICFG", str(file))
        yield
