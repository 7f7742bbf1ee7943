/* What a window shows of a synth: the audio thread writes it while a window watches, others read it, without a lock. */
#ifndef LB_LOOK_H
#define LB_LOOK_H
#include "core.h"

enum { LB_LOOKS = 8, LB_LOOK_RATE = 160 }; /* the last so many are kept; at most so many a second are taken */
typedef struct {
    int watchers;            /* windows that are open */
    double peak;             /* of the sound since the last look */
    LB_LOOK now;             /* the writer's own */
    uint64_t taken;          /* looks so far: the last is at (taken - 1) % LB_LOOKS */
    uint64_t seen[LB_LOOKS]; /* sequence counters: odd while that look is written, twice the looks in its place */
    LB_LOOK looks[LB_LOOKS];
} lb_look; /* begins as zeros */

/* Says that a window opens (1) or closes (0). [any thread] */
void lb_watch(lb_look *, int on);
/* Takes the first look at a synth that begins, or was made as new. [no thread plays] */
void lb_begin_looks(lb_look *, const lb_synth *);
/* After n frames, whose sound is `out`, 0: none; takes a look if a window watches, or if the bass is another one.
   [audio thread] */
void lb_take_look(lb_look *, const lb_synth *, const float *out, int64_t n);
/* Keeps a look that came from elsewhere as the newest: of a window in another process. [one thread] */
void lb_put_look(lb_look *, const LB_LOOK *);
/* Reads the newest look, or that so many before; only the strings that it has are written. Returns 0 if there is none
   (any more). [any thread] */
int lb_read_look(const lb_look *, int before, LB_LOOK *);
/* How many looks have been taken. [any thread] */
uint64_t lb_looks_taken(const lb_look *);
#endif
