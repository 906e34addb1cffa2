"""Read a recording: channels, a table, a figure."""

from pathlib import Path

import exograv

recording = exograv.Recording(Path(__file__).parent / "data" / "floating.mcap")
print(f"{recording.settings['rig']}, simulated: {recording.is_simulated}, complete: {recording.remark is None}")
print("Messages by channel:", recording.channels)
print(recording.to_pandas("/phase"))
ticks = recording.to_pandas()
print(ticks[[f"tau_commanded.{joint}" for joint in recording.joints]].describe().round(2).loc[["mean", "min", "max"]])
Path("out").mkdir(exist_ok=True)
recording.plot("out/floating.png")
print("Figure: out/floating.png")
