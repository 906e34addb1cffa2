"""Identify an arm from a CSV file of joint positions and torques, save the estimate, and read it again."""

import tempfile
from pathlib import Path

import pandas as pd

import exograv

DATA = Path(__file__).parent / "data"

rig = exograv.load_rig("recupera_like")
person = exograv.Person(1.708, 80.5, "male", {"upper_arm": 0.2536, "forearm": 0.2692, "hand": 0.177})
table = pd.read_csv(DATA / "relaxed_arm.csv")
q = table[[f"q_{joint}_rad" for joint in rig.joints]].to_numpy()
tau = table[[f"tau_{joint}_Nm" for joint in rig.joints]].to_numpy()
calibration = exograv.load_calibration(DATA / "calibration.toml", rig)

estimate = exograv.identify(rig, person, q, tau, dt=0.005, calibration=calibration)
print("Outcome:", estimate.outcome)  # this file holds a short motion; `exograv arm identify` moves for 60 s
print(estimate.to_pandas().filter(regex="mass|mz", axis=0).round(3))
print("Left over, predicted [N·m]:", estimate.left_over().round(2))

with tempfile.TemporaryDirectory() as folder:
    file = estimate.save(Path(folder) / "P-07.toml", code="P-07")
    again = exograv.Estimate.load(file, rig, calibration)
print("The arm of the file is the same:", abs(again.left_over() - estimate.left_over()).max() < 1e-3)
