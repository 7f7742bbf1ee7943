/* Shared by the parts of the picture: colours, measures, state, and where places of the neck are drawn. */
#ifndef LB_DRAWING_H
#define LB_DRAWING_H
#include "picture/paint.h"
#include "picture/picture.h"

#include <math.h>
#include <string.h>

typedef struct {
    uint32_t ground, raised, edge, ink, soft, accent, on_accent, trough, hot, good;
} theme;
enum { BLACK = 0xFF100D0B, STRING = 0xFFE3DCCF, STRING_DARK = 0xFF7A7267, METAL = 0xFFC9C3B8, BONE = 0xFFF3E9D2 };
enum { WOOD = 0xFF3B2317, WOOD_LIGHT = 0xFF54341F };

/* Pixels at scale 1. */
enum { EDGE = 14, HEADER = 46, TABS = 28, SONG_BAR = 24, HEADING = 16, CELL = 38, SMALL_CELL = 25, FOOT = 8 };
enum { MOTION_WIDTH = 76, NARROW = 760 /* a window without room for all words of its header */ };
enum { MIN_CELL = 144, MAX_LAMP = 150, LAMP_HEAD = 74 }; /* widths; LAMP_HEAD: of a row's heading */
enum { LAMP_HEIGHT = 26, SMALL_LAMP = 17, LOW = 400 };
enum { MIN_NECK = 120 };                                    /* height of a neck beside a side view */
#define FLOOR_DB (-48.0) /* where the meter begins */
#define TINY 9.0 /* letters */
#define SMALL 11.0
#define MIDDLE 12.5
#define LARGE 20.0

enum { NODES = 160, STRIDE = 164, DRAWN = 64 }; /* steps of a string; numbers in a row; modes drawn */
enum { MAX_PARTS = 256, MAX_COLUMNS = 8, MAX_CELLS = 64, MAX_TEXT = 160,
       MAX_LISTED = 4096 };
enum { LB_PLAY, LB_BENCH_PAGE, LB_TONE_PAGE, LB_SETTINGS, LB_PAGES };
static const double zooms[] = {4, 8, 16, 32};
typedef float quad __attribute__((vector_size(16)));

enum { NOTHING, WORDMARK, PREVIOUS, NEXT, TITLE, QUALITY, LOAD, OVERLOAD, LAMP, TAB, HEAD, SLIDER, STEPPER, ITEM,
       BOARD, PLUCK, MOTION, NAME, UNDO, SIDE, SAVE, SOUND, SOUNDS, MORE, PASTE, UPDATE, CROWNS, COPY, SEARCHED, ENLARGED, RESPONSE, COIL, LAMP_ROW,
       SONG_BUTTON, SONG_LINE, SONG_CROSS, KINDS };
typedef struct {
    int kind, number;
    double x, y, w, h; /* pixels of the array */
    uint64_t drawn;    /* its state when last drawn; 0: it must be drawn */
} part;

enum { NOT_TYPING, VALUE, SAVING, SEARCH, MAX_TYPED = 64 };
enum { NO_COVER, MENU, TIP, MAX_LINES = 12 };
typedef struct { /* a menu or a tip */
    int kind, number, count, lit; /* the menu's parameter, or COPY_SIDE; lines; the one under the pointer, -1: none */
    int does[MAX_LINES];         /* what a line of a menu does: DO_NOTHING ..., or DO_CHOOSE + a value */
    char lines[MAX_LINES][MAX_TEXT];
    double x, y, w, h;
    uint64_t drawn; /* its state when last drawn */
} lb_cover;

typedef struct { /* a row of the list: a group's heading, a bass or a sound */
    int kind, number;
} listed;

typedef struct { /* a string at one look */
    int on, fret, lies; /* `lies`: the higher fret that it lies on at rest; 0: none */
    float maximum;  /* m, the farthest from rest */
    double stop; /* m from the nut */
    quad u[STRIDE / 4];
} shape;

struct lb_picture {
    lb_face face;
    const theme *t;
    lb_sheet sheet, ground;
    double scale, seconds;
    uint64_t laid_out; /* the layout state of the parts' places */
    part parts[MAX_PARTS];
    int count, board, coils; /* parts; the places among them of the neck and of the side view's first pickup, -1: none */
    int page, listing, scrolled; /* listing: basses, then sounds, are listed in place of the neck */
    int columns;                   /* at the list's end, without room */
    int sounds, doomed, lists;     /* how many; the one the next press deletes, -1: none; lists read so far */
    listed listed[MAX_LISTED + LB_SOUND_GROUPS];
    lb_song_view song;
    int pasting;                   /* the clipboard's text is wanted */
    lb_stop stop;                  /* why sliders have stopped last ... */
    double stopped;                /* ... and since when that is shown */
    char notice[MAX_TEXT];        /* replaces the title ... */
    double noticed;                /* ... and since when */
    int64_t choked[2];             /* the note, and its fret, that has been said to fret out last */
    double values[LB_PARAMETERS];
    const lb_own *own; /* the bass's; 0: not known */
    /* what is typed */
    int typing, typed_for; /* VALUE: of a parameter */
    char typed[MAX_TYPED];
    int focus, keyed; /* the parameter that keys move, -1: none; it is marked */
    int pressed_number; /* the pointer has pressed a value and not moved */
    /* what lies over the rest */
    lb_cover cover;
    int requested; /* 1 + the parameter, or LB_PARAMETERS for the response, whose menu a press has asked for; 0: none */
    lb_area covered; /* of the last picture */
    double rested; /* since when the pointer rests */
    /* the pointer */
    int hovered, held; /* parts; -1: none */
    double grabbed, from; /* place and value where a slider was grabbed */
    int string, key; /* the note that the pointer plays; string -1: none */
    /* looks */
    LB_LOOK both[2];
    int which;
    uint64_t taken;
    shape (*shapes)[LB_STRINGS]; /* of the last LB_LOOKS looks, the newest at (shaped - 1) % LB_LOOKS */
    uint64_t shaped;
    int fresh; /* shapes since the last picture drawn */
    quad *sines; /* DRAWN rows of STRIDE */
    int zoom;
    double enlarged; /* by the user; 1: not */
    double level, shown_load, shown_at;
    int lively; /* the last picture had something moving */
    int calm, skipped; /* all moved little in the last picture drawn; the one after it was not drawn */
    int metered; /* the meter's reading in the last picture drawn */
    lb_area busy[LB_STRINGS]; /* where strings moved in it */
    lb_area strip[LB_STRINGS + 1];
    int strips; /* what the last picture drew, apart from each other */
    uint64_t still; /* state of everything else on the neck */
    /* the neck: x of nut and saddle, pixels per metre along it; its middle, and half its width at nut and saddle */
    double nut, saddle, metre, middle, half[2];
};

/* The fret that a sounding string lies on, beyond the one that is pressed; 0: it does not fret out. */
int lb_lies_on(const lb_picture *p, int string);

/* Names a fret: "fret 9"; without frets the place that it stands for, from the nut: "412 mm". */
void lb_fret_text(const LB_LOOK *, int fret, char *text, size_t room);

static inline const LB_LOOK *look_of(const lb_picture *p) { return &p->both[p->which]; }

static inline double px(const lb_picture *p, double units) { return p->scale * units; }

static inline double x_of(const lb_picture *p, double metres) { return p->nut + metres * p->metre; }

static inline double part_along(const lb_picture *p, double x) { return (x - p->nut) / (p->saddle - p->nut); }

/* Half the neck's width at x. */
static inline double half_at(const lb_picture *p, double x) {
    return p->half[0] + (p->half[1] - p->half[0]) * fmax(part_along(p, x), -0.02);
}

static inline int64_t strings_of(const lb_picture *p) { return look_of(p)->strings; }

/* The middle of a string's lane; the lowest string is below. */
static inline double lane_at(const lb_picture *p, int string, double x) {
    return p->middle - half_at(p, x) * ((2.0 * string + 1) / (double)strings_of(p) - 1);
}

/* The end of the board, beyond the last fret. */
static inline double board_end(const lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    return x_of(p, l->place[l->frets] + 0.012);
}

static inline void mix(uint64_t *hash, double v) {
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    *hash = (*hash ^ bits) * 0x9E3779B97F4A7C15u;
    *hash ^= *hash >> 29;
}

/* --- values --- */

static inline double value_of(const lb_picture *p, int k) { return p->face.value(p->face.owner, k); }
static inline double maximum_of(const lb_picture *p, int k) { return p->face.maximum(p->face.owner, k); }

static inline void text_of(const lb_picture *p, int k, double v, char text[MAX_TEXT]) {
    *text = 0;
    p->face.text(p->face.owner, k, v, text, MAX_TEXT);
    char *where = look_of(p)->fretless ? strstr(text, " at fret ") : 0;
    if (where) *where = 0;
}

/* --- of drawing.c --- */

const char *lb_note_name(int key); /* "": there is no such key */
/* Writes a text in the middle of a box, or from its left edge on. */
void lb_label(lb_picture *, lb_sheet *, const part *box, double units, uint32_t colour, const char *, int centred);
/* Begins to take keys as a text: VALUE of a parameter, SAVING, SEARCH. */
void lb_begin_typing(lb_picture *, int what, int parameter, const char *text);
void lb_stop_typing(lb_picture *);
/* Copies from the ground to the array. */
void lb_copy_area(const lb_picture *, lb_area);

/* --- of neck.c --- */

/* The fret at which a string is held; 0: open; -1: not held. */
int lb_fret_held(const lb_picture *, int string);
/* Draws a note's name as high as its lane allows. */
void lb_draw_name(lb_picture *, lb_sheet *, double x, double y, const char *text, int lit);
/* The state of a neck at rest, as one number that is not 0. */
uint64_t lb_neck_state(const lb_picture *);
/* Draws the neck at rest onto the ground. */
void lb_draw_neck(lb_picture *, const part *);
/* Reads the new looks. */
void lb_read_looks(lb_picture *);
/* Draws the neck's moving parts, if they have changed or if `all` is drawn; returns where. */
lb_area lb_draw_lively(lb_picture *, int all);

/* --- of crowns.c --- */

/* Draws the lowest string from the side over its crowns, in mm, and mixes in all that this shows. */
void lb_draw_crowns(lb_picture *, const part *);
/* A pickup, 0 or 1: its place with the present values, mm from the bridge, NaN: there is none; the limits of its own
   slider, so that it stays where it has room; its slider. */
double lb_pickup_place(const lb_picture *, int pickup);
void lb_pickup_limits(const lb_picture *, int pickup, double limits[2]);
int lb_pickup_slider(int pickup);
double lb_mm_along(const lb_picture *); /* pixels for a mm along the side view */
void lb_mix_crowns(const lb_picture *, uint64_t *);
/* True if the present bass cannot use a parameter. */
int lb_is_idle(const lb_picture *, int parameter);

/* --- of menu.c --- */

void lb_open_menu(lb_picture *, int parameter, double x, double y);
int lb_point_menu(lb_picture *, int kind, double x, double y); /* 1: it was for the menu */
/* Makes the tip of the part under the pointer, or takes it away. */
void lb_follow_tip(lb_picture *);
void lb_draw_cover(lb_picture *);
lb_area lb_cover_area(const lb_picture *);
uint64_t lb_cover_state(const lb_picture *); /* a number, not 0, for all that it shows */

/* --- of layout.c --- */

/* The number of basses: if there is one, its parameter has two values of the same name. */
int lb_basses(const lb_picture *);
int lb_key_of(const lb_picture *, int action); /* the key that switches it; -1: none */
const lb_switch *lb_switch_of(int action); /* without a value; 0: there is none */
const char *lb_tab_name(int page);
const char *lb_tip_of(int parameter);
const char *lb_name_of(int parameter); /* beside its value on its page */
const char *lb_section_name(int section);
const char *lb_lamp_row_name(int row);
int lb_is_narrow(const lb_picture *);
/* A number for everything that the parts' places depend on. */
uint64_t lb_layout_state(const lb_picture *);
int lb_is_outdated(const lb_picture *); /* the bass plays as a session kept it, and has changed since */
void lb_lay_out(lb_picture *);

/* --- of parts.c: actions of the kinds of parts --- */

typedef struct { /* the pointer's action: way 1: the wheel goes up, -1: down */
    double x, y;
    int modifiers, way;
} hand;
typedef struct {
    void (*draw)(lb_picture *, const part *);                    /* onto the ground; 0: drawn with the moving parts */
    void (*state)(const lb_picture *, const part *, uint64_t *); /* mixes in all it shows, except the pointer */
    void (*press)(lb_picture *, const part *, const hand *);
    void (*drag)(lb_picture *, const part *, const hand *);
    void (*wheel)(lb_picture *, const part *, const hand *);
    int pointer; /* its shape over the part; LB_POINTER_ACROSS: it moves the parameter with the part's number */
    const char *tip; /* 0: it has none; parts of a parameter have its tip */
} lb_kind;
extern const lb_kind lb_kinds[KINDS];
void lb_change(const lb_picture *, int parameter, double value); /* at once */
void lb_step(lb_picture *, int parameter, int way, int fine);     /* as the wheel does */
void lb_save(lb_picture *);                                       /* under the typed name */
void lb_choose_response(lb_picture *, int file);                    /* -1: none */
void lb_take_found(lb_picture *);                                 /* the first in the list */
void lb_end_note(lb_picture *);                                   /* the note that the pointer plays */
#endif
