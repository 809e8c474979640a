/* Loaded before libc: each look at the time of day finds it stepped by an hour, forth and back. The monotonic clock is left alone. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/time.h>
#include <time.h>

static atomic_uint looks;

static long step(void) { return atomic_fetch_add(&looks, 1) % 2 ? 3600 : -3600; }

int clock_gettime(clockid_t clock, struct timespec *now) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int failed = real(clock, now);
    if (!failed && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) now->tv_sec += step();
    return failed;
}

/* Says at the end how often the time of day was read: a test that counts none has tested nothing. */
__attribute__((destructor)) static void count(void) {
    if (getenv("STEPPING_CLOCK_COUNTS")) fprintf(stderr, "looks at the time of day: %u\n", atomic_load(&looks));
}
