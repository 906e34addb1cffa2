"""The table's arm agrees with de Leva (1996), doi 10.1016/0021-9290(95)00178-6."""

import casadi as ca
import numpy as np
import pytest

from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.rnea import rnea
from exograv.model.anthropometry import TABLE, Body, Sex, segment_lengths
from exograv.model.arm import build_arm, held_weight

# Table 4: mass in % of body mass; centre and radii of gyration (sagittal, transverse, longitudinal) in % of length.
ROWS = {
    ("male", "upper_arm"): (281.7, 2.71, 57.72, 28.5, 26.9, 15.8),
    ("male", "forearm"): (268.9, 1.62, 45.74, 27.6, 26.5, 12.1),
    ("male", "hand"): (187.9, 0.61, 36.24, 28.8, 23.5, 18.4),
    ("female", "upper_arm"): (275.1, 2.55, 57.54, 27.8, 26.0, 14.8),
    ("female", "forearm"): (264.3, 1.38, 45.59, 26.1, 25.7, 9.4),
    ("female", "hand"): (170.1, 0.56, 34.27, 24.4, 20.8, 15.4),
}
# The same segments between other end points: wrist centre or styloid, finger tip or knuckle.
OTHER_ENDS = {
    ("male", "forearm"): (266.9, 46.08, 27.8, 26.7, 12.2),
    ("female", "forearm"): (262.4, 45.92, 26.3, 25.9, 9.5),
    ("male", "hand"): (86.2, 79.00, 62.8, 51.3, 40.1),
    ("female", "hand"): (78.0, 74.74, 53.1, 45.4, 33.5),
}
ROUNDING_MM = 0.3  # half of the last digit of a radius in % of 270 mm, twice

MEAN_MAN = Body(1.741, 73.0, "male")
TORQUES_Nm = {"arm_flexion": 10.55, "arm_elbow": 2.90}
"""Gravity torque of a 73 kg man of mean lengths, with straight horizontal arm; computed from the table."""

LAST_DIGIT = 0.005  # N·m


@pytest.mark.parametrize(("sex", "segment"), ROWS)
def test_every_row_is_as_printed(sex: Sex, segment: str):
    row = TABLE[sex][segment]
    ours = (row.length_mm, row.mass_percent, row.com_percent, *row.gyration_percent)
    assert ours == ROWS[sex, segment]


@pytest.mark.parametrize(("sex", "segment"), OTHER_ENDS)
def test_a_row_says_the_same_body_as_that_of_other_end_points(sex: Sex, segment: str):
    row = TABLE[sex][segment]
    length, *percents = OTHER_ENDS[sex, segment]
    ours = row.length_mm / 100 * np.array([row.com_percent, *row.gyration_percent])
    np.testing.assert_allclose(ours, length / 100 * np.array(percents), atol=ROUNDING_MM)


def level_torque(phi: np.ndarray) -> dict[str, float]:
    """Torque that holds the straight arm horizontal [N·m]."""
    arm = build_arm(MEAN_MAN, "right")
    tree, n = arm.tree, len(arm.tree.joints)
    x = ca.SX.zeros(n)
    x[tree.index("arm_flexion")] = np.pi / 2
    bodies = ca.SX(ca.DM.zeros(10, n))
    for i, body in enumerate(arm.bodies):
        bodies[:, body] = ca.SX(ca.DM(phi[10 * i : 10 * (i + 1)]))
    tau = rnea(tree, x, 0 * x, 0 * x, bodies, ca.SX(ca.DM(GRAVITY)))
    return dict(zip(tree.joint_names, np.array(ca.evalf(tau)).ravel(), strict=True))


def test_a_man_of_mean_measures_weighs_what_the_table_gives():
    torque = level_torque(build_arm(MEAN_MAN, "right").phi)
    for joint, expected in TORQUES_Nm.items():
        assert torque[joint] == pytest.approx(expected, abs=LAST_DIGIT)


def test_a_man_of_the_tables_stature_has_the_tables_lengths():
    lengths = segment_lengths(MEAN_MAN)
    for segment, length in lengths.items():
        assert length == pytest.approx(TABLE["male"][segment].length_mm / 1000)


def test_one_kilogram_in_the_hand_adds_its_lever():
    arm = build_arm(MEAN_MAN, "right")
    added = level_torque(held_weight(arm, 1.0))
    lever = 0.2689 + 0.36 * 0.1879  # m, from the elbow
    assert added["arm_elbow"] == pytest.approx(9.81 * lever, abs=LAST_DIGIT)
    assert added["arm_flexion"] == pytest.approx(9.81 * (lever + 0.2817), abs=LAST_DIGIT)


def test_the_upper_arm_has_the_inertia_of_its_row():
    phi = build_arm(MEAN_MAN, "right").phi[:10]
    mass, lever = 73.0 * 0.0271, 0.5772 * 0.2817
    about_x = mass * ((0.285 * 0.2817) ** 2 + lever**2)
    about_y = mass * ((0.269 * 0.2817) ** 2 + lever**2)
    about_z = mass * (0.158 * 0.2817) ** 2
    np.testing.assert_allclose(phi, [mass, 0, 0, -mass * lever, about_x, 0, about_y, 0, 0, about_z], atol=1e-12)
