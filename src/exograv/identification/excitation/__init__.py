"""Excitation motions for an arm: designed once for a machine, or piece by piece from the current estimate."""

from .adaptive import PIECE_S as PIECE_S
from .adaptive import MotionPiece as MotionPiece
from .adaptive import Planner as Planner
from .basis import Basis as Basis
from .basis import forth_and_back as forth_and_back
from .basis import harmonic as harmonic
from .basis import piece as piece
from .design import HORIZONS_S as HORIZONS_S
from .design import Design as Design
from .design import Designer as Designer
from .forecast import Forecast as Forecast
from .limits import MotionLimits as MotionLimits
from .standard import fixed_motion as fixed_motion
