/* The window of the VST3 plugin, as its hosts hold it: an object with the interfaces of a view. */
#ifndef LB_VST3_VIEW_H
#define LB_VST3_VIEW_H
#include "editor.h"

typedef struct { /* whose window it is; it lives as long */
    void *owner;
    lb_instance *instance;
    void (*take)(void *owner), (*drop)(void *owner);
    void (*tell)(void *owner); /* tells the host of what was done in the window. [the host's thread of windows] */
    int *attached;             /* becomes 1 while one of its views is in a window: there is one at most */
    int *timed;                /* becomes 1 while the host's timer calls that, else the window's own thread has to */
} lb_view_owner;

/* Returns 0 if there is no memory. [main thread] */
void *lb_new_vst3_view(const lb_view_owner *);
#endif
