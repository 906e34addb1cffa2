"""Write the data of examples/data: a relaxed arm on the twin as arrays, its calibration, and a short recording.

    python benchmarks/example_data.py

Five samples of the loop (1 kHz) are averaged to one (200 Hz). Position and torque thus have the same delay.
"""

import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

import exograv

FOLDER = Path(__file__).parents[1] / "examples" / "data"
RIG, LEVEL, SEED = "recupera_like", 2, 1003
IDENTIFY_S, FLOAT_S, EVERY = 20.0, 4.0, 5


def main() -> None:
    """Calibrate, identify, and write."""
    twin = exograv.Twin(exograv.load_rig(RIG), level=LEVEL, seed=SEED)
    twin.prepare()
    twin.save_calibration(FOLDER / "calibration.toml")
    with tempfile.TemporaryDirectory() as spare:
        flight = exograv.float_arm(twin, identify_s=IDENTIFY_S, seconds=1.0, path=Path(spare) / "identify.mcap")
        recording = flight.recording()
    exograv.float_arm(twin, flight.estimate, seconds=FLOAT_S, path=FOLDER / "floating.mcap")
    phases = recording.to_pandas("/phase")
    number = 1 + phases.index[phases["name"] == "identify"][0]
    ticks = recording.ticks[recording.ticks["phase"] == number]
    ticks = ticks[: len(ticks) // EVERY * EVERY]

    def averaged(name: str) -> np.ndarray:
        return ticks[name].reshape(len(ticks) // EVERY, EVERY, -1).mean(axis=1)

    table = pd.DataFrame({"t_s": (averaged("t") - ticks["t"][0]).ravel().round(4)})
    for name, unit, digits in (("q_measured", "rad", 5), ("tau_measured", "Nm", 4)):
        for joint, values in zip(twin.joints, averaged(name).T, strict=True):
            table[f"{name.partition('_')[0]}_{joint}_{unit}"] = values.round(digits)
    table.to_csv(FOLDER / "relaxed_arm.csv", index=False)
    person = twin.person
    print(f"Person: {person}")
    print(f"Left over of the estimate of the run, by the twin's truth: {flight.left_over_true} N·m")
    for path in sorted(FOLDER.iterdir()):
        print(f"{path.name}: {path.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
