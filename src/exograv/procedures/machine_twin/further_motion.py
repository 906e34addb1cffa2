"""Motion that would tell what the recordings of a machine do not."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.files import replace_file
from exograv.identification.excitation.basis import excitation_block, excitation_text
from exograv.identification.machine_twin.friction_laws import LAWS
from exograv.identification.machine_twin.further_design import EmptyLimits, design_further_motion, expected_ratio
from exograv.identification.machine_twin.machine_fit import MachineFit
from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.report.figures.twin_fit_data import ExpectedGain, FurtherMotion

MOTION = "further_motion.toml"
"""Name of the motion file in the folder of the machine."""

GAIN_SURE = 0.015
"""Relative standard deviation of a gain below which a known weight adds little [-]."""

ROTOR_SURE = 0.025
"""Relative standard deviation of a rotor inertia below which faster reversals add little [-]."""

VISCOUS_SURE = 0.05
"""Standard deviation of viscous friction at the largest speed, over Coulomb friction [-]."""

BREAKAWAY_SURE = 0.05
"""Standard deviation of the breakaway ratio below which slower motion adds little [-]."""

DELAY_SURE_S = 0.15e-3
"""Standard deviation of the delay below which steps of the command add little [s]."""


def further_motion(
    description: RigDescription,
    found: MachineFit,
    axes: tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]],
) -> list[str]:
    """Advise on further recordings, one sentence per parameter that is not well known; empty if all are.

    `axes` are the inertia about each axis and its standard deviation (joint,) [kg·m²].
    """
    layout, theta, sd = found.fit.prior.layout, found.fit.theta, found.fit.sd

    def of(name: str) -> tuple[np.ndarray, np.ndarray]:
        return theta[layout.of(name)], sd[layout.of(name)]

    (gain, gain_sd), (rotor, rotor_sd), (coulomb, _) = of("inverse_gain"), of("rotor"), of("coulomb")
    breakaway_sd, viscous_sd = of("breakaway")[1], of("viscous")[1]
    has_reference = bool((found.sweeps.hung > 0.0).any() or found.sweeps.wrench is not None)
    mounts = {sweep.joint: sweep.mount for sweep in description.calibration.sweeps}
    apart = (
        "The encoders of the motors tell the two apart under load: record longer sweeps of it with a known weight"
        if found.has_motor_encoders
        else "Motion alone cannot separate the two"
    )
    told = []
    for j, joint in enumerate(description.joints):
        share = gain_sd[j] / gain[j]
        if share > GAIN_SURE:
            start = f"The gain of '{joint}' is known to ±{1.96 * share:.1%}"
            mount = mounts.get(joint) or description.calibration.mount
            told.append(
                f"{start}: record a further sweep of it with a known weight at {mount}, through more of its range, or "
                "pull at a force sensor so that this joint feels it."
                if has_reference
                else f"{start}, by the drawings of the links alone: record a sweep of it with a known weight at "
                f"{mount} (--weight FILE:MOUNT=KG), or pull at a force sensor (columns force_x, force_y, force_z)."
            )
        if rotor_sd[j] > ROTOR_SURE * abs(rotor[j]):
            of_axis = axes[1][j] / axes[0][j]
            start = f"The rotor inertia of '{joint}' is known to ±{1.96 * rotor_sd[j] / abs(rotor[j]):.0%}"
            if of_axis < ROTOR_SURE:
                told.append(
                    f"{start}, rotor and links about its axis together to ±{1.96 * of_axis:.1%}. {apart}. Enter "
                    "the rotor's data sheet in rig.toml if it is known better."
                )
            else:
                told.append(f"{start}: record quick reversals of it, with the joints behind it bent and stretched.")
        if viscous_sd[j] * found.fastest[j] > VISCOUS_SURE * max(coulomb[j], 1e-9):
            told.append(f"Viscous friction of '{joint}' is uncertain: record passes at two speeds far apart.")
        if "breakaway" in LAWS[found.laws[j]] and breakaway_sd[j] > BREAKAWAY_SURE:
            told.append(f"Slow friction of '{joint}' is uncertain: record it creeping at 0.02 to 0.1 rad/s, both ways.")
    if not np.isfinite(found.response.delay_s):
        told.append("The recordings hold no commands: delay and bandwidth stay usual ones. Record commanded torques.")
    elif found.response.delay_sd_s > DELAY_SURE_S:
        told.append(
            f"The delay is known to ±{1.96e3 * found.response.delay_sd_s:.1f} ms: record steps of the commanded "
            "torque, and every command."
        )
    return told


def write_further_motion(
    path: Path, description: RigDescription, tree: Tree, found: MachineFit, shown: Sequence[tuple[int, str]]
) -> FurtherMotion:
    """Design the motion that tells most about the least known of the shown parameters, and write its file.

    Args:
        path: File to write.
        description: The machine.
        tree: The machine at the lengths of the recordings.
        found: Fit to the present recordings.
        shown: Joint and name of each parameter that counts.

    Raises:
        ConfigError: The file cannot be written.
    """
    places = np.array([found.fit.prior.layout.of(name).start + j for j, name in shown])
    limits = EmptyLimits.of(description, tree)
    design = design_further_motion(found.model, found.fit, limits, places)
    block = excitation_block(design.basis, design.coefficients)
    head = (
        f"# Motion of {description.name} without an arm that tells most about what its recordings do not, written by\n"
        f"# `exograv twin fit`. Fly it: exograv rig calibrate {path.parent} --motion {path}\n\n"
    )
    try:
        replace_file(path, head + excitation_text(block))
    except OSError as error:
        raise ConfigError(f"{path} cannot be written: {error.strerror}. Give another folder with --out.") from error
    ratios = expected_ratio(found, limits, design)[places].tolist()
    rows = [ExpectedGain(description.joints[j], name, ratio) for (j, name), ratio in zip(shown, ratios, strict=True)]
    return FurtherMotion(path, block.period_s, sorted(rows, key=lambda row: row.sd_ratio))
