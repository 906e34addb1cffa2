"""Read a recording: channels, a table, a figure."""

from pathlib import Path

import exograv

recording = exograv.Recording(Path(__file__).parent / "data" / "floating.mcap")
print(f"{recording.settings['rig']}, simulated: {recording.is_simulated}, complete: {recording.remark is None}")
print("Messages by channel:", recording.channels)
print(recording.to_pandas("/phase"))
ticks = recording.to_pandas()
commanded = ticks[[f"tau_commanded.{joint}" for joint in recording.joints]]  # [N·m]
print(commanded.describe().loc[["mean", "min", "max"]].round(2).T)
Path("out").mkdir(exist_ok=True)
recording.plot("out/floating.png")
print("Figure: out/floating.png")
