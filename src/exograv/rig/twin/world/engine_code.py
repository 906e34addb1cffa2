"""Addresses of MuJoCo's own functions and data, for a caller in C.

A call from Python takes half a microsecond longer than the function itself takes for a small machine.
"""

import ctypes
from functools import cache
from pathlib import Path

import mujoco


@cache
def engine_halves() -> tuple[int, int] | None:
    """Return the addresses of `mj_step1` and `mj_step2`; None if the library is not found."""
    found = sorted(Path(mujoco.__file__).parent.glob("libmujoco*"))
    if not found:
        return None
    library = ctypes.CDLL(str(found[0]))  # it is loaded already: no second copy
    first, second = (ctypes.cast(getattr(library, name), ctypes.c_void_p).value for name in ("mj_step1", "mj_step2"))
    return None if first is None or second is None else (first, second)


def engine_addresses(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[int, int]:
    """Addresses of a model and its state. They hold while both objects live."""
    return model._address, data._address  # pyright: ignore[reportAttributeAccessIssue] - the stub lacks them
