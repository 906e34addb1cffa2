"""A CasADi function becomes a callable on pre-bound NumPy buffers: no allocation, no search, no objects per call."""

from .virtual_machine import Kernel as Kernel
from .virtual_machine import compile as compile
