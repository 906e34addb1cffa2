"""`exograv console` on a twin that is as its files say: it is there in seconds, for tests that strike it."""

from exograv.cli import main
from exograv.session.nominal import nominal_machine
from exograv.session.steered import place


def nominal(laboratory, *_):
    """Instead of a minute of calibration."""
    return nominal_machine(laboratory.description, laboratory.assembly().exo.phi), 0.0


if __name__ == "__main__":
    place.machine_of = nominal
    main()
