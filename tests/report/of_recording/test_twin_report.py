"""The page of a fitted twin says what its recordings tell, and what they do not."""

from dataclasses import replace
from pathlib import Path

from exograv.report.figures.twin_fit_data import (
    AxisInertia,
    ExpectedGain,
    FittedParameter,
    FurtherMotion,
    GearFigures,
    JointFriction,
    JointResiduals,
    LawScore,
    TwinFigures,
    WarmGain,
)
from exograv.report.of_recording.twin_report import SIMULATED_MACHINE, headline, write_twin_report

JOINTS = ("shoulder_flexion", "elbow_flexion")
FIGURES = TwinFigures(
    rig="two_joints",
    side="right",
    recordings=["a.mcap"],
    recorded_s=60.0,
    held_out_s=12.0,
    is_simulated=True,
    held_out=[
        JointResiduals("shoulder_flexion", "stribeck", 0.21, 0.2, 1.05, 0.05, 0.2, 30.0),
        JointResiduals("elbow_flexion", "coulomb-viscous", 0.3, 0.2, 1.5, 0.1, 0.25, 30.0),
    ],
    friction=[
        JointFriction(
            joint,
            law,
            [-1.0, -0.1, 0.1, 1.0],
            [-2.0, -1.0, 1.0, 2.0],
            [(-2.1, -1.9), (-1.1, -0.9), (0.9, 1.1), (1.9, 2.1)],
            [0.5],
            [1.6],
            [LawScore("coulomb-viscous", 0.0, 0.0), LawScore("stribeck", 0.015, 0.004)],
        )
        for joint, law in zip(JOINTS, ("stribeck", "coulomb-viscous"), strict=True)
    ],
    parameters=[
        FittedParameter(joint, name, "-", 1.0, (1.0 - 0.1 * left, 1.0 + 0.1 * left), 0.9, 0.05, 1.0 - left)
        for joint in JOINTS
        for name, left in (("inverse_gain", 0.05), ("rotor", 0.5), ("offset", 0.9))
    ],
    axis_inertia=[AxisInertia(joint, 0.5, (0.4, 0.6)) for joint in JOINTS],
    delay_ms=None,
    delay_ci95_ms=None,
    bandwidth_Hz=[None, None],
    gears=[GearFigures("elbow_flexion", 0.08, (0.07, 0.09))],
    has_motor_encoders=True,
    gain_by_temperature=[WarmGain(joint, None, None, None) for joint in JOINTS],
    cuffs=[],
    warnings=["The residual of joint 'elbow_flexion' is large."],
    further_motion=["Record the elbow creeping."],
    designed_motion=FurtherMotion(Path("further_motion.toml"), 30.0, [ExpectedGain("elbow_flexion", "rotor", 0.5)]),
)


def page(tmp_path: Path, figures: TwinFigures = FIGURES) -> str:
    return write_twin_report(figures, tmp_path / "twin.html").read_text(encoding="utf-8")


def test_the_headline_names_the_worst_joint():
    assert "1.50 times the noise" in headline(FIGURES)
    assert "elbow flexion is the worst joint" in headline(FIGURES)


def test_the_gain_by_temperature_is_shown_with_its_interval_or_as_not_told(tmp_path: Path):
    assert "Gain by temperature is not told by these recordings: they hold none." in page(tmp_path)
    steady = WarmGain("shoulder_flexion", None, None, (30.0, 32.0))
    text = page(tmp_path, replace(FIGURES, gain_by_temperature=[steady]))
    assert "not told by these recordings: their temperatures varied too little." in text
    told = WarmGain("elbow_flexion", -0.21, (-0.25, -0.17), (25.0, 61.0))
    text = page(tmp_path, replace(FIGURES, gain_by_temperature=[steady, told]))
    for part in ("25 to 61 °C", "-0.21 %/°C", "-0.25 to -0.17", "30 to 32 °C", "not told"):
        assert part in text


def test_parameters_are_sorted_by_what_the_recordings_tell(tmp_path: Path):
    text = page(tmp_path)
    assert "Told by the recordings: gain (inverse) (shoulder flexion 95%, elbow flexion 95%)." in text
    assert "Told in part: rotor inertia" in text
    assert "Not told: the values are those of the data sheet: encoder offset" in text


def test_the_chosen_law_has_a_mark_and_the_others_have_their_scores(tmp_path: Path):
    assert "<td>0.015 ± 0.004 ✓</td>" in page(tmp_path)
    assert "<td>0.015 ± 0.004</td>" in page(tmp_path)


def test_warnings_and_further_motion_are_on_the_page(tmp_path: Path):
    text = page(tmp_path)
    assert "elbow_flexion&#39; is large" in text
    assert "Record the elbow creeping." in text
    assert "target not reached" in text


def test_only_a_page_of_a_simulated_machine_says_so(tmp_path: Path):
    assert SIMULATED_MACHINE in page(tmp_path)
    assert "SIMULATED" not in page(tmp_path, replace(FIGURES, is_simulated=False))
