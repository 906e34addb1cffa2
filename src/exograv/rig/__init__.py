"""What the loop talks to: machines, real or virtual, behind one interface."""

from .interface import Powered as Powered
from .interface import Rig as Rig
from .interface import may_be_worn as may_be_worn
