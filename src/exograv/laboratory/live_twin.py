"""The twin of a live run: its machine calibrated, its wearer drawn, and the arm identified unless that is done live."""

from exograv.errors import RigError
from exograv.loop.pilot import Progress
from exograv.options import Side
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.live_machine import LiveMachine
from exograv.procedures.self_test.machine_test import test_machine
from exograv.rig.twin.twin import PERIOD

from .cooperative_wearer import cooperative_machine
from .preparation import Preparation
from .truth_score import ScoredWearer
from .virtual_laboratory import driven_laboratory


def prepare_live_twin(
    rig: str, side: Side | None, level: int, seed: int, is_identified: bool, is_tested: bool, progress: Progress
) -> LiveMachine:
    """Draw, calibrate and, if asked, identify and test.

    Args:
        rig: Name or folder of the machine.
        side: Arm; the machine's first where absent.
        level: Of all disturbances.
        seed: Draws machine and wearer.
        is_identified: True if the arm is identified now.
        is_tested: True if the machine is tested without its wearer.
        progress: Told now and then.

    Raises:
        ExogravError: The machine, the wearer or the run was refused, or the self-test has failed.
    """
    preparation = Preparation(driven_laboratory(rig, side, level, seed), seed, progress)
    known = preparation.identified() if is_identified else preparation.calibrated()
    laboratory = preparation.laboratory
    self_test = _tested(preparation, known, progress) if is_tested else None
    connect = cooperative_machine(laboratory, seed, known.t)
    return LiveMachine(laboratory.form, known, connect, PERIOD, ScoredWearer(laboratory), self_test)


def _tested(preparation: Preparation, known: ControllerKnowledge, progress: Progress) -> str:
    """Self-test the machine without its wearer.

    Raises:
        RigError: It has not passed.
    """
    steps, busy_s = test_machine(preparation.under_test(known), progress)
    for step in steps:
        if not step.passed:
            raise RigError(f"The self-test has failed ({step.name}). {step.what_to_do}")
    return f"passed: {len(steps)} steps, {busy_s:.0f} s of the machine"
