/* An instance of the plugin, for the CLAP, VST3 and LV2 shells: its parameter values, its bass, the host's notes, its
   state. It knows no host interface. */
#ifndef LB_INSTANCE_H
#define LB_INSTANCE_H
#include "system/files.h"
#include "instance/look.h"
#include "instance/marks.h"
#include "system/thread.h"

#ifdef _WIN32
#define LB_EXPORTED __declspec(dllexport)
#else
#define LB_EXPORTED __attribute__((visibility("default")))
#endif

enum { LB_STATE_NAME = 64, LB_KEYS = 128, LB_NOTES = LB_CHANNELS * LB_KEYS, LB_MOVES = 256, LB_BY_HAND = 64, LB_UNDONE = 32 };
enum { LB_BEGIN, LB_MOVE, LB_END }; /* phases of a change by hand */
typedef struct { /* a change of a parameter in the window */
    int parameter, phase;
    double value;
} lb_move;
typedef struct { /* counts of a ring: one thread puts entries in, another takes them out */
    uint32_t put, taken;
} lb_ring;
typedef struct { /* changes to tell the host */
    lb_ring ring;
    lb_move moves[LB_MOVES];
} lb_moves;
typedef struct { /* a note played in the window, on a string or, from LB_STRINGS on, any; velocity 0 ends it */
    uint8_t string, key, velocity;
} lb_touch;
typedef struct { /* such notes on their way to the audio thread */
    lb_ring ring;
    lb_touch touches[LB_BY_HAND];
} lb_touches;
#define LB_SHORTEST 0.05 /* s, the least duration of a string's note by hand: one that ends in its first frame is
                            silent */
typedef struct { /* the audio thread's record of them: first frames of notes, and waiting ends */
    int64_t began[LB_KEYS], due[LB_BY_HAND];
    uint8_t keys[LB_BY_HAND];
    int count;
} lb_taps; /* begins as zeros, as the synth does */
enum { LB_TURNS = 8 };
typedef struct { /* offline: a slider's value, from a frame of a block on */
    int64_t offset;
    int parameter;
    double value;
} lb_turn;
typedef struct lb_sound lb_sound;
typedef struct lb_song lb_song; /* of song.h */
typedef struct lb_song_file lb_song_file;
enum { LB_SONG_LINE = 640 };
enum { LB_ROLL, LB_LOOP, LB_PUT_AWAY, LB_GIVE }; /* what a hand does with a song */
typedef struct { /* what a window shows of the song */
    int there;         /* 1: there is one, which can play ... */
    int rolls, loops;  /* ... now, and again and again */
    int part;          /* how much of it has played, thousandths */
    int wrong;         /* 1: the line tells why the last file cannot play */
    char line[LB_SONG_LINE]; /* what of the file plays; "": there is nothing to show */
} lb_song_view;
typedef struct { /* in a window whose plugin is in another process, under the lock of song.c: */
    lb_song_view view;  /* what that plays ... */
    int wants;          /* ... and what a hand wants of it: a bit each of LB_ROLL ... */
    char path[LB_PATH]; /* LB_GIVE: this file */
} lb_song_there;
typedef struct { /* why sliders have stopped before the value that was wanted */
    int count;     /* of stops so far, from 0 again after 255 */
    int parameter; /* the slider; LB_PARAMETERS: several had moved */
    lb_fault fault; /* beyond the last value that fits */
} lb_stop;
typedef struct {
    int wanted;                 /* 1 + the next controller's parameter; 0: none */
    uint8_t of[LB_CONTROLLERS]; /* 1 + the parameter that a controller moves; 0: as in the key map */
} lb_learned;

typedef struct { /* A and B: the active side, 0 or 1, and the values of the other one */
    int64_t side;
    double aside[LB_PARAMETERS];
} lb_sides;
_Static_assert(sizeof(lb_sides) == 8 + LB_PARAMETERS * 8, "lb_sides");

enum { LB_EXPRESS_BEND, LB_EXPRESS_VIBRATO, LB_EXPRESSIONS }; /* of notes: semitones; 0 to 1 */
typedef struct { /* the last note of a key of a channel */
    int32_t id;    /* the host's number for it; below 0: none, see notes.c */
    int16_t port;  /* -1: any */
    uint8_t state; /* of notes.c */
    double retuning; /* semitones, by a master (retuning.h) */
    uint8_t unsent[LB_EXPRESSIONS]; /* tell the synth this amount in the next block */
    double amounts[LB_EXPRESSIONS];
} lb_note;

typedef struct { /* the audio thread's side: no other thread touches it while the instance plays */
    LB_OWNER(owner)
    lb_note notes[LB_NOTES]; /* [channel * LB_KEYS + key] */
    int unsent;              /* notes may have untold amounts */
    int retuned;             /* notes may be retuned */
    int64_t programs;        /* program changes answered so far */
    double stroke;           /* LB_TECHNIQUE as the synth had it last */
    lb_taps taps;
    lb_turn turns[LB_TURNS]; /* of the next block to play */
    int turn_count;
    lb_song *song; /* that plays beside the host's notes; 0: none */
} lb_audio_side;

typedef struct { /* what lb_undo restores */
    double values[LB_PARAMETERS];
    lb_sides sides;
    const void *bass;            /* lb_present_bass of the bass that played */
    char missing[LB_STATE_NAME]; /* the name that was missing; "": none was */
    int responded;               /* the change was one of the response, too; this was it before: */
    lb_response *response;
} lb_before;

typedef struct { /* the window's side: only its thread touches it */
    LB_OWNER(owner)
    lb_before before[LB_UNDONE]; /* for lb_undo */
    int undone, undoable; /* place of the last of these, in a ring, and their number */
    lb_sound *sounds;     /* of the user, as last listed */
    int sound_count;
    char why[200]; /* reason why the last sound or text was not loaded */
    char sound[160]; /* the sound that was loaded or saved last; "": none ... */
    double values[LB_PARAMETERS]; /* ... and its values */
} lb_window_side;

typedef struct {
    /* The host's side. The shell sets these before lb_open_instance: */
    void *owner;
    void (*complain)(void *owner, const char *line); /* writes a line into the host's log. [any thread] */
    void (*ask)(void *owner);                        /* makes another thread call lb_serve soon. [audio thread] */
    void (*pool)(int64_t owner, int64_t strings);    /* lets a host's threads play strings (lb_share); 0: it has none */
    void (*moved)(void *owner);                      /* there are moves to take. [the window's thread] */
    int learns;                                      /* controllers may learn parameters */
    int quality_stays; /* quality does not follow the bass: the host cannot be told */
    /* These change only while no thread plays: */
    const lb_kernels *kernels;
    lb_shelf *shelf;
    lb_synth *synth; /* 0 while the instance is not active */
    double rate;
    int joined; /* it follows a master (retuning.h) */

    /* Every thread reads and writes these, with atomic operations: */
    double values[LB_PARAMETERS];
    lb_marks changed; /* parameters the synth does not know yet ... */
    lb_marks unsent;  /* ... and those that the host does not: moved by a controller or a key, or held within limits */
    int64_t seed;
    int missing; /* the state named a bass that is not on the shelf, `missing_name`: saved until another is chosen */
    int offline; /* the host does not play in real time: it can wait for a change of bass */
    int resting; /* its own threads play no strings: see lb_rest_instance */
    int helpers; /* its own threads that play strings, or that the system refused */
    int64_t loaded;        /* the bass that was loaded last, or failed to load, as one word */
    double built[LB_BUILT]; /* sliders of the bass that was loaded last ... */
    int built_of;           /* ... and its number. Only the thread that loads uses these */
    uint64_t stopped;       /* the last lb_stop as one word (lb_last_stop); 0: there was none */
    lb_bass *ready, *done; /* for the audio thread to play; from it, to free */
    lb_look look;          /* for windows ... */
    lb_moves moves;        /* ... and the changes made in them */
    lb_touches touches;
    lb_song *next_song, *old_song; /* for the audio thread to play; from it, to free */
    int rolls, loops, song_part;   /* the song plays; it begins again at its end; how much has played, thousandths */
    uint32_t song_range;           /* the lowest and highest key of the bass that plays; 0: not known */
    uint64_t song_for;             /* the rate and the bass that it is prepared for; 0: there is none */
    lb_song_file *song_file;       /* under the lock of song.c, with its words: */
    char song_line[LB_SONG_LINE], song_fault[LB_SONG_LINE];
    lb_song_there *there; /* 0: this instance plays */
    lb_learned learned;
    uint32_t responses;    /* set so far */
    uint64_t response_sum; /* of the response; 0: the bass's own plays */
    lb_response *response; /* under the lock of response.c */
    /* and these under the lock of state.c: */
    char missing_name[LB_STATE_NAME];
    char *unknown; /* words of the session that are unknown here: lines "section<tab>name = value"; 0: none */
    lb_sides sides;

    int kept_there;   /* in a window of another process: its plugin plays a kept bass */
    uint32_t updates; /* by the window to the present bass. [the window's thread] */
    lb_audio_side audio;
    lb_window_side window;
} lb_instance;

/* --- of instance.c --- */

void lb_complain(void *owner, const char *line); /* writes to the standard error stream, for hosts without a log */
/* Opens the instrument shelf. Returns 0 after a line in the log if it is empty. [main thread] */
int lb_open_instance(lb_instance *, const char *folder);
void lb_close_instance(lb_instance *);

/* Loads the bass and makes the synth; returns 0 after a line in the log if that fails. [main thread] */
int lb_activate_instance(lb_instance *, double rate);
void lb_deactivate_instance(lb_instance *);
/* Resets it. [not while it plays] */
void lb_reset_instance(lb_instance *);

/* Ends its own threads that play strings, until the instance is reset. [not while it plays] */
void lb_rest_instance(lb_instance *);
/* Sets whether the host renders offline. [any thread] */
void lb_set_offline(lb_instance *, int on);
/* Begins a block, before its events are sent. [audio thread] */
void lb_begin_block(lb_instance *);
/* Plays n frames, and changes the bass if necessary: mono into outs[0], or one output per string; outputs may be 0.
   [audio thread] */
void lb_play_block(lb_instance *, int apart, float *const outs[LB_STRINGS], int64_t n);
/* Returns the last stop of the sliders; count 0 of a new instance. [any thread] */
lb_stop lb_last_stop(const lb_instance *);
/* Sets sliders that would make a neck that cannot be played to the last values on their way that can. For a window whose
   plugin is in another process: `lb_serve` does the same. [the window's thread] */
void lb_stop_sliders(lb_instance *);
/* Returns 1 if it plays only zeros until the host sends something. [audio thread] */
int lb_may_sleep(const lb_instance *);
/* Loads another bass if one is wanted, and frees finished ones. [any thread; the audio thread only offline] */
void lb_serve(lb_instance *);

/* --- of values.c --- */

/* Writes a line into the host's log. [any thread] */
__attribute__((format(printf, 2, 3))) void lb_log(const lb_instance *, const char *form, ...);
double lb_value(const lb_instance *, int parameter);
void lb_read_values(const lb_instance *, double to[LB_PARAMETERS]); /* all of them */
int lb_bass_number(const lb_instance *, double bass); /* of the bass that plays: beyond the only one that one */
int lb_parameter_called(const char *symbol); /* by its symbol or an older one; -1: none but the bass, which has a name */
int lb_is_slider(int parameter); /* on the bench: it changes the bass */
/* The nearest value that the parameter allows: within its bounds, whole if it is. NaN gives the default value. */
double lb_allowed(const lb_instance *, int parameter, double value);
double lb_maximum(const lb_instance *, int parameter);
/* The value in a new instance: the quality is the first bass's in the instrument list. */
double lb_default(const lb_instance *, int parameter);
/* Sets a value for the next block on. With a new bass the quality becomes the one listed for it, if it was the one
   listed for the old bass. [any thread] */
void lb_set_value(lb_instance *, int parameter, double value);
/* Sets a value from the frame `offset` of the next block on. For a slider that changes the bass this holds only
   offline; else it acts from the next block on, or later. In a flood of slider values the first ones come early. [audio
   thread] */
void lb_set_value_at(lb_instance *, int64_t offset, int parameter, double value);
/* Writes a value as text. */
void lb_value_to_text(const lb_instance *, int parameter, double value, char *text, size_t room);
/* Reads a value; returns 0 if the text is not a value. */
int lb_text_to_value(const lb_instance *, int parameter, const char *text, double *value);
/* The key of the bass's `index`-th switch; if there are fewer, -1, and `index` becomes their number. */
int lb_switch_key(const lb_instance *, uint32_t *index);
/* The name of the switch on a key from lb_switch_key. */
const char *lb_switch_name(const lb_instance *, int key);

/* --- of learn.c --- */

/* Makes the next controller move a parameter, replacing its old one; returns 0, and stops waiting, if the parameter is
   -1 or cannot be automated. [any thread] */
int lb_learn(lb_instance *, int parameter);
int lb_learning(const lb_instance *);                   /* the parameter that waits for its controller; -1: none */
int lb_learned_by(const lb_instance *, int controller); /* the parameter that a controller moves; -1: none */
void lb_forget(lb_instance *, int parameter);           /* frees it from its controller. [any thread] */
/* Moves a parameter for MIDI of a controller that has learned it; returns 0 for all other MIDI. [audio thread] */
int lb_take_learned(lb_instance *, int64_t offset, const uint8_t *bytes, size_t count);
/* Takes a parameter from `unsent`; -1: there is none. [audio thread] */
int lb_next_moved(lb_instance *);
/* Writes the learned controllers, for states, and restores them. */
void lb_write_learned(const lb_instance *, uint8_t to[LB_CONTROLLERS]);
void lb_read_learned(lb_instance *, const uint8_t from[LB_CONTROLLERS]);

/* --- of notes.c. [audio thread] --- */

/* Names the host's notes by all four: -1 is any. As a note's own id, -1 is none. */
typedef struct {
    int port, channel, key;
    int32_t id;
} lb_named;
int lb_is_named(lb_named named, lb_named note);
void lb_forget_notes(lb_instance *);
/* True if a master's scale leaves out a key that is no switch (retuning.h). */
int lb_is_left_out(const lb_instance *, int channel, int key);
/* Starts a note (channel -1: on the first), velocity 0 to 1; 0 is the softest. It replaces one of its channel and key. */
void lb_start_note(lb_instance *, int64_t offset, lb_named note, double velocity);
/* Releases held notes, with velocity 0 to 1. */
void lb_stop_note(lb_instance *, int64_t offset, lb_named, double velocity);
/* Ends the sound of notes at once: no pedal holds them. */
void lb_choke_note(lb_instance *, int64_t offset, lb_named);
/* Bends notes' strings or gives them vibrato (LB_EXPRESS_BEND, LB_EXPRESS_VIBRATO); if all notes are meant, held
   ones. */
void lb_express(lb_instance *, int64_t offset, lb_named, int what, double amount);
/* Places the next stroke of notes' keys, 0 to 1 like MPE's controller 74: 1 is nearest to the bridge. To place a note
   itself, call this before it starts. */
void lb_express_place(lb_instance *, int64_t offset, lb_named, double brightness);
/* Takes the host's MIDI: a controller that has learned a parameter moves it; the rest is played, unless it is cut
   short. */
void lb_take_midi(lb_instance *, int64_t offset, const uint8_t *bytes, size_t count);
/* Sends the synth expressions that a flood has held back, and the held notes' tuning where the master has changed it. */
void lb_tell_notes(lb_instance *);

/* --- of hand.c --- */

uint32_t lb_waiting(const lb_ring *); /* how many entries a ring holds */
/* In a flood moves get lost, but not the end of one that has begun. [one thread] */
void lb_put_move(lb_moves *, int parameter, int phase, double value);
int lb_take_move(lb_moves *, lb_move *); /* 0: there is none. [one thread] */
void lb_put_touch(lb_touches *, int on, int string, int key, double velocity); /* velocity 0 to 1. [one thread] */
int lb_take_touch(lb_touches *, lb_touch *);                                   /* 0: there is none. [one thread] */
void lb_play_touch(lb_instance *, const lb_touch *); /* at the next block's first frame. [audio thread] */
void lb_end_taps(lb_instance *);                     /* ends due ones; before the above. [audio thread] */
/* Sets a value by hand, in the window, and tells the host. [the window's thread] */
void lb_move_value(lb_instance *, int parameter, double value, int phase);

/* --- of song.c --- */

/* Reads a MIDI file and plays its bass; returns the fault, which the view has, too. [the window's thread] */
const char *lb_take_song(lb_instance *, const char *path);
void lb_steer_song(lb_instance *, int what);             /* LB_ROLL ... [the window's thread] */
void lb_turn_song(lb_instance *, int what);              /* LB_ROLL or LB_LOOP. [any thread] */
int lb_take_wants(lb_instance *, char path[LB_PATH]);    /* of lb_song_there. [one thread] */
void lb_show_song(lb_instance *, const lb_song_view *);  /* likewise */
void lb_view_song(lb_instance *, lb_song_view *);        /* [not the audio thread] */
/* Prepares the song again if the rate or the bass has changed. [not the audio thread but offline] */
void lb_renew_song(lb_instance *);
int lb_song_asks(const lb_instance *); /* lb_serve has work for a song: that, or one to free. [any thread] */
/* The rest is for the audio thread. */

/* Sends the song's messages for the next n frames. */
void lb_play_song(lb_instance *, int64_t n);
int lb_song_waits(const lb_instance *); /* it plays, or is about to */
void lb_stop_song(lb_instance *);       /* at its beginning; the synth is new. [not while it plays] */
void lb_close_song(lb_instance *);      /* frees all songs. [no thread plays] */

/* --- of state.c --- */

/* The bass and the processor's parameters belong to no side. */
int lb_is_of_sides(int parameter);
void lb_begin_sides(lb_instance *); /* A is active; B has default values. [not while there is a window] */
/* Switches between A and B: swaps all values, except the bass and the processor's, with the other side's.
   [the window's thread] */
void lb_swap_sides(lb_instance *);
void lb_copy_side(lb_instance *); /* to the other side. [the window's thread] */
int lb_side(const lb_instance *); /* [any thread] */
void lb_read_sides(lb_instance *, lb_sides *);        /* [any thread but the audio thread] */
void lb_write_sides(lb_instance *, const lb_sides *); /* the values stay. [any thread but the audio thread] */
/* Keep values and sides for lb_undo before a hand moves one; lb_keep_all: the response as well. [the window's thread] */
void lb_keep_values(lb_instance *);
void lb_keep_all(lb_instance *);
void lb_forget_kept(lb_instance *); /* frees what was kept */
/* Sets the bass and all values, or only a side's, together. [any thread but the audio thread] */
void lb_set_values(lb_instance *, const double values[LB_PARAMETERS], int all);
/* Restores what was kept last and has changed since, if there is any. [the window's thread] */
void lb_undo(lb_instance *);
/* Reads the values, A and B, and the name of the bass, the missing one if one is missing. [not the audio thread] */
void lb_read_present(const lb_instance *, double values[LB_PARAMETERS], lb_sides *, char name[LB_STATE_NAME]);
char *lb_read_unknown(const lb_instance *); /* a copy by malloc; 0: there is none. [not the audio thread] */

/* --- of response.c --- */

/* Gives the instance a response, which it takes over; 0: the bass's own. [not the audio thread] */
void lb_set_response(lb_instance *, lb_response *);
void lb_response_title(lb_instance *, char *text, size_t room); /* "none", or the name of its file without ending */
void lb_free_response(lb_response *);                           /* takes one user away; may be 0 */

/* --- of session.c --- */

enum { LB_MAX_STATE = 8 << 20 /* bytes */ };
/* The state as a text, allocated by malloc: writes its bytes. 0: there is no memory. [not the audio thread] */
void *lb_new_state(lb_instance *, size_t *count);
/* Loads a state; if it is not valid, returns 0 after a line in the log and changes nothing. [main thread] */
int lb_load_state(lb_instance *, const void *bytes, size_t count);

typedef struct { /* the contents of a state; anything missing from an older state is as in a new instance */
    char bass[LB_STATE_NAME];
    int64_t seed;
    double values[LB_PARAMETERS];
    lb_sides sides;
    uint8_t learned[LB_CONTROLLERS];
    lb_response *response;       /* lb_take_kept takes it over; 0: none */
    void *instrument;            /* the bass itself, by malloc, likewise; 0: the one with its name */
    size_t instrument_bytes;
    char *unknown; /* as of lb_instance, by malloc, likewise */
    char response_path[LB_PATH]; /* of a sound: its file, still to be read; "": none */
    char why[200]; /* the fault in it */
} lb_kept;
/* Loads these contents; `values` gets the bass as a number. If the bass is not on the shelf, the present one stays and
   the log says so. [main thread] */
void lb_take_kept(lb_instance *, lb_kept *);

/* --- of sounds.c: files, each with a bass by name and all values of a side --- */

enum { LB_MAX_TEXT = 8192 };  /* bytes in a sound's text or a link, with the final zero */
#define LB_SOUND_ENDING "toml" /* its file's extension */
/* Reads a file; returns the fault, to follow a name: "is empty"; 0: none. [not the audio thread] */
const char *lb_read_sound(const char *path, lb_kept *);
/* Load a file, or a text: a sound, or a link of a page; lb_undo restores the old values. On failure they return the
   fault, valid until the next call, and change nothing. [the window's thread; without a window the main thread] */
const char *lb_take_sound(lb_instance *, const char *path);
const char *lb_take_text(lb_instance *, const char *text);
/* Loads a response from a WAV file, "": none, in the same way. */
const char *lb_take_response(lb_instance *, const char *path);
/* Takes a file that is dropped on the window, a path or a list of addresses, in the same way: a sound (.toml), a response
   (.wav), or else a MIDI file, which plays (song.c). */
const char *lb_take_dropped(lb_instance *, const char *text);
/* Writes the folder of the factory's sounds beside the instruments, LB_PATH bytes; returns 0 if it does not fit. */
int lb_factory_sounds(const char *instruments, char *folder);
/* The rest is for windows. [the window's thread] */

/* Reads the folders again: the factory's sounds, then the user's, each sorted by name; returns their number. Files that
   are no sounds, or need a bass that is not on the shelf, are skipped after a line in the log. */
int lb_list_sounds(lb_instance *);
const char *lb_sound_name(const lb_instance *, int sound); /* its file's name, without the ending */
int lb_sound_is_own(const lb_instance *, int sound);       /* the user's, not the factory's */
void lb_forget_sounds(lb_instance *);                      /* frees the list */
/* Writes the name of the sound that plays, or the bass's title; with a * if values have changed since. */
void lb_title(const lb_instance *, char *text, size_t room);
int lb_playing_sound(const lb_instance *); /* its number in the list; -1: none of them plays */
/* Saves the present values under `name`, with a number if that is taken, or, if it is empty, under the bass's title and
   a number, and writes that into `name`; returns 0 after a line in the log if the folder cannot be written. */
int lb_save_sound(lb_instance *, char *name, size_t room);
/* Loads a sound; lb_undo restores the old values. On failure returns 0, after a line in the log, and changes
   nothing. */
int lb_load_sound(lb_instance *, int sound);
/* Deletes its file, if it is the user's. */
void lb_remove_sound(lb_instance *, int sound);
#endif
