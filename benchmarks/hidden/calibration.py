"""Calibration of a hidden machine, with the shipped drawing or its fitted twin as prior."""

from pathlib import Path

import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import IdentificationError
from exograv.identification.calibration.empty_machine import GAIN_SD
from exograv.identification.calibration.empty_prior import EmptyPrior
from exograv.identification.calibration.twin_prior import twin_prior
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.calibration.breakaway_test import starting_posture
from exograv.procedures.calibration.calibrate import calibrate_machine
from exograv.procedures.calibration.operator import ComputedOperator
from exograv.safety.envelope import Envelope
from exograv.storage.twin_file import read_twin

from .draw import Hidden
from .geometry import Geometry
from .rig import HiddenRig


def compare_priors(folder: Path, hidden: Hidden, geometry: Geometry, ran_s: float) -> None:
    """Print the errors of a calibration by its prior, with the URDF of the machine's folder."""
    description = load_rig(str(folder), "right")
    whole = read_twin(description)
    tree = adjusted(read_exoskeleton(description), description, whole.provenance.lengths_m)
    by_twin = twin_prior(description, tree, whole.layout(), np.array(whole.posterior.mean), whole.posterior.matrix())
    priors: dict[str, EmptyPrior | None] = {"data sheet": None, "twin": by_twin}
    for name, known in priors.items():
        rig = HiddenRig(geometry, hidden, starting_posture(tree), ran_s)
        gain = ActuatorGain(description.nominal_gain, GAIN_SD * description.nominal_gain)
        pilot = Pilot(rig, gain, Envelope(limits(description), rig.period_s))
        pilot.begin("calibrate")
        try:
            found = calibrate_machine(description, tree, pilot, ComputedOperator(rig.hang), known=known).machine
        except IdentificationError as error:
            print(f"{name}: refused. {error}")
            continue
        gains, links = found.actuators, found.phi[:, 0]
        off = gains.gain / hidden.values["gain"] - 1.0
        inside = np.abs(gains.gain - hidden.values["gain"]) < 1.96 * gains.gain_sd
        print(
            f"{name}: gains off by {', '.join(f'{one:+.2%}' for one in off)}; {inside.sum()} of {len(inside)} inside "
            f"the 95 % interval; masses of the links {', '.join(f'{one:.2f}' for one in links)} kg, true "
            f"{', '.join(f'{one:.2f}' for one in hidden.values['mass'])}"
        )
