"""Compiler from a CasADi function to a callable on pre-bound NumPy buffers, without allocation or search per call."""

from .batch import Batch as Batch
from .batch import BoundBatch as BoundBatch
from .compilation import compile as compile
from .content import content_digest as content_digest
from .interface import Kernel as Kernel
from .interface import NativeCall as NativeCall
from .memory import numbers as numbers
from .recipe import Recipe as Recipe
from .recipe import source_digest as source_digest
