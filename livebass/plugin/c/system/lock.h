/* A lock of its own for each file that includes this. [not the audio thread] */
#ifndef LB_LOCK_H
#define LB_LOCK_H
#include "system/thread.h"

#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
static SRWLOCK lock = SRWLOCK_INIT;
#define LB_LOCK AcquireSRWLockExclusive
#define LB_UNLOCK ReleaseSRWLockExclusive
#else
#include <pthread.h>
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
#define LB_LOCK pthread_mutex_lock
#define LB_UNLOCK pthread_mutex_unlock
#endif
static void enter(void) {
    LB_MAY_WAIT();
    LB_LOCK(&lock);
}
static void leave(void) { LB_UNLOCK(&lock); }
#endif
