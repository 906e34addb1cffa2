"""Simulated drives on a twin's motors, each with a watchdog, limits, a temperature and faults of its own."""

from .firmware import SimulatedDrive as SimulatedDrive
from .plant import Plant as Plant
from .plant import Wiring as Wiring
