"""liblsl by way of pylsl, quiet. It starts threads in its process: never import it in the guard's or control's."""

import ctypes
import importlib.util
import os
from functools import cache
from pathlib import Path
from types import ModuleType

from exograv.errors import ConfigError

QUIET = "\n[log]\nlevel = -3\n"
"""Added to a configuration that says nothing of its log: losses and reconnections are reported by us."""


MISSING = "Lab Streaming Layer is not installed. Install it: pip install 'exograv[lsl]'"


def require_lsl() -> None:
    """Ask without importing it, where its threads are not wanted.

    Raises:
        ConfigError: It is not installed.
    """
    if importlib.util.find_spec("pylsl") is None:
        raise ConfigError(MISSING)


@cache
def lsl() -> ModuleType:
    """The module `pylsl`, with the laboratory's own configuration.

    Raises:
        ConfigError: It is not installed, or its library does not load.
    """
    try:
        import pylsl
        import pylsl.lib
    except ImportError:
        raise ConfigError(MISSING) from None
    except RuntimeError as error:
        raise ConfigError(f"pylsl finds no liblsl that it can load: {error}") from error
    # Before anything else is asked of the library: it reads its configuration once.
    configure = pylsl.lib.lib.lsl_set_config_content
    configure.argtypes = [ctypes.c_char_p]
    configure(_configuration().encode())
    return pylsl


def _configuration() -> str:
    """What liblsl would read, from where it would look for it, and the level of its log.

    Source: liblsl 1.18, `api_config::load`.
    """
    places = [
        *([Path(named)] if (named := os.environ.get("LSLAPICFG")) else []),
        Path("lsl_api.cfg"),
        Path("~/lsl_api/lsl_api.cfg").expanduser(),
        Path("/etc/lsl_api/lsl_api.cfg"),
    ]
    own = next((place.read_text(encoding="utf-8") for place in places if place.is_file()), "")
    return own if "[log]" in own else own + QUIET
