"""`exograv calibrate --drives`: stage 0 of a machine on its bus, which has to have been brought up before."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from exograv.control.exo_tick import most_damping
from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ConfigError
from exograv.identification.calibration.empty_machine import GAIN_SD, Calibration
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot, Progress
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.procedures.calibration.calibrate import calibrate_machine, recheck_machine

from .connection import Connected


def settings_of_lengths(description: RigDescription, given: tuple[str, ...]) -> dict[str, float]:
    """What the machine is set to, by segment [m]: as given by SEGMENT=METRES, nominal where nothing is.

    Raises:
        ConfigError: No such segment, no number, or longer or shorter than the machine can be set.
    """
    adjustments = {one.segment: one for one in description.settings.adjustments}
    lengths = {segment: one.nominal_m for segment, one in adjustments.items()}
    for text in given:
        segment, _, value = text.partition("=")
        if segment not in adjustments:
            known = ", ".join(adjustments) or "none"
            raise ConfigError(
                f"--length is '{text}'; {description.name} can be set at: {known}. Give SEGMENT=METRES, such as "
                "forearm=0.26."
            )
        one = adjustments[segment]
        try:
            lengths[segment] = float(value)
        except ValueError:
            raise ConfigError(f"--length is '{text}'; give SEGMENT=METRES, such as {segment}=0.26.") from None
        if not one.min_m <= lengths[segment] <= one.max_m:
            raise ConfigError(f"--length is '{text}'; {segment} can be set from {one.min_m:g} to {one.max_m:g} m.")
    return lengths


def calibrated_on_drives(
    machine: Connected, description: RigDescription, lengths: Mapping[str, float], progress: Progress
) -> tuple[Calibration, float]:
    """From the first nudge to the last weight; the result, and how long the machine was running [s].

    Raises:
        As `calibrate_machine`.
    """
    nominal = description.nominal_gain
    tree = adjusted(read_exoskeleton(description), description, lengths)
    pilot = _pilot(machine, description, ActuatorGain(nominal, GAIN_SD * nominal), tree, progress)
    return calibrate_machine(description, tree, pilot, machine.hands.weights), machine.rig.t


def rechecked_on_drives(
    machine: Connected,
    description: RigDescription,
    lengths: Mapping[str, float],
    before: Calibration,
    progress: Progress,
) -> tuple[Calibration, float]:
    """Friction anew and all else as `before`; the result, and how long the machine was running [s].

    Raises:
        As `recheck_machine`.
    """
    tree = adjusted(read_exoskeleton(description), description, lengths)
    pilot = _pilot(machine, description, before.machine.actuators, tree, progress)
    return recheck_machine(description, tree, pilot, before), machine.rig.t


def _pilot(
    machine: Connected, description: RigDescription, gains: ActuatorGain, tree: Tree, progress: Progress
) -> Pilot:
    worn = limits(description)
    # Without an arm in it a light machine shakes under the damping that suits a worn one.
    damping = np.minimum(worn.damping_Nms_per_rad, most_damping(description, tree))
    return machine.pilot(gains, replace(worn, damping_Nms_per_rad=damping), progress)
