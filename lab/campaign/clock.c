// SPDX-FileCopyrightText: 2026 The antenna_drive authors
// SPDX-License-Identifier: Apache-2.0
//
// A wall clock that differs from the machine's by an offset, for processes that load this first.
//
// The offset [ns] is the first eight bytes of the file CLOCK_OFFSET_FILE, which may change at any
// time. Deadlines on the wall clock are turned into the machine's time when a wait begins. The
// monotonic clock stays as it is.

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static const volatile int64_t *offset;
static int (*real_gettime)(clockid_t, struct timespec *);
static int (*real_cond)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
static int (*real_cond_clock)(pthread_cond_t *, pthread_mutex_t *, clockid_t,
                              const struct timespec *);
static int (*real_sem)(sem_t *, const struct timespec *);
static int (*real_mutex)(pthread_mutex_t *, const struct timespec *);

__attribute__((constructor)) static void begin(void)
{
    static const int64_t none = 0;
    const char *path = getenv("CLOCK_OFFSET_FILE");
    int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    void *memory = file < 0 ? MAP_FAILED : mmap(NULL, 8, PROT_READ, MAP_SHARED, file, 0);
    if (file >= 0)
        close(file);
    real_gettime = dlsym(RTLD_NEXT, "clock_gettime");
    real_cond = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    if (!real_cond)
        real_cond = dlsym(RTLD_NEXT, "pthread_cond_timedwait");
    real_cond_clock = dlsym(RTLD_NEXT, "pthread_cond_clockwait");
    real_sem = dlsym(RTLD_NEXT, "sem_timedwait");
    real_mutex = dlsym(RTLD_NEXT, "pthread_mutex_timedlock");
    offset = memory == MAP_FAILED ? &none : memory;
}

static struct timespec moved(const struct timespec *at, int64_t by)
{
    int64_t ns = at->tv_sec * 1000000000LL + at->tv_nsec + by;
    struct timespec then = {ns / 1000000000LL, ns % 1000000000LL};
    return then;
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    if (!offset)
        begin();
    int status = real_gettime(clock, now);
    if (status == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        *now = moved(now, *offset);
    return status;
}

int gettimeofday(struct timeval *now, void *zone)
{
    struct timespec at;
    clock_gettime(CLOCK_REALTIME, &at);
    now->tv_sec = at.tv_sec;
    now->tv_usec = at.tv_nsec / 1000;
    return 0;
}

time_t time(time_t *now)
{
    struct timespec at;
    clock_gettime(CLOCK_REALTIME, &at);
    if (now)
        *now = at.tv_sec;
    return at.tv_sec;
}

int pthread_cond_clockwait(pthread_cond_t *condition, pthread_mutex_t *mutex, clockid_t clock,
                           const struct timespec *deadline)
{
    if (!offset)
        begin();
    struct timespec then = moved(deadline, clock == CLOCK_REALTIME ? -*offset : 0);
    return real_cond_clock(condition, mutex, clock, &then);
}

/* A condition may wait on the monotonic clock: its deadlines lie far from the wall clock's. */
int pthread_cond_timedwait(pthread_cond_t *condition, pthread_mutex_t *mutex,
                           const struct timespec *deadline)
{
    if (!offset)
        begin();
    int wall = deadline->tv_sec > 1000000000LL;
    struct timespec then = moved(deadline, wall ? -*offset : 0);
    return real_cond(condition, mutex, &then);
}

int sem_timedwait(sem_t *semaphore, const struct timespec *deadline)
{
    if (!offset)
        begin();
    struct timespec then = moved(deadline, -*offset);
    return real_sem(semaphore, &then);
}

int pthread_mutex_timedlock(pthread_mutex_t *mutex, const struct timespec *deadline)
{
    if (!offset)
        begin();
    struct timespec then = moved(deadline, -*offset);
    return real_mutex(mutex, &then);
}
