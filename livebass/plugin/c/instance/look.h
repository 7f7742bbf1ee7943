/* The data a window shows of a synth: the audio thread writes it while a window watches; others read it, without
   locks. */
#ifndef LB_LOOK_H
#define LB_LOOK_H
#include "instance/core.h"

enum { LB_LOOKS = 8, LB_LOOK_RATE = 160 }; /* looks kept; most looks per second */
typedef struct {
    int watchers;            /* open windows */
    double peak;             /* of the sound since the last look */
    LB_LOOK now;             /* the writer's own */
    uint64_t taken;          /* looks so far: the last is at (taken - 1) % LB_LOOKS */
    uint64_t seen[LB_LOOKS]; /* sequence counters: odd while a look is written, else twice the looks in its place */
    LB_LOOK looks[LB_LOOKS];
} lb_look; /* begins as zeros */

/* Tells that a window opens (1) or closes (0). [any thread] */
void lb_watch(lb_look *, int on);
/* Takes the first look at a new or reset synth. [no thread plays] */
void lb_begin_looks(lb_look *, const lb_synth *);
/* Takes a look after n frames with the sound `out` (0: none) if a window watches or the bass has changed.
   [audio thread] */
void lb_take_look(lb_look *, const lb_synth *, const float *out, int64_t n);
/* Keeps a look as the newest, for a window in another process. [one thread] */
void lb_put_look(lb_look *, const LB_LOOK *);
/* Reads the newest look, or the one `before` looks earlier; writes only its strings. Returns 0 if there is none
   (any more). [any thread] */
int lb_read_look(const lb_look *, int before, LB_LOOK *);
/* Returns how many looks have been taken. [any thread] */
uint64_t lb_looks_taken(const lb_look *);
#endif
