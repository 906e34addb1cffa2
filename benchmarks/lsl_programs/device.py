"""Device in its own process, plain pylsl: `python device.py NAME RATE`. Each sample holds the true time and a count."""

import sys
import time

import pylsl
import pylsl.lib

name, rate = sys.argv[1], float(sys.argv[2])
# The replaced libc does not change this clock: CLOCK_MONOTONIC plus the time that the computer was suspended.
TRUE_CLOCK = time.CLOCK_BOOTTIME
# If the process was interrupted between the two readings, the truth is unknown: the clocks are read again.
BRACKET_S = 20e-6
outlet = pylsl.StreamOutlet(pylsl.StreamInfo(name, "EEG", 2, rate, pylsl.lib.cf_double64, f"{name}-1"))
print("ready", flush=True)
begun, count = time.clock_gettime(TRUE_CLOCK), 0
while True:
    time.sleep(max(0.0, begun + count / rate - time.clock_gettime(TRUE_CLOCK)))
    before = stamp = after = float("nan")
    while not after - before < BRACKET_S:
        before, stamp, after = time.clock_gettime(TRUE_CLOCK), pylsl.local_clock(), time.clock_gettime(TRUE_CLOCK)
    outlet.push_sample([0.5 * (before + after), float(count)], stamp)
    count += 1
