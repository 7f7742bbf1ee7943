/* The picture in the plugin's window: header, neck, lamps, and a panel of parameters by group.

   What seldom changes is drawn into the ground, part by part, as each part's state changes; the neck's strings, lights
   and notes go over it, anew for each look. */
#include "drawing.h"

#include <stdio.h>
#include <stdlib.h>

#define FALL 20.0  /* dB/s of the meter */
#define NOTICE 4.0 /* s for which a notice is seen */

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
    p->hovered = p->held = p->string = p->doomed = -1;
    p->zoom = 1;
    p->level = FLOOR_DB;
    p->shapes = calloc(LB_LOOKS, sizeof *p->shapes);
    p->sines = calloc(DRAWN * STRIDE, sizeof(float));
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

static void end_note(lb_picture *p) {
    if (p->string >= 0) p->face.note(p->face.owner, 0, p->string, p->key, 0);
    p->string = -1;
}

void lb_free_picture(lb_picture *p) {
    if (!p) return;
    lb_point(p, LB_POINT_LEAVE, 0, 0, 0);
    for (int key = 0; key < LB_KEY_COUNT; key++)
        if (p->toggled[key]) p->face.note(p->face.owner, 0, -1, key, 0);
    free(p->ground.pixels);
    free(p->shapes);
    free(p->sines);
    free(p);
}

/* --- values --- */

static double value(const lb_picture *p, int k) { return p->face.value(p->face.owner, k); }
static double most(const lb_picture *p, int k) { return p->face.most(p->face.owner, k); }

static void text_of(const lb_picture *p, int k, double v, char text[MOST_TEXT]) {
    *text = 0;
    p->face.text(p->face.owner, k, v, text, MOST_TEXT);
}

static double allowed(const lb_picture *p, int k, double v) {
    v = fmin(fmax(v, lb_parameters[k].least), most(p, k));
    return lb_parameters[k].whole ? rint(v) : v;
}

static void set(const lb_picture *p, int k, double v, int phase) { p->face.set(p->face.owner, k, v, phase); }

/* A change at once. */
static void change(const lb_picture *p, int k, double v) {
    v = allowed(p, k, v);
    set(p, k, value(p, k), LB_BEGIN);
    set(p, k, v, LB_MOVE);
    set(p, k, v, LB_END);
}

/* How many basses there are: with one, its parameter has two values of the same name. */
static int basses(const lb_picture *p) {
    char first[MOST_TEXT], second[MOST_TEXT];
    const int count = (int)most(p, LB_BASS) + 1;
    text_of(p, LB_BASS, 0, first);
    text_of(p, LB_BASS, 1, second);
    return count == 2 && !strcmp(first, second) ? 1 : count;
}

/* --- where everything is --- */

static part *add(lb_picture *p, int kind, int number, double x, double y, double w, double h) {
    static part none;
    if (p->count == MOST_PARTS || w <= 0 || h <= 0) return &none;
    part *q = &p->parts[p->count++];
    *q = (part){kind, number, x, y, w, h, 0};
    return q;
}

static int is_listed(int k) { return k != LB_BASS && k != LB_QUALITY; } /* those are in the header */

static const char *const group_names[] = {LB_GROUPS};
enum { GROUP_COUNT = sizeof group_names / sizeof *group_names };

static int group_size(int group) {
    int size = 0;
    for (int k = 0; k < LB_PARAMETERS; k++) size += is_listed(k) && !strcmp(lb_parameters[k].group, group_names[group]);
    return size;
}

static void lay_out_header(lb_picture *p, double width) {
    const double y = px(p, 9), h = px(p, 28), left = px(p, 122), right = width - px(p, EDGE);
    const double room = right - px(p, 236 + 6 + SAVE_WIDTH + 6) - left, wide = fmin(fmin(px(p, 330), width * 0.36), room);
    add(p, WORDMARK, 0, px(p, EDGE), y, px(p, 100), h);
    add(p, PREVIOUS, 0, left, y, h, h);
    add(p, TITLE, 0, left + h + px(p, 2), y, wide - 2 * h - px(p, 4), h); /* each clears a little around itself */
    add(p, NEXT, 0, left + wide - h, y, h, h);
    if (p->face.save) add(p, SAVE, 0, left + wide + px(p, 6), y, px(p, SAVE_WIDTH), h);
    add(p, OVERLOAD, 0, right - px(p, 82), y, px(p, 82), h);
    add(p, LOAD, 0, right - px(p, 160), y, px(p, 72), h);
    add(p, QUALITY, LB_QUALITY, right - px(p, 236), y, px(p, 70), h);
}

/* Puts groups into pages, each in columns of its own, as many cells as there are rows; those of this page are added. A
   group goes on on the next page if at least half of it has room on the one before. */
static void lay_out_panel(lb_picture *p, double width, double top, int rows) {
    const double units = width / p->scale - EDGE;
    const double fitting = fmax(floor(units / USUAL_CELL), fmin(floor(units / LEAST_CELL), 4));
    const int columns = (int)fmin(fmax(fitting, 1), MOST_COLUMNS);
    const double wide = px(p, units) / columns;
    int page = 0, column = 0;
    memset(p->groups, 0, sizeof p->groups);
    for (int g = 0; g < GROUP_COUNT; g++) {
        const int size = group_size(g);
        const int needed = (size + rows - 1) / rows;
        if (column && 2 * (columns - column) < needed) page++, column = 0;
        for (int k = 0, cell = 0; k < LB_PARAMETERS; k++) {
            if (!is_listed(k) || strcmp(lb_parameters[k].group, group_names[g])) continue;
            if (cell && cell % rows == 0 && ++column == columns) page++, column = 0; /* more than a page holds */
            const double x = px(p, EDGE) + column * wide, y = top + px(p, TABS + HEADING) + cell % rows * px(p, CELL);
            if (page < MOST_PAGES) p->groups[page] |= 1u << g;
            if (page == p->page) {
                if (!cell || (!column && cell % rows == 0))
                    add(p, HEAD, g, x, top + px(p, TABS), wide - px(p, EDGE), px(p, HEADING));
                add(p, lb_parameters[k].points ? STEPPER : SLIDER, k, x, y, wide - px(p, EDGE), px(p, CELL));
            }
            cell++;
        }
        if (size) column++;
    }
    p->pages = page < MOST_PAGES ? page + 1 : MOST_PAGES;
}

/* A tab for each page, of the names of its groups. */
static void tab_name(const lb_picture *p, int page, char text[MOST_TEXT]) {
    *text = 0;
    for (int g = 0; g < GROUP_COUNT; g++)
        if (p->groups[page] >> g & 1) {
            const size_t end = strlen(text);
            snprintf(text + end, MOST_TEXT - end, "%s%s", end ? ", " : "", group_names[g]);
        }
}

static double tab_width(const lb_picture *p, int page) {
    char text[MOST_TEXT];
    tab_name(p, page, text);
    return lb_text_width(px(p, MIDDLE), text) + px(p, 20);
}

static void lay_out_tabs(lb_picture *p, double width, double top) {
    const double h = px(p, TABS - 4), right = width - px(p, EDGE);
    for (int k = 0; p->face.swap && k < 2; k++)
        add(p, SIDE, k, right - px(p, 26) * (2 - k), top, px(p, 24), h);
    if (p->face.undo) add(p, UNDO, 0, right - px(p, 112), top, px(p, 52), h);
    if (p->face.paste) add(p, PASTE, 0, right - px(p, 168), top, px(p, 52), h);
    const double room = right - px(p, p->face.paste ? 174 : p->face.undo ? 118 : 58) - px(p, EDGE + 4 * p->pages);
    double x = px(p, EDGE), all = 0;
    for (int k = 0; k < p->pages; k++) all += tab_width(p, k);
    for (int k = 0; k < p->pages; k++) { /* where there is no room for all, each is narrower */
        const double wide = tab_width(p, k) * fmin(1, room / all);
        add(p, TAB, k, x, top, wide, px(p, TABS - 4));
        x += wide + px(p, 4);
    }
}

/* The key that switches an action; -1: none. */
static int key_of(const lb_picture *p, int action) {
    int key = 0;
    for (const lb_switch *s; key < LB_KEY_COUNT; key++)
        if ((s = p->face.switched(p->face.owner, key)) && s->action == action) return key;
    return -1;
}

static const char *switch_name(int action) {
    for (int k = 0; k < LB_SWITCHES; k++)
        if (lb_switches[k].action == action && lb_switches[k].value < 0) return lb_switches[k].name;
    return 0;
}

enum { LET_RING = 100, PLAYED_ON }; /* lamps besides those of actions: the pedal, and the string that keys call */

/* Lamps that are always there: of what controllers and parameters do, too. */
static const int always[] = {LB_SWITCH_FINGER, LB_SWITCH_PICK, LB_SWITCH_SLAP, LB_SWITCH_PALM_MUTE, LB_SWITCH_LEGATO,
                             LB_SWITCH_SLIDE, LB_SWITCH_VIBRATO, LET_RING};
static int is_always(int lamp) {
    for (size_t k = 0; k < sizeof always / sizeof *always; k++)
        if (always[k] == lamp) return 1;
    return 0;
}

static void lamp_name(const lb_picture *p, int lamp, int with_key, char text[64]) {
    char key[16] = "";
    const char *name = lamp == LET_RING ? "Let ring" : lamp == PLAYED_ON ? "String" : switch_name(lamp);
    if (with_key && lamp < LET_RING) lb_note_name(key_of(p, lamp), key);
    snprintf(text, 64, "%s%s%s", name, *key ? "  " : "", key);
}

static void lay_out_lamps(lb_picture *p, double width, double top) {
    int lamps[LB_SWITCHES + 16], count = 0, with_keys = 1;
    char text[64];
    for (size_t k = 0; k < sizeof always / sizeof *always; k++) lamps[count++] = always[k];
    for (int k = 0; k < LB_SWITCHES; k++)
        if (lb_switches[k].value < 0 && !is_always(lb_switches[k].action) && key_of(p, lb_switches[k].action) >= 0)
            lamps[count++] = lb_switches[k].action;
    if (key_of(p, LB_SWITCH_STRING) >= 0) lamps[count++] = PLAYED_ON;
    for (;; with_keys = 0) {
        double x = px(p, EDGE);
        for (int k = 0; k < count; k++) {
            lamp_name(p, lamps[k], with_keys, text);
            x += lb_text_width(px(p, SMALL), text) + px(p, 22);
        }
        if (!with_keys || x <= width - px(p, EDGE)) break;
    }
    double x = px(p, EDGE);
    for (int k = 0; k < count; k++) {
        lamp_name(p, lamps[k], with_keys, text);
        const double wide = lb_text_width(px(p, SMALL), text) + px(p, 18);
        if (x + wide > width - px(p, EDGE)) continue;
        add(p, LAMP, lamps[k] * 2 + with_keys, x, top + px(p, 3), wide, px(p, LAMPS - 6));
        x += wide + px(p, 4);
    }
}

/* Column by column: basses, then, from a new column on, sounds. Where there is no room for all, the last place is for
   the button that goes on by a column. */
static void lay_out_list(lb_picture *p, double x, double y, double w, double h) {
    enum { MOST_PLACES = MOST_PARTS / 2 }; /* what is laid out behind the list needs parts, too */
    const int rows = (int)fmin(fmax(h / px(p, 24), 1), MOST_PLACES / 2);
    const int columns = (int)fmin(fmax(w / px(p, 200), 1), MOST_PLACES / rows), room = rows * columns;
    const int count = basses(p), first = (count + rows - 1) / rows * rows; /* place of the sounds' heading */
    const int places = p->sounds ? first + 1 + p->sounds : count, full = places > room;
    p->columns = full ? (places + rows) / rows - columns : 0;
    if (p->scrolled > p->columns) p->scrolled = 0;
    for (int k = 0; k < room; k++) {
        const int at = k + p->scrolled * rows, more = full && k == room - 1;
        const int kind = more ? MORE : at < count ? ITEM : at < first || at >= places ? NOTHING : at == first ? SOUNDS : SOUND;
        if (kind != NOTHING)
            add(p, kind, kind == SOUND ? at - first - 1 : at, x + k / rows * w / columns, y + k % rows * px(p, 24),
                w / columns - px(p, 6), px(p, 22));
    }
}

/* The rows of cells that a height has room for. */
static int rows_of(const lb_picture *p, double height) {
    return height >= px(p, 560) ? 4 : height >= px(p, 350) ? 3 : 2;
}

static void lay_out_neck(lb_picture *p, const part *board) {
    const LB_LOOK *l = look_of(p);
    const int strings = l->strings ? (int)l->strings : 4;
    double length = l->strings ? 0 : 1;
    for (int i = 0; i < l->strings; i++) length = fmax(length, l->string[i].length);
    p->nut = board->x + px(p, 52);
    p->saddle = board->x + board->w - px(p, 74);
    p->metre = (p->saddle - p->nut) / length;
    p->middle = board->y + px(p, 20) + (board->h - px(p, 38)) / 2;
    const double lane = fmin((board->h - px(p, 54)) / strings, px(p, 68));
    p->half[0] = 0.42 * lane * strings;
    p->half[1] = 0.5 * lane * strings;
}

static void lay_out(lb_picture *p) {
    const double width = p->sheet.width, height = p->sheet.height;
    const int rows = rows_of(p, height);
    const double panel = height - px(p, TABS + HEADING + CELL * rows + FOOT), lamps = panel - px(p, LAMPS);
    p->count = 0;
    p->hovered = -1;
    lay_out_header(p, width);
    const double top = px(p, HEADER), tall = fmax(lamps - top, px(p, 60));
    if (p->listing) lay_out_list(p, px(p, EDGE), top + px(p, 4), width - 2 * px(p, EDGE), tall - px(p, 8));
    p->board = p->count;
    part *board = add(p, BOARD, 0, 0, top, width, p->listing ? 0 : tall);
    if (p->listing) p->board = -1;
    else {
        lay_out_neck(p, board);
        add(p, PLUCK, LB_PLUCK_POSITION, 0, top, px(p, 16), px(p, 18));
        add(p, MOTION, 0, p->nut, top + tall - px(p, 17), px(p, 76), px(p, 15));
        for (int i = 0; i < strings_of(p); i++) {
            const double lane = 2 * p->half[0] / (double)strings_of(p);
            add(p, NAME, i, p->nut - px(p, 44), lane_at(p, i, p->nut) - lane / 2, px(p, 36), lane);
        }
    }
    lay_out_lamps(p, width, lamps);
    const int before = p->count;
    lay_out_panel(p, width, panel, rows);
    if (p->page >= p->pages) { /* there were more in a smaller window */
        p->page = 0;
        p->count = before;
        lay_out_panel(p, width, panel, rows);
    }
    lay_out_tabs(p, width, panel);
}

/* --- parts of the ground --- */

void lb_label(lb_picture *p, lb_sheet *s, double x, double y, double w, double h, double units, uint32_t colour,
                  const char *text, int centred) {
    const double size = px(p, units), wide = lb_text_width(size, text);
    lb_text(s, centred && wide < w ? x + (w - wide) / 2 : x, y + h / 2 + 0.36 * size, size, colour, text, w);
}

static void button(lb_picture *p, const part *q, int lit, int hot) {
    const theme *t = p->t;
    const uint32_t face = lit ? t->accent : hot ? lb_mixed(t->raised, t->edge, 0.5) : t->raised;
    lb_round(&p->ground, q->x, q->y, q->w, q->h, px(p, 6), 0, face);
    lb_round(&p->ground, q->x, q->y, q->w, q->h, px(p, 6), px(p, 1), lit ? t->accent : t->edge);
}

/* An arrow in a box, up (0), right (1), down (2) or left (3). */
static void arrow(lb_picture *p, const part *q, int way, uint32_t colour) {
    static const int ways[4][2] = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};
    const double x = q->x + q->w / 2, y = q->y + q->h / 2, r = px(p, 4), dx = ways[way][0] * r, dy = ways[way][1] * r;
    for (int side = -1; side < 2; side += 2)
        lb_line(&p->ground, x + dx / 2, y + dy / 2, x - dx / 2 - side * dy, y - dy / 2 + side * dx, px(p, 1.8), colour);
}

/* "0.42 (74 % of the string)": what is in brackets says more, where there is no room for both. */
static void shorten(lb_picture *p, char *text, double room) {
    char *open = strstr(text, " (");
    const size_t end = strlen(text);
    if (!open || text[end - 1] != ')' || lb_text_width(px(p, SMALL), text) <= room) return;
    text[end - 1] = 0;
    memmove(text, open + 2, strlen(open + 2) + 1);
}

/* The track of a slider. */
static void track_of(const lb_picture *p, const part *q, double *x, double *y, double *w) {
    *x = q->x + px(p, 5);
    *y = q->y + px(p, 25);
    *w = q->w - px(p, 10);
}

static double place_on_track(const lb_picture *p, int k, double v) {
    const double least = lb_parameters[k].least, range = most(p, k) - least;
    return range > 0 ? fmin(fmax((v - least) / range, 0), 1) : 0;
}

/* The MIDI controller that moves a parameter, as `lb_face.controller` says. */
static int controller_of(const lb_picture *p, int k) {
    return p->face.learn ? p->face.controller(p->face.owner, k) : LB_NO_CONTROLLER;
}

static void draw_cell_text(lb_picture *p, const part *q, int hot) {
    char text[MOST_TEXT];
    const lb_parameter *k = &lb_parameters[q->number];
    const int controller = controller_of(p, q->number);
    if (controller < 0) snprintf(text, sizeof text, "%s", k->name);
    else snprintf(text, sizeof text, "%s (CC %d)", k->name, controller);
    const double size = px(p, SMALL), y = q->y + px(p, 14), wide = lb_text_width(size, text);
    lb_text(&p->ground, q->x, y, size, hot ? p->t->ink : p->t->soft, text, q->w);
    if (q->kind == STEPPER) return;
    const double room = q->w - wide - px(p, 8);
    if (controller == LB_WAITS) snprintf(text, sizeof text, "move a controller");
    else text_of(p, q->number, p->values[q->number], text);
    shorten(p, text, room);
    const double needed = lb_text_width(size, text);
    const double from = needed < room ? q->x + q->w - needed : q->x + wide + px(p, 8);
    lb_text(&p->ground, from, y, size, p->t->ink, text, room + 1);
}

static void draw_slider(lb_picture *p, const part *q, int hot, int held) {
    double x, y, w;
    const theme *t = p->t;
    const lb_parameter *k = &lb_parameters[q->number];
    track_of(p, q, &x, &y, &w);
    const double now = x + w * place_on_track(p, q->number, p->values[q->number]);
    const double usual = x + w * place_on_track(p, q->number, k->usual), thick = px(p, 4);
    lb_round(&p->ground, x, y - thick / 2, w, thick, thick / 2, 0, t->trough);
    lb_round(&p->ground, fmin(now, usual), y - thick / 2, fabs(now - usual), thick, thick / 2, 0, t->accent);
    if (k->usual > k->least && k->usual < most(p, q->number))
        lb_box(&p->ground, usual - px(p, 0.75), y - px(p, 5), px(p, 1.5), px(p, 10), t->edge);
    lb_round(&p->ground, now - px(p, 5), y - px(p, 7), px(p, 10), px(p, 14), px(p, 4), 0, BLACK);
    const uint32_t colour = held ? t->accent : hot ? 0xFFFFFFFF : STRING;
    lb_round(&p->ground, now - px(p, 4), y - px(p, 6), px(p, 8), px(p, 12), px(p, 3), 0, colour);
    lb_box(&p->ground, now - px(p, 0.5), y - px(p, 4), px(p, 1), px(p, 8), 0x80000000);
}

static void draw_stepper(lb_picture *p, const part *q, int hot) {
    char text[MOST_TEXT];
    const part face = {.x = q->x, .y = q->y + px(p, 17), .w = q->w, .h = px(p, 18)};
    text_of(p, q->number, p->values[q->number], text);
    const int is_switch = most(p, q->number) == 1, on = p->values[q->number] > 0.5;
    const double r = px(p, 3), left = px(p, is_switch ? 20 : 8);
    button(p, &face, 0, hot);
    const uint32_t colour = on ? p->t->accent : p->t->trough;
    if (is_switch) lb_round(&p->ground, face.x + px(p, 9), face.y + face.h / 2 - r, 2 * r, 2 * r, r, 0, colour);
    lb_label(p, &p->ground, face.x + left, face.y, face.w - left - px(p, 16), face.h, SMALL, p->t->ink, text, 0);
    const part end = {.x = face.x + face.w - px(p, 18), .y = face.y, .w = px(p, 14), .h = face.h};
    arrow(p, &end, 1, hot ? p->t->ink : p->t->soft);
}

static int lamp_is_on(const lb_picture *p, int lamp) {
    const LB_LOOK *l = look_of(p);
    if (!l->strings) return 0;
    switch (lamp) {
    case LET_RING: return l->pedal != 0;
    case PLAYED_ON: return l->forced >= 0;
    case LB_SWITCH_SLAP: return l->slapped > 0;
    case LB_SWITCH_PICK: return l->slapped == 0 && l->stroke == LB_PICK;
    case LB_SWITCH_FINGER: return l->slapped == 0 && l->stroke != LB_PICK;
    case LB_SWITCH_PALM_MUTE: if (l->palm > 0) return 1; break;
    case LB_SWITCH_VIBRATO: if (l->vibrato > 0) return 1; break;
    case LB_SWITCH_LEGATO: if (l->legato) return 1; break;
    case LB_SWITCH_SLIDE: if (l->sliding) return 1; break;
    default: break;
    }
    return l->switched >> lamp & 1;
}

static void draw_lamp(lb_picture *p, const part *q, int hot) {
    char text[64];
    const int lamp = q->number / 2, on = lamp_is_on(p, lamp);
    const theme *t = p->t;
    lamp_name(p, lamp, q->number % 2, text);
    if (hot && key_of(p, lamp) >= 0) lb_note_name(key_of(p, lamp), text); /* its key, where both have no room */
    char *gap = strstr(text, "  ");
    lb_round(&p->ground, q->x, q->y, q->w, q->h, q->h / 2, 0, on ? t->accent : hot ? t->edge : t->raised);
    if (gap) *gap = 0;
    const double y = q->y + q->h / 2 + px(p, 4), size = px(p, SMALL);
    const double end = lb_text(&p->ground, q->x + px(p, 9), y, size, on ? t->on_accent : t->ink, text, q->w);
    const uint32_t dim = on ? lb_faded(t->on_accent, 0.6) : t->soft;
    if (gap) lb_text(&p->ground, end + lb_text_width(size, "  "), y, size, dim, gap + 2, q->w);
}

static void draw_heading(lb_picture *p, const part *q, const char *name) {
    char text[MOST_TEXT];
    int k = 0;
    for (; k < MOST_TEXT - 1 && name[k]; k++) text[k] = (char)(name[k] >= 'a' && name[k] <= 'z' ? name[k] - 32 : name[k]);
    text[k] = 0;
    lb_label(p, &p->ground, q->x, q->y, q->w, q->h, 9.0, p->t->accent, text, 0);
}

/* A row of the list: `lit` is the one that plays, a doomed one asks. */
static void draw_row(lb_picture *p, const part *q, const char *text, int lit, int hot, int doomed) {
    const theme *t = p->t;
    const uint32_t face = doomed ? t->hot : lit ? t->accent : t->raised, ink = doomed ? 0xFFFFFFFF : lit ? t->on_accent : t->ink;
    if (lit || hot || doomed) lb_round(&p->ground, q->x, q->y, q->w, q->h, px(p, 5), 0, face);
    lb_label(p, &p->ground, q->x + px(p, 8), q->y, q->w - px(p, 16), q->h, MIDDLE, ink, text, 0);
}

/* True while there is something to be said in place of the title. */
static int is_noticed(const lb_picture *p) {
    return *p->notice && p->seconds >= p->noticed && p->seconds < p->noticed + NOTICE;
}

/* Draws a part onto the ground. */
static void draw_part(lb_picture *p, const part *q, int hot, int held) {
    const theme *t = p->t;
    lb_sheet *s = &p->ground;
    const uint32_t colour = p->listing ? t->on_accent : t->ink; /* of the title */
    char text[MOST_TEXT];
    lb_box(s, floor(q->x - 1), floor(q->y - 1), ceil(q->w + 3), ceil(q->h + 3), t->ground);
    switch (q->kind) {
    case WORDMARK: lb_label(p, s, q->x, q->y, q->w, q->h, LARGE, t->accent, "livebass", 0); break;
    case PREVIOUS:
    case NEXT:
        button(p, q, 0, hot);
        arrow(p, q, q->kind == NEXT ? 1 : 3, t->ink);
        break;
    case TITLE:
        button(p, q, p->listing, hot);
        if (is_noticed(p)) snprintf(text, sizeof text, "%s", p->notice);
        else text_of(p, LB_BASS, p->values[LB_BASS], text);
        lb_label(p, s, q->x + px(p, 10), q->y, q->w - px(p, 30), q->h, MIDDLE, colour, text, 0);
        arrow(p, &(part){.x = q->x + q->w - q->h, .y = q->y, .w = q->h, .h = q->h}, 2, colour);
        break;
    case QUALITY:
        button(p, q, 0, hot);
        text_of(p, LB_QUALITY, p->values[LB_QUALITY], text);
        lb_label(p, s, q->x, q->y, q->w, q->h, SMALL, t->ink, text, 1);
        break;
    case LOAD:
        snprintf(text, sizeof text, "load %.0f %%", 100 * p->told_load);
        lb_label(p, s, q->x, q->y, q->w, q->h, SMALL, p->told_load > 0.9 ? t->hot : t->soft, text, 1);
        break;
    case OVERLOAD: {
        const int on = look_of(p)->strings && look_of(p)->overload > 0;
        lb_round(s, q->x, q->y + px(p, 4), q->w, q->h - px(p, 8), q->h / 2, on ? 0 : px(p, 1), on ? t->hot : t->edge);
        lb_label(p, s, q->x, q->y, q->w, q->h, 9.5, on ? 0xFFFFFFFF : t->soft, "OVERLOAD", 1);
        break;
    }
    case LAMP: draw_lamp(p, q, hot); break;
    case TAB:
        tab_name(p, q->number, text);
        lb_label(p, s, q->x, q->y, q->w, q->h, MIDDLE, q->number == p->page || hot ? t->ink : t->soft, text, 1);
        if (q->number == p->page)
            lb_box(s, q->x + px(p, 8), q->y + q->h - px(p, 2), q->w - px(p, 16), px(p, 2), t->accent);
        break;
    case UNDO:
    case SAVE:
    case PASTE:
    case SIDE: {
        const char *const name = q->kind == UNDO    ? "Undo"
                                 : q->kind == SAVE  ? "Save"
                                 : q->kind == PASTE ? "Paste"
                                 : q->number        ? "B"
                                                    : "A";
        button(p, q, q->kind == SIDE && q->number == p->face.side(p->face.owner), hot);
        lb_label(p, s, q->x, q->y, q->w, q->h, SMALL, t->ink, name, 1);
        break;
    }
    case HEAD: draw_heading(p, q, group_names[q->number]); break;
    case SOUNDS: draw_heading(p, &(part){.x = q->x + px(p, 8), .y = q->y, .w = q->w, .h = q->h}, "Your sounds"); break;
    case SLIDER:
        draw_cell_text(p, q, hot);
        draw_slider(p, q, hot, held);
        break;
    case STEPPER:
        draw_cell_text(p, q, hot);
        draw_stepper(p, q, hot);
        break;
    case ITEM:
        text_of(p, LB_BASS, q->number, text);
        draw_row(p, q, text, (int)p->values[LB_BASS] == q->number, hot, 0);
        break;
    case SOUND: {
        const int doomed = p->doomed == q->number;
        draw_row(p, q, doomed ? "Press again to delete" : p->face.sound(p->face.owner, q->number), 0, hot, doomed);
        break;
    }
    case MORE:
        draw_row(p, q, p->scrolled < p->columns ? "More" : "Back", 0, 1, 0);
        break;
    case NAME:
        lb_note_name((int)look_of(p)->string[q->number].open, text);
        lb_draw_name(p, s, q->x + q->w / 2, q->y + q->h / 2, text, lb_fret_held(p, q->number) == 0);
        break;
    default: break;
    }
}

/* --- drawing --- */

void lb_copy_area(const lb_picture *p, lb_area a) {
    const size_t width = (size_t)p->sheet.width;
    a = lb_common(a, (lb_area){0, 0, p->sheet.width, p->sheet.height});
    for (int y = a.y0; y < a.y1 && a.x1 > a.x0; y++)
        memcpy(p->sheet.pixels + (size_t)y * width + a.x0, p->ground.pixels + (size_t)y * width + a.x0,
               (size_t)(a.x1 - a.x0) * sizeof(uint32_t));
}

/* What the places of the parts are made of. */
static uint64_t layout_state(const lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    uint64_t hash = 1;
    mix(&hash, p->sheet.width);
    mix(&hash, p->sheet.height);
    mix(&hash, p->scale);
    mix(&hash, p->t == &themes[1]);
    mix(&hash, p->page * 4 + p->listing * 2 + p->scrolled * 1000);
    mix(&hash, p->lists);
    mix(&hash, (double)l->strings);
    for (int i = 0; i < l->strings; i++) mix(&hash, l->string[i].length);
    mix(&hash, p->values[LB_BASS]);
    return hash | 1;
}

/* What a part of the ground shows now. */
static uint64_t part_state(const lb_picture *p, int k) {
    const part *q = &p->parts[k];
    const LB_LOOK *l = look_of(p);
    uint64_t hash = 1;
    if (q->kind == BOARD) return lb_neck_state(p);
    mix(&hash, (p->hovered == k) + 2 * (p->held == k));
    if (q->kind == SLIDER || q->kind == STEPPER || q->kind == QUALITY) mix(&hash, p->values[q->number]);
    if (q->kind == SLIDER) mix(&hash, most(p, q->number) + 1000.0 * controller_of(p, q->number));
    if (q->kind == SIDE) mix(&hash, p->face.side(p->face.owner));
    if (q->kind == TITLE || q->kind == ITEM) mix(&hash, p->values[LB_BASS]);
    if (q->kind == TITLE) mix(&hash, is_noticed(p) ? p->noticed + 1 : 0);
    if (q->kind == SOUND) mix(&hash, p->doomed == q->number);
    if (q->kind == LOAD) mix(&hash, rint(100 * p->told_load));
    if (q->kind == OVERLOAD) mix(&hash, l->strings && l->overload > 0);
    if (q->kind == LAMP) mix(&hash, lamp_is_on(p, q->number / 2));
    if (q->kind == NAME) mix(&hash, (double)l->string[q->number].open * 2 + (lb_fret_held(p, q->number) == 0));
    return hash | 1;
}

/* Takes the array to draw into; returns 0 if there is no memory. */
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
    if (p->seconds - p->told_at < 0.5 && p->seconds >= p->told_at) return;
    p->told_at = p->seconds;
    p->told_load = look_of(p)->strings ? look_of(p)->load : 0;
}

/* Ends what the pointer holds. */
static void let_go(lb_picture *p) {
    if (p->held >= 0 && (p->parts[p->held].kind == SLIDER || p->parts[p->held].kind == PLUCK)) {
        const int k = p->parts[p->held].number;
        set(p, k, value(p, k), LB_END);
    }
    p->held = -1;
    end_note(p);
}

void lb_draw(lb_picture *p, uint32_t *pixels, int width, int height, double scale, int dark, double seconds,
             int dirty[4]) {
    memset(dirty, 0, 4 * sizeof *dirty);
    if (width < 1 || height < 1 || !take_sheet(p, pixels, width, height)) return;
    p->scale = fmin(fmax(scale, 1), 4);
    p->t = &themes[dark != 0];
    p->level = fmax(p->level - FALL * fmin(fmax(seconds - p->seconds, 0), 1), FLOOR_DB);
    p->seconds = seconds;
    lb_read_looks(p);
    tell_load(p);
    for (int k = 0; k < LB_PARAMETERS; k++) p->values[k] = value(p, k);
    lb_area changed = {0, 0, 0, 0};
    int anew = 0;
    if (p->laid_out != layout_state(p)) {
        anew = 1;
        let_go(p); /* parts get other numbers */
        lay_out(p);
        p->laid_out = layout_state(p);
        changed = (lb_area){0, 0, width, height};
        lb_box(&p->ground, 0, 0, width, height, p->t->ground);
    }
    for (int k = 0; k < p->count; k++) {
        part *q = &p->parts[k];
        const uint64_t now = part_state(p, k);
        if (q->drawn == now || q->kind == PLUCK || q->kind == MOTION) continue;
        q->drawn = now;
        if (q->kind == BOARD) lb_draw_neck(p, q);
        else draw_part(p, q, p->hovered == k, p->held == k);
        const lb_area area = lb_area_of(q->x - 1, q->y - 1, q->w + 3, q->h + 3);
        if (k == p->board) p->lively = 1, p->still = 0;
        if (!anew) lb_copy_area(p, area);
        changed = lb_joined(changed, area);
    }
    if (anew) lb_copy_area(p, changed);
    if (p->board >= 0) changed = lb_joined(changed, lb_draw_lively(p, anew || !p->still));
    changed = lb_common(changed, (lb_area){0, 0, width, height});
    if (lb_empty(changed)) return;
    dirty[0] = changed.x0;
    dirty[1] = changed.y0;
    dirty[2] = changed.x1 - changed.x0;
    dirty[3] = changed.y1 - changed.y0;
}

/* --- the pointer --- */

static int hit(const lb_picture *p, double x, double y) {
    for (int k = p->count - 1; k >= 0; k--) {
        const part *q = &p->parts[k];
        if (q->kind != NAME && x >= q->x && x < q->x + q->w && y >= q->y && y < q->y + q->h) return k;
    }
    return -1;
}

static int is_live(int kind) {
    return kind != NOTHING && kind != WORDMARK && kind != LOAD && kind != OVERLOAD && kind != HEAD && kind != SOUNDS;
}

/* The string and the fret at a place of the neck. */
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

/* Plays the note under the pointer, unless it sounds; the one before ends after it has begun: they are bound. */
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

/* The value of PLUCK_POSITION that plucks at a place, as the performer reads it. */
static double pluck_value(const lb_picture *p, double x) {
    const LB_LOOK *l = look_of(p);
    const double place = (x - p->nut) / p->metre / l->string[0].length - l->usual;
    const double near = l->nearest - l->usual, far = l->farthest - l->usual;
    if (place * near > 0) return fmin(place / near, 1);
    return place * far > 0 ? fmax(-place / far, -1) : 0;
}

static double slider_value(const lb_picture *p, const part *q, double x) {
    double left, y, wide;
    track_of(p, q, &left, &y, &wide);
    const double least = lb_parameters[q->number].least;
    return allowed(p, q->number, least + (most(p, q->number) - least) * (x - left) / wide);
}

/* The next value of a stepper, or the one before; round and round. */
static void step(lb_picture *p, int k, int way) {
    const double least = lb_parameters[k].least, range = most(p, k) - least + 1, at = value(p, k) + way - least;
    change(p, k, least + at - range * floor(at / range));
}

static void step_bass(lb_picture *p, int way) {
    const int count = basses(p), now = (int)value(p, LB_BASS);
    if (count > 1) change(p, LB_BASS, (now + way + count) % count);
}

static int is_row(int kind) { return kind == ITEM || kind == SOUND || kind == SOUNDS || kind == MORE; }

static void wheel(lb_picture *p, const part *q, int way, int modifiers) {
    if (q->kind == SLIDER) {
        const lb_parameter *k = &lb_parameters[q->number];
        const double range = most(p, q->number) - k->least, fine = modifiers & LB_SHIFT ? 0.005 : 0.025;
        change(p, q->number, value(p, q->number) + way * (k->whole ? 1 : range * fine));
    } else if (q->kind == PLUCK) change(p, q->number, value(p, q->number) + way * -0.05);
    else if (q->kind == STEPPER || q->kind == QUALITY) step(p, q->number, way);
    else if (q->kind == TITLE || q->kind == PREVIOUS || q->kind == NEXT) step_bass(p, -way);
    else if (is_row(q->kind)) p->scrolled = (int)fmin(fmax(p->scrolled - way, 0), p->columns);
}

/* Presses the key of a lamp's switch: one that acts while it is held stays down until the next press. */
static void press_lamp(lb_picture *p, int lamp) {
    const int key = lamp < LET_RING ? key_of(p, lamp) : -1;
    if (key < 0) return;
    const int at_once = lamp == LB_SWITCH_FINGER || lamp == LB_SWITCH_PICK || lamp == LB_SWITCH_SLAP ||
                        lamp == LB_SWITCH_STOP_ALL;
    p->toggled[key] = !p->toggled[key] && !at_once;
    if (p->toggled[key] || at_once) p->face.note(p->face.owner, 1, -1, key, 0.75);
    if (!p->toggled[key]) p->face.note(p->face.owner, 0, -1, key, 0);
}

/* --- the user's sounds --- */

static void read_list(lb_picture *p) {
    p->sounds = p->face.list ? p->face.list(p->face.owner) : 0;
    p->doomed = -1;
    p->lists++;
}

static void notice(lb_picture *p, const char *form, const char *what) {
    snprintf(p->notice, sizeof p->notice, form, what);
    p->noticed = p->seconds;
}

static void save_sound(lb_picture *p) {
    char name[MOST_TEXT - 16];
    if (p->face.save(p->face.owner, name, sizeof name)) notice(p, "Saved: %s", name);
    else notice(p, "Not saved: see the log of the host%s", "");
    if (p->listing) read_list(p);
}

/* Takes it over; by the right button deletes it, once that was pressed twice. */
static void press_sound(lb_picture *p, int sound, int modifiers) {
    if (!(modifiers & LB_RIGHT) && p->doomed != sound) {
        p->listing = 0;
        if (!p->face.load(p->face.owner, sound)) notice(p, "Not loaded: see the log of the host%s", "");
    } else if (!(modifiers & LB_RIGHT)) p->doomed = -1;
    else if (p->doomed != sound) p->doomed = sound;
    else {
        p->face.remove(p->face.owner, sound);
        read_list(p);
    }
}

int lb_wants_text(lb_picture *p) {
    const int wanted = p->pasting;
    p->pasting = 0;
    return wanted;
}

void lb_paste(lb_picture *p, const char *text) {
    const char *why = p->face.paste(p->face.owner, text ? text : "");
    if (why) notice(p, "The clipboard %s", why);
    else notice(p, "Taken from the clipboard%s", "");
}

static void press(lb_picture *p, int k, double x, double y, int modifiers) {
    const part *q = &p->parts[k];
    p->held = k;
    switch (q->kind) {
    case PREVIOUS: step_bass(p, -1); break;
    case NEXT: step_bass(p, 1); break;
    case TITLE:
        if ((p->listing = !p->listing)) read_list(p);
        break;
    case SAVE: save_sound(p); break;
    case PASTE: p->pasting = 1; break;
    case SOUND: press_sound(p, q->number, modifiers); break;
    case MORE: p->scrolled = p->scrolled < p->columns ? p->scrolled + 1 : 0; break;
    case ITEM:
        change(p, LB_BASS, q->number);
        p->listing = 0;
        break;
    case TAB: p->page = q->number; break;
    case MOTION: p->zoom = (p->zoom + 1) % (int)(sizeof zooms / sizeof *zooms); break;
    case QUALITY:
    case STEPPER: step(p, q->number, modifiers & LB_RIGHT ? -1 : 1); break;
    case LAMP: press_lamp(p, q->number / 2); break;
    case BOARD: play_at(p, x, y); break;
    case UNDO:
        p->face.undo(p->face.owner);
        break;
    case SIDE:
        if (q->number != p->face.side(p->face.owner)) p->face.swap(p->face.owner);
        break;
    case SLIDER:
    case PLUCK:
        if (q->kind == SLIDER && modifiers & LB_RIGHT) {
            if (p->face.learn) p->face.learn(p->face.owner, q->number);
            p->held = -1;
            break;
        }
        p->grabbed = x;
        p->from = value(p, q->number);
        set(p, q->number, p->from, LB_BEGIN);
        if (q->kind == SLIDER && !(modifiers & LB_SHIFT)) set(p, q->number, p->from = slider_value(p, q, x), LB_MOVE);
        break;
    default: p->held = -1;
    }
}

static void drag(lb_picture *p, double x, double y, int modifiers) {
    const part *q = &p->parts[p->held];
    if (q->kind == BOARD) play_at(p, x, y);
    else if (q->kind == PLUCK) set(p, q->number, allowed(p, q->number, pluck_value(p, x)), LB_MOVE);
    else if (q->kind == SLIDER) {
        const double fine = modifiers & LB_SHIFT ? 0.1 : 1, way = slider_value(p, q, x);
        const double range = most(p, q->number) - lb_parameters[q->number].least;
        const double moved = p->from + fine * range * (x - p->grabbed) / (q->w - px(p, 10));
        set(p, q->number, fine < 1 ? allowed(p, q->number, moved) : way, LB_MOVE);
    }
}

static int pointer_on(const part *q) {
    if (q->kind == SLIDER || q->kind == PLUCK) return LB_POINTER_ACROSS;
    return is_live(q->kind) && q->kind != BOARD ? LB_POINTER_HAND : LB_POINTER_USUAL;
}

int lb_point(lb_picture *p, int kind, double x, double y, int modifiers) {
    const int at = kind == LB_POINT_LEAVE || !(fabs(x) + fabs(y) < 1e6) ? -1 : hit(p, x, y);
    if (kind == LB_POINT_RELEASE || kind == LB_POINT_LEAVE) let_go(p);
    if (p->held >= 0 && kind == LB_POINT_MOVE) drag(p, x, y, modifiers);
    if (p->held < 0) p->hovered = at;
    if (at < 0 || p->parts[at].kind != SOUND || p->parts[at].number != p->doomed) p->doomed = -1;
    if (kind == LB_POINT_UP || kind == LB_POINT_DOWN) {
        if (at >= 0 && p->held < 0) wheel(p, &p->parts[at], kind == LB_POINT_UP ? 1 : -1, modifiers);
    } else if (kind == LB_POINT_DOUBLE && at >= 0 && (p->parts[at].kind == SLIDER || p->parts[at].kind == PLUCK)) {
        let_go(p);
        change(p, p->parts[at].number, lb_parameters[p->parts[at].number].usual);
    } else if (kind == LB_POINT_PRESS || kind == LB_POINT_DOUBLE) {
        let_go(p);
        if (at >= 0) press(p, at, x, y, modifiers);
    }
    const int shown = p->held >= 0 ? p->held : at;
    return shown >= 0 ? pointer_on(&p->parts[shown]) : LB_POINTER_USUAL;
}
