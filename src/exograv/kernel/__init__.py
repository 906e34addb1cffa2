"""A CasADi function becomes a callable on pre-bound NumPy buffers: no allocation, no search, no objects per call."""

from .compilation import compile as compile
from .interface import Kernel as Kernel
