"""Network of Lab Streaming Layer for one test: its streams are invisible to others, and stay on this computer."""

import os
import secrets
from pathlib import Path

NETWORK = """\
[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
[lab]
SessionID = {session}
"""

VARIABLE = "LSLAPICFG"
"""Environment variable with the path of the configuration, which liblsl reads at its first use."""


def own_network(folder: Path) -> str:
    """Write the configuration of an own network, and return its path."""
    file = folder / "lsl_api.cfg"
    file.write_text(NETWORK.format(session=f"test-{os.getpid()}-{secrets.token_hex(4)}"))
    return str(file)
