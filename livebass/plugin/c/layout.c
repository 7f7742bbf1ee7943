/* Lays out the picture's parts. */
#include "drawing.h"

#include <stdio.h>

int lb_basses(const lb_picture *p) {
    char first[MOST_TEXT], second[MOST_TEXT];
    const int count = (int)most_of(p, LB_BASS) + 1;
    text_of(p, LB_BASS, 0, first);
    text_of(p, LB_BASS, 1, second);
    return count == 2 && !strcmp(first, second) ? 1 : count;
}

static part *add(lb_picture *p, int kind, int number, double x, double y, double w, double h) {
    static part none;
    if (p->count == MOST_PARTS || w <= 0 || h <= 0) return &none;
    part *q = &p->parts[p->count++];
    *q = (part){kind, number, x, y, w, h, 0};
    return q;
}

static int is_listed(int k) { return k != LB_BASS && k != LB_QUALITY; } /* these are in the header */

static int group_size(int group) {
    int size = 0;
    for (int k = 0; k < LB_PARAMETERS; k++) size += is_listed(k) && !strcmp(lb_parameters[k].group, lb_groups[group]);
    return size;
}

static void lay_out_header(lb_picture *p, double width) {
    const double y = px(p, 9), h = px(p, 28), left = px(p, 122), right = width - px(p, EDGE);
    const double room = right - px(p, 236 + 6 + SAVE_WIDTH + 6) - left, wide = fmin(fmin(px(p, 330), width * 0.36), room);
    add(p, WORDMARK, 0, px(p, EDGE), y, px(p, 100), h);
    add(p, PREVIOUS, 0, left, y, h, h);
    add(p, TITLE, 0, left + h + px(p, 2), y, wide - 2 * h - px(p, 4), h); /* each clears a small margin */
    add(p, NEXT, 0, left + wide - h, y, h, h);
    if (p->face.save) add(p, SAVE, 0, left + wide + px(p, 6), y, px(p, SAVE_WIDTH), h);
    add(p, OVERLOAD, 0, right - px(p, 82), y, px(p, 82), h);
    add(p, LOAD, 0, right - px(p, 160), y, px(p, 72), h);
    add(p, QUALITY, LB_QUALITY, right - px(p, 236), y, px(p, 70), h);
}

/* Puts groups into pages, each group in its own columns of `rows` cells; adds this page's groups. A group continues on
   the next page if at least half of it fits on the one before. */
static void lay_out_panel(lb_picture *p, double width, double top, int rows) {
    const double units = width / p->scale - EDGE;
    const double fitting = fmax(floor(units / USUAL_CELL), fmin(floor(units / LEAST_CELL), 4));
    const int columns = (int)fmin(fmax(fitting, 1), MOST_COLUMNS);
    const double wide = px(p, units) / columns;
    int page = 0, column = 0;
    memset(p->groups, 0, sizeof p->groups);
    for (int g = 0; g < LB_GROUPS; g++) {
        const int size = group_size(g);
        const int needed = (size + rows - 1) / rows;
        if (column && 2 * (columns - column) < needed) page++, column = 0;
        for (int k = 0, cell = 0; k < LB_PARAMETERS; k++) {
            if (!is_listed(k) || strcmp(lb_parameters[k].group, lb_groups[g])) continue;
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

/* Writes the names of a page's groups. */
void lb_tab_name(const lb_picture *p, int page, char text[MOST_TEXT]) {
    *text = 0;
    for (int g = 0; g < LB_GROUPS; g++)
        if (p->groups[page] >> g & 1) {
            const size_t end = strlen(text);
            snprintf(text + end, MOST_TEXT - end, "%s%s", end ? ", " : "", lb_groups[g]);
        }
}

static double tab_width(const lb_picture *p, int page) {
    char text[MOST_TEXT];
    lb_tab_name(p, page, text);
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
    for (int k = 0; k < p->pages; k++) { /* without room for all, each is narrower */
        const double wide = tab_width(p, k) * fmin(1, room / all);
        add(p, TAB, k, x, top, wide, px(p, TABS - 4));
        x += wide + px(p, 4);
    }
}

int lb_key_of(const lb_picture *p, int action) {
    int key = 0;
    for (const lb_switch *s; key < LB_KEY_COUNT; key++)
        if ((s = p->face.switched(p->face.owner, key)) && s->action == action) return key;
    return -1;
}

const lb_switch *lb_switch_of(int action) {
    for (int k = 0; k < LB_SWITCHES; k++)
        if (lb_switches[k].action == action && lb_switches[k].value < 0) return &lb_switches[k];
    return 0;
}

/* Lamps that are always shown: controllers and parameters switch them, too. */
static const int always[] = {LB_SWITCH_FINGER, LB_SWITCH_PICK, LB_SWITCH_SLAP, LB_SWITCH_PALM_MUTE, LB_SWITCH_LEGATO,
                             LB_SWITCH_SLIDE, LB_SWITCH_VIBRATO, LB_SWITCH_LET_RING};
static int is_always(int lamp) {
    for (size_t k = 0; k < sizeof always / sizeof *always; k++)
        if (always[k] == lamp) return 1;
    return 0;
}

void lb_lamp_name(const lb_picture *p, int lamp, int with_key, char text[64]) {
    char key[16] = "";
    if (with_key) lb_note_name(lb_key_of(p, lamp), key);
    snprintf(text, 64, "%s%s%s", lb_switch_of(lamp)->name, *key ? "  " : "", key);
}

static void lay_out_lamps(lb_picture *p, double width, double top) {
    int lamps[LB_SWITCHES], count = 0, with_keys = 1;
    char text[64];
    for (size_t k = 0; k < sizeof always / sizeof *always; k++) lamps[count++] = always[k];
    for (int k = 0; k < LB_SWITCHES; k++)
        if (lb_switches[k].value < 0 && !is_always(lb_switches[k].action) && lb_key_of(p, lb_switches[k].action) >= 0)
            lamps[count++] = lb_switches[k].action;
    for (;; with_keys = 0) {
        double x = px(p, EDGE);
        for (int k = 0; k < count; k++) {
            lb_lamp_name(p, lamps[k], with_keys, text);
            x += lb_text_width(px(p, SMALL), text) + px(p, 22);
        }
        if (!with_keys || x <= width - px(p, EDGE)) break;
    }
    double x = px(p, EDGE);
    for (int k = 0; k < count; k++) {
        lb_lamp_name(p, lamps[k], with_keys, text);
        const double wide = lb_text_width(px(p, SMALL), text) + px(p, 18);
        if (x + wide > width - px(p, EDGE)) continue;
        add(p, LAMP, lamps[k] * 2 + with_keys, x, top + px(p, 3), wide, px(p, LAMPS - 6));
        x += wide + px(p, 4);
    }
}

/* Lays out basses column by column and, from a new column on, sounds. If not all fit, the last place has the button
   that scrolls by a column. */
static void lay_out_list(lb_picture *p, double x, double y, double w, double h) {
    enum { MOST_PLACES = MOST_PARTS / 2, MOST_ROWS = MOST_PLACES / 2 }; /* parts after the list need places, too */
    const int rows = (int)fmin(fmax(h / px(p, 24), 1), MOST_ROWS);
    const int fitting = MOST_PLACES / rows, columns = (int)fmin(fmax(w / px(p, 200), 1), fitting), room = rows * columns;
    const int count = lb_basses(p), first = (count + rows - 1) / rows * rows; /* place of the sounds' heading */
    const int places = p->sounds ? first + 1 + p->sounds : count, full = places > room;
    p->columns = full ? (places + rows) / rows - columns : 0;
    if (p->scrolled > p->columns) p->scrolled = 0;
    for (int k = 0; k < room; k++) {
        const int at = k + p->scrolled * rows, more = full && k == room - 1;
        const int kind = more ? MORE : at < count ? ITEM : at < first || at >= places ? NOTHING : at == first ? SOUNDS : SOUND;
        const int column = k / rows, row = k % rows, number = kind == SOUND ? at - first - 1 : at;
        if (kind != NOTHING)
            add(p, kind, number, x + column * w / columns, y + row * px(p, 24), w / columns - px(p, 6), px(p, 22));
    }
}

/* The rows of cells that fit into a height. */
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

void lb_lay_out(lb_picture *p) {
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

uint64_t lb_layout_state(const lb_picture *p) {
    const LB_LOOK *l = look_of(p);
    uint64_t hash = 1;
    mix(&hash, p->sheet.width);
    mix(&hash, p->sheet.height);
    mix(&hash, p->scale);
    mix(&hash, p->t->ground);
    mix(&hash, p->page * 4 + p->listing * 2 + p->scrolled * 1000);
    mix(&hash, p->lists);
    mix(&hash, (double)l->strings);
    for (int i = 0; i < l->strings; i++) mix(&hash, l->string[i].length);
    mix(&hash, p->values[LB_BASS]);
    return hash | 1;
}
