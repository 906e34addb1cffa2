"""Return of freed memory to the system."""

import ctypes
import gc
import sys


def return_free_memory() -> None:
    """Return what a preparation has freed to the system, where the C library can.

    The building of kernels takes several times the memory that they need. The C library of Linux (glibc) keeps the rest
    of it for the process until it is asked.
    """
    gc.collect()
    if sys.platform.startswith("linux") and (trim := getattr(ctypes.CDLL(None), "malloc_trim", None)) is not None:
        trim(0)
