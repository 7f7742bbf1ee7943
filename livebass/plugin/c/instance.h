/* An instance of the plugin, as the shells of CLAP, VST3 and LV2 hold it: the values of its parameters, its bass, the
   host's notes, its state. No interface of a host is known here. */
#ifndef LB_INSTANCE_H
#define LB_INSTANCE_H
#include "look.h"
#include "thread.h"

enum { LB_STATE_NAME = 64, LB_KEYS = 128, LB_NOTES = LB_CHANNELS * LB_KEYS, LB_MOVES = 256, LB_BY_HAND = 64, LB_UNDONE = 32 };
enum { LB_BEGIN, LB_MOVE, LB_END }; /* phases of a change by hand */
typedef struct { /* a change of a parameter in the window */
    int parameter, phase;
    double value;
} lb_move;
typedef struct { /* changes that the host has not been told of: one thread puts them in, another takes them out */
    uint32_t put, taken;
    lb_move moves[LB_MOVES];
} lb_moves;
typedef struct { /* a note that is played in the window, on a string or, from LB_STRINGS on, any; velocity 0 ends it */
    uint8_t string, key, velocity;
} lb_touch;
typedef struct { /* such notes on their way to the audio thread */
    uint32_t put, taken;
    lb_touch touches[LB_BY_HAND];
} lb_touches;
#define LB_SHORTEST 0.05 /* s that a note of a string by hand lasts, however soon it is let go: one that ends in the frame
                            in which it begins has no sound */
typedef struct { /* what the audio thread knows of them: frames at which strings' notes began, and ends that wait */
    int64_t began[LB_KEYS], due[LB_BY_HAND];
    uint8_t keys[LB_BY_HAND];
    int count;
} lb_taps; /* begins as zeros, as the synth does */
enum { LB_TURNS = 8 };
typedef struct { /* offline: a value that the bass is built by, from a frame of a block on */
    int64_t offset;
    int parameter;
    double value;
} lb_turn;
typedef struct lb_sound lb_sound;
typedef struct {
    int wanted;                 /* 1 + the parameter that the next controller is for; 0: none */
    uint8_t of[LB_CONTROLLERS]; /* 1 + the parameter that a controller moves; 0: what the key map says */
} lb_learned;

_Static_assert(LB_PARAMETERS <= 64, "a bit each");
typedef struct { /* of A and B: the one that counts, 0 or 1, and the values of the other one */
    int64_t side;
    double aside[LB_PARAMETERS];
} lb_sides;
typedef struct { /* all numbers little-endian; a later version with more parameters has them at the end of `values`, and of
                    lb_sides.aside */
    char magic[8];
    int64_t version, seed, count;
    char bass[LB_STATE_NAME];
    double values[LB_PARAMETERS];
    /* lb_learned.of and lb_sides, as far as the version says so; the checksum of all words before */
    uint8_t rest[LB_CONTROLLERS + sizeof(lb_sides) + sizeof(uint64_t)];
} lb_state;
_Static_assert(sizeof(lb_state) ==
                   8 + 3 * 8 + LB_STATE_NAME + LB_PARAMETERS * 8 + LB_CONTROLLERS + sizeof(lb_sides) + 8, "lb_state");
_Static_assert(LB_CONTROLLERS % sizeof(uint64_t) == 0, "the checksum is of words");
_Static_assert(sizeof(lb_sides) == 8 + LB_PARAMETERS * 8, "lb_sides");

enum { LB_EXPRESS_BEND, LB_EXPRESS_VIBRATO, LB_EXPRESSIONS }; /* of notes: semitones; 0 to 1 */
typedef struct { /* the last note of a key of a channel */
    int32_t id;    /* the host's number of it; -1: none */
    uint8_t state; /* of notes.c */
    uint8_t untold[LB_EXPRESSIONS]; /* the synth is to be told of this amount in the next block */
    double amounts[LB_EXPRESSIONS];
} lb_note;

typedef struct { /* the audio thread's side: nobody else touches it while the instance plays */
    LB_OWNER(owner)
    lb_note notes[LB_NOTES]; /* [channel * LB_KEYS + key] */
    int untold;              /* there may be notes with an amount that is to be told */
    int64_t programs;        /* program changes that have been answered */
    uint64_t moved;          /* parameters that controllers have moved and the host is to be told of, a bit each */
    lb_taps taps;
    lb_turn turns[LB_TURNS]; /* of the block that is about to be played */
    int turn_count;
} lb_audio_side;

typedef struct { /* the window's side: its thread alone touches it */
    LB_OWNER(owner)
    double before[LB_UNDONE][LB_PARAMETERS];       /* what lb_undo brings back ... */
    char missing_before[LB_UNDONE][LB_STATE_NAME]; /* ... and the name that was missing; "": none was */
    int undone, undoable; /* where the last of these is, in a ring, and how many there are */
    lb_sound *sounds;     /* of the user, as they were listed last */
    int sound_count;
    char why[200]; /* the last sound or text was not taken over */
} lb_window_side;

typedef struct {
    /* The host's side. The shell sets these before lb_open_instance: */
    void *owner;
    void (*complain)(void *owner, const char *line); /* writes a line into the host's log. [any thread] */
    void (*ask)(void *owner);                        /* makes another thread call lb_serve soon. [audio thread] */
    void (*pool)(int64_t owner, int64_t strings);    /* lets a host's threads play strings (lb_share); 0: it has none */
    void (*moved)(void *owner);                      /* there is something to take. [the window's thread] */
    int learns;                                      /* controllers may learn parameters */
    int quality_stays; /* the host cannot be told of another quality: it does not follow the bass */
    /* These change while no thread plays: */
    const lb_kernels *kernels;
    lb_shelf *shelf;
    lb_synth *synth; /* 0 while the instance is not active */
    double rate;

    /* Every thread reads and writes these, by atomic operations: */
    double values[LB_PARAMETERS];
    uint64_t changed; /* parameters that the synth has not been told yet, a bit each */
    int64_t seed;
    int missing; /* the state named a bass that is not on the shelf, `missing_name`: saved until another is chosen */
    int offline; /* the host does not play in real time: a change of bass may be waited for */
    int resting; /* no thread of its own plays strings: see lb_rest_instance */
    int helpers; /* threads of its own that play strings, or that the system refused */
    int64_t loaded;        /* which bass was loaded last, or could not be, as one word */
    lb_bass *ready, *done; /* handed to the audio thread to play, and by it to be freed */
    lb_look look;          /* for windows ... */
    lb_moves moves;        /* ... and what is done in them */
    lb_touches touches;
    lb_learned learned;
    /* and these under the lock of state.c: */
    char missing_name[LB_STATE_NAME];
    lb_sides sides;

    lb_audio_side audio;
    lb_window_side window;
} lb_instance;

/* --- of instance.c --- */

/* Opens the shelf of instruments. Returns 0 after a line in the log if it is empty. [main thread] */
int lb_open_instance(lb_instance *, const char *folder);
void lb_close_instance(lb_instance *);

/* Loads the bass and makes the synth; returns 0 after a line in the log if that fails. [main thread] */
int lb_activate_instance(lb_instance *, double rate);
void lb_deactivate_instance(lb_instance *);
/* Makes it as new. [not while it plays] */
void lb_reset_instance(lb_instance *);

/* Ends the threads of its own that play strings, until the instance is reset. [not while it plays] */
void lb_rest_instance(lb_instance *);
/* Says whether the host plays in real time. [any thread] */
void lb_set_offline(lb_instance *, int on);
/* Begins a block, before its events are sent. [audio thread] */
void lb_begin_block(lb_instance *);
/* Plays n frames, and changes the bass if need be: mono into outs[0], or an output a string; outputs may be 0.
   [audio thread] */
void lb_play_block(lb_instance *, int apart, float *const outs[LB_STRINGS], int64_t n);
/* Returns 1 if it plays nothing but zeros until the host sends something. [audio thread] */
int lb_may_sleep(const lb_instance *);
/* Loads another bass if one is wanted, and frees those that are done. [any thread; the audio thread only offline] */
void lb_serve(lb_instance *);

/* --- of values.c --- */

double lb_value(const lb_instance *, int parameter);
int lb_is_slider(int parameter); /* one of the bench, from LB_ACTION on: the bass is made by it */
/* The value as the parameter allows it: within its bounds, whole where it is. NaN gives the usual one. */
double lb_allowed(const lb_instance *, int parameter, double value);
double lb_most(const lb_instance *, int parameter);
/* The value in a new instance: the quality is that of the first bass, as the list of instruments says. */
double lb_usual(const lb_instance *, int parameter);
/* Sets a value that the next block begins with. With another bass the quality becomes what the list of instruments says
   of that one, if it was what the list says of the one before. [any thread] */
void lb_set_value(lb_instance *, int parameter, double value);
/* Sets a value from the frame `offset` of the next block on: offline one that the bass is built by, too; else those count
   from the next block on, or later. Of a flood of these the first ones come early. [audio thread] */
void lb_set_value_at(lb_instance *, int64_t offset, int parameter, double value);
/* Writes a value as text. */
void lb_value_to_text(const lb_instance *, int parameter, double value, char *text, size_t room);
/* Reads a value; returns 0 if the text is none. */
int lb_text_to_value(const lb_instance *, int parameter, const char *text, double *value);
/* The key that the bass has its `index`-th switch on; with none left -1, and `index` becomes their number. */
int lb_switch_key(const lb_instance *, uint32_t *index);
/* What a key that lb_switch_key gave switches. */
const char *lb_switch_name(const lb_instance *, int key);

/* --- of learn.c --- */

/* Makes the next controller move a parameter, in place of the one before; returns 0, and stops that, if none can: with
   -1, or if the parameter cannot be automated. [any thread] */
int lb_learn(lb_instance *, int parameter);
int lb_learning(const lb_instance *);                   /* the parameter that waits for its controller; -1: none */
int lb_learned_by(const lb_instance *, int controller); /* the parameter that a controller moves; -1: none */
void lb_forget(lb_instance *, int parameter);           /* it has no controller any more. [any thread] */
/* Moves a parameter by MIDI of a controller that has learned it; returns 0 for all other MIDI. [audio thread] */
int lb_take_learned(lb_instance *, int64_t offset, const uint8_t *bytes, size_t count);
/* A parameter that a controller has moved since the last call, for the host to be told; -1: none. [audio thread] */
int lb_next_moved(lb_instance *);
/* Writes what controllers have learned, for states; returns 0 if that is nothing. */
int lb_write_learned(const lb_instance *, uint8_t to[LB_CONTROLLERS]);
/* Takes it back; 0: nothing. */
void lb_read_learned(lb_instance *, const uint8_t *from);

/* --- of notes.c. [audio thread] --- */

/* The host's notes that are meant: those of a key, of a channel (0 to 15) or with channel -1 of all channels; with key -1
   the one that has an id; with both -1 all of the channel. */
typedef struct {
    int channel, key;
    int32_t id;
} lb_named;
void lb_forget_notes(lb_instance *);
/* Starts a note of a channel, any: the first, of velocity 0 to 1, that the host calls `id`. */
void lb_start_note(lb_instance *, int64_t offset, int channel, int key, double velocity, int32_t id);
/* Releases notes, with velocity 0 to 1. */
void lb_stop_note(lb_instance *, int64_t offset, lb_named, double velocity);
/* Ends the sound of notes at once: no pedal holds them. */
void lb_choke_note(lb_instance *, int64_t offset, lb_named);
/* Bends the strings that play notes, or gives them vibrato (LB_EXPRESS_BEND, LB_EXPRESS_VIBRATO); of all, those that are held. */
void lb_express(lb_instance *, int64_t offset, lb_named, int what, double amount);
/* Places the next stroke of a note's key, 0 to 1 as controller 74 of MPE does: 1 nearest to the bridge. To place a note
   itself, this comes before it starts. */
void lb_express_place(lb_instance *, int64_t offset, int key, int32_t id, double brightness);
/* Takes MIDI of the host: a controller that has learned a parameter moves it, all else is played. */
void lb_take_midi(lb_instance *, int64_t offset, const uint8_t *bytes, size_t count);
/* Tells the synth of the expressions that a flood has kept back. */
void lb_tell_notes(lb_instance *);

/* --- of hand.c --- */

/* Of a flood, moves get lost, but not the end of one that has begun. [one thread] */
void lb_put_move(lb_moves *, int parameter, int phase, double value);
int lb_take_move(lb_moves *, lb_move *); /* 0: there is none. [one thread] */
void lb_put_touch(lb_touches *, int on, int string, int key, double velocity); /* velocity 0 to 1. [one thread] */
int lb_take_touch(lb_touches *, lb_touch *);                                   /* 0: there is none. [one thread] */
void lb_play_touch(lb_synth *, lb_taps *, const lb_touch *); /* at the next block's first frame. [audio thread] */
void lb_end_taps(lb_synth *, lb_taps *);                     /* those that are due; before the above. [audio thread] */
/* Sets a value by hand, in the window: the host is told. [the window's thread] */
void lb_move_value(lb_instance *, int parameter, double value, int phase);

/* --- of state.c --- */

/* What the processor does, and which bass it is, belong to no side. */
int lb_is_of_sides(int parameter);
void lb_begin_sides(lb_instance *); /* A counts, and nothing of B was moved. [not while there is a window] */
/* A and B: puts aside all values but the bass and those of the processor, and takes those that were.
   [the window's thread] */
void lb_swap_sides(lb_instance *);
int lb_side(const lb_instance *); /* [any thread] */
void lb_read_sides(lb_instance *, lb_sides *);        /* [any thread but the audio thread] */
void lb_write_sides(lb_instance *, const lb_sides *); /* likewise; the values stay */
/* Keeps these values for lb_undo: before a hand moves one. [the window's thread] */
void lb_keep_values(lb_instance *);
/* Sets the bass and all values, or those of a side alone, together. [any thread but the audio thread] */
void lb_set_values(lb_instance *, const double values[LB_PARAMETERS], int all);
/* Brings back the values that were kept last, if any are left. [the window's thread] */
void lb_undo(lb_instance *);

/* Returns the number of bytes. */
size_t lb_save_state(lb_instance *, lb_state *);
/* Takes over a state; returns 0 after a line in the log, and changes nothing, if it is none. [main thread] */
int lb_load_state(lb_instance *, const void *bytes, size_t count);

typedef struct { /* what bytes of a state say: what an older one does not have is as in a new instance */
    char bass[LB_STATE_NAME];
    int64_t seed;
    double values[LB_PARAMETERS];
    lb_sides sides;
    uint8_t learned[LB_CONTROLLERS];
    char why[200]; /* what is wrong with it */
} lb_kept;
/* Takes all of that over; `values` gets the bass as a number. If its bass is not on the shelf, a line in the log says so,
   and the bass stays. [main thread] */
void lb_take_kept(lb_instance *, lb_kept *);
/* Reads such bytes, aligned to 8; returns what is wrong with them, behind a name: "is damaged"; 0: nothing. */
const char *lb_parse_state(const lb_kernels *, const void *bytes, size_t count, const char *magic, lb_kept *);

/* --- of sounds.c: a file each in the user's folder, with a bass by name and all values of a side --- */

enum { LB_MOST_TEXT = 8192 };         /* bytes of a sound as text, and of a link, with the zero at its end */
#define LB_SOUND_ENDING "toml"        /* of its file, behind a dot */
#define LB_OLD_SOUND_ENDING "lbsound" /* of one that an earlier version wrote: a state ... */
#define LB_SOUND_MAGIC "LBSOUND\n"    /* ... that begins so */
/* Reads a file; returns what is wrong with it as lb_parse_state does. [not the audio thread] */
const char *lb_read_sound(const lb_kernels *, const char *path, lb_kept *);
/* Takes over a file, or a text: a sound, or the link of a page; lb_undo brings back what was. Both return what is wrong,
   until the next call, and then change nothing. [the window's thread; without a window the main thread] */
const char *lb_take_sound(lb_instance *, const char *path);
const char *lb_take_text(lb_instance *, const char *text);
/* The rest is for windows. [the window's thread] */

/* Reads the folder anew; returns how many there are, by name. What is none, or has a bass that is not on the shelf, is
   left out after a line in the log. */
int lb_list_sounds(lb_instance *);
const char *lb_sound_name(const lb_instance *, int sound); /* of its file, without the ending */
void lb_forget_sounds(lb_instance *);                      /* frees the list */
/* Keeps what is set now, under the title of the bass and a number, and says that name; returns 0 after a line in the log
   if the folder cannot be written. */
int lb_save_sound(lb_instance *, char *name, size_t room);
/* Takes one over, so that lb_undo brings back what was; returns 0, as lb_list_sounds, and changes nothing, if it cannot. */
int lb_load_sound(lb_instance *, int sound);
/* Deletes its file. */
void lb_remove_sound(lb_instance *, int sound);
#endif
