"""Machine in MJCF as a URDF: bodies, hinges, slides and sites; shapes, and what URDF cannot hold, are left out."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError
from exograv.model.urdf import MESHES
from exograv.model.urdf_writer import roll_pitch_yaw, words

KINDS = {mujoco.mjtJoint.mjJNT_HINGE: "revolute", mujoco.mjtJoint.mjJNT_SLIDE: "prismatic"}
MASS_LEAST, INERTIA_LEAST = 1e-9, 1e-12  # of a body whose mass is in a mesh that is not there; it is left out again

Vector = Float[np.ndarray, " 3"]


def urdf_of_mjcf(path: Path) -> str:
    """Return the text of a URDF of the machine in an MJCF file.

    Raises:
        ModelError: MuJoCo cannot read the file.
    """
    try:
        # MuJoCo reads a file only if its name ends in .xml; other names cannot include further files.
        is_xml = path.suffix.lower() == ".xml"
        spec = mujoco.MjSpec.from_file(str(path)) if is_xml else mujoco.MjSpec.from_string(path.read_text("utf-8"))
        massless = _without_files(spec)
        model = spec.compile()
    except (ValueError, TypeError) as error:
        what = " ".join(str(error).split())
        step = "Put the included file there" if "opening file" in what else "Correct the MJCF"
        raise ModelError(f"MuJoCo cannot read {path.name}: {what}. {step}.") from error
    return _Urdf(model, massless).text(spec.modelname or path.stem)


def _without_files(spec: mujoco.MjSpec) -> dict[str, str]:
    """Remove everything that needs another file.

    Return the bodies without mass by name, with the meshes that held their mass; empty if there were none.
    """
    for number, body in enumerate(spec.bodies):
        body.name = body.name or f"body_{number}"
    files = {mesh.name or Path(mesh.file).stem: Path(mesh.file).name for mesh in spec.meshes}
    meshes: dict[str, list[str]] = {}
    for geom in spec.geoms:
        # The mass of a geom is NaN if its density gives it, and zero for a mesh that is only shown.
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH and (geom.density if np.isnan(geom.mass) else geom.mass) > 0.0:
            mesh = geom.meshname
            shown = f"'{mesh}' ({files[mesh]})" if files.get(mesh) else f"'{mesh}'"
            meshes.setdefault(geom.parent.name, []).append(shown)
        if geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_SPHERE, [1e-3, 0.0, 0.0]
            geom.meshname, geom.hfieldname, geom.mass, geom.density = "", "", 0.0, 0.0
        geom.material = ""
    for kind in (spec.meshes, spec.hfields, spec.skins, spec.textures, spec.materials, spec.keys, spec.sensors):
        for element in list(kind):
            spec.delete(element)
    # Actuators stay for their limits of torque.
    massless: dict[str, str] = {}
    for body in spec.bodies[1:]:
        if not body.explicitinertial and not any(geom.mass > 0.0 or geom.density > 0.0 for geom in body.geoms):
            massless[body.name] = " and ".join(dict.fromkeys(meshes.get(body.name, [])))
            body.explicitinertial, body.mass, body.inertia = True, MASS_LEAST, [INERTIA_LEAST] * 3
            body.ipos = np.zeros(3)
    return massless


class _Urdf:
    """Writer of one model; the frame of each link lies at the anchor of its last joint."""

    def __init__(self, model: mujoco.MjModel, massless: dict[str, str]):
        self._model, self._massless = model, massless
        self._anchor: dict[int, Vector] = {0: np.zeros(3)}
        self._robot = ElementTree.Element("robot")

    def text(self, name: str) -> str:
        model = self._model
        self._robot.set("name", name)
        self._link("world")
        for body in range(1, model.nbody):
            self._body(body)
        ElementTree.indent(self._robot)
        return ElementTree.tostring(self._robot, encoding="unicode")

    def _body(self, body: int) -> None:
        model, name = self._model, self._model.body(body).name
        parent = int(model.body_parentid[body])
        carrier = "world" if parent == 0 else model.body(parent).name
        p, quaternion = model.body_pos[body] - self._anchor[parent], model.body_quat[body]
        R = _rotation(quaternion)
        joints = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
        anchor = np.zeros(3)
        if not len(joints):
            self._joint(f"{name}_mount", "fixed", (carrier, name), (R, p))
        for order, j in enumerate(joints):
            kind = KINDS.get(mujoco.mjtJoint(model.jnt_type[j]), "floating")
            own = np.zeros(3) if kind == "floating" else model.jnt_pos[j]
            link = name if order == len(joints) - 1 else f"{name}_{order + 1}"
            joint = self._joint(
                model.joint(j).name or f"{name}_joint", kind, (carrier, link), (R, p + R @ (own - anchor))
            )
            if kind != "floating":
                self._axis_and_limit(joint, j)
            if link != name:
                self._link(link)
            carrier, anchor, R, p = link, own, np.eye(3), np.zeros(3)
        self._anchor[body] = anchor
        self._inertial(self._link(name), body, anchor)
        for site in range(model.nsite):
            if model.site_bodyid[site] == body and model.site(site).name:
                link = model.site(site).name
                link = f"{link}_site" if any(link == model.body(i).name for i in range(model.nbody)) else link
                self._link(link)
                place = _rotation(model.site_quat[site]), model.site_pos[site] - anchor
                self._joint(f"{link}_mount", "fixed", (name, link), place)

    def _link(self, name: str) -> ElementTree.Element:
        return ElementTree.SubElement(self._robot, "link", name=name)

    def _joint(
        self, name: str, kind: str, ends: tuple[str, str], place: tuple[np.ndarray, np.ndarray]
    ) -> ElementTree.Element:
        joint = ElementTree.SubElement(self._robot, "joint", name=name, type=kind)
        ElementTree.SubElement(joint, "parent", link=ends[0])
        ElementTree.SubElement(joint, "child", link=ends[1])
        ElementTree.SubElement(joint, "origin", xyz=words(place[1]), rpy=words(roll_pitch_yaw(place[0])))
        return joint

    def _axis_and_limit(self, joint: ElementTree.Element, j: int) -> None:
        model = self._model
        ElementTree.SubElement(joint, "axis", xyz=words(model.jnt_axis[j]))
        limit = {}
        if model.jnt_limited[j]:
            # A URDF counts from the posture of the file; MJCF may give it another position.
            lower, upper = model.jnt_range[j] - model.qpos0[model.jnt_qposadr[j]]
            limit = {"lower": f"{lower:.9g}", "upper": f"{upper:.9g}"}
        effort = self._effort(j)
        if effort > 0.0:
            limit["effort"] = f"{effort:.9g}"
        if limit:
            ElementTree.SubElement(joint, "limit", limit)
        armature = float(model.dof_armature[model.jnt_dofadr[j]])
        if armature > 0.0:
            # URDF has no such attribute; `exograv rig new` moves it to `rig.toml`.
            ElementTree.SubElement(joint, "dynamics", armature=f"{armature:.9g}")

    def _effort(self, j: int) -> float:
        """Return the largest torque of a joint by its own or its actuator's limit; zero if there is none."""
        model = self._model
        if model.jnt_actfrclimited[j]:
            return float(np.abs(model.jnt_actfrcrange[j]).max())
        found = 0.0
        for i in range(model.nu):
            if model.actuator_trntype[i] != mujoco.mjtTrn.mjTRN_JOINT or model.actuator_trnid[i, 0] != j:
                continue
            gear = abs(float(model.actuator_gear[i, 0]))
            is_motor = model.actuator_gaintype[i] == 0 and model.actuator_biastype[i] == 0
            if model.actuator_forcelimited[i]:
                found += gear * float(np.abs(model.actuator_forcerange[i]).max())
            elif is_motor and model.actuator_ctrllimited[i]:
                gain = abs(float(model.actuator_gainprm[i, 0]))
                found += gear * gain * float(np.abs(model.actuator_ctrlrange[i]).max())
        return found

    def _inertial(self, link: ElementTree.Element, body: int, anchor: Vector) -> None:
        model = self._model
        meshes = self._massless.get(model.body(body).name)
        if meshes:
            link.set(MESHES, meshes)
        if meshes is not None or model.body_mass[body] <= 0.0:
            return
        inertial = ElementTree.SubElement(link, "inertial")
        R = _rotation(model.body_iquat[body])
        ElementTree.SubElement(
            inertial, "origin", xyz=words(model.body_ipos[body] - anchor), rpy=words(roll_pitch_yaw(R))
        )
        ElementTree.SubElement(inertial, "mass", value=f"{model.body_mass[body]:.9g}")
        xx, yy, zz = (f"{value:.9g}" for value in model.body_inertia[body])
        ElementTree.SubElement(inertial, "inertia", ixx=xx, iyy=yy, izz=zz, ixy="0", ixz="0", iyz="0")


def _rotation(quaternion: np.ndarray) -> Float[np.ndarray, "3 3"]:
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, quaternion)
    return R.reshape(3, 3)
