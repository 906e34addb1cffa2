"""Visual shapes of a URDF are drawn where the file has them; a mesh that cannot be drawn is replaced, with a reason."""

import base64
import shutil
import struct
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ModelError
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig, robots_folder
from exograv.model.scene import SceneDescription, describe_scene
from exograv.model.scene.visuals import mesh_file, read_stl

CORNERS = np.array(
    [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 2.0, 1.0]]]
)


def binary_stl(path: Path, corners: np.ndarray) -> None:
    rows = b"".join(struct.pack("<12fH", 0.0, 0.0, 1.0, *triangle.ravel(), 0) for triangle in corners)
    path.write_bytes(b"solid in name only".ljust(80) + struct.pack("<I", len(corners)) + rows)


def text_stl(path: Path, corners: np.ndarray) -> None:
    facets = "".join(
        "facet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in triangle)
        + "endloop\nendfacet\n"
        for triangle in corners
    )
    path.write_text(f"solid part\n{facets}endsolid part\n", encoding="utf-8")


def scene_with(folder: Path, visual: str) -> SceneDescription:
    """Picture of recupera_like with a visual on its last moving link."""
    machine = folder / "machine"
    if not machine.exists():
        shutil.copytree(robots_folder() / "recupera_like", machine)
    urdf = (robots_folder() / "recupera_like" / "right.urdf").read_text(encoding="utf-8")
    head = '<link name="forearm_exo">'
    assert head in urdf
    (machine / "right.urdf").write_text(urdf.replace(head, head + visual), encoding="utf-8")
    return describe_scene(load_rig(str(machine), "right"), Body(1.75, 75.0, "male"))


@pytest.mark.parametrize("write", [binary_stl, text_stl])
def test_a_mesh_file_is_read_in_both_forms(write, tmp_path: Path):
    write(tmp_path / "part.stl", CORNERS)
    np.testing.assert_allclose(read_stl(tmp_path / "part.stl"), CORNERS)


def test_a_file_that_is_no_mesh_is_refused(tmp_path: Path):
    (tmp_path / "part.stl").write_text("nothing", encoding="utf-8")
    with pytest.raises(ModelError, match="neither a binary nor a text STL"):
        read_stl(tmp_path / "part.stl")


def test_a_mesh_takes_the_place_of_the_simple_shapes_of_its_link(tmp_path: Path):
    scene = scene_with(tmp_path, "")
    binary_stl(tmp_path / "machine" / "part.stl", CORNERS)
    mesh = '<mesh filename="package://any/part.stl" scale="0.1 0.1 0.1"/>'
    visual = f'<visual><origin xyz="0 0 0.5"/><geometry>{mesh}</geometry></visual>'
    meshed = scene_with(tmp_path, visual)
    (drawn_mesh,) = [shape for shape in meshed.shapes if shape.kind == "mesh"]
    drawn = np.frombuffer(base64.b64decode(drawn_mesh.triangles or ""), "<f4").reshape(-1, 3, 3)
    np.testing.assert_allclose(drawn, 0.1 * CORNERS + [0.0, 0.0, 0.5], atol=1e-6)
    assert drawn_mesh.body == 3
    assert any(shape.body == 3 and shape.role == "machine" for shape in scene.shapes)
    assert [shape for shape in meshed.shapes if shape.body == 3 and shape.role == "machine"] == [drawn_mesh]
    assert meshed.note == ""


def test_boxes_cylinders_and_spheres_are_drawn_where_the_file_has_them(tmp_path: Path):
    forms = (
        ('<origin xyz="0.1 0 0" rpy="0 1.5707963267948966 0"/>', '<cylinder radius="0.02" length="0.4"/>'),
        ("", '<box size="0.1 0.2 0.3"/>'),
        ('<origin xyz="0 0 1"/>', '<sphere radius="0.05"/>'),
    )
    visual = "".join(f"<visual>{origin}<geometry>{form}</geometry></visual>" for origin, form in forms)
    cylinder, box, ball = [
        shape for shape in scene_with(tmp_path, visual).shapes if shape.body == 3 and shape.role == "machine"
    ]
    np.testing.assert_allclose(cylinder.points, [[-0.1, 0.0, 0.0], [0.3, 0.0, 0.0]], atol=1e-12)
    assert box.size == (0.1, 0.2, 0.3)
    assert ball.points == ((0.0, 0.0, 1.0),)
    assert ball.radius == (0.05,)


@pytest.mark.parametrize(
    ("name", "why"),
    [("lost.stl", "there is no file lost.stl"), ("part.dae", "not an STL file"), ("../../../../etc/x.stl", "no file")],
)
def test_a_mesh_that_cannot_be_drawn_leaves_a_simple_shape_and_a_reason(name: str, why: str, tmp_path: Path):
    visual = f'<visual><geometry><mesh filename="{name}"/></geometry></visual>'
    scene = scene_with(tmp_path, visual)
    assert why in scene.note
    assert "forearm_exo" in scene.note
    assert any(shape.body == 3 and shape.role == "machine" for shape in scene.shapes)


def test_a_mesh_is_found_in_the_folder_above_the_machine(tmp_path: Path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "machine").mkdir()
    text_stl(tmp_path / "meshes" / "part.STL", CORNERS)
    assert mesh_file("package://robot/meshes/part.STL", tmp_path / "machine").is_file()


def test_a_mesh_outside_of_the_folders_of_the_machine_is_not_read(tmp_path: Path):
    machine = tmp_path / "a" / "b" / "c"
    machine.mkdir(parents=True)
    text_stl(tmp_path / "secret.stl", CORNERS)
    for name in (str(tmp_path / "secret.stl"), "../../../secret.stl", f"file://{tmp_path}/secret.stl"):
        with pytest.raises(ModelError, match="no file"):
            mesh_file(name, machine)
