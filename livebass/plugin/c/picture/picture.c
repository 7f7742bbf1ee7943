/* The picture in the plugin's window: header, neck, side view, and four pages of parameters and switches.

   Parts that seldom change are drawn into the ground, each when its state changes; the neck's strings, lights and notes
   go over it with each look. */
#include "picture/drawing.h"

#include <stdio.h>
#include <stdlib.h>

#define FALL 20.0  /* dB/s of the meter */

static const theme themes[2] = {
    {0xFFF1ECE4, 0xFFFCFAF6, 0xFFCFC4B5, 0xFF2A2119, 0xFF776A5B, 0xFFD08A1C, 0xFF221503, 0xFFDDD3C5, 0xFFD23A22,
     0xFF4C8A3C},
    {0xFF15110E, 0xFF241D17, 0xFF4A3E34, 0xFFF1E8DB, 0xFFA99A88, 0xFFF0A93B, 0xFF221503, 0xFF0B0907, 0xFFFF6B57,
     0xFF7DB56B},
};

lb_picture *lb_new_picture(const lb_face *face) {
    lb_picture *p = calloc(1, sizeof *p);
    if (!p) return 0;
    p->face = *face;
    p->hovered = p->held = p->string = p->doomed = p->focus = -1;
    p->zoom = 1;
    p->enlarged = face->zoom ? face->zoom(face->owner, 0) : 1;
    p->level = FLOOR_DB;
    p->coils = -1;
    if (face->stopped) p->stop = face->stopped(face->owner); /* of an earlier window */
    p->stopped = -INFINITY;
    p->shapes = calloc(LB_LOOKS, sizeof *p->shapes);
    p->sines = calloc((size_t)DRAWN * STRIDE / 4, sizeof *p->sines);
    if (!p->shapes || !p->sines) {
        lb_free_picture(p);
        return 0;
    }
    float round[2 * NODES];
    for (int k = 0; k < 2 * NODES; k++) round[k] = (float)sin(M_PI * k / NODES);
    for (int j = 0; j < DRAWN; j++)
        for (int k = 0; k <= NODES; k++) ((float *)p->sines)[j * STRIDE + k] = round[(j + 1) * k % (2 * NODES)];
    return p;
}

void lb_free_picture(lb_picture *p) {
    if (!p) return;
    lb_point(p, LB_POINT_LEAVE, 0, 0, 0);
    free(p->ground.pixels);
    free(p->shapes);
    free(p->sines);
    free(p);
}

/* A number, not 0, for everything a part shows now. */
static uint64_t part_state(const lb_picture *p, int k) {
    const part *q = &p->parts[k];
    const lb_kind *kind = &lb_kinds[q->kind];
    uint64_t hash = 1;
    if (kind->pointer != LB_POINTER_DEFAULT) mix(&hash, (p->hovered == k) + 2 * (p->held == k));
    if (kind->state) kind->state(p, q, &hash);
    return hash | 1;
}

/* Sets the array to draw into; returns 0 if there is no memory. */
static int take_sheet(lb_picture *p, uint32_t *pixels, int width, int height) {
    const lb_area all = {0, 0, width, height};
    if (p->sheet.width != width || p->sheet.height != height || !p->ground.pixels) {
        free(p->ground.pixels);
        p->ground = (lb_sheet){calloc((size_t)width * (size_t)height, sizeof(uint32_t)), width, height, all};
        p->laid_out = 0;
    }
    if (p->sheet.pixels != pixels) p->laid_out = 0;
    p->sheet = (lb_sheet){pixels, width, height, all};
    return p->ground.pixels != 0;
}

static void tell_load(lb_picture *p) {
    if (p->seconds - p->shown_at < 0.5 && p->seconds >= p->shown_at) return;
    p->shown_at = p->seconds;
    p->shown_load = look_of(p)->strings ? look_of(p)->load : 0;
}

/* Says in place of the title why a slider has stopped; the side view says more. */
static void tell_stop(lb_picture *p) {
    if (!p->face.stopped) return;
    const lb_stop now = p->face.stopped(p->face.owner);
    if (now.count == p->stop.count) return;
    const char *string = lb_note_name(now.fault.open);
    const char *name = now.parameter < LB_PARAMETERS ? lb_parameters[now.parameter].name : "The neck";
    if (now.fault.fret > 0) snprintf(p->notice, sizeof p->notice, "%s stops: fret %d meets string %s", name, now.fault.fret, string);
    else snprintf(p->notice, sizeof p->notice, "%s stops: the board meets string %s", name, string);
    p->stop = now;
    p->noticed = p->stopped = p->seconds;
}

/* Says in place of the title that the last note frets out, and the fret that its string lies on. */
static void tell_choked(lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    if (l->latest < 0 || l->latest >= l->strings) return;
    const int string = (int)l->latest, on = lb_lies_on(p, string), fret = (int)l->string[string].fret;
    if (!on || (p->choked[0] == l->notes && p->choked[1] == fret)) return;
    const char *name = lb_note_name((int)l->string[string].open);
    char pressed[16], crown[16];
    lb_fret_text(l, fret, pressed, sizeof pressed);
    lb_fret_text(l, on, crown, sizeof crown);
    snprintf(p->notice, sizeof p->notice, "%s, %s frets out: lies on %s", name, pressed, crown); /* the title's room */
    p->noticed = p->seconds;
    p->choked[0] = l->notes;
    p->choked[1] = fret;
}

static int moves_value(const part *q) { return lb_kinds[q->kind].pointer == LB_POINTER_ACROSS; }

/* Ends what the pointer holds. */
static void let_go(lb_picture *p) {
    if (p->held >= 0 && moves_value(&p->parts[p->held])) {
        const int k = p->parts[p->held].number;
        p->face.set(p->face.owner, k, value_of(p, k), LB_END);
    }
    p->held = -1;
    lb_end_note(p);
}

static void put_area(lb_area a, int to[4]) {
    const int all[4] = {a.x0, a.y0, a.x1 - a.x0, a.y1 - a.y0};
    memcpy(to, all, sizeof all);
}

void lb_draw(lb_picture *p, uint32_t *pixels, int width, int height, double scale, int dark, double seconds,
             int dirty[4]) {
    memset(dirty, 0, 4 * sizeof *dirty);
    if (width < 1 || height < 1 || !take_sheet(p, pixels, width, height)) return;
    scale = fmin(fmax(scale, 1), 4);
    const double room = fmin(width / (scale * LB_MIN_WIDTH), height / (scale * LB_MIN_HEIGHT));
    p->scale = scale * fmin(p->enlarged, fmax(room, 1));
    p->t = &themes[dark != 0];
    p->level = fmax(p->level - FALL * fmin(fmax(seconds - p->seconds, 0), 1), FLOOR_DB);
    p->seconds = seconds;
    lb_read_looks(p);
    tell_load(p);
    for (int k = 0; k < LB_PARAMETERS; k++) p->values[k] = value_of(p, k);
    p->own = p->face.own ? p->face.own(p->face.owner) : 0;
    if (p->face.song) p->face.song(p->face.owner, &p->song);
    tell_stop(p);
    tell_choked(p);
    lb_area changed = {0, 0, 0, 0};
    int all = 0;
    if (p->laid_out != lb_layout_state(p)) {
        all = 1;
        let_go(p); /* parts get new numbers */
        lb_lay_out(p);
        p->laid_out = lb_layout_state(p);
        changed = (lb_area){0, 0, width, height};
        lb_box(&p->ground, 0, 0, width, height, p->t->ground);
    }
    lb_follow_tip(p);
    const lb_area cover = lb_cover_area(p);
    if (memcmp(&cover, &p->covered, sizeof cover)) {
        lb_copy_area(p, p->covered);
        changed = lb_joined(changed, p->covered);
        p->still = 0; /* the neck may have been under it */
    }
    for (int k = 0; k < p->count; k++) {
        part *q = &p->parts[k];
        const uint64_t now = part_state(p, k);
        if (q->drawn == now || !lb_kinds[q->kind].draw) continue;
        q->drawn = now;
        const double x = q->x - 1, y = q->y - 1, w = q->w + 3, h = q->h + 3;
        if (k != p->board) lb_box(&p->ground, floor(x), floor(y), ceil(w), ceil(h), p->t->ground);
        lb_kinds[q->kind].draw(p, q);
        const lb_area area = lb_area_of(x, y, w, h);
        if (!all) lb_copy_area(p, area);
        changed = lb_joined(changed, area);
        for (int j = k + 1; k == p->board && j < p->count; j++) /* what lies on it is drawn again */
            if (p->parts[j].y < q->y + q->h) p->parts[j].drawn = 0;
    }
    if (all) lb_copy_area(p, changed);
    int apart = lb_empty(changed); /* only strips are drawn */
    p->strips = 0;
    if (p->board >= 0) changed = lb_joined(changed, lb_draw_lively(p, all || !p->still));
    if (p->cover.kind && (p->cover.drawn != lb_cover_state(p) || !lb_empty(lb_common(cover, changed)))) {
        lb_draw_cover(p);
        p->cover.drawn = lb_cover_state(p);
        changed = lb_joined(changed, cover);
        apart = 0;
    }
    p->covered = cover;
    changed = lb_common(changed, (lb_area){0, 0, width, height});
    if (!apart) p->strip[0] = changed, p->strips = !lb_empty(changed);
    if (!lb_empty(changed)) put_area(changed, dirty);
}

int lb_drawn_area(const lb_picture *p, int k, int area[4]) {
    if (k >= p->strips) return 0;
    put_area(p->strip[k], area);
    return 1;
}

/* --- the pointer --- */

static int hit(const lb_picture *p, double x, double y) {
    for (int k = p->count - 1; k >= 0; k--) {
        const part *q = &p->parts[k];
        const lb_kind *kind = &lb_kinds[q->kind];
        if (!kind->press && !kind->wheel && !kind->tip) continue;
        if (x >= q->x && x < q->x + q->w && y >= q->y && y < q->y + q->h) return k;
    }
    return -1;
}

static void press(lb_picture *p, int k, const hand *h) {
    const part *q = &p->parts[k];
    if (!lb_kinds[q->kind].press) return;
    p->held = k;
    lb_kinds[q->kind].press(p, q, h);
}

int lb_point(lb_picture *p, int kind, double x, double y, int modifiers) {
    p->rested = p->seconds;
    if (p->cover.kind == TIP) p->cover.kind = NO_COVER;
    if (lb_point_menu(p, kind, x, y)) return LB_POINTER_HAND;
    const int at = kind == LB_POINT_LEAVE || !(fabs(x) + fabs(y) < 1e6) ? -1 : hit(p, x, y);
    const hand h = {x, y, modifiers, (kind == LB_POINT_UP) - (kind == LB_POINT_DOWN)};
    const part *q = at < 0 ? 0 : &p->parts[at];
    const int pressed = kind == LB_POINT_RELEASE && p->held >= 0 && p->pressed_number ? p->parts[p->held].number : -1;
    if (kind == LB_POINT_RELEASE || kind == LB_POINT_LEAVE) let_go(p);
    p->pressed_number &= kind == LB_POINT_MOVE;
    if (pressed >= 0) lb_begin_typing(p, VALUE, pressed, "");
    const int pressing = kind == LB_POINT_PRESS || kind == LB_POINT_DOUBLE;
    if (pressing && (p->typing == VALUE || (p->typing == SAVING && !(q && q->kind == SAVE)))) lb_stop_typing(p);
    const part *held = p->held < 0 ? 0 : &p->parts[p->held];
    if (held && kind == LB_POINT_MOVE && lb_kinds[held->kind].drag) lb_kinds[held->kind].drag(p, held, &h);
    if (!held) p->hovered = at;
    if (!q || q->kind != SOUND || q->number != p->doomed) p->doomed = -1;
    if (h.way) {
        if (q && !held && lb_kinds[q->kind].wheel) lb_kinds[q->kind].wheel(p, q, &h);
    } else if (kind == LB_POINT_DOUBLE && q && moves_value(q)) {
        let_go(p);
        lb_change(p, q->number, lb_parameters[q->number].default_value);
    } else if (pressing) {
        let_go(p);
        if (q) press(p, at, &h);
        if (p->requested) lb_open_menu(p, p->requested - 1, x, y);
        p->requested = 0;
    }
    const int shown = p->held >= 0 ? p->held : at;
    return shown >= 0 ? lb_kinds[p->parts[shown].kind].pointer : LB_POINTER_DEFAULT;
}
