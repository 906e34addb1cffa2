"""Closed-loop run: the estimates of one method drive the arm during the identification, as in a session."""

import numpy as np

from exograv.identification.core.interface import Estimate
from exograv.loop.pilot import Progress
from exograv.procedures.identification.method_names import MethodName

from .stream_replay import MethodTrace
from .streams import Calibrated
from .wearer_judge import StopVerdict, WearerJudge


def fly(
    judge: WearerJudge, calibrated: Calibrated, name: MethodName, seconds: float, progress: Progress
) -> tuple[MethodTrace, StopVerdict]:
    """Identify for `seconds`. The verdict of the stop rule is noted and does not end the run.

    Raises:
        ExogravError: The run was stopped.
    """
    worn = calibrated.worn(judge.case, judge.laboratory, progress)
    estimates: list[Estimate] = []
    identifier = worn.identifier(name, listener=lambda _t, estimate, *_: estimates.append(estimate))
    found = worn.identify(identifier, seconds)
    # Computing time is not measured here. The replay of streams measures it, without other work between the samples.
    return MethodTrace(estimates, np.empty(0), 0.0, np.empty(0), 0.0, found.agreement), StopVerdict(
        found.outcome, found.stop_s, found.restless_s
    )
