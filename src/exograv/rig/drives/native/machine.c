/* See machine.h. Compile without fast mathematics and without contraction: the same reports must give the same numbers
   as in Python. */
#define _GNU_SOURCE
#include "machine.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>

typedef int64_t (*now_function)(drive_machine *);
typedef void (*sleep_function)(drive_machine *, int64_t);
typedef int64_t (*send_function)(drive_machine *, const uint8_t *, int64_t);
typedef int64_t (*receive_function)(drive_machine *, uint8_t *, int64_t, int64_t);

enum { SECOND_NS = 1000000000 };

int64_t machine_now(drive_machine *machine)
{
    if (machine->now_hook)
        return ((now_function)machine->now_hook)(machine);
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * SECOND_NS + now.tv_nsec;
}

void machine_sleep_until(drive_machine *machine, int64_t until_ns)
{
    if (machine->sleep_hook) {
        ((sleep_function)machine->sleep_hook)(machine, until_ns);
        return;
    }
    const struct timespec until = {until_ns / SECOND_NS, until_ns % SECOND_NS};
    /* A signal ends the sleep early; the kernel then continues towards the same absolute time. */
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) == EINTR)
        ;
}

double machine_time(drive_machine *machine)
{
    return (double)machine_now(machine) / 1e9 - machine->began_s;
}

int machine_sends(drive_machine *machine, const uint8_t *data, int64_t size)
{
    if (machine->send_hook)
        return ((send_function)machine->send_hook)(machine, data, size) == size;
    return send((int)machine->socket, data, (size_t)size, MSG_DONTWAIT | MSG_NOSIGNAL) == size;
}

int64_t machine_receives(drive_machine *machine, uint8_t *data, int64_t size, int64_t until_ns)
{
    if (machine->receive_hook)
        return ((receive_function)machine->receive_hook)(machine, data, size, until_ns);
    for (int attempt = 0; attempt < 2; attempt++) {
        const ssize_t got = recv((int)machine->socket, data, (size_t)size, MSG_DONTWAIT);
        if (got >= 0)
            return got;
        if (errno != EAGAIN && errno != EWOULDBLOCK)
            return MACHINE_FAILED;
        const int64_t left = until_ns - machine_now(machine);
        if (left <= 0)
            return MACHINE_NOTHING;
        struct pollfd watched = {(int)machine->socket, POLLIN, 0};
        const struct timespec patience = {left / SECOND_NS, left % SECOND_NS};
        if (ppoll(&watched, 1, &patience, NULL) <= 0)
            return MACHINE_NOTHING;
    }
    return MACHINE_NOTHING;
}

void machine_measure(drive_machine *machine, double t, int64_t tick, const double *position, const double *current,
                     const double *motor_position)
{
    double sum = 0.0;
    for (int64_t j = 0; j < machine->joints; j++) {
        machine->q[j] = machine->offset[j] + machine->of_count[j] * position[j];
        machine->joint_current[j] = machine->sign[j] * current[j];
        machine->q_motor[j] = machine->offset[j] + machine->of_motor_count[j] * motor_position[j];
        sum += motor_position[j];
    }
    machine->has_q_motor = machine->has_motor && isfinite(sum);
    machine->state_t = t;
    machine->state_sequence = tick;
}

static double bounded(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

int machine_limit(drive_machine *machine, const double *current, const double *damping, double *limited)
{
    int is_limited = 0;
    for (int64_t j = 0; j < machine->joints; j++) {
        if (!(isfinite(current[j]) && isfinite(damping[j])))
            return 0;
        const double most = machine->current_max[j], cut = bounded(current[j], -most, most);
        limited[j] = machine->sign[j] * cut;
        is_limited |= cut != current[j];
    }
    machine->limited += is_limited;
    return 1;
}
