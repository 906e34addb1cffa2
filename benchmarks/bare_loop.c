/* Bare loop for benchmarks/live_loop.py and live_flights.py: an absolute sleep once per millisecond, then a fixed amount
   of work (12000 rounds take some 30 µs), with the rights of the guard's loop. At the end, or at SIGTERM, it writes
   64-bit numbers [ns] to standard output: the first deadline on CLOCK_MONOTONIC, the lateness of each wake-up, and the
   duration of each work, which shows whether the host slows this computer down.

       cc -O2 bare_loop.c -o bare_loop && ./bare_loop TICKS PRIORITY CPU ROUNDS */
#define _GNU_SOURCE
#include <sched.h>
#include <signal.h>
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
static volatile sig_atomic_t is_over;

static void end(int signal)
{
    (void)signal;
    is_over = 1;
}

static void work(int rounds)
{
    double sum = 0.0;
    for (int k = 0; k < rounds; k++) {
        sum = (sum + memory[(k * 7919) & ((1 << 20) - 1)]) * 1.0000001;
        memory[(k * 104729) & ((1 << 20) - 1)]++;
    }
    result = sum;
}

int main(int count, char **words)
{
    if (count != 5)
        return 2;
    signal(SIGTERM, end);
    const int rounds = atoi(words[4]);
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
    int64_t deadline = now_ns() + 2000000, ran = 0;
    const int64_t first = deadline;
    for (int64_t tick = 0; tick < ticks && !is_over; tick++, ran++, deadline += 1000000) {
        const struct timespec until = {deadline / 1000000000, deadline % 1000000000};
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) != 0 && !is_over)
            ;
        const int64_t woken = now_ns();
        late[tick] = woken - deadline;
        work(rounds);
        worked[tick] = now_ns() - woken;
    }
    fwrite(&first, sizeof first, 1, stdout);
    fwrite(late, sizeof *late, (size_t)ran, stdout);
    fwrite(worked, sizeof *worked, (size_t)ran, stdout);
    return 0;
}
