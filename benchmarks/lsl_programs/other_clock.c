/* Library for LD_PRELOAD that gives a process the CLOCK_MONOTONIC of another computer: shifted, and faster or slower.
 *
 * faked = true + CLOCK_SHIFT_NS + (true - CLOCK_START_NS) * CLOCK_DRIFT_PPB / 1e9
 *
 * Absolute times of that clock that go to the kernel are translated back.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static long long shift, ppb, start;

__attribute__((constructor)) static void read_environment(void) {
    shift = atoll(getenv("CLOCK_SHIFT_NS"));
    ppb = atoll(getenv("CLOCK_DRIFT_PPB"));
    start = atoll(getenv("CLOCK_START_NS"));
}

static long long nanoseconds(const struct timespec *t) { return t->tv_sec * 1000000000LL + t->tv_nsec; }

static struct timespec timespec_of(long long ns) {
    struct timespec t = {ns / 1000000000LL, ns % 1000000000LL};
    return t;
}

static struct timespec true_time(const struct timespec *faked) {
    long long since = nanoseconds(faked) - shift - start;
    return timespec_of(start + (long long)(since / (1.0L + ppb * 1e-9L)));
}

int clock_gettime(clockid_t clock, struct timespec *t) {
    int error = (int)syscall(SYS_clock_gettime, clock, t);
    if (!error && clock == CLOCK_MONOTONIC) {
        long long now = nanoseconds(t);
        *t = timespec_of(now + shift + (long long)((now - start) * (ppb * 1e-9L)));
    }
    return error;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *request, struct timespec *rest) {
    struct timespec t = *request;
    if (clock == CLOCK_MONOTONIC && (flags & TIMER_ABSTIME)) t = true_time(request);
    return syscall(SYS_clock_nanosleep, clock, flags, &t, rest) ? 4 : 0; /* EINTR */
}

int pthread_cond_clockwait(pthread_cond_t *condition, pthread_mutex_t *mutex, clockid_t clock,
                           const struct timespec *until) {
    static int (*real)(pthread_cond_t *, pthread_mutex_t *, clockid_t, const struct timespec *);
    if (!real) real = (int (*)(pthread_cond_t *, pthread_mutex_t *, clockid_t, const struct timespec *))
                   dlsym(RTLD_NEXT, "pthread_cond_clockwait");
    struct timespec t = *until;
    if (clock == CLOCK_MONOTONIC) t = true_time(until);
    return real(condition, mutex, clock, &t);
}
