"""Motions that identify the arm: the machine's own, pieces planned on the way, or motions of the literature."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from exograv import motion
from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import ConfigError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Covariance, Method, Parameters
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.prior import prior
from exograv.identification.excitation import PIECE_S, Designer, MotionLimits, Planner, fixed_motion
from exograv.model.assembly import Assembly
from exograv.motion import Trajectory

from .check_motion import PlannedCheck, check_tour, excitation_s
from .identify import EASE_S, identification_motion, planned_check
from .method_names import MotionName

STANDARD_PERIOD_S = 20.0
STANDARD_SEED = 0  # of the random start: part of the compared method, not of the run


def motion_parts(
    name: MotionName,
    assembly: Assembly,
    machine: CalibratedMachine,
    method: Method,
    seconds: float,
    dt: float,
) -> Iterator[Trajectory]:
    """Motion from rest to rest in `seconds`, in one or more parts. Request each part when the last one is over.

    The last part of a motion that is long enough is the `planned_check`.

    Raises:
        ConfigError: An adaptive motion is planned from a method that states no uncertainty.
    """
    if name == "adaptive" and method.estimate().covariance is None:
        raise ConfigError(
            f"--motion adaptive plans for uncertain parameters, and --method {method.name} states no "
            "uncertainty. Use --method recursive, or --motion designed."
        )
    if name == "designed":
        return iter([identification_motion(assembly, seconds, dt)])
    before, check = excitation_s(seconds), planned_check(assembly, seconds)
    if name == "adaptive":
        parts = adaptive_parts(assembly, machine, method, before, dt)
    elif name == "fixed":
        path = fixed_motion(MotionLimits.of(assembly), before - EASE_S / 2, dt)
        parts = iter([motion.eased_out(motion.eased_in(path, EASE_S), EASE_S)])
    else:
        parts = iter([standard_motion(assembly, machine, before, dt)])
    return parts if check is None else _and_check(parts, check, dt)


def _and_check(parts: Iterator[Trajectory], check: PlannedCheck, dt: float) -> Iterator[Trajectory]:
    """Yield the parts, then the tour of the check from where they end."""
    end = check.postures[0]
    for part in parts:
        end = part.q[-1]
        yield part
    yield check_tour(end, check.postures, dt)


def standard_motion(assembly: Assembly, machine: CalibratedMachine, seconds: float, dt: float) -> Trajectory:
    """Five D-optimal harmonics for this machine, from rest to rest. The design takes about ten seconds."""
    design = Designer(assembly, machine).standard(STANDARD_PERIOD_S, STANDARD_SEED)
    path = design.basis.trajectory(design.coefficients, seconds - EASE_S / 2, dt)
    return motion.eased_out(motion.eased_in(path, EASE_S), EASE_S)


def adaptive_parts(
    assembly: Assembly, machine: CalibratedMachine, method: Method, seconds: float, dt: float
) -> Iterator[Trajectory]:
    """Pieces of about `PIECE_S`, each planned while the previous one runs, from the estimate at its start."""
    model = ArmModel(assembly, machine)
    mean, _ = prior(assembly, machine)
    count = max(1, round(seconds / PIECE_S))
    planner = Planner(assembly, machine, LeftOverPrediction(model, mean), model, seconds / count)
    plan = _plan_of(planner, dt)
    with ThreadPoolExecutor(1) as worker:
        coming = worker.submit(plan, *_known(method), 0, None)
        for k in range(count):
            path = coming.result()
            if k + 1 < count:
                coming = worker.submit(plan, *_known(method), k + 1, path)
            yield path


def _known(method: Method) -> tuple[Covariance, Parameters]:
    estimate = method.estimate()
    if estimate.covariance is None:
        raise ConfigError(
            f"{method.name} no longer states its uncertainty, so no motion can be planned. Use --motion designed."
        )
    return estimate.covariance, estimate.x.copy()


def _plan_of(planner: Planner, dt: float) -> Callable[[Covariance, Parameters, int, Trajectory | None], Trajectory]:
    def plan(covariance: Covariance, x: Parameters, seed: int, under_way: Trajectory | None) -> Trajectory:
        return planner.next_motion(np.array(covariance), planner.home, x, dt, seed, under_way).path

    return plan
