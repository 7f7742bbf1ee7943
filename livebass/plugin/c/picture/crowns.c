/* The bench in the picture: the lowest string from the side over its crowns, in mm, and the pickups. */
#include "picture/drawing.h"

#include <stdio.h>

#define STRING_MM 7.0 /* most pixels at scale 1 for a mm of the string's thickness: to the scale of the gaps it is a bar */
#define WRAP 3.0      /* pixels at scale 1 between the turns of its winding */
#define LABELS 13.0   /* height of the row below, with the frets' numbers and the pickups' names */
#define SHOWN 10.0    /* s that a stop of the sliders is shown */
#define COIL_GAP 3.0 /* mm between a pickup and the strings, as drawn; how it changes is true */

int lb_is_idle(const lb_picture *p, int k) {
    const lb_own *own = p->own;
    if (!own || !(k >= LB_ACTION && k < LB_ACTION + LB_BUILT)) return 0;
    switch (k) {
    case LB_ACTION:
    case LB_NECK_RELIEF:
    case LB_NUT_HEIGHT: return !own->crowns;
    case LB_FRET:
    case LB_FRET_HEIGHT: return !own->crowns || look_of(p)->fretless;
    case LB_NECK_RESONANCE:
    case LB_NECK_MASS: return isnan(own->resonance);
    case LB_PICKUP_PLACE:
    case LB_PICKUP_HEIGHT:
    case LB_CABLE:
    case LB_PICKUP_1_PLACE:
    case LB_PICKUP_1_HEIGHT: return isnan(own->place[0]);
    case LB_PICKUP_2_PLACE:
    case LB_PICKUP_2_HEIGHT: return isnan(own->place[1]);
    default: return isnan(own->length);
    }
}

static int crowns_of(const lb_own *own) { return own->crowns > 0 && own->crowns <= LB_PLACES ? own->crowns : 0; }

/* The gap, mm, between the open string and a crown with the bench's present values (note.py: gap_under). */
static double gap_at(const lb_picture *p, const lb_own *own, int k) {
    const int count = crowns_of(own), last = count > 1 ? count - 1 : 1, twelfth = last < 11 ? last : 11;
    const double range = own->at[last] - own->at[0], s = (own->at[k] - own->at[0]) / range;
    const double pivot = (own->at[twelfth] - own->at[0]) / range;
    const double relief = p->values[LB_NECK_RELIEF], nut = p->values[LB_NUT_HEIGHT];
    const double end = nut + (p->values[LB_ACTION] - 4 * relief * pivot * (1 - pivot) - nut) / pivot;
    const double lifted = p->values[LB_FRET] == k + 1 ? p->values[LB_FRET_HEIGHT] : 0;
    return -own->height[k] + nut + (end - nut) * s + 4 * relief * s * (1 - s) - lifted;
}

static int is_stop_shown(const lb_picture *p) {
    return p->stop.count && p->seconds >= p->stopped && p->seconds < p->stopped + SHOWN;
}

/* The pickup under the pointer, or held; -1: none. */
static int lit_coil(const lb_picture *p) {
    const int at = p->held >= 0 ? p->held : p->hovered;
    return p->coils >= 0 && (at == p->coils || at == p->coils + 1) ? at - p->coils : -1;
}

void lb_mix_crowns(const lb_picture *p, uint64_t *hash) {
    mix(hash, lit_coil(p) + 4 * (p->held >= 0));
    mix(hash, is_stop_shown(p) ? p->stopped + 1 : 0);
    for (int k = LB_ACTION; k < LB_ACTION + LB_BUILT; k++) mix(hash, p->values[k]);
    mix(hash, p->values[LB_BASS]);
    mix(hash, (double)look_of(p)->fretless);
}

/* A side view: pixels for each mm along it and down from the string's underside, at `rest`, to its foot. */
typedef struct {
    const lb_own *own;
    double along, mm, rest, foot;
} side;

static double place_of(const lb_picture *p, const side *v, int k) { return p->nut + v->own->at[k] * v->along; }

/* Writes the height of a crown beside a line from the string down to it. */
static void measure(lb_picture *p, const side *v, int k, const char *where) {
    char text[MAX_TEXT];
    const double gap = gap_at(p, v->own, k), x = place_of(p, v, k), to = v->rest + gap * v->mm;
    const double size = px(p, 10), thin = px(p, 1), middle = fmax((v->rest + to) / 2, v->rest + px(p, 9));
    snprintf(text, sizeof text, "%.2f mm %s", gap, where);
    lb_box(&p->ground, x - thin / 2, v->rest, thin, to - v->rest, p->t->accent);
    for (int end = 0; end < 2; end++)
        lb_box(&p->ground, x - px(p, 3), end ? to : v->rest, px(p, 6), thin, p->t->accent);
    const double wide = lb_text_width(size, text) + px(p, 8);
    lb_round(&p->ground, x + px(p, 5), middle - px(p, 7), wide, px(p, 14), px(p, 4), 0, 0xD0100D0B);
    lb_text(&p->ground, x + px(p, 9), middle + px(p, 3.5), size, 0xFFFFFFFF, text, wide);
}

/* Draws the board up to a crown, and the crown, which is 1 mm high. */
static void draw_crown(lb_picture *p, const side *v, int k) {
    lb_sheet *s = &p->ground;
    const double x = place_of(p, v, k), gap = gap_at(p, v->own, k), from = k ? place_of(p, v, k - 1) : p->nut;
    const double before = k ? gap_at(p, v->own, k - 1) : gap, crown = look_of(p)->fretless ? 0 : 1;
    for (int at = (int)from; at < (int)x; at++) {
        const double top = v->rest + (before + (gap - before) * (at - from) / (x - from) + crown) * v->mm;
        lb_shade(s, at, top, 1, fmax(v->foot - top, 0), WOOD_LIGHT, WOOD);
    }
    const uint32_t colour = p->values[LB_FRET] == k + 1 ? p->t->accent : METAL;
    if (crown > 0)
        lb_round(s, x - px(p, 2), v->rest + gap * v->mm, px(p, 4), crown * v->mm + px(p, 2), px(p, 2), 0, colour);
}

int lb_pickup_slider(int pickup) { return pickup ? LB_PICKUP_2_PLACE : LB_PICKUP_1_PLACE; }

double lb_pickup_place(const lb_picture *p, int k) {
    if (!p->own) return NAN;
    const double place = p->own->place[k];
    const double moved = place + p->values[LB_PICKUP_PLACE] + p->values[lb_pickup_slider(k)];
    return isnan(place) ? NAN : fmax(fmin(moved, p->own->farthest[k]), p->own->nearest[k]);
}

void lb_pickup_limits(const lb_picture *p, int k, double limits[2]) {
    limits[0] = -INFINITY;
    limits[1] = INFINITY;
    if (!p->own || isnan(p->own->place[k])) return;
    const double zero = p->own->place[k] + p->values[LB_PICKUP_PLACE];
    limits[0] = fmin(p->own->nearest[k] - zero, 0);
    limits[1] = fmax(p->own->farthest[k] - zero, 0);
}

double lb_mm_along(const lb_picture *p) {
    return p->own && p->own->length > 0 ? (p->saddle - p->nut) / p->own->length : 1;
}

/* Draws a pickup with its name, and gives its part this place. */
static void draw_pickup(lb_picture *p, const side *v, int k) {
    const double height = p->values[LB_PICKUP_HEIGHT] + p->values[k ? LB_PICKUP_2_HEIGHT : LB_PICKUP_1_HEIGHT];
    const double x = p->saddle - lb_pickup_place(p, k) * v->along, apart = lb_pickup_place(p, 0) - lb_pickup_place(p, 1);
    const double top = v->rest + fmax(COIL_GAP - 0.5 * height, 0.3) * v->mm, tall = v->foot - top, size = px(p, 9.5);
    if (isnan(x)) return;
    const uint32_t edge = lit_coil(p) == k ? p->t->accent : METAL;
    lb_round(&p->ground, x - px(p, 10), top, px(p, 20), tall, px(p, 3), 0, 0xFF2C241D);
    lb_round(&p->ground, x - px(p, 10), top, px(p, 20), tall, px(p, 3), px(p, 1), edge);
    for (int way = -1; way < 2; way += 2) /* the poles */
        lb_round(&p->ground, x + way * px(p, 4) - px(p, 2), top - px(p, 2), px(p, 4), px(p, 7), px(p, 1.5), 0, METAL);
    char text[16] = "pickup";
    if (!isnan(apart)) snprintf(text, sizeof text, "pickup %d", k + 1);
    const double wide = lb_text_width(size, text);
    double left = x - wide / 2;
    if (fabs(apart) * v->along < wide + px(p, 6)) left = (apart > 0) == (k == 0) ? x + px(p, 8) - wide : x - px(p, 8);
    lb_text(&p->ground, left, v->foot + px(p, 10.5), size, lit_coil(p) == k ? p->t->ink : p->t->soft, text, wide + 1);
    part *q = &p->parts[p->coils + k];
    q->x = x - px(p, 13);
    q->y = v->rest;
    q->w = px(p, 26);
    q->h = v->foot + px(p, LABELS) - v->rest;
}

/* Draws a wound string, `tall` pixels, with its underside at `rest`: a core in the turns of a wire, which slant. */
static void draw_string(lb_picture *p, double x0, double x1, double rest, double tall) {
    const double turn = px(p, WRAP), top = rest - tall;
    for (int y = (int)floor(top); y < rest; y++) {
        const double t = fmin(fmax((y + 0.5 - top) / tall, 0), 1), round = sqrt(fmax(1 - (2 * t - 1) * (2 * t - 1), 0));
        const double shine = exp(-(t - 0.3) * (t - 0.3) / 0.03);
        for (int x = (int)floor(x0); x < x1; x++) {
            const double at = (x + 0.5 - x0) / turn + 0.5 * t, ridge = fabs(sin(M_PI * at));
            const double edge = fmin(fmin(y + 1 - top, rest - y), 1);
            const double light = (0.25 + 0.5 * round + 0.35 * shine) * (0.45 + 0.55 * ridge);
            lb_dot(&p->ground, x, y, lb_mixed(0xFF2E2A25, STRING, light), (float)fmin(fmax(edge, 0), 1));
        }
    }
}

/* Writes what the parts are, and why sliders have stopped. */
static void draw_names(lb_picture *p, const side *v, const part *q, double tall) {
    char text[2 * MAX_TEXT + 64] = "", value[MAX_TEXT];
    lb_sheet *s = &p->ground;
    const double size = px(p, 9.5), beside = v->rest - tall / 2 + px(p, 3.5), above = q->y + px(p, 10);
    lb_text(s, p->nut - px(p, 10) - lb_text_width(size, "nut"), beside, size, p->t->soft, "nut", 100);
    lb_text(s, p->saddle + px(p, 14), beside, size, p->t->soft, "bridge", px(p, 56));
    snprintf(text, sizeof text, "%s, the lowest string", lb_note_name((int)v->own->open));
    const double end = lb_text(s, p->nut, above, size, p->t->soft, text, px(p, 200));
    for (int k = 2; k < v->own->crowns; k++) {
        const int in_octave = (k + 1) % 12, marked = !in_octave || (in_octave > 1 && in_octave < 10 && in_octave % 2);
        if (!marked) continue;
        snprintf(text, sizeof text, "%d", k + 1);
        lb_text(s, place_of(p, v, k) - lb_text_width(size, text) / 2, v->foot + px(p, 10.5), size, p->t->soft, text, 100);
    }
    if (!is_stop_shown(p) || !p->face.fault) return;
    const lb_stop *stop = &p->stop;
    size_t at = 0;
    if (stop->parameter < LB_PARAMETERS) {
        text_of(p, stop->parameter, p->values[stop->parameter], value);
        at = (size_t)snprintf(text, sizeof text, "%s stops at %s: beyond it ", lb_parameters[stop->parameter].name, value);
    } else at = (size_t)snprintf(text, sizeof text, "This neck cannot be played: ");
    p->face.fault(&stop->fault, text + at, sizeof text - at);
    const double room = p->saddle - end - px(p, 16), wide = fmin(lb_text_width(size, text), room);
    lb_text(s, p->saddle - wide, above, size, p->t->hot, text, room);
}

/* Draws a line each mm below the string. */
static void draw_scale(lb_picture *p, const side *v, int deepest) {
    char text[16];
    for (int k = 1; k <= deepest; k++) {
        const double y = v->rest + k * v->mm;
        snprintf(text, sizeof text, "%d mm", k);
        if (y > v->foot + 1) return;
        lb_box(&p->ground, p->nut, y, p->saddle - p->nut, fmax(px(p, 0.5), 1), lb_faded(p->t->edge, 0.45));
        if (v->mm > px(p, 9) || k % 2 == 0)
            lb_text(&p->ground, p->saddle + px(p, 8), y + px(p, 3), px(p, 9), p->t->soft, text, 60);
    }
}

void lb_draw_crowns(lb_picture *p, const part *q) {
    const lb_own *own = p->own;
    lb_sheet *s = &p->ground;
    for (int k = 0; k < 2 && p->coils >= 0; k++) p->parts[p->coils + k].x = -2 - p->parts[p->coils + k].w;
    if (!own || isnan(own->length)) {
        lb_label(p, s, q, MIDDLE, p->t->soft, "This bass has no bench file: its sliders change nothing.", 1);
        return;
    }
    s->clip = lb_area_of(q->x, q->y, q->w, q->h);
    const int count = crowns_of(own);
    const double thick = 25.4 * own->thickest * (1 + p->values[LB_GAUGE] / 100);
    double deepest = 4;
    for (int k = 0; k < count; k++) deepest = fmax(deepest, gap_at(p, own, k));
    const double foot = q->y + q->h - px(p, LABELS), room = foot - q->y - px(p, 14);
    const double tall = fmin(thick * px(p, STRING_MM), room / 3), rest = q->y + px(p, 14) + tall;
    const side v = {own, lb_mm_along(p), (room - tall) / (deepest + 1), rest, foot};
    draw_scale(p, &v, (int)deepest + 1);
    for (int k = 0; k < count; k++) draw_crown(p, &v, k);
    for (int k = 0; k < 2; k++) draw_pickup(p, &v, k);
    lb_round(s, p->saddle - px(p, 3), rest, px(p, 6), v.foot - rest, px(p, 2), 0, METAL);
    lb_round(s, p->nut - px(p, 5), rest, px(p, 6), v.foot - rest, px(p, 2), 0, BONE);
    lb_round(s, p->nut - px(p, 5), rest, px(p, 6), v.foot - rest, px(p, 2), px(p, 1), p->t->edge);
    draw_string(p, p->nut - px(p, 5), p->saddle + px(p, 8), rest, tall);
    const int bare = look_of(p)->fretless != 0;
    if (count) measure(p, &v, 0, bare ? "near the nut" : "at fret 1");
    if (count) measure(p, &v, count < 12 ? count - 1 : 11, bare ? "at the octave" : "at fret 12");
    draw_names(p, &v, q, tall);
    s->clip = (lb_area){0, 0, s->width, s->height};
}
