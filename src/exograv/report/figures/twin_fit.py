"""Figures of a fitted twin: residuals against noise, friction by speed, and what the recordings tell."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from exograv.report.style.colours import BLUE, GREY, INK, ORANGE, PALE, SKY
from exograv.report.style.figure_style import joint_colours, joint_label, legend, name_rows

from .twin_fit_data import FittedParameter, JointFriction, JointResiduals

COLUMNS = 2
"""Panels beside each other."""

INTERVAL = 1.96
"""Half of a 95 % interval, in standard deviations."""

WORDS = {
    "inverse_gain": "gain (inverse)", "coulomb": "Coulomb friction", "viscous": "viscous friction",
    "load_share": "friction by load", "asymmetry": "asymmetry", "rotor": "rotor inertia", "breakaway": "breakaway",
    "log_v_stribeck": "Stribeck speed (log)", "viscous_power": "power of speed", "offset": "encoder offset",
}  # fmt: skip
"""Words for a parameter."""


def draw_residuals(rows: Sequence[JointResiduals]) -> Figure:
    """Draw the residual torque per tick on the fitted and the held-out part, beside the noise."""
    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    ax = figure.subplots()
    x = np.arange(len(rows))
    bars = (
        ("noise of the sensors", GREY, [row.noise_Nm for row in rows]),
        ("residual, fitted part", SKY, [row.fitted_rms_Nm for row in rows]),
        ("residual, held-out part", BLUE, [row.rms_Nm for row in rows]),
        ("held-out part below 7 Hz", ORANGE, [row.slow_rms_Nm for row in rows]),
    )
    width = 0.8 / len(bars)
    for k, (label, colour, heights) in enumerate(bars):
        ax.bar(x + (k - 0.5 * (len(bars) - 1)) * width, heights, 0.92 * width, color=colour, label=label)
    ax.set_xticks(x, [joint_label(row.joint, "\n") for row in rows])
    ax.set_ylabel("RMS torque [N·m]")
    legend(figure, [ax], "upper center", len(bars))
    return figure


def draw_friction(rows: Sequence[JointFriction]) -> Figure:
    """Draw the friction of each joint by its speed, with the 95 % interval and the friction of held-out motion."""
    lines = -(-len(rows) // COLUMNS)
    figure = Figure(figsize=(7.2, 2.4 * lines), layout="constrained")
    panels = figure.subplots(lines, COLUMNS, squeeze=False).ravel()
    colours = joint_colours(tuple(row.joint for row in rows))
    for ax, row, colour in zip(panels, rows, colours, strict=False):
        # Two parts: the curve jumps where the speed changes its sign.
        half, (low, high) = len(row.v_rad_s) // 2, np.array(row.ci95_Nm).T
        for part in (slice(0, half), slice(half, None)):
            label = "law with 95 % interval" if part.start == 0 else "_nolegend_"
            ax.fill_between(row.v_rad_s[part], low[part], high[part], color=colour, alpha=0.25, lw=0)
            ax.plot(row.v_rad_s[part], row.torque_Nm[part], color=colour, label=label)
        ax.plot(row.measured_v_rad_s, row.measured_Nm, "o", color=INK, ms=3, label="held-out motion")
        ax.axhline(0.0, color=GREY, lw=0.6)
        ax.set_title(joint_label(row.joint))
        ax.set_xlabel("speed [rad/s]")
        ax.set_ylabel("friction [N·m]")
    for ax in panels[len(rows) :]:
        ax.set_axis_off()
    legend(figure, panels[:1], "lower center", 2)
    return figure


def draw_parameters(rows: Sequence[FittedParameter]) -> Figure:
    """Draw each parameter in standard deviations of its prior, with its 95 % interval; the prior is grey."""
    joints = tuple(dict.fromkeys(row.joint for row in rows))
    names = [name for name in WORDS if any(row.parameter == name for row in rows)]
    lines = -(-len(joints) // COLUMNS)
    figure = Figure(figsize=(7.2, (0.22 * len(names) + 0.7) * lines), layout="constrained")
    panels = figure.subplots(lines, COLUMNS, squeeze=False, sharex=True, sharey=True).ravel()
    for ax, joint, colour in zip(panels, joints, joint_colours(joints), strict=False):
        ax.axvspan(-INTERVAL, INTERVAL, color=PALE, zorder=0)
        for row in rows:
            if row.joint == joint:
                place, scale = names.index(row.parameter), row.prior_sd
                ends = [(end - row.prior) / scale for end in row.ci95]
                ax.plot(ends, [place, place], color=colour, lw=2.5, solid_capstyle="butt")
                ax.plot((row.estimate - row.prior) / scale, place, "o", color=colour, ms=4)
        name_rows(ax, [WORDS[name] for name in names])
        ax.set_title(joint_label(joint))
    for ax in panels[len(joints) :]:
        ax.set_axis_off()
    for ax in panels[max(len(joints) - COLUMNS, 0) : len(joints)]:
        ax.set_xlabel("distance from the data sheet\n[its standard deviations]")
    return figure
