/* The VST3 plugin's window for hosts: an object with a view's interfaces. */
#ifndef LB_VST3_VIEW_H
#define LB_VST3_VIEW_H
#include "window/editor.h"

typedef struct { /* the window's owner; it outlives the window */
    void *owner;
    lb_instance *instance;
    void (*take)(void *owner), (*drop)(void *owner);
    void (*tell)(void *owner); /* tells the host of changes made in the window. [the host's window thread] */
    int *attached;             /* becomes 1 while one of its views is in a window: at most one is */
    int *timed;                /* becomes 1 while the host's timer calls `tell`; else the window's own thread must */
} lb_view_owner;

/* Returns 0 if there is no memory. [main thread] */
void *lb_new_vst3_view(const lb_view_owner *);
#endif
