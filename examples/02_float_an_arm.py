"""Identify a relaxed arm in a machine and float it.

The machine is simulated. These lines drive a real one with `exograv.Drives(rig, "drives.toml", person)` in place of
the twin (docs/howto/rig_test.md).
"""

import exograv

rig = exograv.load_rig("recupera_like")
machine = exograv.Twin(rig, level=2, seed=1)

machine.prepare()  # calibrate the empty machine
flight = exograv.float_arm(machine, identify_s=20.0, gravity_level=0.0, seconds=5.0)

print("Left over, predicted by the estimate [N·m]:", flight.estimate.left_over().round(2))
print("Left over, true value of the twin [N·m]:   ", flight.left_over_true.round(2))
print("Drift of the floating arm [°]:             ", flight.drift_deg.round(2))
print("Recording:", flight.path)
