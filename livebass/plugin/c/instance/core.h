/* A bass and its synth, without Python: memory, files and threads; the kernels do the rest. */
#ifndef LB_CORE_H
#define LB_CORE_H
#include "kernels.h"

/* A host's log line about a session with a missing instrument. */
#define LB_NOT_INSTALLED "the session's instrument is not installed: %.63s"

/* The line about the plugin's own threads if the system refuses them priority. */
#define LB_NO_HELPERS "one core plays: threads of the plugin's own need real-time priority, which the system refuses"

typedef struct lb_bass lb_bass;
typedef struct lb_response lb_response; /* of response.h */
typedef struct {
    LB_SYNTH record; /* first: the kernels take its address */
    const lb_kernels *kernels;
    void *rings;
    int64_t pool;               /* address of the function that lets a host's threads play strings; 0: none */
    struct lb_helper *helpers;  /* its own threads that play strings */
    int offline, relief, ahead; /* ahead: the bass put on last can run ahead */
    int64_t busy;               /* parameters and bends keep the kernels busy until this frame */
    float mix[LB_CHUNK];        /* of lb_play_strings */
} lb_synth;

/* The kernels for this processor; LIVEBASS_LEVEL may name a lower level. [any thread] */
const lb_kernels *lb_best_kernels(void);

/* --- basses --- */

typedef struct { /* an instrument file: its path, and its bytes if they are not those on disk */
    const char *path;
    const void *bytes;
    size_t size;
} lb_source;

/* Reads an instrument file and prepares it in a tier, at an audio rate (Hz). Basses of the same file, tier and rate
   share their operators. With `ahead` its strings may run ahead of the clock in quiet times, which takes memory.
   `built`: the values of lb_sliders, which change the bass; 0: unchanged. `response`: in place of the bass's own; 0:
   that; the bass becomes a user of it. Returns 0 after writing one line into `error`, (room) bytes. [not the audio
   thread] */
lb_bass *lb_load_bass(const lb_source *, int tier, double rate, int64_t seed, int ahead, const double *built,
                      lb_response *response, const lb_kernels *, char *error, size_t room);
typedef struct { /* what stands above a string at rest, so that the neck cannot be played */
    int open, fret; /* the string's open note, MIDI; 0: the board */
    double height;  /* mm */
} lb_fault;
size_t lb_fault_to_text(const lb_fault *, char *text, size_t room); /* as a clause; returns its length */
/* Returns 1 if a file's bass can have the values in `built`; else writes the fault. [not the audio thread] */
int lb_fits(const lb_source *, const double *built, lb_fault *, const lb_kernels *);
/* Moves sliders from values that a file's bass can have towards those in `built`, as far as it can have them, and writes
   them there, and the fault beyond them. Returns 0 if it cannot even have the first ones. [not the audio thread] */
int lb_fit_sliders(const lb_source *, const double *from, double *built, lb_fault *, const lb_kernels *);
/* Frees a bass, which may be 0; it must not be playing. [not the audio thread] */
void lb_free_bass(lb_bass *);

/* Rounds a slider's value to hundredths of its unit: 0 stays 0 in a host that keeps fractions of the range as floats,
   and the bass stays unchanged. */
double lb_hundredths(double value);

/* --- synths --- */

/* Returns 0 if there is no memory. [not the audio thread] */
lb_synth *lb_new_synth(double rate, const lb_kernels *);
/* Resets a synth with another bass, or 0; frees its old basses. Its parameters stay. [not while it plays] */
void lb_put_on(lb_synth *, lb_bass *);
/* Resets a synth and the bass it was given last; its parameters stay. [not while it plays] */
void lb_reset_synth(lb_synth *);
/* Frees a synth, which may be 0, and its basses. [not while it plays] */
void lb_free_synth(lb_synth *);

/* True during a change of bass: no other change may begin. [audio thread] */
int lb_changing(const lb_synth *);
/* Plays another bass from the next block on; the old one rings out. Not during a change. [audio thread] */
void lb_change_bass(lb_synth *, lb_bass *);
/* Takes back the bass that a synth has not begun to play, or 0. [audio thread] */
lb_bass *lb_take_next(lb_synth *);
/* Returns a bass that has rung out, or 0; the caller frees it, in another thread. [audio thread] */
lb_bass *lb_take_faded(lb_synth *);

/* Messages are for the frame `offset` of the next block; offsets must not decrease within a block. Values are clamped
   to their limits; NaN is the default value. [audio thread] */
void lb_send(lb_synth *, int64_t offset, const uint8_t *bytes, size_t count); /* MIDI; anything else is ignored */
/* Moves a controller on every channel, for notes of all channels. */
void lb_send_everywhere(lb_synth *, int64_t offset, int controller, int value);
/* The next three are for control, not for notes: in a flood they take no more than the synth can follow; notes are
   neither lost nor late. They return 0 for a value not taken: send the last one again in the next block. */
/* Sets a parameter if an event of the synth can set it, else does nothing. */
int lb_set(lb_synth *, int64_t offset, int parameter, double value);
/* Bends the string that last played a channel's (0 to 15) key, until it plays another note. */
int lb_bend_note(lb_synth *, int64_t offset, int channel, int key, double semitones);
/* Sets the vibrato, 0 to 1, of the string that last played a channel's key, until it plays another note. */
int lb_vibrate_note(lb_synth *, int64_t offset, int channel, int key, double amount);
/* Ends the sound of a channel's key at once, regardless of the pedal. */
void lb_cut_note(lb_synth *, int64_t offset, int channel, int key);
/* The next note of a key will be played on this string, counted from 0. */
void lb_choose_string(lb_synth *, int64_t offset, int key, int string);
/* The next note of a key will be plucked at this place, -1 to 1 as for the parameter LB_PLUCK_POSITION. */
void lb_place_note(lb_synth *, int64_t offset, int key, double position);

/* Plays n frames. [audio thread] */
void lb_play(lb_synth *, float *out, int64_t n);
/* Plays n frames, each of the LB_STRINGS strings into its own output, unless that is 0. While one bass plays, their sum
   in float32, string after string, equals lb_play's sound bit for bit. [audio thread] */
void lb_play_strings(lb_synth *, float *const *outs, int64_t n);

/* --- strings side by side: the sound is the same bit for bit, whichever threads play them --- */

/* From now on each block calls `pool`, except offline: it may let other threads call lb_help until the `strings`
   strings are played, and then returns, or at once if it has no threads. [not while it plays] */
void lb_share(lb_synth *, void (*pool)(int64_t owner, int64_t strings), void *owner);
/* Plays strings of the present block, if any are left. [a thread of the pool] */
void lb_help(lb_synth *);
/* Ends the synth's own threads, and starts `count`, at most one per remaining core. Returns 0 if the system refuses
   them real-time priority, without which other programs could hold up a string: then none run. None run on Windows
   either, where no thread can rest for less than a block. [not the audio thread, except offline] */
int lb_set_helpers(lb_synth *, int count);

/* True if it plays only zeros until the next message. [audio thread] */
int lb_is_still(const lb_synth *);
/* Returns how many strings are relieved now. [audio thread] */
int lb_overload(const lb_synth *);

/* Offline nothing depends on the clock: strings do not run ahead and are not relieved. [audio thread] */
void lb_offline(lb_synth *, int on);
/* With relief on, overload moves strings to coarser operators for a while; a new synth has it off. [audio thread] */
void lb_relieve(lb_synth *, int on);

/* --- the shelf: the instruments that a plugin offers --- */

/* Finds the instrument files: first those in `folder`, beside the binary, in the order of its list instruments.txt;
   then the user's, by name: in $XDG_DATA_HOME/livebass or ~/.local/share/livebass, on macOS
   ~/Library/Application Support/livebass, on Windows %APPDATA%\livebass. If names repeat, the first counts. Returns 0
   if there is no memory. Names and paths are UTF-8 and live as long as the shelf. [not the audio thread] */
typedef struct lb_shelf lb_shelf;
lb_shelf *lb_open_shelf(const char *folder);
const char *lb_shelf_folder(const lb_shelf *);           /* of the plugin's own instruments */
int lb_shelf_count(const lb_shelf *);                    /* at most LB_MAX_BASSES */
const char *lb_shelf_name(const lb_shelf *, int);        /* of the file, without .lbass: what sessions save */
const char *lb_shelf_title(const lb_shelf *, int);       /* the file's title, for people; followed by its name if an
                                                            earlier one has the same title */
lb_source lb_shelf_source(const lb_shelf *, int);
void *lb_source_bytes(const lb_source *, size_t *count); /* its bytes, allocated by malloc; 0: it cannot be read */
/* Plays a bass as a session kept it, in place of the one with its name, or beside all if there is none; returns its
   number, or -1 after writing one line into `error`. The same bass as on disk is that one. [main thread] */
int lb_keep_bass(lb_shelf *, const char *name, const void *bytes, size_t count, char *error, size_t room);
int lb_is_kept(const lb_shelf *, int);           /* it differs from the one on disk, which exists */
void lb_update_bass(lb_shelf *, int);            /* plays the one on disk, if it exists. [not the audio thread] */
const void *lb_present_bass(const lb_shelf *, int);    /* what plays of these two, ... */
void lb_put_bass(lb_shelf *, int, const void *present); /* ... and plays it again. [not the audio thread] */
uint64_t lb_kept_sum(const lb_shelf *, int); /* 0: the one on disk plays */
const lb_switch *lb_shelf_switch(const lb_shelf *, int, int key); /* a key's switch; 0: the key plays a note */
/* Where it is listed for people. */
enum { LB_SHIPPED, LB_MINE, LB_FACTORY, LB_LABORATORY, LB_SOUND_GROUPS };
int lb_shelf_group(const lb_shelf *, int);
int lb_shelf_quality(const lb_shelf *, int);             /* the list's initial quality: a value of LB_QUALITY */
const LB_INSTRUMENT *lb_shelf_instrument(const lb_shelf *, int); /* 0: the file cannot be read */
/* A bass's own values of what sliders move, in mm, kg, Hz, pF, degrees, inches (strings). NaN: not known. */
typedef struct {
    double action, nut_height, relief; /* under the lowest string at fret 12 and fret 1, and the hollow */
    double foam, place[2], cable, finger_width, pluck_angle, a4;
    double nearest[2], farthest[2];             /* from the bridge, that a pickup has room for */
    double thickest, thinnest, tension, length; /* of the strings; of the lowest one */
    double resonance, mass;                     /* at which its neck bends */
    double at[LB_PLACES], height[LB_PLACES];    /* of the crowns under it, from the nut and the open string at rest */
    int crowns;
    int64_t open; /* note of the lowest string, MIDI */
} lb_own;
const lb_own *lb_shelf_own(const lb_shelf *, int);
int lb_shelf_find(const lb_shelf *, const char *name);   /* -1: it is not there */
int lb_shelf_program(const lb_shelf *, int64_t program); /* the choice of a program change, from 0; -1: none */
void lb_close_shelf(lb_shelf *);                         /* may be 0 */
#endif
