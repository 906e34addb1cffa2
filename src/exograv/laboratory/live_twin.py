"""Twin of a live run: calibrated machine, drawn wearer, and the identified arm if it is not identified live."""

from exograv.errors import RigError
from exograv.loop.pilot import Progress
from exograv.options import TwinOptions
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.live_machine import LiveMachine
from exograv.procedures.self_test.machine_test import test_machine
from exograv.rig.twin.twin import PERIOD

from .cooperative_wearer import cooperative_machine
from .preparation import Preparation
from .truth_score import ScoredWearer
from .virtual_laboratory import driven_laboratory


def prepare_live_twin(options: TwinOptions, is_identified: bool, is_tested: bool, progress: Progress) -> LiveMachine:
    """Draw and calibrate the machine. If requested, identify the arm and test the machine.

    Args:
        options: Machine, disturbances and seed.
        is_identified: True if the arm is identified now.
        is_tested: True if the machine is tested without its wearer.
        progress: Receives the progress.

    Raises:
        ExogravError: The machine, the wearer or the run was refused, or the self-test has failed.
    """
    seed = options.seed
    drawn = driven_laboratory(options.rig, options.side, options.level, seed, options.world)
    preparation = Preparation(drawn, seed, progress)
    known = preparation.identified() if is_identified else preparation.calibrated()
    laboratory = preparation.laboratory
    self_test = _tested(preparation, known, progress) if is_tested else None
    connect = cooperative_machine(laboratory, seed, known.t)
    return LiveMachine(laboratory.form, known, connect, PERIOD, ScoredWearer(laboratory), self_test)


def _tested(preparation: Preparation, known: ControllerKnowledge, progress: Progress) -> str:
    """Self-test the machine without its wearer.

    Raises:
        RigError: A step has failed.
    """
    steps, busy_s = test_machine(preparation.under_test(known), progress)
    for step in steps:
        if not step.passed:
            raise RigError(f"The self-test has failed ({step.name}). {step.what_to_do}")
    return f"passed: {len(steps)} steps, {busy_s:.0f} s of the machine"
