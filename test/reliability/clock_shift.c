/*
 * The system clock of one process, ahead of the machine's by what a file says; to be preloaded.
 *
 * As with a clock that is really set, a wait until a moment of the system clock ends when that
 * clock gets there, wherever it is set meanwhile: it is made in slices.  The steady clock is left
 * alone.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define SLICE 10000000LL /* ns */
#define SECOND 1000000000LL

static volatile long long *shift; /* s */
static int (*cond_timedwait)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
static int (*mutex_timedlock)(pthread_mutex_t *, const struct timespec *);
static int (*semaphore_timedwait)(sem_t *, const struct timespec *);

__attribute__((constructor)) static void begin(void) {
    int file = open(getenv("CLOCK_SHIFT"), O_RDONLY);
    shift = mmap(NULL, sizeof *shift, PROT_READ, MAP_SHARED, file, 0);
    close(file);
    cond_timedwait = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    mutex_timedlock = dlsym(RTLD_NEXT, "pthread_mutex_timedlock");
    semaphore_timedwait = dlsym(RTLD_NEXT, "sem_timedwait");
}

static long long ahead(void) { return shift ? *shift * SECOND : 0; }

static long long nanoseconds(const struct timespec *t) { return t->tv_sec * SECOND + t->tv_nsec; }

static long long machine_now(void) {
    struct timespec t;
    syscall(SYS_clock_gettime, CLOCK_REALTIME, &t);
    return nanoseconds(&t);
}

/* The end of a slice, by the machine's clock, of a wait until `t`. */
static struct timespec slice(const struct timespec *t) {
    long long end = nanoseconds(t) - ahead(), soon = machine_now() + SLICE;
    if (end > soon) end = soon;
    if (end < 0) end = 0;
    return (struct timespec){end / SECOND, end % SECOND};
}

static int over(const struct timespec *t) { return machine_now() + ahead() >= nanoseconds(t); }

int clock_gettime(clockid_t clock, struct timespec *t) {
    int result = (int)syscall(SYS_clock_gettime, clock, t);
    if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        t->tv_sec += ahead() / SECOND;
    return result;
}

int gettimeofday(struct timeval *restrict t, void *restrict zone) {
    struct timespec now;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &now);
    *t = (struct timeval){now.tv_sec, now.tv_nsec / 1000};
    return 0;
}

time_t time(time_t *t) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (t) *t = now.tv_sec;
    return now.tv_sec;
}

int pthread_cond_timedwait(pthread_cond_t *restrict c, pthread_mutex_t *restrict m,
                           const struct timespec *restrict t) {
    if (c->__data.__wrefs & 2) return cond_timedwait(c, m, t); /* it waits on the steady clock */
    for (;;) {
        struct timespec end = slice(t);
        int result = cond_timedwait(c, m, &end);
        if (result != ETIMEDOUT || over(t)) return result;
    }
}

int pthread_mutex_timedlock(pthread_mutex_t *restrict m, const struct timespec *restrict t) {
    for (;;) {
        struct timespec end = slice(t);
        int result = mutex_timedlock(m, &end);
        if (result != ETIMEDOUT || over(t)) return result;
    }
}

int sem_timedwait(sem_t *restrict s, const struct timespec *restrict t) {
    for (;;) {
        struct timespec end = slice(t);
        int result = semaphore_timedwait(s, &end);
        if (result == 0 || errno != ETIMEDOUT || over(t)) return result;
    }
}
