"""An OpenSim file of an arm is the same arm as an MJCF of it, in both layouts of OpenSim."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.rig.twin.foreign_arm.osim_text import (
    Coordinate,
    Layout,
    Model,
    Part,
    TransformAxis,
    coupling,
    linear,
    osim,
    spline,
)

from exograv.errors import ModelError
from exograv.model.description import load_rig
from exograv.rig.twin import WearerModel, read_wearer_model
from exograv.rig.twin.foreign_arm.opensim.document import read_opensim
from exograv.rig.twin.foreign_arm.opensim.kinematics import OsimKinematics
from exograv.rig.twin.foreign_arm.opensim_specification import arm_specification
from exograv.rig.twin.foreign_arm.wearer_file import compile_wearer, open_wearer_file
from exograv.rig.twin.foreign_arm.wearer_map import WearerMap, read_wearer_map

EXAMPLES = Path(__file__).parents[4] / "examples" / "wearers"
SAME = 1e-6  # N·m, m, kg, -: the claim of the docs; the errors are those of double precision
SHIPPED = {"arm26": "recupera_like", "rajagopal": "recupera_like", "rajagopal_7": "recupera_like_7"}


def shipped(told: str) -> Path:
    return EXAMPLES / f"{told.removesuffix('_7')}.xml"


def opensim_of(path: Path) -> Model:
    """Rewrite an MJCF whose bodies are parallel and whose hinges meet in the origins of the bodies."""
    own = mujoco.MjModel.from_xml_path(str(path))
    parts = []
    for body in range(1, own.nbody):
        assert np.allclose(own.body_quat[body], [1.0, 0.0, 0.0, 0.0])
        first, count = int(own.body_jntadr[body]), int(own.body_jntnum[body])
        joints = range(first, first + count)
        axes = [TransformAxis(own.joint(j).name, tuple(own.jnt_axis[j])) for j in joints]
        R = Rotation.from_quat(np.roll(own.body_iquat[body], -1)).as_matrix()
        inertia = (R * own.body_inertia[body]) @ R.T
        parts.append(
            Part(
                own.body(body).name,
                own.body(own.body_parentid[body]).name if own.body_parentid[body] else "ground",
                tuple(own.body_pos[body]),
                mass=float(own.body_mass[body]),
                com=tuple(own.body_ipos[body]),
                inertia=[*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]],
                kind="CustomJoint" if axes else "WeldJoint",
                coordinates=[Coordinate(axis.coordinate) for axis in axes],
                axes=axes,
            )
        )
    return Model(parts)


def compiled(text: str, told: WearerMap, folder: Path) -> tuple[mujoco.MjModel, mujoco.MjData, tuple[str, ...]]:
    path = folder / "model.osim"
    path.write_text(text, encoding="utf-8")
    model, notes = compile_wearer(open_wearer_file(path), told)
    return model, mujoco.MjData(model), notes


def put(model: mujoco.MjModel, data: mujoco.MjData, posture: Mapping[str, float]) -> None:
    """Put joints at their angles, and other joints that follow where their polynomials say."""
    data.qpos[:] = model.qpos0
    for name, value in posture.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    for k in range(model.neq):
        led, leader = (model.jnt_qposadr[one[k]] for one in (model.eq_obj1id, model.eq_obj2id))
        moved = data.qpos[leader] - model.qpos0[leader]
        if model.joint(model.eq_obj1id[k]).name in posture:
            continue
        data.qpos[led] = model.qpos0[led] + np.polyval(model.eq_data[k, :5][::-1], moved)
    mujoco.mj_forward(model, data)


@pytest.mark.parametrize("layout", [3, 4])
@pytest.mark.parametrize("told", SHIPPED)
def test_at_any_posture_axes_and_gravity_torque_are_those_of_the_shipped_arm(tmp_path: Path, told: str, layout: Layout):
    own = mujoco.MjModel.from_xml_path(str(shipped(told)))
    mapped = read_wearer_map(EXAMPLES / f"{told}.toml")
    model, data, _ = compiled(osim(opensim_of(shipped(told)), layout), mapped, tmp_path)
    model.opt.gravity[:] = own.opt.gravity[:] = [0.0, -9.81, 0.0]
    theirs, generator = mujoco.MjData(own), np.random.default_rng(0)
    names = [own.joint(j).name for j in range(own.njnt)]
    for _ in range(5):
        posture = dict(zip(names, generator.uniform(-1.5, 1.5, len(names)), strict=True))
        put(own, theirs, posture)
        put(model, data, posture)
        for name in names:
            ours, other = model.joint(name).id, own.joint(name).id
            np.testing.assert_allclose(data.xaxis[ours], theirs.xaxis[other], atol=SAME)
            np.testing.assert_allclose(data.xanchor[ours], theirs.xanchor[other], atol=SAME)
            torques = [d.qfrc_bias[m.jnt_dofadr[j]] for m, d, j in ((model, data, ours), (own, theirs, other))]
            assert torques[0] == pytest.approx(torques[1], abs=SAME)


def assert_same_arm(found: WearerModel, expected: WearerModel) -> None:
    assert found.skeleton.lengths == pytest.approx(expected.skeleton.lengths, abs=SAME)
    for bone, other in zip(found.skeleton.bones, expected.skeleton.bones, strict=True):
        assert bone.mass == pytest.approx(other.mass, abs=SAME)
        np.testing.assert_allclose(bone.com, other.com, atol=SAME)
        np.testing.assert_allclose(bone.inertia, other.inertia, atol=SAME)
        for joint, like in zip(bone.joints, other.joints, strict=True):
            assert joint.name == like.name
            np.testing.assert_allclose(joint.axis, like.axis, atol=SAME)


@pytest.mark.parametrize("layout", [3, 4])
@pytest.mark.parametrize("told", SHIPPED)
def test_the_shipped_arm_in_an_opensim_file_is_the_shipped_arm(tmp_path: Path, told: str, layout: Layout):
    rig, path = load_rig(SHIPPED[told]), tmp_path / "model.osim"
    path.write_text(osim(opensim_of(shipped(told)), layout), encoding="utf-8")
    found = [read_wearer_model(one, EXAMPLES / f"{told}.toml", rig) for one in (path, shipped(told))]
    assert_same_arm(*found)
    assert found[0].sha256 != found[1].sha256


def test_an_opensim_arm_written_as_mjcf_is_read_back_as_the_same_arm(tmp_path: Path, rig):
    model = opensim_of(shipped("rajagopal")).with_part("ulna", turned=(0.1, 0.2, -0.1), own_turned=(0.1, 0.2, -0.1))
    text, mapped = osim(model), read_wearer_map(EXAMPLES / "rajagopal.toml")
    (tmp_path / "model.osim").write_text(text, encoding="utf-8")
    spec, _ = arm_specification(read_opensim(text, tmp_path / "model.osim"), mapped)
    spec.compile()
    (tmp_path / "model.xml").write_text(spec.to_xml(), encoding="utf-8")
    told = EXAMPLES / "rajagopal.toml"
    assert_same_arm(*(read_wearer_model(tmp_path / f"model.{end}", told, rig) for end in ("osim", "xml")))


CHAIN_MAP = WearerMap.model_validate(
    {
        "title": "chain",
        "side": "right",
        "forward": "x",
        "left": "-z",
        "up": "y",
        "lock_others": True,
        "body": {"height_m": 1.75, "mass_kg": 75.0, "sex": "male"},
        "segments": {"upper_arm": "upper", "forearm": "lower", "hand": "last"},
        "shoulder": {"joints": ["one", "two", "three"]},
        "freedoms": {"elbow": {"joint": "bend"}},
    }
)
TURNED = {"turned": (0.3, -0.2, 0.5), "own_turned": (-0.4, 0.1, 0.2), "own_at": (0.01, 0.02, -0.03)}
SOLID = {"mass": 1.2, "com": (0.01, -0.1, 0.02), "inertia": (0.01, 0.008, 0.012, 0.001, -0.0005, 0.0007)}
PARABOLA = "<PolynomialFunction><coefficients>0.1 0.05 0</coefficients></PolynomialFunction>"
BENDS = spline([-2.0, -1.0, 0.0, 1.0, 2.0], [0.05, 0.02, 0.0, 0.01, 0.03])


def chain(default: float = 0.0) -> Model:
    """Arm with oblique frames, a joint that slides as it bends, and a last body that follows the elbow."""
    first = [
        TransformAxis("one", (0.6, 0.2, 0.8)),
        TransformAxis("two", (0.1, 1.0, 0.1), linear(-1.0, 0.3)),
        TransformAxis("three", (0.0, 0.3, 1.0)),
        TransformAxis("", (0.0, 0.0, 1.0), "<Constant><value>0.04</value></Constant>", "translation3"),
    ]
    second = [
        TransformAxis("bend", (0.02, 0.01, 0.0873)),
        TransformAxis("bend", (1.0, 1.0, 0.0), BENDS, "translation1"),
        TransformAxis("bend", (0.0, 1.0, 0.0), PARABOLA),
    ]  # fmt: skip
    return Model(
        [
            Part("upper", "ground", (0.1, 0.2, 0.3), **TURNED, **SOLID, axes=first,
                 coordinates=[Coordinate(name, default) for name in ("one", "two", "three")]),
            Part("lower", "upper", (0.0, -0.3, 0.0), **TURNED, **SOLID, axes=second,
                 coordinates=[Coordinate("bend", default)]),
            Part("last", "lower", (0.0, -0.25, 0.0), **TURNED, **SOLID, kind="PinJoint",
                 coordinates=[Coordinate("follow", 0.7)]),
        ],
        couplings=[coupling("follow", "bend", linear(-0.5, 0.1))],
    )  # fmt: skip


# Posture of the chain, and what OpenSim 4.6 (package `opensim` of PyPI) computes there: origins of the bodies and their
# y axes on the ground, and the torque that holds the arm against gravity. The spline has a node here.
POSTURE = {"one": 0.5, "two": -0.3, "three": 0.8, "bend": 1.0}
AT_NODE = {"lower_joint_translation1": 0.01}
PLACES = {
    "upper": ([0.128908322594, 0.183668520092, 0.341830608866], [-0.636333304954, -0.015781959096, 0.771252782669]),
    "lower": ([0.337578778096, 0.220100188938, 0.107894842488], [0.378329048718, -0.7896667157, 0.48300477121]),
    "last": ([0.243902814097, 0.440434969534, -0.042418813666], [0.827253263323, -0.269475018856, 0.49298605714]),
}
TORQUES = {"one": 6.874627388581, "two": 4.216137077646, "three": 6.290016653646, "follow": 0.776945546219}
ROUNDED = 1e-10  # m, -, N·m: the digits above, with the error of double precision


@pytest.mark.parametrize("layout", [3, 4])
def test_bodies_and_gravity_torques_are_those_that_opensim_computes(tmp_path: Path, layout: Layout):
    text = osim(chain(0.2), layout)
    model, data, _ = compiled(text, CHAIN_MAP, tmp_path)
    model.opt.gravity[:] = [0.0, -9.80665, 0.0]
    put(model, data, {**POSTURE, **AT_NODE})
    kinematics = OsimKinematics(read_opensim(text, Path("model.osim")))
    for body, (origin, y) in PLACES.items():
        T = kinematics.pose(body, POSTURE)
        np.testing.assert_allclose(T[:3, 3], origin, atol=ROUNDED)
        np.testing.assert_allclose(T[:3, 1], y, atol=ROUNDED)
        np.testing.assert_allclose(data.body(body).xpos, origin, atol=ROUNDED)
        np.testing.assert_allclose(data.body(body).xmat.reshape(3, 3)[:, 1], y, atol=ROUNDED)
    for joint, torque in TORQUES.items():
        assert data.qfrc_bias[model.joint(joint).dofadr[0]] == pytest.approx(torque, abs=ROUNDED)


FIT = 0.002  # m, and the same in rad at these lengths: the largest error that a fitted spline may have


@pytest.mark.parametrize("layout", [3, 4])
def test_mujoco_has_the_bodies_where_opensims_definition_has_them(tmp_path: Path, layout: Layout):
    text = osim(chain(0.2), layout)
    model, data, _ = compiled(text, CHAIN_MAP, tmp_path)
    kinematics, generator = OsimKinematics(read_opensim(text, Path("model.osim"))), np.random.default_rng(0)
    for _ in range(5):
        posture = {name: float(generator.uniform(-1.5, 1.5)) for name in ("one", "two", "three", "bend")}
        put(model, data, posture)
        for body in ("upper", "lower", "last"):
            T = kinematics.pose(body, posture)
            tolerance = SAME if body == "upper" else FIT
            np.testing.assert_allclose(data.body(body).xpos, T[:3, 3], atol=tolerance)
            np.testing.assert_allclose(data.body(body).xmat.reshape(3, 3), T[:3, :3], atol=tolerance)


def test_the_default_posture_of_the_file_does_not_move_an_arm_at_a_posture(tmp_path: Path):
    posture = {"one": 0.5, "two": -0.3, "three": 0.8, "bend": 0.0}
    found = []
    for default in (0.0, -0.9):
        model = chain(default)
        parts = [replace(part, axes=[axis for axis in part.axes if axis.function != BENDS]) for part in model.parts]
        compiled_model, data, _ = compiled(osim(replace(model, parts=parts)), CHAIN_MAP, tmp_path)
        put(compiled_model, data, posture)
        found.append([data.xpos.copy(), data.xmat.copy(), data.qfrc_bias.copy()])
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=SAME)


@pytest.mark.parametrize(
    ("kind", "axes", "slides"),
    [
        ("PinJoint", [(0.0, 0.0, 1.0)], []),
        ("UniversalJoint", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], []),
        ("GimbalJoint", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)], []),
        ("BallJoint", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)], []),
        ("SliderJoint", [], [(1.0, 0.0, 0.0)]),
        ("PlanarJoint", [(0.0, 0.0, 1.0)], [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]),
        ("WeldJoint", [], []),
    ],
)
def test_a_joint_is_the_custom_joint_of_its_axes(kind: str, axes: list, slides: list):
    coordinates = [Coordinate(f"c{k}", 0.1 * (k + 1)) for k in range(len(axes) + len(slides))]
    transform = [TransformAxis(f"c{k}", axis) for k, axis in enumerate(axes)]
    transform += [
        TransformAxis(f"c{len(axes) + k}", axis, linear(), f"translation{k + 1}") for k, axis in enumerate(slides)
    ]
    own = Part("body", **TURNED, **SOLID, kind=kind, coordinates=coordinates)
    poses = [
        OsimKinematics(read_opensim(osim(Model([part])), Path("model.osim"))).pose("body")
        for part in (own, replace(own, kind="CustomJoint", axes=transform))
    ]
    np.testing.assert_allclose(poses[0], poses[1], atol=SAME)


def test_a_planar_joint_turns_before_it_slides_in_its_parent():
    coordinates = [Coordinate("turn", np.pi / 2), Coordinate("along", 0.3), Coordinate("across", 0.1)]
    document = read_opensim(osim(Model([Part("body", kind="PlanarJoint", coordinates=coordinates)])), Path("m.osim"))
    T = OsimKinematics(document).pose("body")
    np.testing.assert_allclose(T[:3, 3], [0.3, 0.1, 0.0], atol=SAME)
    np.testing.assert_allclose(T[:3, 0], [0.0, 1.0, 0.0], atol=SAME)


def test_a_frame_on_a_frame_on_a_body_counts_both():
    text = osim(Model([Part("body", at=(0.1, 0.0, 0.0), turned=(0.0, 0.0, np.pi / 2), kind="WeldJoint")]))
    inner = (
        '<PhysicalOffsetFrame name="inner"><socket_parent>ground_offset</socket_parent>'
        "<translation>0.2 0 0</translation><orientation>0 0 0</orientation></PhysicalOffsetFrame></frames>"
    )
    text = text.replace(">ground_offset</socket_parent_frame>", ">inner</socket_parent_frame>").replace(
        "</frames>", inner
    )
    T = OsimKinematics(read_opensim(text, Path("model.osim"))).pose("body")
    np.testing.assert_allclose(T[:3, 3], [0.1, 0.2, 0.0], atol=SAME)


def test_a_locked_coordinate_is_rigid_at_its_default_and_it_is_said(tmp_path: Path):
    part = chain().parts[2]
    model = replace(chain().with_part("last", coordinates=[replace(part.coordinates[0], locked=True)]), couplings=[])
    compiled_model, data, notes = compiled(osim(model), CHAIN_MAP, tmp_path)
    assert "Locked in the file, and rigid here: follow." in notes
    assert "follow" not in [compiled_model.joint(j).name for j in range(compiled_model.njnt)]
    put(compiled_model, data, {})
    T = OsimKinematics(read_opensim(osim(model), Path("model.osim"))).pose("last")
    np.testing.assert_allclose(data.body("last").xpos, T[:3, 3], atol=SAME)


def test_forces_muscles_and_other_constraints_are_left_out_and_it_is_said(tmp_path: Path):
    model = replace(
        chain(),
        forces='<CoordinateLimitForce name="a"/><SpringGeneralizedForce name="b"/><Thelen2003Muscle name="c"/>',
        couplings=[*chain().couplings, '<PointConstraint name="p"/>'],
    )
    notes = " ".join(compiled(osim(model), CHAIN_MAP, tmp_path)[2])
    assert "1 CoordinateLimitForce, 1 SpringGeneralizedForce, 1 Thelen2003Muscle" in notes
    assert "1 PointConstraint" in notes
    assert "lower_joint_translation1 (largest error" in notes


def test_a_coupling_that_is_switched_off_binds_nothing(tmp_path: Path):
    for switch in ("<isDisabled>true</isDisabled>", "<isEnforced>false</isEnforced>"):
        model = replace(chain(), couplings=[coupling("follow", "bend", linear(), switch)])
        compiled_model, data, _ = compiled(osim(model), CHAIN_MAP, tmp_path)
        put(compiled_model, data, {"bend": 1.0})
        assert data.qpos[compiled_model.joint("follow").qposadr[0]] == pytest.approx(0.7)


def test_what_follows_the_elbow_by_a_wild_function_is_refused_in_one_sentence(tmp_path: Path):
    wild = spline([-2.0, -1.0, 0.0, 0.5, 1.0, 2.0], [0.5, -0.5, 0.4, -0.6, 0.5, -0.5])
    with pytest.raises(ModelError, match=r"'follow' follows 'bend'.*allowed: 1 °") as caught:
        compiled(osim(replace(chain(), couplings=[coupling("follow", "bend", wild)])), CHAIN_MAP, tmp_path)
    assert "\n" not in str(caught.value)


def test_masses_that_do_not_move_with_the_arm_need_no_possible_inertia(tmp_path: Path):
    trunk = Part("trunk", mass=20.0, inertia=(1.0, 0.1, 0.1, 0.0, 0.0, 0.0), kind="WeldJoint")
    arm = chain().with_part("upper", parent="trunk")
    model, _, _ = compiled(osim(replace(arm, parts=[trunk, *arm.parts])), CHAIN_MAP, tmp_path)
    assert model.body("trunk").mass[0] < SAME
    with pytest.raises(ModelError, match=r"MuJoCo cannot compile .*inertia"):
        compiled(osim(chain().with_part("lower", inertia=trunk.inertia)), CHAIN_MAP, tmp_path)
