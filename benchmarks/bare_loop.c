/* Bare loop for benchmarks/live_loop.py: an absolute sleep once per millisecond, then a fixed amount of work (some
   30 µs), with the rights of the guard's loop. It writes the lateness of each wake-up, then the duration of each work, as
   64-bit numbers [ns] to standard output. The work shows whether the host slows this computer down.

       cc -O2 bare_loop.c -o bare_loop && ./bare_loop TICKS PRIORITY CPU */
#define _GNU_SOURCE
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

static int64_t now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static char memory[1 << 20];
static volatile double result;

static void work(void)
{
    double sum = 0.0;
    for (int k = 0; k < 12000; k++) {
        sum = (sum + memory[(k * 7919) & ((1 << 20) - 1)]) * 1.0000001;
        memory[(k * 104729) & ((1 << 20) - 1)]++;
    }
    result = sum;
}

int main(int count, char **words)
{
    if (count != 4)
        return 2;
    const int64_t ticks = atoll(words[1]);
    int64_t *late = malloc((size_t)ticks * 2 * sizeof *late), *worked = late + ticks;
    memset(late, 0, (size_t)ticks * 2 * sizeof *late); /* no page is touched for the first time in the loop */
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(atoi(words[3]), &one);
    sched_setaffinity(0, sizeof one, &one);
    mlockall(MCL_CURRENT | MCL_FUTURE);
    const struct sched_param priority = {atoi(words[2])};
    if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0)
        fprintf(stderr, "no SCHED_FIFO\n");
    int64_t deadline = now_ns() + 2000000;
    for (int64_t tick = 0; tick < ticks; tick++, deadline += 1000000) {
        const struct timespec until = {deadline / 1000000000, deadline % 1000000000};
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) != 0)
            ;
        const int64_t woken = now_ns();
        late[tick] = woken - deadline;
        work();
        worked[tick] = now_ns() - woken;
    }
    fwrite(late, sizeof *late, (size_t)ticks * 2, stdout);
    return 0;
}
