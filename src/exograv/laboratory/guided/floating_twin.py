"""The twin with an identified arm that floats behind the guard."""

from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.pilot import Pilot, Progress
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.rehabilitation.guided.floating_arm import FloatingArm
from exograv.recording import RecordingWriter
from exograv.rig.twin import Twin
from exograv.safety.envelope import Envelope


def flown(
    laboratory: VirtualLaboratory,
    known: ControllerKnowledge,
    seed: int,
    recording: RecordingWriter | None,
    progress: Progress,
) -> FloatingArm[Twin]:
    """The arm floats from the first tick on; `seed` draws the run's noise."""
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, seed, t0=known.t)
    envelope = Envelope(limits(laboratory.description), twin.period_s)
    pilot = Pilot(twin, known.machine.actuators, envelope, recording, progress)
    pilot.worn = PersonLimitsManager(envelope, known.assembly, known.machine, known.x)
    pilot.worn.know(known.x)
    return FloatingArm(twin, pilot, ArmController(known.assembly, known.machine, known.x, twin.period_s))
