"""Consumer in its own process, plain pylsl: `python consumer.py SOURCE_ID FILE`; it saves its notes when it ends.

Rows of the file: number of the tick, stamp, LSL's correction, time of arrival; all but the first in seconds.
"""

import signal
import sys
import time

import numpy as np
import pylsl

found = pylsl.resolve_byprop("source_id", sys.argv[1], 1, 30.0)
inlet = pylsl.StreamInlet(found[0])
inlet.time_correction(5.0)
inlet.open_stream(5.0)
is_over = []
signal.signal(signal.SIGTERM, lambda *_: is_over.append(True))
print("ready", flush=True)
rows = []
while not is_over:
    values, stamps = inlet.pull_chunk(0.0, 4096, as_numpy=True)
    came = time.monotonic()
    if len(stamps):
        correction = inlet.time_correction(1.0)
        rows.append(np.column_stack([np.asarray(values)[:, 1], stamps, np.full((len(stamps), 2), (correction, came))]))
    time.sleep(0.0005)
np.save(sys.argv[2], np.concatenate(rows))
