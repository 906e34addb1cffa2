"""Calibration of the empty machine (stage 0): breakaway test, sweeps without load, and sweeps with known weights."""

import numpy as np

from exograv.identification.calibration.empty_machine import Calibration, calibrate, recheck
from exograv.identification.calibration.empty_prior import EmptyPrior
from exograv.loop.pilot import Pilot
from exograv.model.description import JointSweep as SweepSettings
from exograv.model.description import RigDescription
from exograv.model.rig_settings import Excitation
from exograv.model.tree import Tree
from exograv.motion import Trajectory, go_to, hold, joined, sweep
from exograv.rig import Powered

from .breakaway_checks import refuse_before_motion
from .breakaway_test import BreakawayTester, starting_posture
from .empty_motion import empty_motion
from .empty_run import TRAVEL, EmptyRun
from .operator import Operator
from .phase_texts import say

SLOW, FAST = 0.3, 0.9  # rad/s: two speeds separate Coulomb from viscous friction
# Creep passes through all low speeds, to show how friction falls from rest (Stribeck effect).
CREEP, CREEP_WAY = 0.16, 0.35  # largest speed [rad/s] and length [rad]
CHECK_WAY = 0.6  # rad: length of the slow pass of a re-check
SWEEP_PARTS = 2  # duration of the sweeps without a weight, in units of the pass with one weight


def calibrate_machine(
    description: RigDescription,
    tree: Tree,
    pilot: Pilot,
    operator: Operator,
    motion: Excitation | None = None,
    known: EmptyPrior | None = None,
) -> Calibration:
    """Push, sweep, weigh, move along a `motion` if there is one, and fit, with what is `known` as prior.

    The pilot's rig must be empty and hang still, and the tree set to its lengths.

    Raises:
        ConfigError: The rig is not the one that `rig.toml` describes.
        IdentificationError: A joint, its encoder, its motor or a weight is not as described.
        RigError: The envelope stopped the run.
    """
    refuse_before_motion(description, tree, pilot.rig)
    run = EmptyRun(description, tree, pilot, operator)
    BreakawayTester(run).nudge()
    plans, hanging = description.calibration.sweeps, starting_posture(tree)
    for i, plan in enumerate(plans):
        weights = description.calibration.weights_kg
        which = {"joint": plan.joint, "number": i + 1, "of": len(plans), "parts": SWEEP_PARTS + len(weights)}
        run.cool(hanging)
        run.follow(to_and_fro(run, plan, SLOW, FAST, CREEP), say("calibration.sweep", **which, span=SWEEP_PARTS))
        mount = plan.mount or description.calibration.mount
        for weight, mass in enumerate(weights):
            run.cool(hanging)
            run.load(mount, weight)
            run.follow(
                to_and_fro(run, plan, SLOW),
                say("calibration.weight", **which, weight=f"{mass:g}", part=SWEEP_PARTS + weight),
            )
        run.load(mount, None)
    if motion is not None:
        run.cool(hanging)
        run.follow(empty_motion(motion, pilot.q.copy(), pilot.rig.period_s), say("calibration.motion"))
    check_passes(run)
    lead_home(run)
    return calibrate(description, tree, run.sweeps(), known)


def recheck_machine(description: RigDescription, tree: Tree, pilot: Pilot, before: Calibration) -> Calibration:
    """Measure friction again, by one push per joint and passes without weights. The rest stays as `before`.

    Raises:
        As `calibrate_machine`.
    """
    refuse_before_motion(description, tree, pilot.rig)
    run = EmptyRun(description, tree, pilot)
    BreakawayTester(run).nudge(pushes=1)
    check_passes(run)
    lead_home(run)
    return recheck(description, tree, run.sweeps(), before)


def lead_home(run: EmptyRun) -> None:
    """Move the machine to where it hangs and switch its motors off, if it can: the fit sends no commands."""
    rig = run.pilot.rig
    if isinstance(rig, Powered):
        home = go_to(run.pilot.q.copy(), starting_posture(run.tree), TRAVEL, rig.period_s)
        run.follow(home, say("calibration.home"))
        rig.disable()


def check_passes(run: EmptyRun) -> None:
    """Move every joint slowly and fast, both ways, without weights, to measure its friction."""
    plans, hanging = run.description.calibration.sweeps, starting_posture(run.tree)
    for i, plan in enumerate(plans):
        run.cool(hanging)
        text = say("calibration.friction", joint=plan.joint, number=i + 1, of=len(plans))
        run.follow(to_and_fro(run, plan, SLOW, FAST, way=CHECK_WAY), text)


def to_and_fro(run: EmptyRun, plan: SweepSettings, *speeds: float, way: float = np.inf) -> Trajectory:
    """Path to the start of a sweep, then one pass per speed [rad/s].

    Passes at `SLOW` are `way` [rad] long at most, creep passes `CREEP_WAY`.
    """
    dt, joint = run.pilot.rig.period_s, run.description.joints.index(plan.joint)
    start = np.deg2rad(plan.posture_deg)
    start[joint] = np.deg2rad(plan.from_deg)
    whole = float(np.deg2rad(plan.to_deg) - start[joint])
    parts = [go_to(run.pilot.q, start, TRAVEL, dt)]
    for speed in speeds:
        goal = start.copy()
        far = {SLOW: way, CREEP: CREEP_WAY}.get(speed, np.inf)
        goal[joint] += np.copysign(min(abs(whole), far), whole)
        if speed == CREEP:
            passes = [go_to(start, goal, speed, dt), go_to(goal, start, speed, dt)]
        else:
            passes = [sweep(start, joint, float(goal[joint]), speed, dt)]
        parts += [hold(start, 0.3, dt), *passes]
    return joined([*parts, hold(start, 0.2, dt)])
