/* The parts of the picture: a table defines what each kind draws, shows and does. */
#include "picture/drawing.h"

#include <stdio.h>

#define NOTICE 4.0 /* s that a notice stays */
enum { KNOB = 7 }; /* from a slider's knob or track to where a press takes hold of it */

/* True if the pointer is over a part, or holds it. */
static int is_hot(const lb_picture *p, const part *q) { return q - p->parts == p->hovered; }
static int is_held(const lb_picture *p, const part *q) { return q - p->parts == p->held; }

/* --- values --- */

static double allowed(const lb_picture *p, int k, double v) {
    v = fmin(fmax(v, lb_parameters[k].minimum), maximum_of(p, k));
    for (int coil = 0; coil < 2; coil++)
        if (k == lb_pickup_slider(coil)) {
            double limits[2];
            lb_pickup_limits(p, coil, limits);
            v = fmin(fmax(v, limits[0]), limits[1]);
        }
    return lb_parameters[k].whole ? rint(v) : v;
}

static void set(const lb_picture *p, int k, double v, int phase) { p->face.set(p->face.owner, k, v, phase); }

/* The pointer takes hold of a value. */
static void grab(lb_picture *p, const part *q, double x) {
    p->grabbed = x;
    p->from = value_of(p, q->number);
    set(p, q->number, p->from, LB_BEGIN);
}

void lb_change(const lb_picture *p, int k, double v) {
    v = allowed(p, k, v);
    set(p, k, value_of(p, k), LB_BEGIN);
    set(p, k, v, LB_MOVE);
    set(p, k, v, LB_END);
}

static void mix_value(const lb_picture *p, const part *q, uint64_t *hash) { mix(hash, p->values[q->number]); }

static void mix_bass(const lb_picture *p, const part *q, uint64_t *hash) { mix(hash, p->values[LB_BASS]); }

/* Sets a stepper's next value, or its previous one, cyclically. */
static void step(lb_picture *p, int k, int way) {
    const double minimum = lb_parameters[k].minimum, range = maximum_of(p, k) - minimum + 1, at = value_of(p, k) + way - minimum;
    lb_change(p, k, minimum + at - range * floor(at / range));
}

static void notice(lb_picture *p, const char *text, const char *what) {
    snprintf(p->notice, sizeof p->notice, "%s%s", text, what);
    p->noticed = p->seconds;
}

static void load(lb_picture *p, int sound) {
    if (!p->face.load(p->face.owner, sound)) notice(p, "Not loaded: see the log of the host", "");
}

/* The sound that plays, as listed; -1: none. */
static int playing_sound(const lb_picture *p) {
    return p->sounds && p->face.playing ? p->face.playing(p->face.owner) : -1;
}

/* Goes on to the next bass or, after the last, to the user's sounds; and around. */
static void step_bass(lb_picture *p, int way) {
    const int basses = lb_basses(p), sounds = p->face.playing ? p->face.list(p->face.owner) : 0, all = basses + sounds;
    const int playing = sounds ? p->face.playing(p->face.owner) : -1;
    const int now = playing >= 0 ? basses + playing : (int)value_of(p, LB_BASS), next = (now + way + all) % all;
    if (next >= basses) load(p, next - basses);
    else if (all > 1) lb_change(p, LB_BASS, next);
}

static void wheel_step(lb_picture *p, const part *q, const hand *h) { step(p, q->number, h->way); }

/* True if a press opens a stepper's values as a menu. */
static int has_menu(const lb_picture *p, const part *q) { return maximum_of(p, q->number) > 2; }

static void press_step(lb_picture *p, const part *q, const hand *h) {
    p->focus = q->number;
    if (h->modifiers & LB_RIGHT || has_menu(p, q)) p->requested = q->number + 1;
    else step(p, q->number, 1);
}

void lb_step(lb_picture *p, int k, int way, int fine) {
    const lb_parameter *known = &lb_parameters[k];
    if (known->points) step(p, k, way);
    else {
        const double range = maximum_of(p, k) - known->minimum;
        lb_change(p, k, value_of(p, k) + way * (known->whole ? 1 : range * (fine ? 0.005 : 0.025)));
    }
}

static void wheel_bass(lb_picture *p, const part *q, const hand *h) { step_bass(p, -h->way); }

/* Mixes in the typed text, if this is typed. */
static void mix_typed(const lb_picture *p, int what, uint64_t *hash) {
    for (size_t k = 0; p->typing == what && k <= strlen(p->typed); k++) mix(hash, p->typed[k] + 1);
}

/* --- what several parts draw --- */

static void button(lb_picture *p, const part *q, int lit, int hot) {
    const theme *t = p->t;
    const uint32_t face = lit ? t->accent : hot ? lb_mixed(t->raised, t->edge, 0.5) : t->raised;
    lb_round(&p->ground, q->x, q->y, q->w, q->h, px(p, 6), 0, face);
    lb_round(&p->ground, q->x, q->y, q->w, q->h, px(p, 6), px(p, 1), lit ? t->accent : t->edge);
}

/* Draws an arrow in a box: up (0), right (1), down (2) or left (3). */
static void arrow(lb_picture *p, const part *q, int way, uint32_t colour) {
    static const int ways[4][2] = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};
    const double x = q->x + q->w / 2, y = q->y + q->h / 2, r = px(p, 4), dx = ways[way][0] * r, dy = ways[way][1] * r;
    for (int side = -1; side < 2; side += 2)
        lb_line(&p->ground, x + dx / 2, y + dy / 2, x - dx / 2 - side * dy, y - dy / 2 + side * dx, px(p, 1.8), colour);
}

/* Cuts "2.40 mm at fret 12" after its unit if it does not fit. */
static void shorten(lb_picture *p, char *text, double room) {
    char *unit = strchr(text, ' '), *more = unit ? strchr(unit + 1, ' ') : 0;
    if (more && lb_text_width(px(p, SMALL), text) > room) *more = 0;
}

static void draw_heading(lb_picture *p, const part *q, const char *name) {
    char text[MAX_TEXT];
    int k = 0;
    for (; k < MAX_TEXT - 1 && name[k]; k++) text[k] = (char)(name[k] >= 'a' && name[k] <= 'z' ? name[k] - 32 : name[k]);
    text[k] = 0;
    lb_label(p, &p->ground, q, TINY, p->t->accent, text, 0);
}

/* Draws a row of the list: the playing one is `lit`; a doomed one asks before it is deleted. */
static void draw_row(lb_picture *p, const part *q, const char *text, int lit, int hot, int doomed) {
    const theme *t = p->t;
    const uint32_t face = doomed ? t->hot : lit ? t->accent : t->raised;
    const uint32_t ink = doomed ? 0xFFFFFFFF : lit ? t->on_accent : t->ink;
    const part room = {.x = q->x + px(p, 8), .y = q->y, .w = q->w - px(p, 16), .h = q->h};
    if (lit || hot || doomed) lb_round(&p->ground, q->x, q->y, q->w, q->h, px(p, 5), 0, face);
    lb_label(p, &p->ground, &room, MIDDLE, ink, text, 0);
}

/* --- the header --- */

static void draw_wordmark(lb_picture *p, const part *q) {
    lb_label(p, &p->ground, q, LARGE, p->t->accent, "livebass", 0);
}

static void draw_arrow(lb_picture *p, const part *q) {
    button(p, q, 0, is_hot(p, q));
    arrow(p, q, q->kind == NEXT ? 1 : 3, p->t->ink);
}

static void press_arrow(lb_picture *p, const part *q, const hand *h) { step_bass(p, q->kind == NEXT ? 1 : -1); }

/* True while a notice replaces the title. */
static int is_noticed(const lb_picture *p) {
    return *p->notice && p->seconds >= p->noticed && p->seconds < p->noticed + NOTICE;
}

static void draw_title(lb_picture *p, const part *q) {
    char text[MAX_TEXT];
    const uint32_t colour = p->listing ? p->t->on_accent : p->t->ink;
    button(p, q, p->listing, is_hot(p, q));
    if (p->typing == SAVING) snprintf(text, sizeof text, "Name: %s|", p->typed);
    else if (is_noticed(p)) snprintf(text, sizeof text, "%s", p->notice);
    else if (p->face.title) p->face.title(p->face.owner, text, sizeof text);
    else text_of(p, LB_BASS, p->values[LB_BASS], text);
    const part room = {.x = q->x + px(p, 10), .y = q->y, .w = q->w - px(p, 30), .h = q->h};
    lb_label(p, &p->ground, &room, MIDDLE, colour, text, 0);
    arrow(p, &(part){.x = q->x + q->w - q->h, .y = q->y, .w = q->h, .h = q->h}, 2, colour);
}

static void mix_title(const lb_picture *p, const part *q, uint64_t *hash) {
    mix_bass(p, q, hash);
    mix(hash, is_noticed(p) ? p->noticed + 1 : 0);
    mix_typed(p, SAVING, hash);
    for (int k = 0; p->face.title && k < LB_PARAMETERS; k++) mix(hash, p->values[k]);
    mix(hash, p->lists);
}

static void draw_quality(lb_picture *p, const part *q) {
    char text[MAX_TEXT];
    button(p, q, 0, is_hot(p, q));
    const int end = lb_is_narrow(p) ? 0 : snprintf(text, sizeof text, "quality: ");
    text_of(p, LB_QUALITY, p->values[LB_QUALITY], text + end);
    lb_label(p, &p->ground, q, SMALL, p->t->ink, text, 1);
}

static void draw_load(lb_picture *p, const part *q) {
    char text[MAX_TEXT];
    snprintf(text, sizeof text, "load %.0f %%", 100 * p->shown_load);
    lb_label(p, &p->ground, q, SMALL, p->shown_load > 0.9 ? p->t->hot : p->t->soft, text, 1);
}

static void mix_load(const lb_picture *p, const part *q, uint64_t *hash) { mix(hash, rint(100 * p->shown_load)); }

static int is_overloaded(const lb_picture *p) { return look_of(p)->strings && look_of(p)->overload > 0; }

static void draw_overload(lb_picture *p, const part *q) {
    const int on = is_overloaded(p);
    const double r = px(p, 4), y = q->y + q->h / 2;
    const part room = {.x = q->x + px(p, 18), .y = q->y, .w = q->w - px(p, 18), .h = q->h};
    lb_round(&p->ground, q->x + px(p, 6), y - r, 2 * r, 2 * r, r, 0, on ? p->t->hot : p->t->trough);
    lb_round(&p->ground, q->x + px(p, 6), y - r, 2 * r, 2 * r, r, px(p, 1), on ? p->t->hot : p->t->edge);
    lb_label(p, &p->ground, &room, SMALL, on ? p->t->hot : p->t->soft, "overload", 0);
}

static void mix_overload(const lb_picture *p, const part *q, uint64_t *hash) { mix(hash, is_overloaded(p)); }

/* --- the neck --- */

static void draw_neck(lb_picture *p, const part *q) {
    lb_draw_neck(p, q);
    p->lively = 1; /* moving parts go over it */
    p->still = 0;
}

static void mix_neck(const lb_picture *p, const part *q, uint64_t *hash) { *hash ^= lb_neck_state(p); }

/* Finds the string and the fret at a place on the neck. */
static int string_at(const lb_picture *p, double x, double y, int *fret) {
    const LB_LOOK *l = look_of(p);
    const double strings = (double)l->strings, at = (1 - (y - p->middle) / half_at(p, x)) * strings / 2;
    if (!(x >= p->nut - px(p, 44) && x <= p->saddle && at >= 0 && at < strings)) return -1;
    *fret = 0;
    if (x > p->nut && l->frets && x < board_end(p)) {
        while (*fret < l->frets && x_of(p, l->place[*fret]) < x) ++*fret;
        if (l->fretless && *fret && x - x_of(p, l->place[*fret - 1]) < x_of(p, l->place[*fret]) - x) --*fret;
    }
    return (int)at;
}

void lb_end_note(lb_picture *p) {
    if (p->string >= 0) p->face.note(p->face.owner, 0, p->string, p->key, 0);
    p->string = -1;
}

/* Plays the note under the pointer, unless it sounds already; the old note ends after the new one begins: legato. */
static void play_at(lb_picture *p, double x, double y) {
    int fret = 0;
    const int string = string_at(p, x, y, &fret), before = p->string, key_before = p->key;
    if (string < 0) return;
    const int key = (int)look_of(p)->string[string].open + fret;
    if ((string == before && key == key_before) || key < 0 || key > 127) return;
    p->string = string;
    p->key = key;
    p->face.note(p->face.owner, 1, string, key, 0.75);
    if (before >= 0) p->face.note(p->face.owner, 0, before, key_before, 0);
}

/* The performer's PLUCK_POSITION for a place. */
static double pluck_value(const lb_picture *p, double x) {
    const LB_LOOK *l = look_of(p);
    const double place = (x - p->nut) / p->metre / l->string[0].length - l->default_value;
    const double near = l->nearest - l->default_value, far = l->farthest - l->default_value;
    if (place * near > 0) return fmin(place / near, 1);
    return place * far > 0 ? fmax(-place / far, -1) : 0;
}

static void press_neck(lb_picture *p, const part *q, const hand *h) { play_at(p, h->x, h->y); }

static void press_pluck(lb_picture *p, const part *q, const hand *h) { grab(p, q, h->x); }

static void drag_pluck(lb_picture *p, const part *q, const hand *h) {
    set(p, q->number, allowed(p, q->number, pluck_value(p, h->x)), LB_MOVE);
}

static void wheel_pluck(lb_picture *p, const part *q, const hand *h) {
    lb_change(p, q->number, value_of(p, q->number) - 0.05 * h->way);
}

static void draw_motion(lb_picture *p, const part *q) {
    char text[32];
    snprintf(text, sizeof text, "motion \xC3\x97%.0f", zooms[p->zoom]);
    lb_text(&p->ground, q->x, q->y + px(p, 11), px(p, 9.5), is_hot(p, q) ? p->t->ink : p->t->soft, text, 200);
}

static void mix_motion(const lb_picture *p, const part *q, uint64_t *hash) { mix(hash, p->zoom); }

static void press_motion(lb_picture *p, const part *q, const hand *h) {
    p->zoom = (p->zoom + 1) % (int)(sizeof zooms / sizeof *zooms);
}

static void draw_enlarged(lb_picture *p, const part *q) {
    char text[16];
    snprintf(text, sizeof text, "%.0f %%", 100 * p->enlarged);
    lb_text(&p->ground, q->x, q->y + px(p, 11), px(p, 9.5), is_hot(p, q) ? p->t->ink : p->t->soft, text, q->w);
}

static void mix_enlarged(const lb_picture *p, const part *q, uint64_t *hash) { mix(hash, p->enlarged); }

/* Sets the next zoom, or the one before. */
static void wheel_enlarged(lb_picture *p, const part *q, const hand *h) {
    static const double all[] = {0.75, 1, 1.25, 1.5, 1.75, 2};
    enum { COUNT = sizeof all / sizeof *all };
    int at = 0;
    while (at < COUNT - 1 && all[at] < p->enlarged - 0.01) at++;
    p->enlarged = p->face.zoom(p->face.owner, all[(at + (h->way < 0 ? COUNT - 1 : 1)) % COUNT]);
}

static void press_enlarged(lb_picture *p, const part *q, const hand *h) {
    wheel_enlarged(p, q, &(hand){.way = h->modifiers & LB_RIGHT ? -1 : 1});
}

static void draw_name(lb_picture *p, const part *q) {
    const char *text = lb_note_name((int)look_of(p)->string[q->number].open);
    lb_draw_name(p, &p->ground, q->x + q->w / 2, q->y + q->h / 2, text, lb_fret_held(p, q->number) == 0);
}

static void mix_name(const lb_picture *p, const part *q, uint64_t *hash) {
    mix(hash, (double)look_of(p)->string[q->number].open * 2 + (lb_fret_held(p, q->number) == 0));
}

/* --- lamps --- */

static int lamp_is_on(const lb_picture *p, int lamp) {
    const LB_LOOK *l = look_of(p);
    if (!l->strings) return 0;
    switch (lamp) {
    case LB_SWITCH_LET_RING: if (l->pedal) return 1; break;
    case LB_SWITCH_SLAP: return l->slapped > 0;
    case LB_SWITCH_PICK: return l->slapped == 0 && l->stroke == LB_PICK;
    case LB_SWITCH_FINGER: return l->slapped == 0 && l->stroke != LB_PICK && l->stroke != LB_POP;
    case LB_SWITCH_THUMB_ON_ALL: return l->slapped == l->strings;
    case LB_SWITCH_POP_ON_ALL: return l->slapped == 0 && l->stroke == LB_POP;
    case LB_SWITCH_PALM_MUTE: if (l->palm > 0) return 1; break;
    case LB_SWITCH_VIBRATO: if (l->vibrato > 0) return 1; break;
    case LB_SWITCH_LEGATO: if (l->legato) return 1; break;
    case LB_SWITCH_SLIDE: if (l->sliding) return 1; break;
    default: break;
    }
    return (int)(l->switched >> lamp & 1);
}

/* True if the bass can use a lamp: by a parameter, or by a key of its map. */
static int lamp_works(const lb_picture *p, int lamp) {
    return lb_switch_of(lamp)->parameter >= 0 || lb_key_of(p, lamp) >= 0;
}

static void draw_lamp(lb_picture *p, const part *q) {
    const theme *t = p->t;
    const int on = lamp_is_on(p, q->number), stroke = lb_switch_of(q->number)->parameter == LB_TECHNIQUE;
    const uint32_t ink = on ? t->on_accent : lamp_works(p, q->number) ? t->ink : lb_faded(t->soft, 0.5);
    const double r = stroke ? px(p, 4) : q->h / 2;
    lb_round(&p->ground, q->x, q->y, q->w, q->h, r, 0, on ? t->accent : is_hot(p, q) ? t->edge : t->raised);
    if (stroke && !on) lb_round(&p->ground, q->x, q->y, q->w, q->h, r, px(p, 1), lb_faded(t->accent, 0.6));
    const part room = {.x = q->x + px(p, 3), .y = q->y, .w = q->w - px(p, 6), .h = q->h};
    lb_label(p, &p->ground, &room, q->h < px(p, LAMP_HEIGHT - 5) ? TINY : SMALL, ink, lb_switch_of(q->number)->name, 1);
}

static void mix_lamp(const lb_picture *p, const part *q, uint64_t *hash) { mix(hash, lamp_is_on(p, q->number)); }

/* Chooses a lamp's stroke, or switches its technique on or off; without a parameter, presses its key. */
static void press_lamp(lb_picture *p, const part *q, const hand *h) {
    const lb_switch *s = lb_switch_of(q->number);
    if (h->modifiers & LB_RIGHT) {
        if (s->parameter >= 0) p->requested = s->parameter + 1;
    } else if (s->parameter == LB_TECHNIQUE) lb_change(p, s->parameter, s->on);
    else if (s->parameter >= 0) lb_change(p, s->parameter, value_of(p, s->parameter) > 0 ? 0 : s->on);
    for (int on = 1; s->parameter < 0 && lb_key_of(p, s->action) >= 0 && on >= 0; on--)
        p->face.note(p->face.owner, on, -1, lb_key_of(p, s->action), 0.75);
}

static void draw_lamp_row(lb_picture *p, const part *q) { draw_heading(p, q, lb_lamp_row_name(q->number)); }

/* --- the panel --- */

static void draw_tab(lb_picture *p, const part *q) {
    const uint32_t ink = q->number == p->page || is_hot(p, q) ? p->t->ink : p->t->soft;
    lb_label(p, &p->ground, q, MIDDLE, ink, lb_tab_name(q->number), 1);
    if (q->number != p->page) return;
    lb_box(&p->ground, q->x + px(p, 8), q->y + q->h - px(p, 2), q->w - px(p, 16), px(p, 2), p->t->accent);
}

static void press_tab(lb_picture *p, const part *q, const hand *h) { p->page = q->number; }

static void draw_head(lb_picture *p, const part *q) { draw_heading(p, q, lb_section_name(q->number)); }

/* True if a cell is in the small form, for low windows. */
static int is_small(const lb_picture *p, const part *q) { return q->h < px(p, CELL - 1); }

/* The part of a stepper's cell before its box: a switch needs little room for its value. */
static double name_part(const lb_picture *p, const part *q) {
    return !is_small(p, q) ? 0 : q->kind == STEPPER && maximum_of(p, q->number) == 1 ? 0.68 : 0.42;
}

/* Finds a slider's track. */
static void track_of(const lb_picture *p, const part *q, double *x, double *y, double *w) {
    *x = q->x + px(p, 5);
    *y = q->y + px(p, is_small(p, q) ? 19 : 25);
    *w = q->w - px(p, 10);
}

static double place_on_track(const lb_picture *p, int k, double v) {
    const double minimum = lb_parameters[k].minimum, range = maximum_of(p, k) - minimum;
    return range > 0 ? fmin(fmax((v - minimum) / range, 0), 1) : 0;
}

/* The MIDI controller that moves a parameter, as from `lb_face.controller`. */
static int controller_of(const lb_picture *p, int k) {
    return p->face.learn ? p->face.controller(p->face.owner, k) : LB_NO_CONTROLLER;
}

static void draw_cell_text(lb_picture *p, const part *q) {
    char text[MAX_TEXT];
    const lb_parameter *k = &lb_parameters[q->number];
    const int controller = controller_of(p, q->number), idle = lb_is_idle(p, q->number);
    if (controller < 0) snprintf(text, sizeof text, "%s", lb_name_of(q->number));
    else snprintf(text, sizeof text, "%s (CC %d)", lb_name_of(q->number), controller);
    const double size = px(p, SMALL), y = q->y + px(p, is_small(p, q) ? 12 : 14), wide = lb_text_width(size, text);
    const double maximum = k->points && is_small(p, q) ? q->w * name_part(p, q) - px(p, 4) : q->w;
    const uint32_t ink = idle ? lb_faded(p->t->soft, 0.5) : p->t->ink, soft = idle ? ink : p->t->soft;
    lb_text(&p->ground, q->x, y, size, is_hot(p, q) ? ink : soft, text, maximum);
    if (p->keyed && p->focus == q->number)
        lb_round(&p->ground, q->x - px(p, 4), q->y, q->w + px(p, 6), q->h - px(p, 1), px(p, 4), px(p, 1), p->t->accent);
    if (k->points) return; /* a stepper has its value in its box */
    if (p->typing == VALUE && p->typed_for == q->number) {
        const double box = fmax(q->w * 0.45, px(p, 60)), left = q->x + q->w - box;
        snprintf(text, sizeof text, "%s|", p->typed);
        lb_box(&p->ground, left, y - px(p, 11), box, px(p, 14), p->t->trough);
        lb_text(&p->ground, left + px(p, 4), y, size, p->t->accent, text, box - px(p, 6));
        return;
    }
    const double room = q->w - wide - px(p, 8);
    if (controller == LB_WAITS) snprintf(text, sizeof text, "move a controller");
    else text_of(p, q->number, p->values[q->number], text);
    shorten(p, text, room);
    const double needed = lb_text_width(size, text);
    const double from = needed < room ? q->x + q->w - needed : q->x + wide + px(p, 8);
    lb_text(&p->ground, from, y, size, ink, text, room + 1);
}

static void draw_slider(lb_picture *p, const part *q) {
    draw_cell_text(p, q);
    double x, y, w;
    const theme *t = p->t;
    const lb_parameter *k = &lb_parameters[q->number];
    track_of(p, q, &x, &y, &w);
    const double high = is_small(p, q) ? 4.5 : 7; /* half the knob */
    const int idle = lb_is_idle(p, q->number);
    const double now = x + w * place_on_track(p, q->number, p->values[q->number]);
    const double default_value = x + w * place_on_track(p, q->number, k->default_value), thick = px(p, 4);
    lb_round(&p->ground, x, y - thick / 2, w, thick, thick / 2, 0, t->trough);
    if (idle) return;
    lb_round(&p->ground, fmin(now, default_value), y - thick / 2, fabs(now - default_value), thick, thick / 2, 0, t->accent);
    if (k->default_value > k->minimum && k->default_value < maximum_of(p, q->number))
        lb_box(&p->ground, default_value - px(p, 0.75), y - px(p, 5), px(p, 1.5), px(p, 10), t->edge);
    lb_round(&p->ground, now - px(p, 5), y - px(p, high), px(p, 10), px(p, 2 * high), px(p, 4), 0, BLACK);
    const uint32_t colour = is_held(p, q) ? t->accent : is_hot(p, q) ? 0xFFFFFFFF : STRING;
    lb_round(&p->ground, now - px(p, 4), y - px(p, high - 1), px(p, 8), px(p, 2 * high - 2), px(p, 3), 0, colour);
    lb_box(&p->ground, now - px(p, 0.5), y - px(p, high - 3), px(p, 1), px(p, 2 * high - 6), 0x80000000);
}

/* Draws the box of a cell's value, with an arrow and a text from `left` on; returns where it is. */
static part draw_box(lb_picture *p, const part *q, double left, int way, const char *text) {
    const int hot = is_hot(p, q);
    const double part_of = name_part(p, q), top = px(p, is_small(p, q) ? 3 : 17);
    const part box = {.x = q->x + part_of * q->w, .y = q->y + top, .w = (1 - part_of) * q->w, .h = px(p, 18)};
    const part room = {.x = box.x + left, .y = box.y, .w = box.w - left - px(p, 16), .h = box.h};
    const part end = {.x = box.x + box.w - px(p, 18), .y = box.y, .w = px(p, 14), .h = box.h};
    button(p, &box, 0, hot);
    lb_label(p, &p->ground, &room, SMALL, p->t->ink, text, 0);
    arrow(p, &end, way, hot ? p->t->ink : p->t->soft);
    return box;
}

static void draw_stepper(lb_picture *p, const part *q) {
    draw_cell_text(p, q);
    char text[MAX_TEXT];
    text_of(p, q->number, p->values[q->number], text);
    const int is_switch = maximum_of(p, q->number) == 1, on = p->values[q->number] > 0.5;
    const part box = draw_box(p, q, px(p, is_switch ? 20 : 8), has_menu(p, q) ? 2 : 1, text);
    const double r = px(p, 3);
    const uint32_t colour = on ? p->t->accent : p->t->trough;
    if (is_switch) lb_round(&p->ground, box.x + px(p, 9), box.y + box.h / 2 - r, 2 * r, 2 * r, r, 0, colour);
}

static void mix_focus(const lb_picture *p, const part *q, uint64_t *hash) {
    mix(hash, p->keyed && p->focus == q->number);
}

static void mix_stepper(const lb_picture *p, const part *q, uint64_t *hash) {
    mix_value(p, q, hash);
    mix_focus(p, q, hash);
}

static void mix_slider(const lb_picture *p, const part *q, uint64_t *hash) {
    mix_value(p, q, hash);
    mix(hash, p->values[LB_GAUGE] + 1000 * p->values[LB_PICKUP_PLACE]); /* other values depend on these */
    mix(hash, lb_is_idle(p, q->number));
    mix_focus(p, q, hash);
    if (p->typed_for == q->number) mix_typed(p, VALUE, hash);
    mix(hash, maximum_of(p, q->number) + 1000.0 * controller_of(p, q->number));
}

/* --- the response --- */

#define RESPONSE_NAME "Response"

/* Writes the name of the response. */
static void response_of(const lb_picture *p, char text[MAX_TEXT]) {
    *text = 0;
    if (p->face.response) p->face.response(p->face.owner, text, MAX_TEXT);
}

static void draw_response(lb_picture *p, const part *q) {
    char text[MAX_TEXT];
    const uint32_t ink = is_hot(p, q) ? p->t->ink : p->t->soft;
    lb_text(&p->ground, q->x, q->y + px(p, is_small(p, q) ? 12 : 14), px(p, SMALL), ink, RESPONSE_NAME, q->w);
    response_of(p, text);
    draw_box(p, q, px(p, 8), 2, text);
}

static void mix_response(const lb_picture *p, const part *q, uint64_t *hash) {
    char text[MAX_TEXT];
    response_of(p, text);
    for (int k = 0; text[k]; k++) mix(hash, text[k]);
}

static void press_response(lb_picture *p, const part *q, const hand *h) { p->requested = q->number + 1; }

void lb_choose_response(lb_picture *p, int file) {
    const char *why = p->face.respond(p->face.owner, file);
    if (why) notice(p, why, "");
}

static double slider_value(const lb_picture *p, const part *q, double x) {
    double left, y, wide;
    track_of(p, q, &left, &y, &wide);
    const double minimum = lb_parameters[q->number].minimum;
    return allowed(p, q->number, minimum + (maximum_of(p, q->number) - minimum) * (x - left) / wide);
}

/* Takes hold of a value. Beside the knob, on the track, the value jumps there; on the number, a click types it. */
static void press_slider(lb_picture *p, const part *q, const hand *h) {
    p->focus = q->number;
    if (h->modifiers & LB_RIGHT) {
        p->requested = q->number + 1;
        p->held = -1;
        return;
    }
    grab(p, q, h->x);
    double x, y, w;
    track_of(p, q, &x, &y, &w);
    p->pressed_number = p->face.read && h->y < y - px(p, KNOB) && h->x > q->x + q->w * 0.6;
    const double knob = x + w * place_on_track(p, q->number, p->from);
    if (h->modifiers & LB_SHIFT || h->y < y - px(p, KNOB) || fabs(h->x - knob) <= px(p, KNOB)) return;
    set(p, q->number, p->from = slider_value(p, q, h->x), LB_MOVE);
}

static void drag_slider(lb_picture *p, const part *q, const hand *h) {
    if (p->pressed_number && fabs(h->x - p->grabbed) < px(p, 3)) return;
    p->pressed_number = 0;
    const double range = maximum_of(p, q->number) - lb_parameters[q->number].minimum;
    const double moved = range * (h->x - p->grabbed) / (q->w - px(p, 10));
    set(p, q->number, allowed(p, q->number, p->from + (h->modifiers & LB_SHIFT ? 0.1 : 1) * moved), LB_MOVE);
}

static void wheel_slider(lb_picture *p, const part *q, const hand *h) {
    lb_step(p, q->number, h->way, h->modifiers & LB_SHIFT);
}

/* --- A and B, Undo --- */

static void draw_button(lb_picture *p, const part *q, const char *text, int lit, int hot) {
    button(p, q, lit, hot);
    lb_label(p, &p->ground, q, SMALL, lit ? p->t->on_accent : p->t->ink, text, 1);
}

static void draw_labelled(lb_picture *p, const part *q) {
    static const char *const labels[KINDS][2] = { /* the second: without room */
        [UNDO] = {"Undo", "Undo"}, [SAVE] = {"Save sound", "Save"}, [PASTE] = {"Paste sound", "Paste"},
        [UPDATE] = {"Update", "Update"},
    };
    draw_button(p, q, labels[q->kind][lb_is_narrow(p)], q->kind == UPDATE, is_hot(p, q));
}

/* Undoes the last change, and names it: it may be on another page. */
static void press_undo(lb_picture *p, const part *q, const hand *h) {
    double before[LB_PARAMETERS];
    char cabinet[MAX_TEXT], now[MAX_TEXT];
    int k = 0;
    for (int j = 0; j < LB_PARAMETERS; j++) before[j] = value_of(p, j);
    response_of(p, cabinet);
    p->face.undo(p->face.owner);
    response_of(p, now);
    while (k < LB_PARAMETERS && value_of(p, k) == before[k]) k++;
    if (k < LB_PARAMETERS) notice(p, "Undone: ", lb_parameters[k].name);
    else if (strcmp(cabinet, now) != 0) notice(p, "Undone: ", RESPONSE_NAME);
}

static void press_paste(lb_picture *p, const part *q, const hand *h) { p->pasting = 1; }

static void press_update(lb_picture *p, const part *q, const hand *h) {
    p->face.update(p->face.owner);
    notice(p, "The bass is the present one. Undo brings the saved one back.", "");
}

static void draw_side(lb_picture *p, const part *q) {
    draw_button(p, q, q->number ? "B" : "A", q->number == p->face.side(p->face.owner), is_hot(p, q));
}

static void mix_side(const lb_picture *p, const part *q, uint64_t *hash) { mix(hash, p->face.side(p->face.owner)); }

static void draw_copy(lb_picture *p, const part *q) {
    draw_button(p, q, p->face.side(p->face.owner) ? "B to A" : "A to B", 0, is_hot(p, q));
}

static void press_copy(lb_picture *p, const part *q, const hand *h) {
    p->face.copy(p->face.owner);
    notice(p, p->face.side(p->face.owner) ? "B is copied to A" : "A is copied to B", "");
}

static void press_side(lb_picture *p, const part *q, const hand *h) {
    if (q->number != p->face.side(p->face.owner)) p->face.swap(p->face.owner);
}

/* --- the list of basses and of the user's sounds --- */

static void read_list(lb_picture *p) {
    p->sounds = p->face.list ? p->face.list(p->face.owner) : 0;
    p->doomed = -1;
    p->lists++;
}

void lb_save(lb_picture *p) {
    char name[MAX_TEXT - 16];
    snprintf(name, sizeof name, "%s", p->typed);
    if (p->face.save(p->face.owner, name, sizeof name)) notice(p, "Saved: ", name);
    else notice(p, "Not saved: see the log of the host", "");
    p->lists++;
    if (p->listing) read_list(p);
}

/* Asks for a name; a second press takes the typed one, or the bass's. */
static void press_save(lb_picture *p, const part *q, const hand *h) {
    if (p->typing == SAVING) {
        lb_save(p);
        lb_stop_typing(p);
    } else lb_begin_typing(p, SAVING, 0, "");
}

int lb_wants_text(lb_picture *p) {
    const int wanted = p->pasting;
    p->pasting = 0;
    return wanted;
}

void lb_paste(lb_picture *p, const char *text) {
    const char *why = p->face.paste(p->face.owner, text ? text : "");
    notice(p, why ? "The clipboard " : "Taken from the clipboard", why ? why : "");
}

void lb_drop(lb_picture *p, const char *text) {
    const char *why = p->face.drop ? p->face.drop(p->face.owner, text) : "This window takes no files";
    if (why) notice(p, why, "");
}

/* --- the song --- */

static void draw_song_button(lb_picture *p, const part *q) {
    const int lit = q->number == LB_ROLL ? p->song.rolls : p->song.loops;
    draw_button(p, q, q->number == LB_LOOP ? "Loop" : p->song.rolls ? "Stop" : "Play", lit, is_hot(p, q));
}

static void mix_song_button(const lb_picture *p, const part *q, uint64_t *hash) {
    mix(hash, 2 * p->song.rolls + p->song.loops);
}

static void press_song(lb_picture *p, const part *q, const hand *h) { p->face.steer(p->face.owner, q->number); }

static void draw_song_line(lb_picture *p, const part *q) {
    const double low = q->y + q->h - px(p, 1.5), played = q->w * p->song.part / 1000;
    lb_label(p, &p->ground, q, SMALL, p->song.wrong ? p->t->hot : p->t->ink, p->song.line, 0);
    if (p->song.there) lb_box(&p->ground, q->x, low, q->w, px(p, 1.5), p->t->trough);
    if (p->song.there) lb_box(&p->ground, q->x, low, played, px(p, 1.5), p->t->accent);
}

static void mix_song_line(const lb_picture *p, const part *q, uint64_t *hash) {
    mix(hash, 2 * p->song.part + p->song.wrong);
    for (const char *c = p->song.line; *c; c++) mix(hash, *c);
}

static void draw_song_cross(lb_picture *p, const part *q) {
    const double x = q->x + q->w / 2, y = q->y + q->h / 2, r = px(p, 3.5);
    button(p, q, 0, is_hot(p, q));
    for (int side = -1; side < 2; side += 2)
        lb_line(&p->ground, x - r, y - side * r, x + r, y + side * r, px(p, 1.5), p->t->ink);
}

static void close_list(lb_picture *p) {
    p->listing = 0;
    if (p->typing == SEARCH) lb_stop_typing(p);
}

/* Loads a sound; the right button deletes one of the user's with its second press. */
static void press_sound(lb_picture *p, const part *q, const hand *h) {
    const int sound = q->number;
    if (!(h->modifiers & LB_RIGHT) && p->doomed != sound) {
        close_list(p);
        load(p, sound);
    } else if (!(h->modifiers & LB_RIGHT)) p->doomed = -1;
    else if (p->face.is_own && !p->face.is_own(p->face.owner, sound)) return;
    else if (p->doomed != sound) p->doomed = sound;
    else {
        p->face.remove(p->face.owner, sound);
        read_list(p);
    }
}

static void press_title(lb_picture *p, const part *q, const hand *h) {
    if (p->listing) close_list(p);
    else {
        read_list(p);
        lb_begin_typing(p, SEARCH, 0, "");
        p->listing = 1;
    }
}

static void wheel_list(lb_picture *p, const part *q, const hand *h) {
    p->scrolled = (int)fmin(fmax(p->scrolled - h->way, 0), p->columns);
}

/* True if a bass plays as it is, not as a sound. */
static int is_playing(const lb_picture *p, const part *q) {
    return (int)p->values[LB_BASS] == q->number && playing_sound(p) < 0;
}

static void mix_item(const lb_picture *p, const part *q, uint64_t *hash) { mix(hash, is_playing(p, q)); }

static void draw_item(lb_picture *p, const part *q) {
    char text[MAX_TEXT];
    text_of(p, LB_BASS, q->number, text);
    draw_row(p, q, text, is_playing(p, q), is_hot(p, q), 0);
}

static void press_item(lb_picture *p, const part *q, const hand *h) {
    close_list(p);
    lb_change(p, LB_BASS, q->number);
}

void lb_take_found(lb_picture *p) {
    lb_lay_out(p); /* the last letters may not have been drawn */
    for (int k = 0; k < p->count; k++) {
        const part *q = &p->parts[k];
        if (q->kind != ITEM && q->kind != SOUND) continue;
        lb_kinds[q->kind].press(p, q, &(hand){0});
        return;
    }
    p->lists++; /* nothing was found: all are listed again */
}

static void draw_sounds(lb_picture *p, const part *q) {
    static const char *const groups[LB_SOUND_GROUPS] = {"Basses", "Mine", "Sounds", "Laboratory"};
    draw_heading(p, &(part){.x = q->x + px(p, 8), .y = q->y, .w = q->w, .h = q->h}, groups[q->number]);
}

/* The text that the listed names must have. */
static void draw_search(lb_picture *p, const part *q) {
    char text[MAX_TEXT];
    const part room = {.x = q->x + px(p, 8), .y = q->y, .w = q->w - px(p, 16), .h = q->h};
    snprintf(text, sizeof text, "%s|", *p->typed ? p->typed : "Type to search ");
    lb_round(&p->ground, q->x, q->y, q->w, q->h, px(p, 5), px(p, 1), p->t->edge);
    lb_label(p, &p->ground, &room, MIDDLE, *p->typed ? p->t->ink : p->t->soft, text, 0);
}

static void mix_search(const lb_picture *p, const part *q, uint64_t *hash) { mix_typed(p, SEARCH, hash); }

static void draw_sound(lb_picture *p, const part *q) {
    const int doomed = p->doomed == q->number, lit = playing_sound(p) == q->number;
    const char *text = doomed ? "Press again to delete" : p->face.sound(p->face.owner, q->number);
    draw_row(p, q, text, lit, is_hot(p, q), doomed);
}

static void mix_sound(const lb_picture *p, const part *q, uint64_t *hash) {
    mix(hash, (p->doomed == q->number) + 2 * (playing_sound(p) == q->number));
}

static void draw_more(lb_picture *p, const part *q) {
    draw_row(p, q, p->scrolled < p->columns ? "More" : "Back", 0, 1, 0);
}

static void press_more(lb_picture *p, const part *q, const hand *h) {
    p->scrolled = p->scrolled < p->columns ? p->scrolled + 1 : 0;
}

/* --- the pickups in the side view --- */

static void press_coil(lb_picture *p, const part *q, const hand *h) {
    p->focus = q->number;
    if (h->modifiers & LB_RIGHT) {
        p->requested = q->number + 1;
        p->held = -1;
    } else grab(p, q, h->x);
}

/* To the left is toward the neck. */
static void drag_coil(lb_picture *p, const part *q, const hand *h) {
    const double moved = (p->grabbed - h->x) / lb_mm_along(p);
    set(p, q->number, allowed(p, q->number, p->from + (h->modifiers & LB_SHIFT ? 0.1 : 1) * moved), LB_MOVE);
}

static void wheel_coil(lb_picture *p, const part *q, const hand *h) {
    lb_step(p, q->number == LB_PICKUP_2_PLACE ? LB_PICKUP_2_HEIGHT : LB_PICKUP_1_HEIGHT, h->way, h->modifiers & LB_SHIFT);
}

static void mix_crowns(const lb_picture *p, const part *q, uint64_t *hash) { lb_mix_crowns(p, hash); }

/* --- the table --- */

enum { DEFAULT = LB_POINTER_DEFAULT, HAND = LB_POINTER_HAND, ACROSS = LB_POINTER_ACROSS };
const lb_kind lb_kinds[KINDS] = {
    [WORDMARK] = {.draw = draw_wordmark},
    [PREVIOUS] = {draw_arrow, 0, press_arrow, 0, wheel_bass, HAND, "The bass or sound before."},
    [NEXT] = {draw_arrow, 0, press_arrow, 0, wheel_bass, HAND, "The next bass or sound."},
    [TITLE] = {draw_title, mix_title, press_title, 0, wheel_bass, HAND, "Choose a bass or one of your sounds. * means changed."},
    [QUALITY] = {draw_quality, mix_value, press_step, 0, wheel_step, HAND, 0},
    [LOAD] = {.draw = draw_load, .state = mix_load, .tip = "How much of its time the sound takes. At 100 % it would break up."},
    [OVERLOAD] = {.draw = draw_overload, .state = mix_overload,
                  .tip = "Lit while time runs out and strings play more coarsely: see Relief on the page Settings."},
    [LAMP] = {draw_lamp, mix_lamp, press_lamp, 0, 0, HAND, "Press to switch it. Right-click to learn a MIDI controller."},
    [TAB] = {draw_tab, 0, press_tab, 0, 0, HAND, 0},
    [HEAD] = {.draw = draw_head},
    [SLIDER] = {draw_slider, mix_slider, press_slider, drag_slider, wheel_slider, ACROSS, 0},
    [STEPPER] = {draw_stepper, mix_stepper, press_step, 0, wheel_step, HAND, 0},
    [ITEM] = {draw_item, mix_item, press_item, 0, wheel_list, HAND, 0},
    [BOARD] = {draw_neck, mix_neck, press_neck, press_neck, 0, DEFAULT, 0},
    [PLUCK] = {0, 0, press_pluck, drag_pluck, wheel_pluck, ACROSS, 0},
    [MOTION] = {draw_motion, mix_motion, press_motion, 0, 0, HAND, "Magnification of the strings' motion."},
    [ENLARGED] = {draw_enlarged, mix_enlarged, press_enlarged, 0, wheel_enlarged, HAND, "Zoom of all windows of livebass."},
    [NAME] = {.draw = draw_name, .state = mix_name},
    [UNDO] = {draw_labelled, 0, press_undo, 0, 0, HAND, "Undo the last change."},
    [SIDE] = {draw_side, mix_side, press_side, 0, 0, HAND, "Two sets of values, to compare by ear."},
    [COPY] = {draw_copy, mix_side, press_copy, 0, 0, HAND, "Copy the values you hear to the other set."},
    [SAVE] = {draw_labelled, 0, press_save, 0, 0, HAND, "Save a sound: type a name, then Return or Save."},
    [PASTE] = {draw_labelled, 0, press_paste, 0, 0, HAND, "Take a link of the page, or a sound, from the clipboard."},
    [SOUND] = {draw_sound, mix_sound, press_sound, 0, wheel_list, HAND, "Press to load it. Right-click twice to delete it."},
    [SOUNDS] = {.draw = draw_sounds, .wheel = wheel_list},
    [SEARCHED] = {.draw = draw_search, .state = mix_search, .wheel = wheel_list},
    [MORE] = {draw_more, 0, press_more, 0, wheel_list, HAND, 0},
    [RESPONSE] = {draw_response, mix_response, press_response, 0, 0, HAND,
                  "The sound of a speaker cabinet or a room: an impulse response. Your session keeps it."},
    [UPDATE] = {draw_labelled, 0, press_update, 0, 0, HAND,
                "The bass has changed since your session was saved, and plays as it did. Press to take the new one."},
    [SONG_BUTTON] = {draw_song_button, mix_song_button, press_song, 0, 0, HAND,
                     "Play or stop the file, or play it again and again."},
    [SONG_LINE] = {.draw = draw_song_line, .state = mix_song_line, .tip = "Your session does not keep the file."},
    [SONG_CROSS] = {draw_song_cross, 0, press_song, 0, 0, HAND, "Put the file away."},
    [CROWNS] = {.draw = lb_draw_crowns, .state = mix_crowns},
    [COIL] = {0, 0, press_coil, drag_coil, wheel_coil, ACROSS,
              "Drag the pickup along the string; the wheel raises it. Double-click: the preset's place."},
    [LAMP_ROW] = {.draw = draw_lamp_row},
};
