/* Cyclic part of a machine of CANopen drives, translated from bus.py, cycle.py and node.py. No function allocates
   memory, waits without a bound, or fails: failures are counted, and look like silence. */
#pragma once
#include "record.h"

/* Send the SYNC and wait for the drives' answers. The measurement stays the last one if not all come in time. */
void can_read(can_drives *drives);

/* Send a command to each drive; return 1 if it was sent.
   It is not sent after `valid_until` [s], and never with a number that is not finite. */
int can_write(can_drives *drives, int64_t sequence, double valid_until, const double *current, const double *damping);
