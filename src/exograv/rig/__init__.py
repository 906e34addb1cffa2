"""Interface of machines, their drives on several buses, and the simulated machine."""

from .interface import Powered as Powered
from .interface import Rig as Rig
from .interface import may_be_worn as may_be_worn
