"""Methods that feel the cuffs while the arm rests: their rests are taken before the motion, in a run of their own."""

from dataclasses import replace

from exograv.identification.core.interface import Estimate, Method, RestingMethod
from exograv.loop.pilot import Progress
from exograv.procedures.identification.resting_poses import rest_first

from .stream_replay import NOTE_S
from .streams import MOTION_S, Calibrated
from .subject import BenchmarkSubject


def rested(method: Method, subject: BenchmarkSubject, calibrated: Calibrated, progress: Progress) -> list[Estimate]:
    """Take the rests that a method needs, on a machine with sensors at its cuffs.

    Returns:
        What the method would have said while it rested, once a second; nothing where it needs none.

    Raises:
        ExogravError: The run was stopped.
    """
    if not isinstance(method, RestingMethod):
        return []
    before = method.estimate()
    worn = calibrated.worn(subject.case, subject.laboratory, progress)
    worn.controller.mode.drive = 1.0
    rest_first(worn.pilot, worn.controller, method)
    seconds = range(1, int(min(method.rest_s, MOTION_S) / NOTE_S) + 1)
    return [replace(before, t=NOTE_S * second) for second in seconds]
