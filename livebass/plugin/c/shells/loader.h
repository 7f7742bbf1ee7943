/* A thread that loads an instance's basses, for hosts without one for that. */
#ifndef LB_LOADER_H
#define LB_LOADER_H
#include "instance/instance.h"
#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#else
#include <pthread.h>
#endif

typedef struct {
    lb_instance *instance;
    int on; /* the thread runs and must continue */
#ifdef _WIN32
    HANDLE thread;
    SRWLOCK lock;
    CONDITION_VARIABLE wish;
#else
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t wish;
#endif
} lb_loader; /* begins as zeros */

/* [main thread] */
void lb_start_loader(lb_loader *, lb_instance *);
void lb_stop_loader(lb_loader *); /* may be off */
/* Makes the thread call lb_serve. Takes no lock: if the signal is lost, the next block asks again. [audio thread] */
void lb_ask_loader(lb_loader *);
#endif
