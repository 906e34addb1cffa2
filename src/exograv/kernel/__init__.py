"""A CasADi function becomes a callable on pre-bound NumPy buffers: no allocation, no search, no objects per call."""

from .batch import Batch as Batch
from .batch import BoundBatch as BoundBatch
from .compilation import compile as compile
from .interface import Kernel as Kernel
