"""Import of liblsl by pylsl, with a quiet log. It starts threads: never import it in guard or control processes."""

import ctypes
import importlib.util
import os
from functools import cache
from pathlib import Path
from types import ModuleType

from exograv.errors import ConfigError

QUIET = "\n[log]\nlevel = -3\n"
"""Addition to a configuration without a log section: losses and reconnections are reported by exograv."""


MISSING = "Lab Streaming Layer is not installed. Install it: pip install 'exograv[lsl]'"


def require_lsl() -> None:
    """Check that LSL is installed, without an import in a process where its threads are not wanted.

    Raises:
        ConfigError: LSL is not installed.
    """
    if importlib.util.find_spec("pylsl") is None:
        raise ConfigError(MISSING)


@cache
def lsl() -> ModuleType:
    """Return the module `pylsl`, with the laboratory's own configuration.

    Raises:
        ConfigError: LSL is not installed, or its library does not load.
    """
    try:
        import pylsl
        import pylsl.lib
    except ImportError:
        raise ConfigError(MISSING) from None
    except RuntimeError as error:
        raise ConfigError(f"pylsl finds no liblsl that it can load: {error}") from error
    # This must be the first call of the library, which reads its configuration only once.
    configure = pylsl.lib.lib.lsl_set_config_content
    configure.argtypes = [ctypes.c_char_p]
    configure(_configuration().encode())
    return pylsl


def _configuration() -> str:
    """Return the configuration that liblsl would find itself, with the level of its log.

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
