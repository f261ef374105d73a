/*
 * System clock of one process, ahead of the machine's by the seconds in a file; to be preloaded.
 *
 * As with a clock that is really set, a wait until a moment of the system clock ends when that
 * clock gets there, wherever it is set meanwhile: it is made in slices.
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
    cond_timedwait = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    mutex_timedlock = dlsym(RTLD_NEXT, "pthread_mutex_timedlock");
    semaphore_timedwait = dlsym(RTLD_NEXT, "sem_timedwait");
}

static long long ahead(void) { return shift ? *shift * SECOND : 0; }

static long long machine_now(void) {
    struct timespec t;
    syscall(SYS_clock_gettime, CLOCK_REALTIME, &t);
    return t.tv_sec * SECOND + t.tv_nsec;
}

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

/* Time that is left until `t`, ns; at most a slice, whose end by the machine's clock is `end`. */
static long long next_slice(const struct timespec *t, struct timespec *end) {
    long long now = machine_now(), left = t->tv_sec * SECOND + t->tv_nsec - ahead() - now;
    long long until = now + (left < SLICE ? left : SLICE);
    *end = (struct timespec){until > 0 ? until / SECOND : 0, until > 0 ? until % SECOND : 0};
    return left;
}

#define WAIT(call, timed_out)                          \
    for (struct timespec end;;) {                      \
        int last = next_slice(t, &end) <= SLICE;       \
        int result = call;                             \
        if (!(timed_out) || last) return result;       \
    }

int pthread_cond_timedwait(pthread_cond_t *restrict c, pthread_mutex_t *restrict m,
                           const struct timespec *restrict t) {
    if (c->__data.__wrefs & 2) return cond_timedwait(c, m, t); /* it waits on the steady clock */
    WAIT(cond_timedwait(c, m, &end), result == ETIMEDOUT)
}

int pthread_mutex_timedlock(pthread_mutex_t *restrict m, const struct timespec *restrict t) {
    WAIT(mutex_timedlock(m, &end), result == ETIMEDOUT)
}

int sem_timedwait(sem_t *restrict s, const struct timespec *restrict t) {
    WAIT(semaphore_timedwait(s, &end), result && errno == ETIMEDOUT)
}
