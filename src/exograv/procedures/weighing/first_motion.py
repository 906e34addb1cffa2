"""First motion of a worn machine: for twenty seconds the machine carries the table's arm and moves it gently."""

from exograv import motion
from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.prior import prior
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.phases import ARM_CHECK
from exograv.loop.pilot import Pilot
from exograv.model.support import sample_postures

from .motion_samples import MotionListener
from .weighing_path import informative_path

SECONDS = 20.0
CANDIDATES = 64  # postures of the task workspace; every pair is a possible path
SPEED, TRAVEL = 0.35, 0.3  # rad/s: gentle, because the wearer's arm is not known yet


def first_motion(pilot: Pilot, controller: ArmController, model: ArmModel) -> list[Sample]:
    """Move the arm to and fro, and return the samples.

    Args:
        pilot: Pilot of the worn machine, at the donning posture.
        controller: Controller with the table's arm; it drives the arm afterwards, too.
        model: Model of the same arm.

    Raises:
        RigError: The envelope stopped the run.
    """
    dt, text = pilot.rig.period_s, "Checking the arm's weight against the table"
    x = controller.x.copy()
    believed = prior(model.assembly, model.machine)
    pilot.worn = pilot.worn or PersonLimitsManager(pilot.envelope, model.assembly, model.machine, believed[0])
    pilot.worn.expect(*believed, SPEED)
    fade(pilot, controller, "drive", ARM_CHECK.drive.goal(is_known=False), pilot.q.copy())
    postures = sample_postures(model.assembly.description, CANDIDATES)[1:]
    way = informative_path(model, x, x[ParameterLayout.of(model.assembly).phi], SPEED, postures)
    approach = motion.go_to(pilot.q, way.low, TRAVEL, dt)
    to_and_fro = way.cycles(max(SECONDS - approach.seconds, 0.0), dt).table()
    listener = MotionListener(model.n_joints, dt)
    pilot.run(controller, motion.joined([approach, to_and_fro]), text, listener)
    return listener.samples
