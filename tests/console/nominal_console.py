"""Command `exograv run console` on a twin with data-sheet values, which is ready in seconds, for tests that kill it."""

from pathlib import Path

from exograv.cli import main
from exograv.laboratory.preparation import Preparation
from exograv.model.assembly import Assembly
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess


def nominal_knowledge(
    self: Preparation, file: Path | None = None, assembly: Assembly | None = None, make: str = ""
) -> ControllerKnowledge:
    """Return the data-sheet values of the machine in place of a calibration, which takes a minute."""
    assembly = assembly or self.laboratory.assembly()
    machine = nominal_machine(self.laboratory.description, assembly.exo.phi)
    return ControllerKnowledge(assembly, machine, table_guess(assembly, machine), 0.0)


if __name__ == "__main__":
    Preparation.calibrated = nominal_knowledge
    main()
