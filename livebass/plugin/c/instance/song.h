/* A MIDI file that plays in an instance, by the kernels that play scores in `livebass play`: at its own tempo, once or in
   a loop. No state keeps it; a host's reset stops it. */
#ifndef LB_SONG_H
#define LB_SONG_H
#include "instance/instance.h"

/* Its messages, for a rate and a bass. Once given to an instance it belongs to the audio thread. */
struct lb_song {
    LB_DESK desk;
    int64_t end;   /* frames: it then stops or begins again */
    int continues; /* it is the last one, for another bass: it goes on where that was */
    int64_t memory[]; /* frames and packed messages, then what the desk keeps */
};

/* A song of `count` messages, to be filled in by frame: the frame and the packed words (ring.py) of each. Returns 0 if
   there is no memory. [not the audio thread] */
lb_song *lb_new_song(int64_t count, int64_t **frames, int64_t **words);
/* Makes the filled song ready to play, at an audio rate, up to frame `end`. */
void lb_load_song(lb_song *, double rate, int64_t end, const lb_kernels *);
/* Gives it to the audio thread, in place of the last one. [not the audio thread] */
void lb_put_song(lb_instance *, lb_song *);
/* Frees songs that the audio thread has replaced. [not the audio thread but offline] */
void lb_free_songs(lb_instance *);
#endif
