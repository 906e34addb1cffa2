"""`exograv console` on a twin with the machine of its data sheets: ready in seconds, for tests that strike it."""

from exograv.cli import main
from exograv.laboratory.preparation import Preparation
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess


def nominal_knowledge(self: Preparation, file=None, assembly=None) -> ControllerKnowledge:
    """Replace a minute of calibration by the machine's data sheets."""
    assembly = assembly or self.laboratory.assembly()
    machine = nominal_machine(self.laboratory.description, assembly.exo.phi)
    return ControllerKnowledge(assembly, machine, table_guess(assembly, machine), 0.0)


if __name__ == "__main__":
    Preparation.calibrated = nominal_knowledge
    main()
