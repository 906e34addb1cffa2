"""Visual shapes of a machine from its URDF: boxes, cylinders, spheres, and meshes in STL files."""

import base64
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError
from exograv.model.tree import Frame, Tree
from exograv.model.urdf import origin_of, robot_of, vector_of

from .description import Shape, point_of, rows_of

TRIANGLES_MAX = 40_000
"""Largest number of triangles of all meshes together: 2 MB of JSON, and a smooth picture without a graphics card."""

STL_HEADER, STL_ROW = 84, 50  # bytes of a binary STL file: header with count, and each triangle


def read_visuals(path: Path, tree: Tree) -> tuple[list[Shape], str]:
    """Read the visual shapes of a URDF file; also return why a mesh is not drawn, or an empty text.

    Raises:
        ModelError: The file is not a valid URDF.
    """
    shapes, why, left = list[Shape](), "", TRIANGLES_MAX
    for link in robot_of(path).findall("link"):
        frame = tree.frames.get(link.get("name", ""))
        if frame is None:
            continue
        for visual in link.findall("visual"):
            try:
                shape, triangles = _shape(visual, frame, path, left)
            except (ModelError, OSError, ValueError) as error:
                why = why or f"Link '{link.get('name')}' is drawn by a simple shape: {error}"
                continue
            left -= triangles
            shapes.append(shape)
    return shapes, why


def _shape(visual: ElementTree.Element, frame: Frame, path: Path, left: int) -> tuple[Shape, int]:
    """Shape of one `<visual>`, and its number of triangles."""
    label = "a <visual>"
    R_link, p_link = origin_of(visual, label, path.name)
    R, p = frame.R_body_frame @ R_link, frame.p_body_frame + frame.R_body_frame @ p_link
    geometry = visual.find("geometry")
    form = geometry[0] if geometry is not None and len(geometry) else None
    if form is None:
        raise ModelError("its <visual> has no <geometry>.")
    if form.tag == "box":
        return Shape(
            "box",
            frame.body,
            "machine",
            (point_of(p),),
            (),
            point_of(vector_of(form, "size", label, path.name)),
            rows_of(R),
        ), 0
    if form.tag == "sphere":
        return Shape("ball", frame.body, "machine", (point_of(p),), (float(form.get("radius", "")),)), 0
    if form.tag == "cylinder":
        half = 0.5 * float(form.get("length", "")) * R[:, 2]
        points = (point_of(p - half), point_of(p + half))
        return Shape("cylinder", frame.body, "machine", points, (float(form.get("radius", "")),)), 0
    if form.tag != "mesh":
        raise ModelError(f"<{form.tag}> is not drawn.")
    scale = vector_of(form, "scale", label, path.name) if "scale" in form.attrib else np.ones(3)
    corners = read_stl(mesh_file(form.get("filename", ""), path.parent)) * scale
    if len(corners) > left:
        raise ModelError(f"the meshes have more than the {TRIANGLES_MAX} triangles allowed. Simplify them.")
    flat = (corners @ R.T + p).astype("<f4")
    text = base64.b64encode(flat.tobytes()).decode()
    return Shape("mesh", frame.body, "machine", (), triangles=text), len(corners)


def mesh_file(name: str, folder: Path) -> Path:
    """File of a mesh, by its path or by a `package://` address, in the machine's folder or a folder above it.

    Raises:
        ModelError: There is no such file, or it is not an STL file.
    """
    inside = Path(name.removeprefix("file://"))
    if name.startswith("package://"):
        inside = Path(*Path(name.removeprefix("package://")).parts[1:])
    if inside.suffix.lower() != ".stl":
        raise ModelError(f"{name} is not an STL file. Convert it.")
    places = [folder.resolve(), *list(folder.resolve().parents)[:2]]
    for place in places:
        found = (place / inside).resolve()
        # A machine file may come from somebody else: it must not draw any file of this computer into a page.
        if found.is_relative_to(places[-1]) and found.is_file():
            return found
    raise ModelError(f"there is no file {name} in {folder.name} or the two folders above it.")


def read_stl(path: Path) -> Float[np.ndarray, "triangle 3 3"]:
    """Corners of the triangles of an STL file, binary or text.

    Raises:
        ModelError: The file is not a valid STL file.
    """
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= STL_HEADER and len(data) == STL_HEADER + STL_ROW * count:
        rows = np.frombuffer(
            data, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")]), count, STL_HEADER
        )
        corners = rows["corners"].astype(float)
    else:
        words = data.decode("ascii", "replace").split()
        numbers = [words[k + 1 : k + 4] for k, word in enumerate(words) if word == "vertex"]
        if not numbers or len(numbers) % 3:
            raise ModelError(f"{path.name} is neither a binary nor a text STL file.")
        corners = np.array(numbers, dtype=float).reshape(-1, 3, 3)
    if not np.isfinite(corners).all():
        raise ModelError(f"{path.name} holds a number that is not finite.")
    return corners
