"""Eclipse Zenoh. It starts threads in its process: only the bridge's imports it, never the guard's or control's."""

import importlib
import importlib.util
from functools import cache
from types import ModuleType

from exograv.errors import ConfigError

MISSING = "Eclipse Zenoh is not installed. Install it: pip install 'exograv[ros2]'"


def require_zenoh() -> None:
    """Ask without importing it, where its threads are not wanted.

    Raises:
        ConfigError: It is not installed.
    """
    if importlib.util.find_spec("zenoh") is None:
        raise ConfigError(MISSING)


@cache
def zenoh() -> ModuleType:
    """The module `zenoh`.

    Raises:
        ConfigError: It is not installed.
    """
    try:
        return importlib.import_module("zenoh")
    except ImportError:
        raise ConfigError(MISSING) from None
