/* The bench in the picture: the lowest string from the side over its crowns, in mm. */
#include "picture/drawing.h"

#include <stdio.h>

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

void lb_mix_crowns(const lb_picture *p, uint64_t *hash) {
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

static void draw_pickup(lb_picture *p, const side *v, int k) {
    const double own_place = p->values[k ? LB_PICKUP_2_PLACE : LB_PICKUP_1_PLACE];
    const double own_height = p->values[k ? LB_PICKUP_2_HEIGHT : LB_PICKUP_1_HEIGHT];
    const double away = v->own->place[k] + p->values[LB_PICKUP_PLACE] + own_place, x = p->saddle - away * v->along;
    const double gap = fmax(COIL_GAP - 0.5 * (p->values[LB_PICKUP_HEIGHT] + own_height), 0.3);
    const double top = v->rest + gap * v->mm, tall = v->foot - top;
    if (isnan(away)) return;
    lb_round(&p->ground, x - px(p, 9), top, px(p, 18), tall, px(p, 3), 0, BLACK);
    lb_round(&p->ground, x - px(p, 9), top, px(p, 18), tall, px(p, 3), px(p, 1), METAL);
}

/* Draws a line each mm below the string. */
static void draw_scale(lb_picture *p, const side *v, int deepest) {
    char text[16];
    for (int k = 1; k <= deepest; k++) {
        const double y = v->rest + k * v->mm;
        snprintf(text, sizeof text, "%d mm", k);
        lb_box(&p->ground, p->nut, y, p->saddle - p->nut, fmax(px(p, 0.5), 1), lb_faded(p->t->edge, 0.45));
        if (v->mm > px(p, 9) || k % 2 == 0)
            lb_text(&p->ground, p->saddle + px(p, 8), y + px(p, 3), px(p, 9), p->t->soft, text, 60);
    }
}

void lb_draw_crowns(lb_picture *p, const part *q) {
    const lb_own *own = p->own;
    lb_sheet *s = &p->ground;
    if (!own || isnan(own->length)) {
        lb_label(p, s, q, MIDDLE, p->t->soft, "This bass has no bench file: its sliders change nothing.", 1);
        return;
    }
    s->clip = lb_area_of(q->x, q->y, q->w, q->h);
    const int count = crowns_of(own);
    const double thick = 25.4 * own->thickest * (1 + p->values[LB_GAUGE] / 100);
    double deepest = 4;
    for (int k = 0; k < count; k++) deepest = fmax(deepest, gap_at(p, own, k));
    const double mm = (q->h - px(p, 14)) / (deepest + 1 + thick), rest = q->y + px(p, 4) + thick * mm;
    const side v = {own, (p->saddle - p->nut) / own->length, mm, rest, q->y + q->h};
    draw_scale(p, &v, (int)deepest + 1);
    for (int k = 0; k < count; k++) draw_crown(p, &v, k);
    for (int k = 0; k < 2; k++) draw_pickup(p, &v, k);
    lb_round(s, p->saddle - px(p, 3), rest, px(p, 6), v.foot - rest, px(p, 2), 0, METAL);
    lb_round(s, p->nut - px(p, 5), rest, px(p, 6), v.foot - rest, px(p, 2), 0, BONE);
    const double tall = fmax(thick * mm, px(p, 1.5)); /* the string */
    lb_shade(s, p->nut - px(p, 5), rest - tall, p->saddle - p->nut + px(p, 12), tall, STRING, STRING_DARK);
    if (count) measure(p, &v, 0, "at fret 1");
    if (count) measure(p, &v, count < 12 ? count - 1 : 11, "at fret 12");
    s->clip = (lb_area){0, 0, s->width, s->height};
}
