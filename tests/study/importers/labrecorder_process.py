"""Record streams with the library of LabRecorder: `python labrecorder_process.py FILE STREAM…`, until the input ends.

It knows nothing of exograv.
"""

import sys
import time

import labrecorder  # pyright: ignore[reportMissingImports] - no dependency of the project
import pylsl

FETCHED_S = 3.0
"""Time that LabRecorder needs for the last samples: it fetches them every half second."""


def main() -> None:
    """Record the named streams."""
    file, *names = sys.argv[1:]
    found = [pylsl.resolve_byprop("name", name, 1, 10.0)[0] for name in names]
    with labrecorder.Recording(file, found):
        print("recording", flush=True)
        sys.stdin.read()
        time.sleep(FETCHED_S)


if __name__ == "__main__":
    main()
