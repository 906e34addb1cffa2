"""Machines of the twin as their own calibration knows them."""

from functools import cache

from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.machine import CalibratedMachine
from exograv.laboratory.twin_calibration import EmptyTwin
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.rig import Rig
from exograv.rig.twin import Machine
from exograv.safety.envelope import Envelope


@cache
def calibrated(level: int, seed: int, rig: str = "recupera_like") -> tuple[Machine, CalibratedMachine]:
    """The machine of a seed as it is, and as stage 0 found it."""
    laboratory = draw_laboratory(rig, None, level, seed)

    def pilot_of(twin: Rig, actuators: ActuatorGain) -> Pilot:
        return Pilot(twin, actuators, Envelope(limits(laboratory.description), twin.period_s))

    empty = EmptyTwin(laboratory.description, laboratory.machine, seed, laboratory.wearer.lengths_given)
    return laboratory.machine, empty.calibrate(pilot_of)[0].machine
