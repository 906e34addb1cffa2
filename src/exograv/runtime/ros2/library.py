"""Import of Eclipse Zenoh. It starts threads: only the bridge imports it, never the guard's or control's process."""

import importlib
import importlib.util
from functools import cache
from types import ModuleType

from exograv.errors import ConfigError

MISSING = "Eclipse Zenoh is not installed. Install it: pip install 'exograv[ros2]'"


def require_zenoh() -> None:
    """Check that Zenoh is installed, without an import in a process where its threads are not wanted.

    Raises:
        ConfigError: Zenoh is not installed.
    """
    if importlib.util.find_spec("zenoh") is None:
        raise ConfigError(MISSING)


@cache
def zenoh() -> ModuleType:
    """Return the module `zenoh`.

    Raises:
        ConfigError: Zenoh is not installed.
    """
    try:
        return importlib.import_module("zenoh")
    except ImportError:
        raise ConfigError(MISSING) from None
