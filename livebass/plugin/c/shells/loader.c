/* The thread that loads basses, on Windows and elsewhere. */
#include "shells/loader.h"

#ifdef _WIN32
static void enter(lb_loader *l) { AcquireSRWLockExclusive(&l->lock); }
static void leave(lb_loader *l) { ReleaseSRWLockExclusive(&l->lock); }
static void rest(lb_loader *l) { SleepConditionVariableSRW(&l->wish, &l->lock, INFINITE, 0); }
void lb_ask_loader(lb_loader *l) { WakeConditionVariable(&l->wish); }
#else
static void enter(lb_loader *l) { pthread_mutex_lock(&l->lock); }
static void leave(lb_loader *l) { pthread_mutex_unlock(&l->lock); }
static void rest(lb_loader *l) { pthread_cond_wait(&l->wish, &l->lock); }
void lb_ask_loader(lb_loader *l) { pthread_cond_signal(&l->wish); }
#endif

static void load(lb_loader *l) {
    enter(l);
    while (l->on) {
        rest(l);
        leave(l);
        lb_serve(l->instance);
        enter(l);
    }
    leave(l);
}

#ifdef _WIN32
static DWORD WINAPI run(void *loader) {
    load(loader);
    return 0;
}
static int start(lb_loader *l) {
    InitializeSRWLock(&l->lock);
    InitializeConditionVariable(&l->wish);
    return (l->thread = CreateThread(0, 0, run, l, 0, 0)) != 0;
}
static void join(lb_loader *l) {
    WaitForSingleObject(l->thread, INFINITE);
    CloseHandle(l->thread);
}
#else
static void *run(void *loader) {
    load(loader);
    return 0;
}
static int start(lb_loader *l) {
    pthread_mutex_init(&l->lock, 0);
    pthread_cond_init(&l->wish, 0);
    return !pthread_create(&l->thread, 0, run, l);
}
static void join(lb_loader *l) { pthread_join(l->thread, 0); }
#endif

void lb_start_loader(lb_loader *l, lb_instance *i) {
    l->instance = i;
    l->on = 1;
    l->on = start(l);
}

void lb_stop_loader(lb_loader *l) {
    if (!l->on) return;
    enter(l);
    l->on = 0;
    lb_ask_loader(l);
    leave(l);
    join(l);
}
