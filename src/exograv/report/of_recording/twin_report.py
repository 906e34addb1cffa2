"""Page of a fitted twin: residuals, friction, parameters, and what further motion would tell."""

from collections.abc import Sequence
from pathlib import Path

from exograv.report.figures.twin_fit import INTERVAL, WORDS, draw_friction, draw_parameters, draw_residuals
from exograv.report.figures.twin_fit_data import FittedParameter, JointFriction, TwinFigures, WarmGain
from exograv.report.style.figure_style import house_style, joint_label
from exograv.report.style.page import Bullets, Chapter, Page, Table, Text, Tile, write_page

OVER_NOISE_GOAL = 1.2
"""Goal for the held-out residual over the noise [-]."""

LITTLE_LEARNED, MOSTLY_LEARNED = 0.3, 0.7
"""Shares of a parameter that the recordings tell, below and above which it counts as not told and told [-]."""

MOST_GAINED = 8
"""Number of parameters in the table of the designed motion."""

SIMULATED_MACHINE = "SIMULATED: the machine of a recording exists in a simulation only."

RESIDUALS_TEXT = (
    "RMS of measured torque minus the twin's torque at every tick of clear motion. The parameters have not seen the "
    "held-out part. A residual equal to the noise leaves nothing to explain."
)
FRICTION_TEXT = (
    "Friction of the unloaded joint at constant speed, as at the end of the recordings. Dots are medians of the "
    "friction that held-out motion shows. The interval is that of the law: it does not contain the noise of a dot."
)
LAWS_TEXT = (
    "Mean logarithm of the held-out loss over that of the best law, with its standard deviation. The simplest law that "
    "exceeds the best one by chance only, or by less than 0.02, is chosen; it has a tick mark."
)
PARAMETERS_TEXT = (
    "Each parameter in standard deviations of the data sheet's prior. The grey band is the 95 % interval before the "
    "recordings, the bar that after them. A bar as long as the band means that the recordings do not tell the "
    "parameter."
)


def write_twin_report(figures: TwinFigures, html_path: Path) -> Path:
    """Write the page, or replace it; its folder is created too.

    Raises:
        RecordingError: The page cannot be written.
    """
    with house_style():
        chapters = [
            Chapter("Residual torque", (), "residuals", draw_residuals(figures.held_out), RESIDUALS_TEXT),
            Chapter(
                "Friction",
                [Text(LAWS_TEXT), _laws(figures.friction)],
                "friction",
                draw_friction(figures.friction),
                FRICTION_TEXT,
            ),
            Chapter(
                "Parameters", [_parameters(figures)], "parameters", draw_parameters(figures.parameters), PARAMETERS_TEXT
            ),
        ]
    chapters += [_identifiability(figures.parameters, figures.gain_by_temperature), _further(figures)]
    page = Page(
        headline=headline(figures),
        simulated=SIMULATED_MACHINE if figures.is_simulated else "",
        title=f"Twin of {figures.rig}",
        facts=_facts(figures),
        tiles=_tiles(figures),
        lead=[Text(sentence, "notice") for sentence in figures.warnings],
        chapters=chapters,
        letters="none",
    )
    return write_page(html_path, page)


def headline(figures: TwinFigures) -> str:
    """Held-out residual over noise, in one sentence."""
    worst = max(figures.held_out, key=lambda row: row.over_noise)
    return (
        f"The twin of {figures.rig} leaves at most {worst.over_noise:.2f} times the noise of the sensors of the "
        f"held-out torque; {joint_label(worst.joint)} is the worst joint."
    )


def _facts(figures: TwinFigures) -> list[tuple[str, str]]:
    return [
        ("side", figures.side),
        ("recordings", ", ".join(figures.recordings)),
        ("recorded", f"{figures.recorded_s:.0f} s"),
        ("held out", f"{figures.held_out_s:.0f} s"),
    ]


def _tiles(figures: TwinFigures) -> list[Tile]:
    worst = max(row.over_noise for row in figures.held_out)
    note = f"goal: {OVER_NOISE_GOAL:g}, worst joint"
    tiles = [Tile("held-out residual / noise", f"{worst:.2f}", note, worst <= OVER_NOISE_GOAL)]
    if figures.delay_ms is not None and figures.delay_ci95_ms is not None:
        low, high = figures.delay_ci95_ms
        tiles.append(Tile("delay", f"{figures.delay_ms:.2f} ms", f"95 %: {low:.2f} to {high:.2f} ms"))
    tiles.append(Tile("encoders on the motors", "yes" if figures.has_motor_encoders else "no", "by the recordings"))
    told = sum(row.learned >= MOSTLY_LEARNED for row in figures.parameters)
    share = f"by more than {MOSTLY_LEARNED:.0%}"
    return [*tiles, Tile("parameters told", f"{told} of {len(figures.parameters)}", share)]


def _laws(rows: Sequence[JointFriction]) -> Table:
    names = [one.law for one in rows[0].laws]
    cells = [
        (joint_label(row.joint), *(_score(one.excess, one.excess_sd, one.law == row.law) for one in row.laws))
        for row in rows
    ]
    return Table(("joint", *names), cells)


def _score(excess: float, sd: float, is_chosen: bool) -> str:
    return f"{excess:.3f} ± {sd:.3f}" + (" ✓" if is_chosen else "")


def _parameters(figures: TwinFigures) -> Table:
    rows = [
        (
            joint_label(row.joint),
            WORDS[row.parameter],
            row.unit,
            f"{row.estimate:.4g}",
            f"{row.ci95[0]:.4g} to {row.ci95[1]:.4g}",
            f"{row.prior:.4g} ± {INTERVAL * row.prior_sd:.2g}",
            f"{row.learned:.0%}",
        )
        for row in figures.parameters
    ]
    rows += [
        (
            joint_label(row.joint),
            "rotor and links about the axis",
            "kg·m²",
            f"{row.inertia_kgm2:.4g}",
            f"{row.inertia_ci95_kgm2[0]:.4g} to {row.inertia_ci95_kgm2[1]:.4g}",
            "",
            "",
        )
        for row in figures.axis_inertia
    ]
    rows += [
        (
            joint_label(row.joint),
            "compliance of the gear",
            "mrad/(N·m)",
            f"{row.compliance_mrad_per_Nm:.4g}",
            f"{row.ci95_mrad_per_Nm[0]:.4g} to {row.ci95_mrad_per_Nm[1]:.4g}",
            "",
            "",
        )
        for row in figures.gears
    ]
    rows += [
        (
            "cuffs",
            f"stiffness over that in rig.toml, {row.direction}",
            "-",
            f"{row.factor:.3g}",
            f"{row.ci95[0]:.3g} to {row.ci95[1]:.3g}",
            "",
            f"{row.learned:.0%}",
        )
        for row in figures.cuffs
    ]
    columns = ("joint", "parameter", "unit", "estimate", "95 % interval", "data sheet, 95 %", "told by the recordings")
    return Table(columns, rows)


def _identifiability(rows: Sequence[FittedParameter], gains: Sequence[WarmGain]) -> Chapter:
    groups = (
        ("Told by the recordings", [row for row in rows if row.learned >= MOSTLY_LEARNED]),
        ("Told in part", [row for row in rows if LITTLE_LEARNED <= row.learned < MOSTLY_LEARNED]),
        ("Not told: the values are those of the data sheet", [row for row in rows if row.learned < LITTLE_LEARNED]),
    )
    bullets = [f"{title}: {_listed(group)}." for title, group in groups if group]
    said = "The share is 1 − standard deviation after the recordings / before them."
    return Chapter("What the recordings tell", [said, Bullets(bullets), *_warm(gains)], "identifiability")


def _warm(gains: Sequence[WarmGain]) -> list[str | Table]:
    """Table of the gains by temperature; a sentence if no recording tells one."""
    if not any(row.percent_per_C is not None for row in gains):
        why = "their temperatures varied too little" if any(row.temperature_C for row in gains) else "they hold none"
        return [f"Gain by temperature is not told by these recordings: {why}."]
    rows = [
        (
            joint_label(row.joint),
            "not told" if row.temperature_C is None else f"{row.temperature_C[0]:.0f} to {row.temperature_C[1]:.0f} °C",
            "not told" if row.percent_per_C is None else f"{row.percent_per_C:.2f} %/°C",
            "" if row.ci95_percent_per_C is None else "{:.2f} to {:.2f}".format(*row.ci95_percent_per_C),
        )
        for row in gains
    ]
    return [Table(("joint", "temperature of the motor", "gain by temperature", "95 % interval"), rows)]


def _listed(rows: Sequence[FittedParameter]) -> str:
    """Parameters with their joints, such as "gain (elbow flexion 95 %)"."""
    by_name = dict[str, list[str]]()
    for row in rows:
        by_name.setdefault(row.parameter, []).append(f"{joint_label(row.joint)} {row.learned:.0%}")
    return "; ".join(f"{WORDS[name]} ({', '.join(joints)})" for name, joints in by_name.items())


def _further(figures: TwinFigures) -> Chapter:
    motion = figures.designed_motion
    rows = [
        (joint_label(row.joint), WORDS[row.parameter], f"{row.sd_ratio:.0%}") for row in motion.expected[:MOST_GAINED]
    ]
    return Chapter(
        "What further motion would tell",
        [
            Bullets(figures.further_motion) if figures.further_motion else "No parameter needs another kind of motion.",
            f"The file {motion.file.name} beside the twin holds a motion of {motion.period_s:g} s. It is designed for "
            "the parameters that these recordings tell least, within the limits of the machine. "
            "`exograv rig calibrate FOLDER --motion FILE` flies it. The table shows what it is expected to tell most.",
            Table(("joint", "parameter", "standard deviation after it, of that before"), rows),
        ],
        "further_motion",
    )
