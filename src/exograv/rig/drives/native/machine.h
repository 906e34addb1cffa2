/* What all buses share in C, translated from driver.py, clock.py and units.py. No function allocates memory, waits
   without a bound, or fails: failures are counted, and look like silence. */
#pragma once
#include "record.h"

/* Time of CLOCK_MONOTONIC [ns]. */
int64_t machine_now(drive_machine *machine);

/* Sleep until a time of CLOCK_MONOTONIC [ns]; at once if it is over. */
void machine_sleep_until(drive_machine *machine, int64_t until_ns);

/* Time on the rig's clock [s]. */
double machine_time(drive_machine *machine);

/* Send a frame; return 1 if the system has taken all of it. */
int machine_sends(drive_machine *machine, const uint8_t *data, int64_t size);

/* Return the size of the next datagram before `until_ns`; MACHINE_NOTHING without one, and MACHINE_FAILED if the system
   reports an error. */
int64_t machine_receives(drive_machine *machine, uint8_t *data, int64_t size, int64_t until_ns);

/* Convert the drives' numbers to joints, as `Units` does; the measurement answers the question of `tick` at `t` [s]. */
void machine_measure(drive_machine *machine, double t, int64_t tick, const double *position, const double *current,
                     const double *motor_position);

/* Write the currents in the drives' directions, cut to their limits; return 0 if a number is not finite. */
int machine_limit(drive_machine *machine, const double *current, const double *damping, double *limited);
