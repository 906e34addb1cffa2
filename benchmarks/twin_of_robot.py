r"""Twin of a robot arm from the log of one day, judged on the logs of other days.

    python benchmarks/twin_of_robot.py A.csv --held-out B.csv C.csv --urdf ur10e.urdf --mount wrist_3_link \
        --gains 13.56,12.09,10.15,9.69,10.06,10.46

The logs have time, positions, velocities, currents and desired currents of each joint, in this order. The table states
the RMS torque in clear motion below 7 Hz that is left unexplained: by the twin, by plain least squares (links, rotors,
Coulomb and viscous friction, offsets, no prior), and by the URDF with rotors and friction of zero.
"""

import argparse
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from exograv.identification.calibration.empty_fit import EmptyMachine
from exograv.identification.machine_twin.friction_laws import ABSENT, TWIN_PER_JOINT
from exograv.identification.machine_twin.machine_fit import fit_machine, recording_residual
from exograv.identification.machine_twin.measured_motion import MeasuredMotion, samples_of
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.tree import Tree
from exograv.model.urdf import read_urdf
from exograv.recording import read_log

PERIOD_S = 0.01
CURRENT, ASKED = 13, 19
"""First columns of currents and desired currents, counted from 0."""

RIG = """\
name = "robot"
title = "Robot arm of a log"
[urdf]
right = "right.urdf"
[wearer]
shoulder_centre = "{mount}"
[[cuffs]]
name = "none"
exo_frame = "{mount}"
segment = "upper_arm"
along_N_per_mm = 1.0
across_N_per_mm = 1.0
about_limb_Nm_per_deg = 0.1
about_others_Nm_per_deg = 0.1
[donning]
posture_deg = {zeros}
arm_posture_deg = [0.0, 0.0, 0.0, 90.0]
[task_workspace]
lower_deg = {lower}
upper_deg = {upper}
[calibration]
mount = "{mount}"
weights_kg = [1.0, 2.0]
[[calibration.sweeps]]
joint = "{first}"
posture_deg = {zeros}
from_deg = -10.0
to_deg = 10.0
[excitation]
period_s = 10.0
centre_deg = {zeros}
sine_deg = [{zeros}]
cosine_deg = [{zeros}]
"""
ACTUATOR = """\
[[actuators]]
joint = "{joint}"
place = "shoulder"
drive = "harmonic"
torque_constant_Nm_per_A = {constant}
gear_ratio = {ratio}
efficiency = 1.0
torque_max_Nm = {torque_max}
rotor_inertia_kgm2 = {rotor}
weak_kp_Nm_per_rad = 80.0
weak_kd_Nms_per_rad = 10.0
"""
RATIO, ROTOR_KGM2 = 101.0, 1.0
"""Gear ratio of such drives, and a rotor inertia at the joint whose prior is wide."""


def robot_rig(folder: Path, urdf: Path, mount: str, gains: Sequence[float]) -> RigDescription:
    """Write the folder of a machine for the robot, and read it."""
    tree = read_urdf(urdf)
    n = len(tree.joints)
    shutil.copy(urdf, folder / "right.urdf")
    values = {"mount": mount, "first": tree.joint_names[0], "zeros": [0.0] * n}
    text = RIG.format(**values, lower=[-90.0] * n, upper=[90.0] * n)
    for joint, gain in zip(tree.joints, gains, strict=True):
        text += ACTUATOR.format(
            joint=joint.name, constant=gain / RATIO, ratio=RATIO, torque_max=joint.effort, rotor=ROTOR_KGM2
        )
    (folder / "rig.toml").write_text(text, encoding="utf-8")
    return load_rig(str(folder), "right")


def motion_of(path: Path, joints: Sequence[str], hanging: int) -> MeasuredMotion:
    """Read the motion of a log, on an even grid."""
    log = read_log(path, joints)
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines]
    table = np.array([row for row in rows if len(row) == len(rows[0])], dtype=float)
    table = table[np.concatenate([[True], np.diff(table[:, 0]) > 0.0])]
    t = np.arange(log.t[0], log.t[-1], PERIOD_S)

    def on_grid(first: int) -> np.ndarray:
        columns = table[:, first : first + len(joints)].T
        return np.column_stack([np.interp(t, table[:, 0], column) for column in columns])

    return MeasuredMotion(path.stem, t, on_grid(1), on_grid(CURRENT), on_grid(ASKED), np.zeros((len(t), hanging)))


def least_squares(model: EmptyMachine, motion: MeasuredMotion) -> np.ndarray:
    """Fit links, rotors, friction and offsets without a prior; the gains are those of the data sheet."""
    layout, theta = model.prior.layout, nominal(model)
    samples = samples_of((motion,)).sweeps
    blocks = [*(layout.of(name) for name in ("coulomb", "viscous", "asymmetry", "rotor")), layout.links]
    free = np.concatenate([np.arange(block.start, block.stop) for block in blocks])
    derivative, clear = model.derivative(samples, theta), samples.clear
    # Torque is linear in these parameters: the derivative at any of their values is the regressor.
    A = np.concatenate([of_joint[np.ix_(free, rows)].T for of_joint, rows in zip(derivative, clear.T, strict=True)])
    left = model.residual(samples, theta, float(samples.t[-1]))
    b = np.concatenate([errors[rows] for errors, rows in zip(left.T, clear.T, strict=True)])
    theta[free] += np.linalg.lstsq(A, b, rcond=1e-9)[0]
    return theta


def nominal(model: EmptyMachine) -> np.ndarray:
    """Return the values of the URDF, without rotors and friction."""
    layout, theta = model.prior.layout, model.prior.mean.copy()
    for name in ("coulomb", "viscous", "rotor", "load_share"):
        theta[layout.of(name)] = 0.0
    for name, value in ABSENT.items():
        theta[layout.of(name)] = value
    return theta


def main() -> None:
    """Fit one log, and print the errors on the others."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--held-out", type=Path, nargs="+", required=True)
    parser.add_argument("--urdf", type=Path, required=True)
    parser.add_argument("--mount", required=True)
    parser.add_argument("--gains", required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        gains = [float(gain) for gain in options.gains.split(",")]
        description = robot_rig(Path(folder), options.urdf, options.mount, gains)
        tree: Tree = read_exoskeleton(description)
        model = EmptyMachine(description, tree, TWIN_PER_JOINT)
        hanging = len(description.mounts) * model.prior.layout.weights
        motion = motion_of(options.log, description.joints, hanging)
        found = fit_machine(description, tree, (motion,))
        thetas = {"twin": found.fit.theta, "least squares": least_squares(model, motion), "URDF": nominal(model)}
        print("laws:", ", ".join(found.laws))
        print("| torque of | model | " + " | ".join(f"{joint} N·m" for joint in description.joints) + " |")
        print("|---" * (2 + len(description.joints)) + "|")
        for path in (options.log, *options.held_out):
            judged = motion_of(path, description.joints, hanging)
            for name, theta in thetas.items():
                left = recording_residual(description, tree, theta, (judged,)).slow_Nm
                print(f"| {path.stem} | {name} | " + " | ".join(f"{value:.2f}" for value in left.tolist()) + " |")


if __name__ == "__main__":
    main()
