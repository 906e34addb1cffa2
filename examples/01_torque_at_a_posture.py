"""Compute the torque that carries a person's arm in a machine, for several gravity levels, with its interval."""

import numpy as np

import exograv

rig = exograv.load_rig("recupera_like")
person = exograv.Person(height_m=1.75, mass_kg=70.0, sex="female")
compensator = exograv.Compensator(rig, person)  # the arm of the anthropometric table

q = np.deg2rad([40.0, 20.0, 0.0, 70.0])
print(f"{'gravity level':28}" + "".join(f"{joint:>26}" for joint in rig.joints))
for name, level in (("weightless", 0.0), ("Moon", 0.165), ("Mars", 0.38), ("Earth", 1.0)):
    tau, (low, high) = compensator.torque(q, level), compensator.interval(q, level)
    cells = "".join(f"{t:9.2f} ({a:6.2f} to {b:5.2f})" for t, a, b in zip(tau, low, high, strict=True))
    print(f"{name:10} {level:5.3f} [N·m]     {cells}")
