"""Rest run before the motion, for methods that measure cuff forces while the arm rests."""

from dataclasses import replace

from exograv.identification.core.interface import Estimate, Method, RestingMethod
from exograv.loop.phases import RESTING
from exograv.loop.pilot import Progress
from exograv.procedures.identification.resting_poses import rest_first

from .options import MOTION_S
from .stream_replay import NOTE_S
from .streams import Calibrated
from .wearer_judge import WearerJudge


def take_method_rests(method: Method, judge: WearerJudge, calibrated: Calibrated, progress: Progress) -> list[Estimate]:
    """Let the method take its rests, on a machine with sensors at its cuffs.

    Returns:
        Estimates during the rests, one per second; an empty list for a method without rests.

    Raises:
        ExogravError: The run was stopped.
    """
    if not isinstance(method, RestingMethod):
        return []
    before = method.estimate()
    worn = calibrated.worn(judge.case, judge.laboratory, progress)
    worn.controller.mode.drive = RESTING.drive.goal(is_known=False)
    rest_first(worn.pilot, worn.controller, method)
    seconds = range(1, int(min(method.rest_s, MOTION_S) / NOTE_S) + 1)
    return [replace(before, t=NOTE_S * second) for second in seconds]
