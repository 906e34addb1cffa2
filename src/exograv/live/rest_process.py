"""Process that learns an arm from the rests of a live session, so that the computation delays no other process."""

import os
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Covariance, Sample
from exograv.model.assembly import Assembly
from exograv.procedures.identification.estimator_session import Belief
from exograv.procedures.identification.rest_learning import RestLearned, RestLearner
from exograv.runtime.clock.free_memory import return_free_memory
from exograv.storage.rests_so_far import RestsSoFar
from exograv.storage.session_checkpoint import CheckedArm

NICE = 10
"""Lower priority of this process: guard and control come first."""


@dataclass(frozen=True)
class RestJob:
    """Start arguments of the process."""

    assembly: Assembly
    machine: CalibratedMachine
    x: Parameters
    """Parameters that the machine carries."""
    belief: Belief
    """Mean and covariance of the estimate from before the first rest."""
    before: RestsSoFar
    """Rests of the session from before."""


@dataclass(frozen=True)
class ReadyToLearn:
    """Message of the process when it can learn: the residual torque that the carried arm states [N·m]."""

    covariance: Covariance
    """Mean square error of the carried parameters."""
    stated_Nm: np.ndarray


@dataclass(frozen=True)
class RestReport:
    """Message of the process after a rest: the result, and the arm that the machine should carry from now on."""

    learned: RestLearned
    x: Parameters
    covariance: Covariance
    checked: CheckedArm | None
    """Estimate for the participant's file; None without one."""
    so_far: RestsSoFar


@dataclass(frozen=True)
class ArmRefused:
    """Message to the process: control refused the parameters of the last rest, and carries these."""

    x: Parameters
    covariance: Covariance


def rest_process(job: RestJob, parent: Connection) -> None:
    """Learn from the samples of each rest, until the parent ends the session or is gone."""
    os.nice(NICE)
    learner = RestLearner(ArmModel(job.assembly, job.machine), job.x, job.belief)
    learner.count_on(job.before)
    return_free_memory()
    parent.send(ReadyToLearn(learner.covariance, learner.stated_Nm))
    while (word := _next(parent)) is not None:
        if isinstance(word, ArmRefused):
            learner.keep(word.x, word.covariance)
        else:
            learned = learner.learn(word)
            arm = learner.x, learner.covariance
            parent.send(RestReport(learned, *arm, learner.kept.checked, learner.so_far))


def _next(parent: Connection) -> ArmRefused | list[Sample] | None:
    """Wait for the next message; None at the end of the session."""
    try:
        return parent.recv()
    except EOFError:
        return None
