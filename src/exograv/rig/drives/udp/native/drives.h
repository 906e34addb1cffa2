/* Driver of a controller with the UDP protocol (docs/reference/udp_protocol.md), translated from host.py and link.py.
   No function allocates memory, waits without a bound, or fails: failures are counted, and look like silence. */
#pragma once
#include "record.h"

/* Poll the controller and wait for its answer. The measurement stays the last one if none comes in time. */
void udp_read(udp_drives *drives);

/* Send a command that answers a measurement; return 1 if it was sent.
   It is not sent after `valid_until` [s], and never with a number that is not finite. */
int udp_write(udp_drives *drives, int64_t sequence, double valid_until, const double *current, const double *damping);
