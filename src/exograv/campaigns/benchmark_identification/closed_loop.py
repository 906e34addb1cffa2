"""Closed loop: what one method learns drives the arm that it learns from, as in a session."""

import numpy as np

from exograv.identification.core.interface import Estimate
from exograv.laboratory.preparation import pilot_of
from exograv.loop.arm_controller import ArmController
from exograv.loop.pilot import Progress
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import Identifier, identify_arm
from exograv.procedures.identification.method_names import MethodName

from .stream_replay import MethodTrace
from .streams import Calibrated, worn_twin
from .subject import BenchmarkSubject, StopVerdict


def fly(
    subject: BenchmarkSubject, calibrated: Calibrated, name: MethodName, seconds: float, progress: Progress
) -> tuple[MethodTrace, StopVerdict]:
    """Identify for `seconds`, whatever the stop rule says; it is only asked.

    Raises:
        ExogravError: The run was stopped.
    """
    assembly, machine = subject.assembly, subject.machine
    twin = worn_twin(subject.case, subject.laboratory, calibrated)
    pilot = pilot_of(twin, machine.actuators, subject.laboratory, progress)
    controller = ArmController(assembly, machine, table_guess(assembly, machine), twin.period_s)
    estimates: list[Estimate] = []
    identifier = Identifier(
        pilot, controller, machine, name, "current", lambda _t, estimate, *_: estimates.append(estimate)
    )
    found = identify_arm(pilot, controller, identifier, seconds)
    # The loop's work is not timed here: the replay did that, with nothing else between the samples.
    return MethodTrace(estimates, np.empty(0), 0.0, np.empty(0), 0.0), StopVerdict(
        found.outcome, found.stop_s, found.restless_s
    )
