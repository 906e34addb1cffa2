"""Compare identification methods on the same data, by their own prediction and by the twin that made the data.

A method that states no uncertainty, such as `gradient-full`, predicts nan.
"""

from pathlib import Path

import pandas as pd

import exograv

DATA = Path(__file__).parent / "data"

rig = exograv.load_rig("recupera_like")
twin = exograv.Twin(rig, level=2, seed=1003)  # benchmarks/example_data.py recorded the data on this twin
table = pd.read_csv(DATA / "relaxed_arm.csv")
q = table[[f"q_{joint}_rad" for joint in rig.joints]].to_numpy()
tau = table[[f"tau_{joint}_Nm" for joint in rig.joints]].to_numpy()
calibration = exograv.load_calibration(DATA / "calibration.toml", rig)

print(f"{'method':16} {'left over, predicted [N·m]':32} left over, true [N·m]")
for method in ("recursive", "rls", "gradient-full", "anthropometric"):
    estimate = exograv.identify(rig, twin.person, q, tau, dt=0.005, calibration=calibration, method=method)
    print(f"{method:16} {estimate.left_over().round(2)!s:32} {twin.left_over_true(estimate).round(2)}")
