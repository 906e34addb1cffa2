"""A URDF that could cause harm is refused with fault, place, allowed values and next step; any other is read."""

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.errors import ModelError
from exograv.model.description import load_rig
from exograv.model.tree import is_physical
from exograv.model.urdf import SIZE_MAX_BYTES, read_urdf, root_of, tree_of

MACHINE = load_rig("recupera_like").urdf_path.read_text(encoding="utf-8")
PATIENCE_S = 5.0  # far above the 20 ms for a valid file; a hang takes minutes
PARITY = 1e-12

YOKE = '<mass value="1.68"/>'
YOKE_INERTIA = 'ixx="0.003150"'
ELBOW_LIMIT = '<limit lower="0.0" upper="2.18" effort="30" velocity="3.0"/>'
ELBOW_ORIGIN = '<origin xyz="0 0 -0.29" rpy="0 0 0"/>'
MOUNT_END = '<child link="calibration_mount"/>'


def replaced(*pairs: tuple[str, str]) -> str:
    text = MACHINE
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def read(folder: Path, text: str | bytes):
    path = folder / "machine.urdf"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
    return read_urdf(path)


def refusal(folder: Path, text: str | bytes) -> str:
    with pytest.raises(ModelError) as caught:
        read(folder, text)
    return str(caught.value)


BILLION_LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a "ha">'
    + "".join(f'<!ENTITY a{i} "{"&a" + str(i - 1) + ";" if i else "&a;"}{"&a;" * 9}">' for i in range(9))
    + ']><robot name="&a8;"/>'
)
EXTERNAL_ENTITY = '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/hostname">]><robot name="&x;"/>'

REFUSED = {
    "two parents": (
        replaced(
            (
                "</robot>",
                '<joint name="j" type="fixed"><parent link="base"/><child link="forearm_cuff"/></joint></robot>',
            )
        ),
        "'forearm_cuff' has the parents 'base' and 'forearm_exo'",
    ),
    "a ring": (
        replaced(('<parent link="upper_arm_exo"/>', '<parent link="calibration_mount"/>')),
        "joint 'elbow_flexion' leads back to 'forearm_exo'; the links form a ring: forearm_exo, calibration_mount. Cut",
    ),
    "a ring of all links": (
        '<robot name="o"><link name="a"/><link name="b"/>'
        '<joint name="1" type="fixed"><parent link="a"/><child link="b"/></joint>'
        '<joint name="2" type="fixed"><parent link="b"/><child link="a"/></joint></robot>',
        "the links form a ring",
    ),
    "two roots": (replaced(('<link name="base"/>', '<link name="base"/><link name="loose"/>')), "base, loose"),
    "a joint to nowhere": (replaced((MOUNT_END, '<child link="hand"/>')), "names link 'hand'. Links there: base"),
    "a joint from nowhere": (replaced((MOUNT_END, "")), "joint 'calibration_mount_mount' has no <child"),
    "two links of one name": (
        replaced(('<link name="shoulder_centre"/>', '<link name="shoulder_centre"/><link name="shoulder_centre"/>')),
        "more than one link is called 'shoulder_centre'",
    ),
    "two joints of one name": (
        replaced(('<joint name="forearm_cuff_mount"', '<joint name="upper_arm_cuff_mount"')),
        "more than one joint is called 'upper_arm_cuff_mount'",
    ),
    "a link without name": (replaced(('<link name="shoulder_centre"/>', "<link/>")), "a <link> has no name"),
    "no mass": (replaced((YOKE, '<mass value="0"/>')), "'shoulder_yoke' weighs 0.0 kg; it must be positive"),
    "negative mass": (replaced((YOKE, '<mass value="-1.68"/>')), "'shoulder_yoke' weighs -1.68 kg"),
    "mass that is no number": (replaced((YOKE, '<mass value="nan"/>')), "mass of link 'shoulder_yoke': value is 'nan'"),
    "mass in words": (replaced((YOKE, '<mass value="light"/>')), "value is 'light'"),
    "mass with digit groups": (replaced((YOKE, '<mass value="1_68"/>')), "value is '1_68'"),
    "infinite mass": (replaced((YOKE, '<mass value="inf"/>')), "value is 'inf'"),
    "overflowing mass": (replaced((YOKE, '<mass value="1e300"/>')), "a number between ±1e+06 is needed"),
    "overflowing centre": (replaced(("-0.07 -0.105 0", "1e200 0 0")), "three numbers between ±1e+06 are needed"),
    "no mass at all": (replaced((YOKE, "")), "<inertial> of link 'shoulder_yoke' needs both <mass> and <inertia>"),
    "unphysical inertia": (
        replaced((YOKE_INERTIA, 'ixx="0.5"')),
        "no body has the inertia of link 'shoulder_yoke': principal moments 0.004718, 0.0056, 0.5 kg·m²",
    ),
    "negative inertia": (replaced((YOKE_INERTIA, 'ixx="-0.001"')), "Each must be positive and smaller than the sum"),
    "large product of inertia": (
        replaced(('ixy="0"', 'ixy="0.01"')),
        "no body has the inertia of link 'shoulder_yoke'",
    ),
    "moving link without inertial": (
        '<robot name="o"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/>'
        '<child link="b"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>',
        "link 'b' moves but has no <inertial>",
    ),
    "no limits": (replaced((ELBOW_LIMIT, "")), "joint 'elbow_flexion' has no <limit>. Give effort and velocity"),
    "limit without effort": (replaced((' effort="30"', "")), "limit of joint 'shoulder_rotation': effort is None"),
    "no effort": (replaced(('effort="60"', 'effort="0"')), "must be positive"),
    "swapped limits": (replaced(('lower="0.0" upper="2.18"', 'lower="2.18" upper="0.0"')), "Are they swapped?"),
    "degrees": (replaced(('lower="0.0" upper="2.18"', 'lower="0" upper="125"')), "Are these degrees?"),
    "unknown joint type": (
        replaced(('name="elbow_flexion" type="revolute"', 'name="elbow_flexion" type="floating"')),
        "joint 'elbow_flexion' is of type 'floating'; allowed: fixed, revolute, continuous, prismatic",
    ),
    "joint without type": (replaced(('name="elbow_flexion" type="revolute"', 'name="elbow_flexion"')), "is of type ''"),
    "mimic": (
        replaced(('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1"/><mimic joint="elbow_flexion"/>')),
        "joint 'shoulder_rotation' mimics another",
    ),
    "long axis": (replaced(('<axis xyz="0 0 1"/>', '<axis xyz="0 0 2"/>')), "has length 2; it must be 1"),
    "axis of two numbers": (replaced(('<axis xyz="0 0 1"/>', '<axis xyz="0 1"/>')), "xyz is '0 1'; three numbers"),
    "origin with NaN": (replaced((ELBOW_ORIGIN, '<origin xyz="0 0 nan"/>')), "xyz is '0 0 nan'"),
    "nothing that moves": ('<robot name="o"><link name="a"/></robot>', "no moving joint"),
    "no XML": ("joint: shoulder", "is not valid XML"),
    "cut off": (MACHINE[: len(MACHINE) // 2], "is not valid XML"),
    "empty": ("", "is not valid XML"),
    "another XML": ("<mujoco/>", "starts with <mujoco>; a URDF starts with <robot>"),
    "latin-1": (MACHINE.replace("Recupera-like", "Récupéra").encode("latin-1"), "is not UTF-8"),
    "UTF-16": (MACHINE.encode("utf-16"), "is not UTF-8"),
    "a zero byte": (MACHINE.replace("hanging", "\0"), "is not valid XML"),
    "too large": (MACHINE + " " * SIZE_MAX_BYTES, "more than the 1000000 bytes allowed"),
    "a billion laughs": (BILLION_LAUGHS, "document type or entities"),
    "an external entity": (EXTERNAL_ENTITY, "document type or entities"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_could_hurt_later_is_refused_with_its_place(name: str, tmp_path: Path):
    text, expected = REFUSED[name]
    message = refusal(tmp_path, text)
    assert expected in message
    assert message.startswith("machine.urdf")
    assert message.count(". ") + message.count("? ") >= 1 or message.endswith("?"), "nothing says what to do next"


def test_a_file_that_is_not_there_is_refused_with_its_path(tmp_path: Path):
    with pytest.raises(ModelError, match=r"absent\.urdf cannot be read: No such file"):
        read_urdf(tmp_path / "absent.urdf")


def test_a_chain_of_thousands_of_fixed_links_is_read_or_refused_but_not_a_crash(tmp_path: Path):
    links = 3000
    chain = "".join(
        f'<link name="l{i}"/><joint name="f{i}" type="fixed"><parent link="{f"l{i - 1}" if i else "b"}"/>'
        f'<child link="l{i}"/></joint>'
        for i in range(links)
    )
    body = '<robot name="o"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/>'
    joint = '<child link="b"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    assert "link 'b' moves but has no <inertial>" in refusal(tmp_path, f"{body}{joint}{chain}</robot>")


def test_as_many_links_as_fit_into_a_file_take_no_quadratic_time(tmp_path: Path):
    started = time.perf_counter()
    refusal(tmp_path, '<robot name="o">' + "".join(f'<link name="{i}"/>' for i in range(45_000)) + "</robot>")
    assert time.perf_counter() - started < PATIENCE_S


def test_a_fixed_link_without_inertial_is_a_massless_frame(tmp_path: Path):
    tree = read(tmp_path, MACHINE)
    bare = read(tmp_path, MACHINE.replace('<link name="calibration_mount"/>', "").replace(_mount_joint(), ""))
    np.testing.assert_array_equal(tree.phi, bare.phi)
    assert tree.frame("calibration_mount").body == tree.index("elbow_flexion")


def _mount_joint() -> str:
    start = MACHINE.index('<joint name="calibration_mount_mount"')
    return MACHINE[start : MACHINE.index("</joint>", start) + len("</joint>")]


def test_a_weight_fixed_to_a_link_is_the_same_as_a_heavier_link(tmp_path: Path):
    weight = (
        '<inertial><mass value="2.0"/><inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    loaded = read(
        tmp_path,
        replaced(('<link name="calibration_mount"/>', f'<link name="calibration_mount">{weight}</link>')),
    )
    bare = read(tmp_path, MACHINE)
    added = loaded.phi[3] - bare.phi[3]
    p = bare.frame("calibration_mount").p_body_frame
    steiner = 2.0 * (p @ p * np.eye(3) - np.outer(p, p)) + np.diag([0.01, 0.02, 0.02])
    moments = [steiner[0, 0], steiner[0, 1], steiner[1, 1], steiner[0, 2], steiner[1, 2], steiner[2, 2]]
    np.testing.assert_allclose(added, [2.0, *(2.0 * p), *moments], atol=PARITY)
    np.testing.assert_array_equal(loaded.phi[:3], bare.phi[:3])


def test_a_moving_link_may_carry_its_mass_on_a_fixed_one(tmp_path: Path):
    text = (
        '<robot name="o"><link name="a"/><link name="b"/><link name="c"><inertial><origin xyz="0 0 -0.1"/>'
        '<mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/><limit effort="1" velocity="1"/></joint>'
        '<joint name="f" type="fixed"><parent link="b"/><child link="c"/></joint></robot>'
    )
    tree = read(tmp_path, text)
    np.testing.assert_allclose(tree.phi[0, :4], [1.0, 0.0, 0.0, -0.1])
    assert (tree.joints[0].lower, tree.joints[0].upper) == (-np.inf, np.inf)


@given(
    places=st.lists(st.integers(0, len(MACHINE.encode()) - 1), min_size=1, max_size=6),
    values=st.binary(min_size=6, max_size=6),
    cut=st.one_of(st.none(), st.integers(0, len(MACHINE.encode()))),
)
@settings(max_examples=250)
def test_changed_bytes_give_a_physical_tree_or_a_model_error(
    places: list[int], values: bytes, cut: int | None, tmp_path_factory: pytest.TempPathFactory
):
    data = bytearray(MACHINE.encode("utf-8"))
    for place, value in zip(places, values, strict=False):
        data[place] = value
    folder = tmp_path_factory.getbasetemp()
    started = time.perf_counter()
    try:
        tree = read(folder, bytes(data[:cut]))
    except ModelError:
        pass
    else:
        assert all(is_physical(phi) for phi in tree.phi)
    assert time.perf_counter() - started < PATIENCE_S


NUMBERS = st.one_of(st.floats(), st.sampled_from(["", "nan", "-inf", "1e999", "0x10", "1,5", "٣", "1e-320", "1_0"]))
QUOTED = MACHINE.split('"')[5::2]


@given(which=st.integers(0, len(QUOTED) - 1), value=NUMBERS)
@settings(max_examples=250)
def test_any_attribute_with_any_number_gives_a_physical_tree_or_a_model_error(
    which: int, value: float | str, tmp_path_factory: pytest.TempPathFactory
):
    pieces = MACHINE.split('"')
    pieces[5 + 2 * which] = str(value)
    try:
        tree = read(tmp_path_factory.getbasetemp(), '"'.join(pieces))
    except ModelError:
        return
    assert all(is_physical(phi) for phi in tree.phi)
    assert all(np.isfinite(joint.p_parent_joint).all() for joint in tree.joints)


def test_joints_of_two_arms_stand_one_arm_after_the_other():
    names = read_urdf(load_rig("recupera_like_dual").urdf_path).joint_names
    assert [name.split("_")[0] for name in names] == ["right"] * 4 + ["left"] * 4
    assert [name.split("_", 1)[1] for name in names[:4]] == [name.split("_", 1)[1] for name in names[4:]]


def is_tree(count: int, joints: list[tuple[int, int]]) -> bool:
    """Return True if every link but one has one parent, and the way up from every link ends at that one."""
    parents = {child: parent for parent, child in joints}
    if len(joints) != len(parents) or len(parents) != count - 1:
        return False
    for link in range(count):
        for _ in range(count):
            link = parents.get(link, link)
        if link in parents:
            return False
    return True


@settings(max_examples=300)
@given(count=st.integers(2, 6), data=st.data())
def test_links_are_read_only_if_they_form_a_tree_and_the_reader_always_ends(count: int, data: st.DataObject):
    ends = st.tuples(st.integers(0, count - 1), st.integers(0, count - 1))
    joints = data.draw(st.lists(ends, min_size=count - 2, max_size=count))
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    text = "".join(f'<link name="{link}">{inertial}</link>' for link in range(count)) + "".join(
        f'<joint name="j{number}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
        '<limit effort="1" velocity="1"/></joint>'
        for number, (parent, child) in enumerate(joints)
    )
    robot = root_of(f"<robot name='o'>{text}</robot>", "o.urdf")
    if is_tree(count, joints):
        assert len(tree_of(robot, Path("o.urdf")).joints) == count - 1
    else:
        with pytest.raises(ModelError, match="not a tree"):
            tree_of(robot, Path("o.urdf"))
