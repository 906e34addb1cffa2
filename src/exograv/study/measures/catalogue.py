"""Catalogue of all measures: name, unit, meaning, level and origin. Files, figures, pages and docs use these texts."""

from dataclasses import dataclass
from typing import Literal

Level = Literal["touch", "window", "session", "participant"]
Origin = Literal["touches", "ticks", "skeleton"]
"""Data from which a measure is computed: the tidy tables, the ticks of a recording (1 kHz), its skeleton points (20
Hz).
"""

BALASUBRAMANIAN = "Balasubramanian et al. 2015, J NeuroEng Rehabil 12:112"
HANCOCK = "Hancock, Butler, Fischman 1995, J Mot Behav 27:241"


@dataclass(frozen=True)
class Measure:
    """Entry of the catalogue for one measure."""

    name: str
    unit: str
    """Unit of the values, or `-` for a measure without a unit."""

    level: Level
    origin: Origin
    meaning: str
    source: str = ""
    """Source of the definition, if it is not ours."""


def _both(name: str, level: Level, meaning: str, source: str = "") -> tuple[Measure, Measure]:
    """Return the measure in pixels, and in millimetres for a calibrated screen."""
    px, mm = (Measure(f"{name}_{unit}", unit, level, "touches", meaning, source) for unit in ("px", "mm"))
    return px, mm


POINTING = (
    *_both("deviation", "touch", "distance of the contact from the target's centre"),
    Measure("direction_deg", "°", "touch", "touches", "direction of the deviation, from right, upwards positive"),
    *_both("median_deviation", "window", "median of the deviations"),
    Measure("touches", "-", "window", "touches", "number of accepted touches"),
    Measure(
        "share_in_pace", "-", "window", "touches", "share of the intervals that are neither too short nor too long"
    ),
    *_both("median_deviation", "session", "median of the deviations"),
    *_both("iqr_deviation", "session", "interquartile range of the deviations"),
    *_both("constant_error_right", "session", "mean deviation to the right", HANCOCK),
    *_both("constant_error_up", "session", "mean deviation upwards", HANCOCK),
    *_both("constant_error", "session", "length of the mean deviation", HANCOCK),
    *_both("variable_error", "session", "square root of the summed variances about the mean deviation", HANCOCK),
    *_both("variable_error_right", "session", "standard deviation to the right"),
    *_both("variable_error_up", "session", "standard deviation upwards"),
    *_both("ellipse_major", "session", "major half axis of the ellipse that holds 95 % of a normal distribution"),
    *_both("ellipse_minor", "session", "minor half axis of that ellipse"),
    Measure(
        "ellipse_angle_deg", "°", "session", "touches", "angle of its major axis, from right, upwards positive, 0–180"
    ),
    Measure("mean_direction_deg", "°", "session", "touches", "circular mean of the directions"),
    Measure(
        "direction_strength",
        "-",
        "session",
        "touches",
        "mean resultant length: 1 all directions equal, 0 none preferred",
    ),
    Measure("touches_per_window", "-", "session", "touches", "mean number of accepted touches"),
    Measure("median_interval_s", "s", "session", "touches", "median time between accepted touches"),
    Measure(
        "share_in_pace", "-", "session", "touches", "share of the intervals that are neither too short nor too long"
    ),
)
LEARNING = (
    Measure("slope_in_session", "1/window", "session", "touches", "Theil–Sen slope of log deviation over windows"),
    *_both("first_window_deviation", "session", "median deviation in the first window"),
    Measure(
        "first_window_cost",
        "-",
        "session",
        "touches",
        "log ratio of the first window's median deviation to that of the others",
    ),
    Measure(
        "first_touch_cost", "-", "session", "touches", "mean log ratio of a window's first deviation to the later ones"
    ),
    Measure(
        "cost_of_rest",
        "-",
        "session",
        "touches",
        "mean log ratio of a window's first half to the last window's second half",
    ),
    Measure(
        "cost_of_long_rest", "-", "session", "touches", "the same after rests of 1.5 times the usual length or more"
    ),
    Measure("slope_across_sessions", "1/session", "participant", "touches", "Theil–Sen slope of log median deviation"),
    Measure("change_start", "-", "participant", "touches", "log ratio of session 1 to plateau, by exponential fit"),
    Measure("change_sessions", "session", "participant", "touches", "number of sessions in which this falls to 37 %"),
    Measure("plateau_px", "px", "participant", "touches", "median deviation that the exponential fit approaches"),
)
MOVEMENT = (
    Measure("hand_movement_s", "s", "touch", "skeleton", "time from leaving the resting place to the touch"),
    Measure("hand_path_m", "m", "touch", "skeleton", "length of the hand's path in this movement"),
    Measure("hand_peak_speed_m_per_s", "m/s", "touch", "skeleton", "largest speed of the hand in this movement"),
    Measure("hand_sparc", "-", "touch", "skeleton", "smoothness: arc length of the speed's spectrum", BALASUBRAMANIAN),
    Measure("joint_movement_s", "s", "touch", "ticks", "time from leaving the resting posture to the touch"),
    Measure("joint_path_rad", "rad", "touch", "ticks", "length of the joints' path in this movement"),
    Measure("joint_peak_speed_rad_per_s", "rad/s", "touch", "ticks", "largest norm of the joints' velocity in it"),
    Measure("joint_sparc", "-", "touch", "ticks", "smoothness: arc length of the speed's spectrum", BALASUBRAMANIAN),
    Measure("joint_ldlj", "-", "touch", "ticks", "smoothness: negative log of dimensionless jerk", BALASUBRAMANIAN),
    Measure("motor_torque_rms_Nm", "N·m", "window", "ticks", "root mean square of the motors' torque, all joints"),
    Measure("carried_share", "-", "window", "ticks", "mean share of the arm's weight that the machine carried"),
    Measure("end_posture_scatter_deg", "°", "session", "ticks", "root of the joints' summed variances at the touch"),
    Measure("path_scatter_deg", "°", "session", "ticks", "RMS distance of the reaches from the mean reach, over time"),
)
MEASURES = (*POINTING, *LEARNING, *MOVEMENT)


def measure(name: str, level: Level) -> Measure:
    """Return the measure of this name and level."""
    return next(m for m in MEASURES if (m.name, m.level) == (name, level))
