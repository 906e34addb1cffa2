"""Devices in another process: `python device.py NAME:TYPE…` pushes counted samples, each with the device's own time.

It knows nothing of exograv.
"""

import sys
import time

import pylsl
import pylsl.lib


def opened(name: str, value_type: str) -> pylsl.StreamOutlet:
    """Open a stream of three channels, or of texts."""
    is_text = value_type == "string"
    kind, channels, rate = ("Markers", 1, 0.0) if is_text else ("EEG", 3, 200.0)
    info = pylsl.StreamInfo(name, kind, channels, rate, pylsl.lib.string2fmt[value_type], f"{name}-1")
    info.desc().append_child_value("maker", "Nobody & Sons")
    parent = info.desc().append_child("channels")
    for k in range(channels):
        parent.append_child("channel").append_child_value("label", f"C{k}")
    return pylsl.StreamOutlet(info)


def main() -> None:
    """Push until killed."""
    named = [one.split(":") for one in sys.argv[1:]]
    outlets = [(opened(name, value_type), value_type) for name, value_type in named]
    print("ready", flush=True)
    for count in range(1_000_000):
        for outlet, value_type in outlets:
            if value_type == "string":
                if count % 10 == 0:
                    outlet.push_sample([f"Größer {'ß' * (count % 7)} als ½ {count}"])
            else:
                cast = int if value_type.startswith("int") else float
                outlet.push_sample([cast(count), cast(count / 3), cast(-count)], 1e4 + count / 7)
        time.sleep(0.005)


if __name__ == "__main__":
    main()
