/* A bass and the synth that plays it, without Python: memory, files and threads; all else is in the kernels. */
#ifndef LB_CORE_H
#define LB_CORE_H
#include "kernels.h"

/* The line in a host's log about a session whose instrument is missing. */
#define LB_NOT_INSTALLED "the session's instrument is not installed: %.63s"

/* The line about threads of one's own that the system refuses. */
#define LB_NO_HELPERS "one core plays: threads of the plugin's own need real-time priority, which the system refuses"

typedef struct lb_bass lb_bass;
typedef struct {
    LB_SYNTH record; /* first: the kernels take its address */
    const lb_kernels *kernels;
    void *rings;
    int64_t pool;               /* address of the function that has a host's threads play strings; 0: none */
    struct lb_helper *helpers;  /* threads of its own that do */
    int offline, relief, ahead; /* ahead: the bass that was put on last can run ahead */
    int64_t busy;               /* the frame until which parameters and bends keep the kernels busy */
    float mix[LB_CHUNK];        /* of lb_play_strings */
} lb_synth;

/* The kernels for this processor; LIVEBASS_LEVEL may name a lower level. [any thread] */
const lb_kernels *lb_best_kernels(void);

/* --- basses --- */

/* Reads an instrument file and prepares it in a tier, at an audio rate (Hz). Basses of the same file, tier and rate
   share their operators. With `ahead` its strings may run ahead of the clock in quiet times, which takes memory.
   `built`: the LB_BUILT values from LB_ACTION on, by which it is built anew; 0: as the file has it. Returns 0 after
   writing one line into `error`, (room) bytes. [not the audio thread] */
lb_bass *lb_load_bass(const char *path, int tier, double rate, int64_t seed, int ahead, const double *built,
                      const lb_kernels *, char *error, size_t room);
/* Frees a bass, which may be 0; it must not be playing. [not the audio thread] */
void lb_free_bass(lb_bass *);

/* A value of those that a bass is built by, in hundredths of its unit: a host that knows parts of the range in float
   gives back 0 as 0, and the bass stays as its file has it. */
double lb_hundredths(double value);

/* --- synths --- */

/* Returns 0 if there is no memory. [not the audio thread] */
lb_synth *lb_new_synth(double rate, const lb_kernels *);
/* Gives a synth a bass, or 0, that it plays as new; frees those it had. Its parameters stay. [not while it plays] */
void lb_put_on(lb_synth *, lb_bass *);
/* Makes a synth and the bass that it was given last as new; its parameters stay. [not while it plays] */
void lb_reset_synth(lb_synth *);
/* Frees a synth, which may be 0, and its basses. [not while it plays] */
void lb_free_synth(lb_synth *);

/* True while a change of bass is under way: no other may begin. [audio thread] */
int lb_changing(const lb_synth *);
/* Plays another bass from the next block on; the one before rings out. Not while one is changing. [audio thread] */
void lb_change_bass(lb_synth *, lb_bass *);
/* Takes back the bass that a synth was given and has not begun to play, or 0. [audio thread] */
lb_bass *lb_take_next(lb_synth *);
/* Returns a bass that has rung out, or 0; whoever asked frees it, elsewhere. [audio thread] */
lb_bass *lb_take_faded(lb_synth *);

/* Messages are for the frame `offset` of the next block; offsets must not fall within one block. Values beyond their
   limits are held within, NaN is the usual value. [audio thread] */
void lb_send(lb_synth *, int64_t offset, const uint8_t *bytes, size_t count); /* MIDI; whatever else is left out */
/* Moves a controller on every channel: for notes of whatever channel. */
void lb_send_everywhere(lb_synth *, int64_t offset, int controller, int value);
/* The next three are for control, not for notes: of a flood they take no more than the synth can follow, so that notes
   are neither lost nor late. What is not taken gives 0: the last value is to be sent again in the next block. */
/* Sets a parameter that an event of the synth sets, else nothing. */
int lb_set(lb_synth *, int64_t offset, int parameter, double value);
/* Bends one string, counted from 0, besides what the wheel does, until the controllers are reset. */
int lb_bend_string(lb_synth *, int64_t offset, int string, double semitones);
/* The same for the string that played a key of a channel (0 to 15) last, until it plays another note. */
int lb_bend_note(lb_synth *, int64_t offset, int channel, int key, double semitones);
/* Vibrato of the string that played a key of a channel last, 0 to 1, until it plays another note. */
int lb_vibrate_note(lb_synth *, int64_t offset, int channel, int key, double amount);
/* Ends the sound of the note of a key of a channel at once, whatever the pedal does. */
void lb_cut_note(lb_synth *, int64_t offset, int channel, int key);
/* The next note of a key will be played on this string, counted from 0. */
void lb_choose_string(lb_synth *, int64_t offset, int key, int string);
/* The next note of a key will be plucked at this place, -1 to 1 as the parameter LB_PLUCK_POSITION. */
void lb_place_note(lb_synth *, int64_t offset, int key, double position);

/* Plays n frames. [audio thread] */
void lb_play(lb_synth *, float *out, int64_t n);
/* Plays n frames, each of the LB_STRINGS strings into its own output, where that is not 0; their sum in float32, string
   after string, is what lb_play gives, bit for bit while one bass plays. [audio thread] */
void lb_play_strings(lb_synth *, float *const *outs, int64_t n);

/* --- strings side by side: whoever plays them, the sound is the same bit for bit --- */

/* From now on `pool` is called while a block plays: it may have other threads call lb_help until the strings, so many,
   are played, and returns then, or at once if it has none. Not offline. [not while it plays] */
void lb_share(lb_synth *, void (*pool)(int64_t owner, int64_t strings), void *owner);
/* Plays strings of the present block, if some are left. [a thread of the pool] */
void lb_help(lb_synth *);
/* Ends the threads of its own that it has, and starts `count`, at most one a core that is left. Returns 0 if the system
   refuses them real-time priority, without which other programs could hold up a string: then there are none, as on
   Windows, where none rests for less than a block. [not the audio thread, but offline] */
int lb_set_helpers(lb_synth *, int count);

/* True if it plays nothing but zeros until something is sent to it. [audio thread] */
int lb_is_still(const lb_synth *);
/* How many strings are relieved now. [audio thread] */
int lb_overload(const lb_synth *);

/* Offline nothing depends on the clock: strings do not run ahead and are not relieved. [audio thread] */
void lb_offline(lb_synth *, int on);
/* With relief on, overload moves strings to coarser operators for a while; a new synth has it off. [audio thread] */
void lb_relieve(lb_synth *, int on);

/* --- the shelf: the instruments that a plugin offers --- */

/* Finds the instrument files: those beside the binary, in `folder`, in the order of its list instruments.txt; then all
   others of the user, by name: in $XDG_DATA_HOME/livebass or ~/.local/share/livebass, on macOS
   ~/Library/Application Support/livebass, on Windows %APPDATA%\livebass. Of one name the first counts. Returns 0 if
   there is no memory. Names and paths are UTF-8 and live as long as the shelf. [not the audio thread] */
typedef struct lb_shelf lb_shelf;
lb_shelf *lb_open_shelf(const char *folder);
int lb_shelf_count(const lb_shelf *);                    /* at most LB_MOST_BASSES */
const char *lb_shelf_name(const lb_shelf *, int);        /* of the file, without .lbass: what sessions save */
const char *lb_shelf_title(const lb_shelf *, int);       /* what the file says it is called, for people; its name
                                                            comes behind if one before has that title */
const char *lb_shelf_path(const lb_shelf *, int);
const lb_switch *lb_shelf_switch(const lb_shelf *, int, int key); /* what a key switches; 0: it is a note's */
int lb_shelf_quality(const lb_shelf *, int);             /* in which to begin: a value of LB_QUALITY, as the list says */
const LB_PLAYER *lb_shelf_player(const lb_shelf *, int); /* 0: the file cannot be read */
int lb_shelf_find(const lb_shelf *, const char *name);   /* -1: it is not there */
int lb_shelf_program(const lb_shelf *, int64_t program); /* what a program change, from 0, chooses; -1: nothing */
void lb_close_shelf(lb_shelf *);                         /* may be 0 */
#endif
