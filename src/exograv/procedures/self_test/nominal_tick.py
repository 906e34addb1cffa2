"""Nominal tick that `exograv doctor` times: the default machine with soft cuffs around a table arm."""

import numpy as np

from exograv import motion
from exograv.control.observer import Observer
from exograv.control.tick import ControlMode, Tick
from exograv.dynamics.parameters import Parameters
from exograv.loop.control_step import CLOSURE_SLOPE_MAX
from exograv.loop.machine_limits import limits
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.safety.envelope import Envelope
from exograv.signals import Reference

RIG = "recupera_like"
BODY = Body(1.75, 75.0, "male")


def nominal_tick() -> tuple[Tick, Parameters, Assembly]:
    """Return a controller, its parameters and its assembly."""
    description = load_rig(RIG)
    assembly = assemble(description, BODY)
    machine = nominal_machine(description, assembly.exo.phi)
    return Tick(assembly, machine), table_guess(assembly, machine), assembly


class MovingTick:
    """Decision of the pilot's loop in each period, on the machine's own excitation, so that the loops really move.

    The encoders read the reference: the decision is timed, without a machine.
    """

    def __init__(self, dt: float):
        self.tick, self._x, assembly = nominal_tick()
        self.tick.mode = ControlMode(drive=1.0)
        excitation = assembly.description.excitation
        centre, sine, cosine = (
            np.deg2rad(x) for x in (excitation.centre_deg, excitation.sine_deg, excitation.cosine_deg)
        )
        # One period, whose end joins its start, so that the loop may run for any time.
        path = motion.fourier(centre, sine, cosine, excitation.period_s, excitation.period_s, dt)
        self._references = [Reference(*row) for row in zip(path.q, path.v, path.a, strict=True)]
        self._observer = Observer(assembly.n, dt)
        self._envelope = Envelope(limits(assembly.description), dt)
        self.open_ticks = 0
        """Ticks in which the loops were not closed. They contain no valid decision."""

    def __call__(self, period: int) -> None:
        """Decide the torque of this period."""
        reference = self._references[period % len(self._references)]
        observer, tick = self._observer, self.tick
        observer.update(reference.q)
        self._envelope.limit(tick.step(observer.q, observer.v, reference, self._x), observer.q, observer.v)
        if not tick.closure_slope < CLOSURE_SLOPE_MAX:
            self.open_ticks += 1
