/* A MIDI file read by the kernels, as Python and the page read it: the messages of its bass. [not the audio thread] */
#ifndef LB_SCORE_H
#define LB_SCORE_H
#include "kernels.h"

typedef struct {
    const lb_kernels *kernels;
    LB_SMF smf;
    LB_SCORE score; /* its `played_count` LB_PLAYED at `played`, by frame, are what to play */
    int64_t left_out, raised; /* key switches of another instrument; low notes that move up by octaves */
    void *memory[6];
    int blocks; /* of memory */
} lb_score;
typedef struct { /* what a bass makes of keys */
    int lowest, highest;
    uint8_t switches[LB_KEY_COUNT]; /* 1: the key switches */
} lb_keys;

/* Reads a file's bytes, which must stay, at a rate (Hz), and chooses its bass, as `auto` does. Returns 0 after writing
   the fault into `why`, as one line to follow the name and a colon. Free it in either case. */
int lb_read_score(lb_score *, const uint8_t *bytes, size_t count, int rate, const lb_kernels *, char *why, size_t room);
void lb_free_score(lb_score *);
/* Makes notes of low keys, and takes switches of another instrument away, unless the file is a take. Returns 0 if there
   is no memory. */
int lb_fit_score(lb_score *, const lb_keys *);
/* Writes a part as Python lists it: channel 2 "Bass" (program 34, 120 notes, E1 to G2). */
void lb_describe_part(const lb_score *, int64_t number, char *text, size_t room);
/* Writes what plays, what does not, and why. */
void lb_describe_score(const lb_score *, char *line, size_t room);
#endif
