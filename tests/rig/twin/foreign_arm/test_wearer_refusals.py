"""An unusable model or map is refused in one line that names place, value, allowed values and next step."""

from collections.abc import Callable
from pathlib import Path

import pytest

from exograv.errors import ConfigError, ExogravError
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.model.description import RigDescription, load_rig
from exograv.rig.twin import read_wearer_model
from exograv.rig.twin.foreign_arm.wearer_file import SIZE_MAX

EXAMPLES = Path(__file__).parents[4] / "examples" / "wearers"
MODEL = (EXAMPLES / "rajagopal.xml").read_text(encoding="utf-8")
MAP = (EXAMPLES / "rajagopal.toml").read_text(encoding="utf-8")


@pytest.fixture
def refusal(tmp_path: Path, rig: RigDescription, monkeypatch) -> Callable[..., str]:
    """Function that returns the message of the refusal of a model and a map, given as texts."""
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log of its warnings where it runs

    def refusal(model: str = MODEL, told: str = MAP, description: RigDescription = rig) -> str:
        (tmp_path / "model.xml").write_text(model, encoding="utf-8")
        (tmp_path / "map.toml").write_text(told, encoding="utf-8")
        with pytest.raises(ExogravError) as caught:
            read_wearer_model(tmp_path / "model.xml", tmp_path / "map.toml", description)
        message = str(caught.value)
        assert "\n" not in message
        return message

    return refusal


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"arm_flex_r"', '"arm_flex_l"', ("no joint 'arm_flex_l'", "arm_flex_r, arm_add_r")),
        ('"humerus"', '"humerous"', ("no body 'humerous'", "torso, humerus, ulna")),
        ('upper_arm = "humerus"', 'upper_arm = "torso"', ("'torso'", "not part of the arm")),
        ('upper_arm = "humerus"', 'upper_arm = "hand"', ("segments.upper_arm", "moves with the forearm")),
        ('elbow = { joint = "elbow_flex_r" }', "", ("freedoms.elbow is missing",)),
        ('flexion = { joint = "arm_flex_r" }', "", ("freedoms.flexion is missing",)),
        ('"arm_add_r", sign = -1', '"arm_add_r", sign = 1', ("freedoms.abduction", "180°", "Turn its sign")),
        ('"arm_flex_r"', '"arm_flex_r", sign = 2', ("sign",)),
        ('"arm_rot_r" }', '"arm_rot_r" }\nforearm_roll = { joint = "pro_sup_r" }', ("does not move forearm_roll",)),
        ("pro_sup_r = 90.0", "", ("more joints than the map names", "pro_sup_r")),
        ("pro_sup_r = 90.0", "pro_sup_r = 90.0\nelbow_flex_r = 0.0", ("elbow_flex_r", "named twice")),
        ('side = "right"', 'side = "left"', ("left arm", "holds the right one", "--side")),
        ('side = "right"', 'side = "middle"', ("side", "'middle'")),
        ('left = "-z"', 'left = "z"', ("right-handed",)),
        ('up = "y"', 'up = "w"', ("up",)),
        (
            'forward = "x"\nleft = "-z"\nup = "y"',
            'forward = "-x"\nleft = "-z"\nup = "-y"',
            ("does not hang", "zero_deg"),
        ),
        ("height_m = 1.70", "height_m = 170", ("height_m", "170")),
        ('sex = "male"', "", ("body.sex",)),
        ('side = "right"', 'side = "right"\nmass_scale = 1000.0', ("weighs", "mass_scale")),
        ('side = "right"', 'side = "right"\nmuscles = true', ("muscles",)),
        ("[locked]", "[locked", ("not valid TOML",)),
    ],
)
def test_a_map_that_does_not_fit_is_refused(refusal, old: str, new: str, words: tuple[str, ...]):
    assert old in MAP
    message = refusal(told=MAP.replace(old, new))
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<worldbody>", "<worldbodies>", ("MuJoCo cannot compile",)),
        ('pos="0.013144 -0.286273 -0.009595"', 'pos="13.144 -286.273 -9.595"', ("upper_arm is 287 m", "units")),
        ('axis="0 0 1" range="-90 90"', 'axis="0 1 0" range="-90 90"', ("freedoms.flexion", "90°")),
        ('mass="2.0325"', 'mass="-2.0325"', ("'humerus' weighs -2.0325 kg",)),
        ('mass="2.0325"', 'mass="nan"', ("'humerus' weighs nan kg",)),
        ('"0.011946 0.004121 0.013409"', '"119.46 41.21 134.09"', ("'humerus' weighs 2.03 kg", "0.5 m", "units")),
        ('axis="0.2260 0.0223 0.9739" range="0 150"', 'type="slide"', ("freedoms.elbow", "slides")),
    ],
)
def test_a_model_that_cannot_be_an_arm_is_refused(refusal, old: str, new: str, words: tuple[str, ...]):
    assert old in MODEL
    message = refusal(model=MODEL.replace(old, new, 1))
    for word in words:
        assert word in message


def test_a_machine_that_moves_more_than_the_map_names_is_refused(refusal):
    message = refusal(description=load_rig("recupera_like_7"))
    assert "no joint for forearm_roll" in message


def test_a_machine_for_both_arms_takes_no_single_arm(refusal):
    assert "holds the right and left one" in refusal(description=load_rig("recupera_like_dual"))


def test_a_wrist_that_nobody_told_is_asked_for(tmp_path: Path, rig):
    told = (EXAMPLES / "arm26.toml").read_text(encoding="utf-8")
    (tmp_path / "map.toml").write_text(told[: told.index("[points.wrist]")], encoding="utf-8")
    with pytest.raises(ExogravError, match="the wrist is unknown"):
        read_wearer_model(EXAMPLES / "arm26.xml", tmp_path / "map.toml", rig)


def test_files_that_are_too_large_or_no_text_or_not_there_are_refused(tmp_path: Path, rig):
    large, binary = tmp_path / "large.xml", tmp_path / "binary.xml"
    with large.open("wb") as file:
        file.truncate(SIZE_MAX + 1)
    binary.write_bytes(b"\x80\xff\xfe")
    for path, words in ((large, "larger than"), (binary, "not a text file"), (tmp_path / "none.xml", "cannot be read")):
        with pytest.raises(ConfigError, match=words):
            read_wearer_model(path, EXAMPLES / "arm26.toml", rig)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_wearer_model(EXAMPLES / "arm26.xml", tmp_path / "none.toml", rig)


@pytest.mark.parametrize(("model", "told"), [("arm26.xml", None), (None, "arm26.toml")])
def test_model_and_map_go_together(model: str | None, told: str | None):
    model, told = (str(EXAMPLES / name) if name else None for name in (model, told))
    with pytest.raises(ConfigError, match="needs its map, and a map needs its model"):
        draw_laboratory("recupera_like", None, 2, 0, model, told)
