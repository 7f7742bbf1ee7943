/* A bass and the synth that plays it, without Python: memory, files and threads; all else is in the kernels. */
#ifndef LB_CORE_H
#define LB_CORE_H
#include "kernels.h"

typedef struct lb_bass lb_bass;
typedef struct {
    LB_SYNTH record; /* first: the kernels take its address */
    const lb_kernels *kernels;
    void *rings;
} lb_synth;

/* The kernels for this processor; LIVEBASS_LEVEL may name a lower level. [any thread] */
const lb_kernels *lb_best_kernels(void);

/* Reads an instrument file and prepares it in a tier, at an audio rate (Hz). Basses of the same file, tier and rate
   share their operators. Returns 0 after writing one line into `error`, (room) bytes. [not the audio thread] */
lb_bass *lb_load_bass(const char *path, int tier, double rate, int64_t seed, const lb_kernels *, char *error,
                      size_t room);
/* Frees a bass, which may be 0; it must not be playing. [not the audio thread] */
void lb_free_bass(lb_bass *);
/* What a synth takes as the address of a bass, and back. [any thread] */
int64_t lb_address(const lb_bass *);
lb_bass *lb_bass_at(int64_t address);

/* Returns 0 if there is no memory. [not the audio thread] */
lb_synth *lb_new_synth(double rate, const lb_kernels *);
/* Gives a synth a bass, or 0, that it plays as new; frees those it had. [not while it plays] */
void lb_put_on(lb_synth *, lb_bass *);
/* Makes a synth and the bass that it was given last as new. [not while it plays] */
void lb_reset_synth(lb_synth *);
void lb_free_synth(lb_synth *);
/* Sends a MIDI message for the frame `offset` of the next block; whatever else comes is left out. [audio thread] */
void lb_send(lb_synth *, int64_t offset, const uint8_t *bytes, size_t count);
/* Plays n frames. [audio thread] */
void lb_play(lb_synth *, float *out, int64_t n);
#endif
