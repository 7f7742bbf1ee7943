/* A lock of its own for each file that includes this. [not the audio thread] */
#ifndef LB_LOCK_H
#define LB_LOCK_H
#include "thread.h"

#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
static SRWLOCK lock = SRWLOCK_INIT;
static void enter(void) {
    LB_MAY_WAIT();
    AcquireSRWLockExclusive(&lock);
}
static void leave(void) { ReleaseSRWLockExclusive(&lock); }
#else
#include <pthread.h>
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static void enter(void) {
    LB_MAY_WAIT();
    pthread_mutex_lock(&lock);
}
static void leave(void) { pthread_mutex_unlock(&lock); }
#endif
#endif
