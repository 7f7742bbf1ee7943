/* Checks the thread rules in builds for tests. */
#include "system/thread.h"

#ifdef LB_CHECK_THREADS
#include <stdio.h>
#include <stdlib.h>

static _Thread_local int real_time; /* this thread is within a block; its address identifies the thread */

static void stop(const char *function, const char *why) {
    fprintf(stderr, "livebass: %s: %s\n", function, why);
    abort();
}

lb_owner *lb_enter_alone(lb_owner *owner, const char *function) {
    const void *nobody = 0, *self = &real_time;
    if (!__atomic_compare_exchange_n(&owner->thread, &nobody, self, 0, __ATOMIC_ACQUIRE, __ATOMIC_RELAXED) &&
        nobody != self)
        stop(function, "another thread is at work there");
    owner->depth++;
    return owner;
}

void lb_leave_alone(lb_owner **owner) {
    if (!--(*owner)->depth) __atomic_store_n(&(*owner)->thread, 0, __ATOMIC_RELEASE);
}

void lb_check_waiting(const char *function) {
    if (real_time) stop(function, "the audio thread may not wait");
}

void lb_set_real_time(int on) { real_time = on; }
#endif
