"""Run the pointing task in code: three windows, a simulated participant who touches beside the target."""

import numpy as np

import exograv

session = exograv.PointingSession("training", windows=3)
random = np.random.default_rng(1)
session.start(0.0)
t, next_touch = 0.0, 0.0
while not session.is_over:
    session.advance(t)
    if session.picture.target is not None and t >= next_touch:
        session.touch(t, *random.normal(0.0, 12.0, 2))
        next_touch = t + random.normal(2.6, 0.3)
    t += 0.1

touches = session.to_pandas()
print(f"{len(touches)} touches in {t:.0f} s, {touches['is_accepted'].sum()} accepted")
print(touches[touches["is_accepted"]].groupby("window")["deviation_px"].describe()[["count", "mean", "50%"]].round(1))
