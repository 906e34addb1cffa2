"""Files of machines as strangers write them, and answers to the questions of their rig files."""

from collections.abc import Mapping
from pathlib import Path

from exograv.model.open_questions import open_questions

DRIVE_ANSWERS: dict[str, list[str]] = {
    "urdf.side": ['"right"'],
    "adjustments.range_m": ["[0.20, 0.37]"],
    "drives.drive": ['"harmonic"'],
    "drives.torque_constant_Nm_per_A": ["0.06"],
    "drives.gear_ratio": ["100.0"],
    "drives.rotor_inertia_kgm2": ["0.1"],
    "drives.torque_max_Nm": ["40.0"],
    "drives.speed_max_deg_s": ["170.0"],
    "calibration.weights_kg": ["[1.0, 2.0]"],
}


def answered(folder: Path, answers: Mapping[str, list[str]]) -> None:
    """Answer each question with the next of its key's answers; the last one is used for all that follow."""
    path = folder / "rig.toml"
    left = {key: list(choices) for key, choices in answers.items()}
    lines = path.read_text(encoding="utf-8").splitlines()
    for question in open_questions(path.read_text(encoding="utf-8")):
        choices = left[question.key]
        answer = choices.pop(0) if len(choices) > 1 else choices[0]
        lines[question.line - 1] = lines[question.line - 1].replace('"?"', answer, 1)
    path.write_text("\n".join(lines), encoding="utf-8")


def task(lower: str, upper: str) -> dict[str, list[str]]:
    """Return all answers of a builder, with this task workspace [°]."""
    return {**DRIVE_ANSWERS, "task_workspace.lower_deg": [lower], "task_workspace.upper_deg": [upper]}


FOUR = task("[0.0, 0.0, -40.0, 25.0]", "[95.0, 50.0, 45.0, 110.0]")
ELBOW = task("[25.0]", "[110.0]")
ELBOW_AND_ROLL = task("[25.0, -40.0]", "[110.0, 40.0]")


def robot(name: str, *parts: str) -> str:
    """Return the text of a URDF."""
    return f'<?xml version="1.0"?>\n<robot name="{name}">\n' + "\n".join(parts) + "\n</robot>\n"


def link(name: str, mass: float = 0.0, com: str = "0 0 0") -> str:
    """Return a link, with a mesh that is not there; without inertial if it has no mass."""
    mesh = f'<visual><geometry><mesh filename="package://nowhere/{name}.stl"/></geometry></visual>'
    xx, zz = 0.004 * mass, 0.001 * mass
    inertial = (
        f'<inertial><origin xyz="{com}"/><mass value="{mass}"/>'
        f'<inertia ixx="{xx}" iyy="{xx}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    return f'<link name="{name}">{inertial if mass else ""}{mesh}</link>'


def joint(
    name: str, ends: tuple[str, str], xyz: str, axis: str, limit: str = "", kind: str = "revolute", more: str = ""
) -> str:
    """Return a joint; `limit` holds lower, upper, effort and velocity."""
    keys = ("lower", "upper", "effort", "velocity")
    words = " ".join(f'{key}="{value}"' for key, value in zip(keys, limit.split(), strict=False))
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{ends[0]}"/><child link="{ends[1]}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{f"<limit {words}/>" if words else ""}{more}</joint>'
    )


def arm(base: str, names: tuple[str, str, str, str], y: float = -0.2, limits: Mapping[int, str] | None = None) -> str:
    """Return four links and joints of an arm: flexion, abduction, rotation, elbow; links are a_, b_, c_ and d_ …."""
    side = 1 if y < 0 else -1
    a, b, c, d = (f"{letter}_{names[3]}" for letter in "abcd")
    of = {0: "-0.7 2.2 60 3", 1: "-0.2 1.3 60 3", 2: "-1.2 1.2 30 3", 3: "0 2.2 30 3"} | dict(limits or {})
    return "\n".join(
        [
            link(a, 2.0, f"-0.05 {-0.08 * side} 0"),
            joint(names[0], (base, a), f"0 {y} 0.5", "0 -1 0", of[0]),
            link(b, 1.6, f"-0.05 {-0.05 * side} -0.05"),
            joint(names[1], (a, b), "0 0 0", f"{-side} 0 0", of[1]),
            link(c, 1.2, f"0 {-0.05 * side} -0.15"),
            joint(names[2], (b, c), "0 0 0", f"0 0 {side}", of[2]),
            link(d, 0.7, f"0 {-0.03 * side} -0.1"),
            joint(names[3], (c, d), "0 0 -0.29", "0 -1 0", of[3]),
        ]
    )


NAMES = ("right_sh_flex", "right_sh_abd", "right_sh_rot", "right_elbow")
NUMBERS = ("J1", "J2", "J3", "J4")

ONE_JOINT = robot(
    "elbow_orthosis",
    link("upper_arm_shell", 1.2),
    link("forearm_shell", 0.55, "0 0.01 -0.12"),
    joint("elbow", ("upper_arm_shell", "forearm_shell"), "0 0 0", "0 -1 0", "0 2.3 18 4"),
)
TWO_JOINTS = robot(
    "arm_orthosis_right",
    link("base_link", 2.0),
    link("link_1", 0.6, "0 0.02 -0.10"),
    link("link_2", 0.35, "0 0 -0.06"),
    joint("right_elbow_joint", ("base_link", "link_1"), "0 -0.2 0.3", "0 -1 0", "0 2.4 18 5"),
    joint("right_pronation_joint", ("link_1", "link_2"), "0 0 -0.12", "0 0 1", "-1.4 1.4 6 5"),
)

NO_LIMITS = "0.0 0.0 0.0 0.0"
ONE_AXIS = robot(
    "suit",
    link("shoulder", 0.02),
    link("upperArm", 0.9, "0 0 -0.2"),
    link("lowerArm", 0.6, "0 0 -0.18"),
    joint("shoulder_joint", ("shoulder", "upperArm"), "0 -0.16 1.05", "0 1 0", NO_LIMITS),
    joint("elbow_joint", ("upperArm", "lowerArm"), "0 0 -0.29", "0 -1 0", NO_LIMITS),
)


def written(folder: Path, text: str, name: str = "machine.urdf") -> Path:
    """Write a machine's file, and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
