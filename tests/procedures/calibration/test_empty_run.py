"""Weights hang at the machine in full, and are gone in full, at every period of the loop."""

from collections.abc import Callable

import numpy as np
import pytest

from exograv.dynamics.actuator import ActuatorGain
from exograv.loop.machine_limits import limits
from exograv.loop.output_feedback import Controller, Guide
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.motion import Trajectory
from exograv.procedures.calibration.empty_run import EmptyRun
from exograv.procedures.calibration.operator import ComputedOperator
from exograv.rig.twin import Disturbances, Twin, draw_machine
from exograv.safety.envelope import Envelope
from exograv.signals import Reference

STEP_MAX_KG = 0.1
"""Largest step of a weight: a sudden weight would drop the arm."""


class Slower(Twin):
    """Twin whose driver measures every few milliseconds."""

    own_period_s = 1e-3

    @property
    def period_s(self) -> float:
        """Time between two measurements [s]."""
        return self.own_period_s


class StillPilot(Pilot):
    """Pilot of a machine that stands still, with a measurement in all ticks but the last."""

    def run(
        self,
        controller: Controller,
        trajectory: Trajectory,
        text: str,
        listener: Callable[[TickSample], None] | None = None,
        guide: Guide | None = None,
    ) -> None:
        """Call the listener for the ticks of the path."""
        state, none = self.rig.read(), np.zeros(len(self.q))
        moment = TickSample(state, self.q, none, none, none, none, Reference(self.q, none, none))
        for _ in range(len(trajectory) - 1):
            assert listener is not None
            listener(moment)


def run_at(description: RigDescription, period_ms: int, hang: Callable[[str, float], None]) -> EmptyRun:
    """Return the run of an empty machine with a loop of this period."""
    tree, seed = read_exoskeleton(description), 0
    twin = Slower(description, draw_machine(description, Disturbances.at_level(0), seed), None, seed)
    twin.own_period_s = 1e-3 * period_ms
    nominal = description.nominal_gain
    envelope = Envelope(limits(description), twin.period_s)
    return EmptyRun(
        description, tree, StillPilot(twin, ActuatorGain(nominal, nominal), envelope), ComputedOperator(hang)
    )


@pytest.mark.parametrize("period_ms", [1, 2, 4])
def test_a_weight_is_hung_and_taken_off_in_full_and_in_small_steps(period_ms: int):
    description = load_rig("recupera_like")
    hung = [0.0]
    run = run_at(description, period_ms, lambda _mount, mass_kg: hung.append(mass_kg))
    mount = description.calibration.mount
    for weight, stated in ((0, description.calibration.weights_kg[0]), (1, description.calibration.weights_kg[1])):
        run.load(mount, weight)
        assert hung[-1] == stated
    run.load(mount, None)
    assert hung[-1] == 0.0
    assert np.abs(np.diff(hung)).max() < STEP_MAX_KG
