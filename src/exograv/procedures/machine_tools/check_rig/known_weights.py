"""Findings on the known weights of the calibration: each has to load the joint of its sweep, which has to carry it."""

from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.procedures.calibration.known_weights import LOADED_NM, weight_load, weights_not_carried

from .findings import CheckFindings


def examine_weights(description: RigDescription, tree: Tree, findings: CheckFindings) -> None:
    """Report joints that the known weight does not load, with a note where no weight can, and weights too heavy."""
    for sentence in weights_not_carried(description, tree):
        findings.problem(sentence)
    for sweep in description.settings.sweeps:
        load = weight_load(description, tree, sweep)
        if load.tau >= LOADED_NM:
            continue
        if load.is_vertical:
            findings.note(
                f"the axis of '{sweep.joint}' is vertical in its sweep: no weight loads it, and its torque gain stays "
                "that of the data sheet."
            )
        else:
            findings.problem(
                f"the known weight at '{load.mount}' loads '{sweep.joint}' with {load.tau:.2f} N·m in its sweep; "
                f"allowed: at least {LOADED_NM} N·m. Change posture_deg of that sweep so that the lever is longer, or "
                f"name a link beyond '{sweep.joint}' as its mount."
            )
