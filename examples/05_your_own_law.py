"""Add a control law of your own to a floating arm: a viscous field at the elbow. The guard limits every torque."""

import numpy as np

import exograv

rig = exograv.load_rig("recupera_like")
machine = exograv.Twin(rig, level=1, seed=1)
elbow = rig.joints.index("elbow_flexion")


def wave_in_a_viscous_field(q: np.ndarray, v: np.ndarray, t: float) -> np.ndarray:
    """Torque to add to the compensation [N·m], by position [rad], velocity [rad/s] and time [s]."""
    tau = np.zeros(len(q))
    tau[elbow] = 0.8 * np.sin(2.0 * t) - 0.5 * v[elbow]
    return tau


first = exograv.float_arm(machine, identify_s=10.0, seconds=1.0, path="out/identified.mcap")
flight = exograv.float_arm(machine, first.estimate, seconds=6.0, path="out/law.mcap", law=wave_in_a_viscous_field)
ticks = flight.recording().ticks
moved = np.rad2deg(np.ptp(ticks["q_measured"][ticks["phase"] == ticks["phase"].max()], axis=0))
print("The law moved the joints by [°]:", moved.round(1))
try:
    exograv.float_arm(machine, first.estimate, seconds=1.0, path="out/wrong.mcap", law=lambda q, v, t: q * np.nan)
except exograv.ExogravError as error:
    print("A law that returns NaN:", error)
