/* The neck in the picture: at rest, with the body; and its moving parts: strings, lights, names, the pluck point. */
#include "picture/drawing.h"

#include <stdio.h>

enum { METAL_DARK = 0xFF6E6960, MOVING = 0xFFFFD28A, FLASH = 0xFFFF8A3A };

/* A family's body. Lengths are parts of the body's, heights of half its height; two values: the side of the lowest
   string, below, and the other one. */
typedef struct {
    uint32_t wood, wood_dark, rim, rim_dark;
    double horn[2], waist_at[2], waist, shoulder; /* shoulder: height where the body begins, if it has no horns */
} body;
enum { PRECISION, JAZZ, OTHER, UPRIGHT };
static const body bodies[] = {
    [PRECISION] = {0xFFE0A04A, 0xFFC07A2C, 0xFF2A150C, 0xFF120906, {0.20, 0.13}, {0.42, 0.42}, 0.10, 0},
    [JAZZ] = {0xFFD98E3C, 0xFFB8631F, 0xFF6E1F12, 0xFF1A0D0A, {0.24, 0.12}, {0.34, 0.54}, 0.12, 0},
    [OTHER] = {0xFF8A5A36, 0xFF6A4024, 0xFF4A2A18, 0xFF24140C, {0.18, 0.16}, {0.40, 0.40}, 0.14, 0},
    [UPRIGHT] = {0xFFC8762E, 0xFFA4571C, 0xFF6B3210, 0xFF381A0A, {0, 0}, {0.42, 0.42}, 0.24, 0.5},
};
/* Finishes of bodies with horns, so that basses of a family look apart: wood and rim, each light and dark. */
static const uint32_t finishes[][4] = {
    {0}, /* the family's own */
    {0xFFD6AE78, 0xFFBC8E58, 0xFF7E562C, 0xFF4A2F15}, /* natural */
    {0xFFB23A2A, 0xFF8F2A1E, 0xFF5A140E, 0xFF2A0806}, /* cherry */
    {0xFF7FB0A0, 0xFF669886, 0xFF4E7D6E, 0xFF2F5248}, /* sea green */
    {0xFF4F7FA8, 0xFF3D688E, 0xFF27496A, 0xFF152B42}, /* blue */
};
#define FARTHEST 0.1f /* m, the farthest a string may be from rest; NaN is drawn at rest */
#define UNSEEN 1e-7f /* m of a mode, less than 0.01 pixels at any enlargement */
#define SAME_PLACE 1e-5 /* m, within which a string ends at a fret */
#define SHINE 2.4f /* brightness of a blur, over the fraction of time that the string is there */

int lb_fret_held(const lb_picture *p, int string) {
    const LB_STRING_LOOK *l = &look_of(p)->string[string];
    if (l->state == LB_FREE) return -1;
    return l->fret > 0 && l->fret <= look_of(p)->frets ? (int)l->fret : 0;
}

void lb_draw_name(lb_picture *p, lb_sheet *s, double x, double y, const char *text, int lit) {
    const double lane = 2 * p->half[0] / (double)strings_of(p), tall = fmin(px(p, 17), lane), size = 0.59 * tall;
    const double wide = fmax(lb_text_width(size, text) + 0.47 * tall, 1.2 * tall);
    lb_round(s, x - wide / 2, y - tall / 2, wide, tall, tall / 2, 0, lit ? p->t->accent : p->t->raised);
    if (!lit) lb_round(s, x - wide / 2, y - tall / 2, wide, tall, tall / 2, px(p, 1), p->t->edge);
    const uint32_t colour = lit ? p->t->on_accent : p->t->ink;
    lb_text(s, x - lb_text_width(size, text) / 2, y + 0.36 * size, size, colour, text, wide);
}

/* --- the neck at rest --- */

/* Noise without steps along x and y, 0 to 1. */
static float grain(float x, float y) {
    const float fx = floorf(x), fy = floorf(y);
    float corner[4];
    for (int k = 0; k < 4; k++) {
        uint32_t n = (uint32_t)((int)fx + (k & 1)) * 374761393u + (uint32_t)((int)fy + (k >> 1)) * 668265263u;
        n = (n ^ n >> 13) * 1274126177u;
        corner[k] = (float)((n ^ n >> 16) & 1023) / 1023;
    }
    const float sx = (x - fx) * (x - fx) * (3 - 2 * (x - fx)), sy = y - fy;
    const float above = corner[0] + (corner[1] - corner[0]) * sx, below = corner[2] + (corner[3] - corner[2]) * sx;
    return above + (below - above) * sy;
}

/* Where the body begins. */
static double body_begin(const lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    return x_of(p, l->place[l->frets] - 0.045);
}

/* The family, as the look shows it: a double bass is long, a split coil has its halves apart, one to a pair of strings. */
static int family_of(const lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    const LB_STRING_LOOK *low = &l->string[0], *high = &l->string[l->strings - 1];
    if (low->length > 1) return UPRIGHT;
    if (low->pickups == 1 && fabs(low->saddle[0] - high->saddle[0]) > 5e-3) return PRECISION;
    return low->pickups == 2 && low->aperture[0] < 0.025 ? JAZZ : OTHER;
}

/* The body's colours: its family's, or a finish by the bass's name. */
static void take_finish(const lb_picture *p, body *b) {
    char name[MAX_TEXT];
    uint32_t sum = 0;
    text_of(p, LB_BASS, p->values[LB_BASS], name);
    for (const char *c = name; *c; c++) sum = sum * 31 + (uint8_t)*c;
    const uint32_t *finish = finishes[(sum + 1) % (sizeof finishes / sizeof *finishes)];
    if (!*finish || b->shoulder > 0) return;
    b->wood = finish[0];
    b->wood_dark = finish[1];
    b->rim = finish[2];
    b->rim_dark = finish[3];
}

/* The part of half a body's height up to which it reaches at a place along it; `inner`: from where on, at a cutaway. */
static double outline_at(const body *b, int side, double t, double *inner) {
    const double horn = b->horn[side], apart = t - b->waist_at[side], end = (t - 0.86) / 0.14;
    double outer = 1 - b->waist * exp(-apart * apart / 0.012);
    *inner = 0;
    if (b->shoulder > 0 && t < 0.22) outer *= b->shoulder + (1 - b->shoulder) * sin(fmax(t, 0) / 0.22 * M_PI / 2);
    if (horn > 0 && t < 0.18) {
        const double way = (0.18 - t) / (0.18 + horn), tip = 0.7;
        outer *= tip + (1 - tip) * sqrt(fmax(1 - way * way, 0));
        const double cut = (t + horn) / (horn + 0.05);
        if (cut < 1) *inner = tip * sqrt(1 - cut * cut);
    }
    return end > 0 ? outer * sqrt(fmax(1 - end * end, 0)) : outer;
}

static void draw_body(lb_picture *p, const part *q) {
    lb_sheet *s = &p->ground;
    body own = bodies[family_of(p)];
    const body *b = &own;
    take_finish(p, &own);
    const double left = body_begin(p), right = q->x + q->w - px(p, 34), long_ = right - left;
    const double half = q->h / 2 - px(p, 2), middle = q->y + q->h / 2;
    const double first = left - fmax(b->horn[0], b->horn[1]) * long_;
    lb_area a = lb_area_of(first, middle - half, right - first, 2 * half);
    a = lb_common(a, (lb_area){0, 0, s->width, s->height});
    for (int x = a.x0; x < a.x1; x++) {
        const double t = (x + 0.5 - left) / long_;
        double inner[2], outer[2];
        for (int side = 0; side < 2; side++)
            outer[side] = t < -b->horn[side] ? 0 : half * outline_at(b, side, t, &inner[side]);
        for (int y = a.y0; y < a.y1; y++) {
            const int side = y + 0.5 < middle;
            const double away = fabs(y + 0.5 - middle), depth = outer[side] - away;
            const double cover = fmin(depth, away - half * (t < -b->horn[side] ? 1 : inner[side])) + 0.5;
            if (outer[side] <= 0 || cover <= 0) continue;
            const double cut = inner[side] > 0 ? away - half * inner[side] : depth; /* from the cutaway's edge */
            const double rim = fmin(fmin(fmin(depth, cut), right - x) / (0.5 * half), 1), dark = (1 - rim) * (1 - rim);
            const float along = (float)((x - q->x) / p->scale), across = (float)((y - q->y) / p->scale);
            const uint32_t wood = lb_mixed(b->wood_dark, b->wood, grain(along * 0.02f, across * 0.35f));
            const uint32_t colour = lb_mixed(wood, lb_mixed(b->rim, b->rim_dark, dark * 1.2 - 0.3), dark * 1.1 + 0.06);
            lb_dot(s, x, y, colour, (float)fmin(cover, 1));
        }
    }
    if (b->shoulder <= 0) return;
    for (int side = -1; side < 2; side += 2) /* the sound holes */
        for (int k = 0; k < 24; k++) {
            const double u = (k - 11.5) / 12, x = right - 0.36 * long_ + 0.17 * long_ * u;
            const double y = middle + side * half * (0.66 + 0.07 * sin(u * 2.4)), r = px(p, fabs(u) > 0.85 ? 3.4 : 1.6);
            lb_round(s, x - r, y - r, 2 * r, 2 * r, r, 0, 0xFF160B06);
        }
}

/* Draws a fret's number under it, unless the figure of the motion is there. */
static void draw_number(lb_picture *p, int fret, double x) {
    char text[8];
    const double size = px(p, 9.5);
    if (x < p->nut + px(p, MOTION_WIDTH + 8)) return;
    snprintf(text, sizeof text, "%d", fret);
    const double begin = body_begin(p), horn = 0.17 * (p->saddle - begin);
    const uint32_t colour = x > begin - horn ? lb_faded(BONE, 0.75) : p->t->soft;
    lb_text(&p->ground, x - lb_text_width(size, text) / 2, p->middle + p->half[1] + px(p, 15), size, colour, text, 100);
}

static void draw_fret(lb_picture *p, double x, double half) {
    lb_sheet *s = &p->ground;
    lb_box(s, x - px(p, 0.2), p->middle - half, px(p, 2.6), 2 * half, 0x70000000);
    lb_shade(s, x - px(p, 1.3), p->middle - half, px(p, 2.4), 2 * half, METAL, METAL_DARK);
    lb_box(s, x - px(p, 0.9), p->middle - half, px(p, 0.9), 2 * half, 0xB0FFFFFF);
}

/* Draws a fret's mark in the board: a dot, or two; without frets, a dot at the edge. */
static void draw_mark(lb_picture *p, int fret, double x, double half) {
    const LB_LOOK *l = look_of(p);
    const int in_octave = fret % 12;
    if (in_octave && in_octave != 3 && in_octave != 5 && in_octave != 7 && in_octave != 9) return;
    const double mid = l->fretless ? x : (x + x_of(p, l->place[fret - 1])) / 2, r = px(p, l->fretless ? 2.5 : 4.2);
    const double apart = l->fretless ? half - px(p, 2) : in_octave ? 0 : half_at(p, mid) * 2 / (double)l->strings;
    const uint32_t colour = lb_faded(BONE, apart > 0 ? 0.85 : 0.6);
    for (int side = l->fretless ? 1 : -1; side < 2; side += 2)
        lb_round(&p->ground, mid - r, p->middle + side * apart - r, 2 * r, 2 * r, r, 0, colour);
    draw_number(p, fret, mid);
}

static void draw_board(lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    lb_sheet *s = &p->ground;
    const double end = board_end(p);
    for (int x = (int)p->nut; x < (int)end; x++) {
        const double half = half_at(p, x) + px(p, 3), top = p->middle - half, foot = p->middle + half;
        for (int y = (int)top; y <= (int)foot; y++) {
            const float along = (float)((x - p->nut) / p->scale), across = (float)((y - p->middle) / p->scale);
            const float g = grain(along * 0.025f, across * 0.55f);
            const double rim = 1 - fmin(fmin(y - top, foot - y) / px(p, 5), 1);
            const double cover = fmin(fmin(y + 1 - top, foot - y), 1);
            lb_dot(s, x, y, lb_mixed(lb_mixed(WOOD, WOOD_LIGHT, 0.15 + 0.7 * g), BLACK, 0.5 * rim), (float)cover);
        }
    }
    for (int k = 1; k <= l->frets; k++) {
        const double x = x_of(p, l->place[k]), rim = half_at(p, x) + px(p, 3);
        if (!l->fretless) draw_fret(p, x, rim);
        draw_mark(p, k, x, rim);
    }
    const double half = half_at(p, p->nut) + px(p, 3);
    lb_round(s, p->nut - px(p, 5), p->middle - half, px(p, 6), 2 * half, px(p, 2), 0, BONE);
    lb_box(s, p->nut + px(p, 1), p->middle - half, px(p, 2), 2 * half, 0x50000000);
}

/* Draws a pickup: adjacent strings with it at the same place share one. */
static void draw_pickup(lb_picture *p, int k) {
    const LB_LOOK *l = look_of(p);
    lb_sheet *s = &p->ground;
    for (int i = 0, last; i < l->strings; i = last) {
        const LB_STRING_LOOK *string = &l->string[i];
        for (last = i + 1; last < l->strings && fabs(l->string[last].saddle[k] - string->saddle[k]) < 2e-3; last++) {}
        if (k >= string->pickups) continue;
        const double x = x_of(p, string->length - string->saddle[k]), lane = half_at(p, x) * 2 / (double)l->strings;
        const double top = lane_at(p, last - 1, x) - 0.48 * lane, foot = lane_at(p, i, x) + 0.48 * lane;
        const double wide = fmax(string->aperture[k] * p->metre, px(p, 18));
        const double loud = string->mix[k] != 0 ? 1 : 0.45;
        lb_round(s, x - wide / 2 + px(p, 1), top + px(p, 2), wide, foot - top, px(p, 5), 0, 0x60000000);
        lb_round(s, x - wide / 2, top, wide, foot - top, px(p, 5), 0, BLACK);
        lb_round(s, x - wide / 2, top, wide, foot - top, px(p, 5), px(p, 1), 0xFF3A332D);
        for (int at = i; at < last; at++)
            for (int side = -1; side < 2; side += 2) {
                const double y = lane_at(p, at, x) + side * 0.2 * lane, r = px(p, 2.8);
                lb_round(s, x - r, y - r, 2 * r, 2 * r, r, 0, lb_faded(METAL, loud));
            }
    }
}

static void draw_bridge(lb_picture *p) {
    lb_sheet *s = &p->ground;
    const double x = p->saddle, half = half_at(p, x) + px(p, 2), lane = 2 * half_at(p, x) / (double)strings_of(p);
    if (family_of(p) == UPRIGHT) { /* of wood, on its edge */
        lb_round(s, x - px(p, 2), p->middle - half + px(p, 2), px(p, 9), 2 * half, px(p, 3), 0, 0x60000000);
        lb_round(s, x - px(p, 4), p->middle - half, px(p, 8), 2 * half, px(p, 3), 0, 0xFFE2BE86);
        return;
    }
    lb_round(s, x - px(p, 7), p->middle - half + px(p, 3), px(p, 34), 2 * half, px(p, 4), 0, 0x60000000);
    lb_round(s, x - px(p, 8), p->middle - half, px(p, 34), 2 * half, px(p, 4), 0, METAL_DARK);
    lb_round(s, x - px(p, 8), p->middle - half, px(p, 34), 2 * half, px(p, 4), px(p, 1), METAL);
    for (int i = 0; i < strings_of(p); i++) {
        const double y = lane_at(p, i, x);
        lb_round(s, x - px(p, 3), y - 0.32 * lane, px(p, 22), 0.64 * lane, px(p, 3), 0, METAL);
        lb_box(s, x - px(p, 0.8), y - 0.32 * lane, px(p, 1.6), 0.64 * lane, 0xFF8F897E);
    }
}

/* Half a string's thickness, for steel at usual tension; somewhat enlarged, as the neck is drawn too wide. */
static double thickness(const lb_picture *p, int string) {
    const double speed = look_of(p)->string[string].speed;
    return fmax(0.14 / fmax(speed, 20) * p->metre, px(p, 0.7));
}

/* Draws a string's shadow. */
static void draw_shadow(lb_picture *p, int string) {
    const double half = thickness(p, string), drop = px(p, 3.5), x0 = p->nut - px(p, 5), x1 = p->saddle + px(p, 14);
    lb_line(&p->ground, x0, lane_at(p, string, x0) + drop, x1, lane_at(p, string, x1) + drop, 2 * half, 0x480E0B09);
}

void lb_draw_neck(lb_picture *p, const part *q) {
    lb_sheet *s = &p->ground;
    lb_box(s, q->x, q->y, q->w, q->h, p->t->ground);
    if (!strings_of(p)) {
        static const char *const why = "No bass is loaded: the host has not switched the plugin on.";
        lb_label(p, s, q, MIDDLE, p->t->soft, why, 1);
        return;
    }
    s->clip = lb_area_of(q->x, q->y, q->w, q->h);
    draw_body(p, q);
    draw_board(p);
    for (int k = 0; k < 4; k++) draw_pickup(p, k);
    draw_bridge(p);
    for (int i = 0; i < strings_of(p); i++) draw_shadow(p, i);
    lb_text(s, q->x + q->w - px(p, EDGE + 12), q->y + q->h - px(p, 6), px(p, 9.5), p->t->soft, "out", 100); /* the meter */
    s->clip = (lb_area){0, 0, s->width, s->height};
}

uint64_t lb_neck_state(const lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    uint64_t hash = 1;
    mix(&hash, (double)l->strings * 1000 + (double)l->frets * 2 + (double)l->fretless);
    for (int k = 0; k <= l->frets && k < LB_PLACES; k++) mix(&hash, l->place[k]);
    for (int i = 0; i < l->strings; i++) {
        mix(&hash, l->string[i].length);
        mix(&hash, (double)l->string[i].pickups);
        for (int k = 0; k < l->string[i].pickups && k < 4; k++) {
            mix(&hash, l->string[i].saddle[k]);
            mix(&hash, l->string[i].aperture[k]);
            mix(&hash, l->string[i].mix[k] != 0);
        }
    }
    return hash | 1;
}

/* --- looks --- */

/* A string's loudest slot; 0: it is silent. */
static const LB_SLOT_SIGHT *loudest(const LB_STRING_LOOK *l) {
    const LB_SLOT_SIGHT *found = 0;
    double maximum = -1;
    for (int k = 0; k < LB_SLOTS; k++) {
        const LB_SLOT_SIGHT *s = &l->sight.slot[k];
        double sum = 0;
        for (int j = 0; j < 16 && j < s->modes; j++) sum += (double)s->u[j] * s->u[j];
        if (s->on && sum > maximum) found = s, maximum = sum;
    }
    return found;
}

static void take_shape(const lb_picture *p, const LB_STRING_LOOK *l, shape *to) {
    const LB_SLOT_SIGHT *s = loudest(l);
    to->on = s != 0;
    to->maximum = 0;
    if (!s) return;
    const double scale = sqrt(2 / s->length);
    to->fret = (int)s->fret;
    to->lies = (int)s->lies;
    to->stop = fmax(l->length - s->length, 0);
    float *u = (float *)to->u;
    for (int k = 0; k <= NODES; k++) u[k] = (float)(s->stop * (NODES - k) / NODES);
    for (int j = 0; j < DRAWN && j < s->modes && j < LB_SEEN; j++) {
        const float a = (float)scale * s->u[j];
        if (fabsf(a) < UNSEEN) continue;
        const quad q = {a, a, a, a}, *row = p->sines + (ptrdiff_t)j * (STRIDE / 4);
        for (int k = 0; k < STRIDE / 4; k++) to->u[k] += q * row[k];
    }
    for (int k = 0; k <= NODES; k++) {
        if (!(u[k] == u[k])) u[k] = 0;
        u[k] = u[k] > FARTHEST ? FARTHEST : u[k] < -FARTHEST ? -FARTHEST : u[k];
        to->maximum = fmaxf(to->maximum, fabsf(u[k]));
    }
}

/* A string's newest shape, or the one `before` shapes earlier. */
static const shape *shape_of(const lb_picture *p, int string, int before) {
    return &p->shapes[(p->shaped - 1 - (uint64_t)before) % LB_LOOKS][string];
}

int lb_lies_on(const lb_picture *p, int string) {
    const shape *one = shape_of(p, string, 0);
    return p->shaped && one->on && one->fret == look_of(p)->string[string].fret ? one->lies : 0;
}

void lb_fret_text(const LB_LOOK *l, int fret, char *text, size_t room) {
    if (l->fretless) snprintf(text, room, "%.0f mm", 1e3 * l->place[fret]);
    else snprintf(text, room, "fret %d", fret);
}

static double within(double v, double minimum, double greatest) {
    return v > minimum ? (v < greatest ? v : greatest) : minimum;
}

/* Clamps the values of a look from another process. */
static void bound(LB_LOOK *l) {
    if (l->strings < 0 || l->strings > LB_STRINGS) l->strings = 0;
    l->frets = l->frets < 0 ? 0 : l->frets >= LB_PLACES ? LB_PLACES - 1 : l->frets;
    for (int k = 0; k < LB_PLACES; k++) l->place[k] = within(l->place[k], 0, 5);
    double *parts[] = {&l->load, &l->peak, &l->position, &l->nearest, &l->default_value, &l->farthest};
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) *parts[k] = within(*parts[k], 0, k < 2 ? 100 : 1);
    for (int i = 0; i < l->strings; i++) {
        LB_STRING_LOOK *s = &l->string[i];
        s->length = within(s->length, 0.1, 5);
        s->speed = within(s->speed, 20, 2000);
        s->open = s->open >= 0 && s->open < 128 ? s->open : 0;
        if (s->pickups < 0 || s->pickups > 4) s->pickups = 0;
        for (int k = 0; k < LB_PLACES; k++) s->light[k] = (float)within(s->light[k], 0, 1);
        for (int k = 0; k < 4; k++) {
            s->saddle[k] = within(s->saddle[k], 0, s->length);
            s->aperture[k] = within(s->aperture[k], 0, 0.2);
        }
        for (int k = 0; k < LB_SLOTS; k++) {
            LB_SLOT_SIGHT *slot = &s->sight.slot[k];
            slot->length = within(slot->length, 1e-3, s->length);
            if (slot->lies < 0 || slot->lies > l->frets) slot->lies = 0;
        }
    }
}

/* Puts frets where they are. A look has the place where a string ends that is stopped at each: on a board, for places
   that choke it, that of the higher one that it lies on. These divide what is left of the string evenly in pitch. */
static void set_places(LB_LOOK *l) {
    const double length = l->string[0].length;
    for (int k = 1, last = 0; k <= l->frets; k++) {
        if (k < l->frets && l->place[k + 1] - l->place[k] < SAME_PLACE) continue;
        const double ratio = (length - l->place[k]) / (length - l->place[last]);
        for (int at = last + 1; at < k; at++)
            l->place[at] = length - (length - l->place[last]) * pow(ratio, (double)(at - last) / (k - last));
        last = k;
    }
}

void lb_read_looks(lb_picture *p) {
    const uint64_t taken = lb_looks_taken(p->face.look);
    const uint64_t fresh = taken - p->taken;
    if (!p->skipped) p->fresh = 0;
    for (int k = fresh < LB_LOOKS - 1 ? (int)fresh - 1 : LB_LOOKS - 2; k >= 0; k--) {
        LB_LOOK *to = &p->both[!p->which];
        if (!lb_read_look(p->face.look, k, to)) continue;
        bound(to);
        set_places(to);
        if (to->bass != look_of(p)->bass || to->strings != look_of(p)->strings) p->shaped = 0;
        p->which = !p->which;
        for (int i = 0; i < to->strings; i++) take_shape(p, &to->string[i], &p->shapes[p->shaped % LB_LOOKS][i]);
        p->shaped++;
        p->fresh++;
        for (int i = 0; i < to->strings; i++) { /* a fret that a string lies on is lit as long as it sounds */
            const int on = lb_lies_on(p, i);
            if (on) to->string[i].light[on] = 1;
        }
        p->level = fmax(p->level, 20 * log10(fmax(to->peak, 1e-9)));
    }
    p->taken = taken;
}

/* --- what moves on the neck --- */

enum { MAX_BLURRED = 4, BLURRED = 2 }; /* shapes and columns in a stretch of blur */
enum { TONES = 16, MAX_TALL = 1024 }; /* colours across a string; most pixels of a column in a blur */

/* A column of the array, drawn from top to bottom. */
typedef struct {
    uint32_t *first; /* its pixel of row 0 */
    int width, top, foot;
} column;

static uint32_t *pixel(const column *c, int y) { return c->first + (ptrdiff_t)y * c->width; }

/* Draws a stroke around y, `wide` columns wide, in `tones` from its upper edge to its lower one. */
static void stroke(const column *c, int wide, float y, float half, const uint32_t *tones) {
    const int from = (int)(y - half - 0.5f), to = (int)(y + half + 1.5f);
    const float shades = (TONES - 1) / (2 * half + 1);
    for (int j = from > c->top ? from : c->top; j < to && j < c->foot; j++) {
        const float away = (float)j + 0.5f - y, cover = half + 0.5f - fabsf(away);
        if (cover <= 0) continue;
        uint32_t *p = pixel(c, j);
        const uint32_t tone = tones[(int)((away + half + 0.5f) * shades)], of = (uint32_t)(int)(256 * cover);
        for (int k = 0; k < wide; k++) p[k] = of >= 256 ? tone : lb_over(p[k], tone, of);
    }
}

/* Adds a stroke that was between two heights for a fraction of the time. */
static void smear(float *sums, float from, float to, float share) {
    const int first = (int)from, last = (int)to;
    sums[first] += share * (1 - (from - (float)first));
    sums[first + 1] += share * (from - (float)first);
    sums[last] -= share * (1 - (to - (float)last));
    sums[last + 1] -= share * (to - (float)last);
}

/* Draws the blur of a string at heights y above its rest, `wide` columns wide. */
static void blur(const column *c, int wide, float rest, float half, const float *y, int count) {
    float sums[MAX_TALL + 2], low = y[0], high = y[0], sum = 0;
    for (int k = 1; k < count; k++) {
        low = y[k] < low ? y[k] : low;
        high = y[k] > high ? y[k] : high;
    }
    if (high - low < 0.5f || high - low + 2 * half + 4 > MAX_TALL) return;
    const int top = (int)(rest - high - half) - 1, tall = (int)(high - low + 2 * half) + 4;
    memset(sums, 0, (size_t)tall * sizeof *sums);
    for (int k = 1; k < count; k++) {
        const int up = y[k] > y[k - 1];
        const float from = rest - y[k - !up] - half - (float)top, to = rest - y[k - up] + half - (float)top;
        const float shine = SHINE * (2 * half + 0.6f) / (to - from);
        smear(sums, from, to, (shine < 1 ? shine : 1) / (float)(count - 1));
    }
    for (int j = 0; j < tall; j++) {
        sum += sums[j];
        if (sum < 0.004f || top + j < c->top || top + j >= c->foot) continue;
        uint32_t *p = pixel(c, top + j);
        const uint32_t cover = (uint32_t)(int)(200 * (sum < 1 ? sum : 1));
        for (int k = 0; k < wide; k++) p[k] = lb_over(p[k], MOVING, cover);
    }
}

/* A shape, read column by column. */
typedef struct {
    const float *u;
    float at, step; /* nodes */
} walk;

static float next_height(walk *w) {
    const float at = w->at;
    w->at += w->step;
    if (at <= 0 || at >= NODES) return 0;
    const int node = (int)at;
    return w->u[node] + (w->u[node + 1] - w->u[node]) * (at - (float)node);
}

/* The shapes of a string to draw: the newest, and those since the last picture. */
static int shapes_of(const lb_picture *p, int string) {
    const int maximum = p->shaped < MAX_BLURRED ? (int)p->shaped : MAX_BLURRED, wanted = p->fresh > 0 ? p->fresh + 1 : 2;
    int count = 0;
    while (count < maximum && count < wanted && shape_of(p, string, count)->on) count++;
    return count;
}

/* The farthest that a string is drawn from its lane, and its enlargement, in pixels. */
static double farthest(const lb_picture *p) { return 1.9 * p->half[0] / (double)strings_of(p); }
static double enlarged(const lb_picture *p) { return p->metre * zooms[p->zoom]; }

/* Draws a string over its blur since the last picture; two pixels at a time, on a fine screen three. */
static void draw_string(lb_picture *p, lb_sheet *s, int string, const uint32_t *tones) {
    const float half = (float)thickness(p, string), limit = (float)farthest(p), zoom = (float)enlarged(p);
    const int left = (int)fmax(p->nut - px(p, 5), 0), right = (int)fmin(p->saddle + px(p, 14), s->width);
    const int end = (int)p->saddle, step = (int)(1 + p->scale), count = shapes_of(p, string);
    walk walks[LB_LOOKS];
    int begin = right;
    for (int k = 0; k < count; k++) {
        const shape *one = shape_of(p, string, k);
        const double start = x_of(p, one->stop), nodes = NODES / (p->saddle - start);
        if (!k) begin = (int)start > left ? (int)start : left;
        walks[k] = (walk){(const float *)one->u, (float)((begin + 0.5 * step - start) * nodes), (float)(nodes * step)};
    }
    const double first = lane_at(p, string, p->nut), last = lane_at(p, string, p->saddle);
    const double slope = (last - first) / (p->saddle - p->nut);
    float y[LB_LOOKS], before = 0;
    column c = {0, s->width, s->clip.y0 > 0 ? s->clip.y0 : 0, s->clip.y1 < s->height ? s->clip.y1 : s->height};
    for (int x = left, groups = 0; x < right;) {
        const int moves = count && x >= begin && x < end, edge = x < begin ? begin : x < end ? end : right;
        const int to = edge < right ? edge : right, wide = x + step <= to ? step : to - x;
        const float rest = (float)(first + (x + 0.5 * wide - p->nut) * slope);
        c.first = s->pixels + x;
        if (moves) {
            for (int k = 0; k < count; k++) {
                const float moved = zoom * next_height(&walks[k]);
                y[k] = moved > limit ? limit : moved < -limit ? -limit : moved;
            }
            const int stretch = x + BLURRED * step <= to ? BLURRED * step : to - x;
            if (groups++ % BLURRED == 0) blur(&c, stretch, rest, half, y, count);
            const float steep = x > begin ? (y[0] - before) / (float)step : 0;
            stroke(&c, wide, rest - y[0], half * sqrtf(1 + steep * steep), tones);
            before = y[0];
        } else stroke(&c, wide, rest, half, tones);
        x += wide;
    }
}

static void draw_lights(lb_picture *p, lb_sheet *s) {
    const LB_LOOK *l = look_of(p);
    for (int i = 0; i < l->strings; i++)
        for (int k = 1; k <= l->frets; k++) {
            const double bright = l->string[i].light[k], x = x_of(p, l->place[k]), y = lane_at(p, i, x);
            if (!(bright > 0.02)) continue;
            const double lane = 2 * half_at(p, x) / (double)l->strings, shown = 0.3 + 0.7 * fmin(bright, 1);
            lb_glow(s, x, y, px(p, 7 + 9 * bright), lane * (0.4 + 0.3 * bright), lb_faded(FLASH, shown));
            if (l->fretless) continue;
            lb_box(s, x - px(p, 1.2), y - 0.42 * lane, px(p, 2.4), 0.84 * lane, lb_faded(0xFFFFF0C8, shown));
        }
}

/* Draws the notes' names where fingers hold them. */
static void draw_names(lb_picture *p, lb_sheet *s) {
    const LB_LOOK *l = look_of(p);
    for (int i = 0; i < l->strings; i++) {
        const int fret = lb_fret_held(p, i);
        if (fret < 1) continue;
        const char *text = lb_note_name((int)l->string[i].open + fret);
        const double at = x_of(p, l->place[fret]), before = x_of(p, l->place[fret - 1]);
        const double x = l->fretless ? at : at - fmin((at - before) / 2, px(p, 16));
        lb_draw_name(p, s, x, lane_at(p, i, x), text, 1);
    }
}

static void draw_pluck(lb_picture *p, lb_sheet *s) {
    const LB_LOOK *l = look_of(p);
    part *q = &p->parts[p->board + 1];
    const int lively = p->held == p->board + 1 || p->hovered == p->board + 1;
    const double x = x_of(p, l->position * l->string[0].length), r = px(p, lively ? 8 : 6.5), y = q->y + px(p, 10);
    const uint32_t colour = lively ? 0xFFFFFFFF : p->t->accent;
    q->x = x - px(p, 8);
    for (double at = y; at < p->middle + half_at(p, x); at += px(p, 7))
        lb_box(s, x - px(p, 0.75), at, px(p, 1.5), px(p, 3.5), lb_faded(colour, 0.55));
    lb_round(s, x - r, y - r, 2 * r, 2 * r, r, 0, BLACK);
    lb_round(s, x - r + px(p, 1.5), y - r + px(p, 1.5), 2 * r - px(p, 3), 2 * r - px(p, 3), r, 0, colour);
    if (!lively) return;
    char text[MAX_TEXT];
    snprintf(text, sizeof text, "pluck at %.0f %%", 100 * l->position);
    const double wide = lb_text_width(px(p, SMALL), text) + px(p, 12);
    const double left = fmin(x + px(p, 12), p->sheet.width - wide - px(p, 40));
    lb_round(s, left, y - px(p, 9), wide, px(p, 18), px(p, 5), 0, 0xD0100D0B);
    lb_text(s, left + px(p, 6), y + px(p, 4), px(p, SMALL), 0xFFFFFFFF, text, wide);
}

/* The meter's reading, 0 to 1. */
static double meter_part(const lb_picture *p) { return fmin(fmax((p->level - FLOOR_DB) / -FLOOR_DB, 0), 1); }

/* Draws the meter from the ground up, and returns where. */
static lb_area draw_meter(lb_picture *p, const part *q) {
    const double w = px(p, 8), x = q->x + q->w - px(p, EDGE) - w, top = q->y + px(p, 6), tall = q->h - px(p, 24);
    const double full = tall * meter_part(p);
    lb_sheet *s = &p->sheet;
    lb_copy_area(p, lb_area_of(x, top, w, tall));
    lb_round(s, x, top, w, tall, px(p, 3), 0, p->t->trough);
    for (double at = 0; at < full; at += px(p, 3)) {
        const double db = FLOOR_DB * (1 - at / tall);
        const uint32_t colour = db > -1 ? p->t->hot : db > -9 ? p->t->accent : p->t->good;
        lb_box(s, x + px(p, 1), top + tall - at - px(p, 2), w - px(p, 2), px(p, 2), colour);
    }
    return lb_area_of(x, top, w, tall);
}

/* The state of the neck's other moving parts, besides strings, lights and the meter. */
static uint64_t still_state(const lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    uint64_t hash = 1;
    mix(&hash, l->position);
    mix(&hash, p->zoom * 64 + (p->hovered > p->board && p->hovered <= p->board + 2 ? p->hovered - p->board : 0) * 8 +
                   (p->held == p->board + 1));
    for (int i = 0; i < l->strings; i++) mix(&hash, (double)(l->string[i].state * 100 + l->string[i].fret));
    return hash;
}

static int is_lively(const lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    for (int i = 0; i < l->strings; i++) {
        if (loudest(&l->string[i])) return 1;
        for (int k = 0; k < LB_PLACES; k++)
            if (l->string[i].light[k] > 0.02f) return 1;
    }
    return 0;
}

/* True if no string moves by more than two pixels at scale 1, and no light is on. */
static int is_calm(const lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    const double maximum = px(p, 2) / (p->metre * zooms[p->zoom]);
    for (int i = 0; i < l->strings; i++) {
        const shape *one = shape_of(p, i, 0);
        if (p->shaped && one->on && one->maximum > maximum) return 0;
        for (int k = 0; k < LB_PLACES; k++)
            if (l->string[i].light[k] > 0.02f) return 0;
    }
    return 1;
}

/* Where a string is drawn, and the lights on it; `moves`: whether it may differ in the next picture. */
static lb_area band_of(const lb_picture *p, int string, int *moves) {
    const LB_LOOK *l = look_of(p);
    const double one = lane_at(p, string, p->nut), other = lane_at(p, string, p->saddle), thick = thickness(p, string);
    double away = 0;
    const int count = shapes_of(p, string);
    *moves = count > 0;
    for (int k = 0; k < count; k++) away = fmax(away, fmin(shape_of(p, string, k)->maximum * enlarged(p), farthest(p)));
    for (int k = 1; k <= l->frets; k++)
        if (l->string[string].light[k] > 0.02f) away = 2 * farthest(p), *moves = 1;
    away += 2 * thick + px(p, 2);
    const double top = fmin(one, other) - away, foot = fmax(one, other) + away;
    return lb_area_of(p->nut - px(p, 20), top, p->saddle - p->nut + px(p, 36), foot - top);
}

/* Finds the strips of the neck to draw: the bands in which strings move or moved, joined where they overlap. */
static void find_strips(lb_picture *p, const lb_area *bands, const int *moves, lb_area neck) {
    p->strips = 0;
    for (int i = 0; i < strings_of(p); i++) {
        const lb_area now = moves[i] ? bands[i] : (lb_area){0, 0, 0, 0};
        lb_area strip = lb_common(lb_joined(now, p->busy[i]), neck);
        p->busy[i] = now;
        if (lb_empty(strip)) continue;
        while (p->strips && !lb_empty(lb_common(strip, p->strip[p->strips - 1])))
            strip = lb_joined(strip, p->strip[--p->strips]);
        p->strip[p->strips++] = strip;
    }
}

/* Draws what moves within a strip. */
static void draw_strip(lb_picture *p, const lb_area *bands, lb_area strip, const uint32_t *tones) {
    lb_sheet s = p->sheet;
    s.clip = strip;
    lb_copy_area(p, strip);
    draw_lights(p, &s);
    for (int i = 0; i < strings_of(p); i++) {
        s.clip = lb_common(bands[i], strip); /* a steep string is thick: nothing of it may stay beyond its band */
        if (!lb_empty(s.clip)) draw_string(p, &s, i, tones);
    }
    s.clip = strip;
    draw_names(p, &s);
    draw_pluck(p, &s);
}

/* Draws only where something moves or moved in the last picture. While everything moves little, draws only every
   second picture. */
lb_area lb_draw_lively(lb_picture *p, int all) {
    const part *q = &p->parts[p->board];
    const lb_area nothing = {0, 0, 0, 0}, whole = {0, 0, p->sheet.width, p->sheet.height};
    const lb_area area = lb_common(lb_area_of(q->x, q->y, q->w, q->h), whole);
    const int lively = is_lively(p), metered = (int)rint(meter_part(p) * 200);
    const uint64_t still = still_state(p);
    const int calm = is_calm(p), moves = metered != p->metered || (p->fresh && (lively || p->lively));
    all = all || still != p->still;
    p->skipped = !all && moves && !p->skipped && calm && p->calm;
    p->strips = 0;
    if (!all && (!moves || p->skipped)) return nothing;
    lb_area bands[LB_STRINGS], drawn = nothing;
    int moving[LB_STRINGS];
    for (int i = 0; i < strings_of(p); i++) bands[i] = band_of(p, i, &moving[i]);
    find_strips(p, bands, moving, area);
    if (all) p->strip[0] = area, p->strips = !lb_empty(area);
    const int meters = all || metered != p->metered;
    p->metered = metered;
    p->calm = calm;
    p->still = still;
    p->lively = lively;
    uint32_t tones[TONES];
    for (int k = 0; k < TONES; k++) tones[k] = lb_mixed(STRING, STRING_DARK, 1.25 * k / TONES - 0.1);
    for (int k = 0; k < p->strips; k++) {
        if (strings_of(p)) draw_strip(p, bands, p->strip[k], tones);
        else lb_copy_area(p, p->strip[k]);
        drawn = lb_joined(drawn, p->strip[k]);
    }
    const lb_area meter = meters ? lb_common(draw_meter(p, q), whole) : nothing;
    if (!lb_empty(meter)) p->strip[p->strips++] = meter;
    return lb_joined(drawn, meter);
}
