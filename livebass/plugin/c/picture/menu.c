/* What lies over the picture: menus and tips; and the keyboard. */
#include "picture/drawing.h"
#include "instance/response.h"

#include <stdio.h>

#define LINE_HIGH 19.0
#define TIP_DELAY 0.7  /* s */
#define TIP_WIDTH 250.0
enum { DO_NOTHING, DO_TYPE, DO_RESET, DO_LEARN, DO_FORGET, DO_PASTE, DO_CHOOSE };

static void add_line(lb_cover *c, int does, const char *text) {
    if (c->count == MAX_LINES) return;
    c->does[c->count] = does;
    snprintf(c->lines[c->count++], MAX_TEXT, "%s", text);
}

/* Gives a cover its size, and a place at x, y within the picture. */
static void place(lb_picture *p, double x, double y) {
    lb_cover *c = &p->cover;
    double wide = 0;
    for (int k = 0; k < c->count; k++) wide = fmax(wide, lb_text_width(px(p, SMALL), c->lines[k]));
    c->w = wide + px(p, 20);
    c->h = c->count * px(p, c->kind == MENU ? LINE_HIGH : 15) + px(p, 8);
    c->x = floor(fmax(fmin(x, p->sheet.width - c->w), 0));
    c->y = floor(y + c->h > p->sheet.height ? fmax(y - c->h - px(p, 24), 0) : y);
    c->drawn = 0;
}

static void close_cover(lb_picture *p) { p->cover.kind = NO_COVER; }

/* Adds a parameter's name and value. */
static void add_value(lb_picture *p, int k) {
    char text[64 + MAX_TEXT];
    const int end = snprintf(text, 64, "%.40s: ", lb_parameters[k].name);
    text_of(p, k, p->values[k], text + end);
    add_line(&p->cover, DO_NOTHING, text);
}

/* The response's menu: none, the files of the user's folder, as many as fit, and the clipboard. */
static void add_responses(lb_picture *p) {
    lb_cover *c = &p->cover;
    add_line(c, DO_NOTHING, "WAV files in the folder " LB_RESPONSES " of your sounds");
    add_line(c, DO_CHOOSE, "None");
    for (int k = 0, files = p->face.responses(p->face.owner); k < files && c->count < MAX_LINES - 1; k++)
        add_line(c, DO_CHOOSE + 1 + k, p->face.response_name(p->face.owner, k));
    if (p->face.paste) add_line(c, DO_PASTE, "Paste the path of a WAV file");
}

void lb_open_menu(lb_picture *p, int k, double x, double y) {
    char text[MAX_TEXT];
    lb_cover *c = &p->cover;
    *c = (lb_cover){.kind = MENU, .number = k, .lit = -1};
    if (k == LB_PARAMETERS) {
        add_responses(p);
        place(p, x, y);
        return;
    }
    add_value(p, k);
    for (int j = 0; lb_parameters[k].points && lb_parameters[k].points[j] && j < MAX_LINES - 4; j++) {
        text_of(p, k, lb_parameters[k].minimum + j, text);
        add_line(c, DO_CHOOSE + j, text);
    }
    if (!lb_parameters[k].points && p->face.read) add_line(c, DO_TYPE, "Type a value");
    add_line(c, DO_RESET, "Reset");
    const int controller = p->face.learn ? p->face.controller(p->face.owner, k) : LB_NO_CONTROLLER;
    if (p->face.learn && lb_parameters[k].kind >= 0) {
        if (controller == LB_WAITS) add_line(c, DO_LEARN, "Stop learning");
        else if (controller < 0) add_line(c, DO_LEARN, "Learn a MIDI controller");
        else {
            snprintf(text, sizeof text, "Forget controller %d", controller);
            add_line(c, DO_FORGET, text);
        }
    }
    place(p, x, y);
}

static void choose(lb_picture *p, int line) {
    const lb_cover c = p->cover;
    const int does = line < 0 ? DO_NOTHING : c.does[line], k = c.number;
    close_cover(p);
    if (does == DO_TYPE) lb_begin_typing(p, VALUE, k, "");
    else if (does == DO_RESET) lb_change(p, k, lb_parameters[k].default_value);
    else if (does == DO_LEARN || does == DO_FORGET) p->face.learn(p->face.owner, k);
    else if (does == DO_PASTE) p->pasting = 1;
    else if (does >= DO_CHOOSE && k == LB_PARAMETERS) lb_choose_response(p, does - DO_CHOOSE - 1);
    else if (does >= DO_CHOOSE) lb_change(p, k, does - DO_CHOOSE);
}

static int line_at(const lb_picture *p, double x, double y) {
    const lb_cover *c = &p->cover;
    const int line = (int)floor((y - c->y - px(p, 4)) / px(p, LINE_HIGH));
    return x < c->x || x >= c->x + c->w || line < 0 || line >= c->count ? -1 : line;
}

int lb_point_menu(lb_picture *p, int kind, double x, double y) {
    if (p->cover.kind != MENU) return 0;
    const int line = line_at(p, x, y), head = line >= 0 && p->cover.does[line] == DO_NOTHING;
    if (kind == LB_POINT_MOVE) p->cover.lit = head ? -1 : line;
    else if (kind == LB_POINT_PRESS || kind == LB_POINT_DOUBLE) {
        if (!head) choose(p, line);
    } else if (kind != LB_POINT_RELEASE) close_cover(p);
    return 1;
}

/* Adds a text in lines of at most TIP_WIDTH; `large`: it begins with a large letter. */
static void add_wrapped(lb_picture *p, const char *text, int large) {
    char line[MAX_TEXT] = "";
    for (int first = 1; *text; first = 0) {
        const size_t word = strcspn(text, " "), end = strlen(line);
        snprintf(line + end, sizeof line - end, "%s%.*s", end ? " " : "", (int)word, text);
        if (end && lb_text_width(px(p, SMALL), line) > px(p, TIP_WIDTH)) {
            line[end] = 0;
            add_line(&p->cover, DO_NOTHING, line);
            snprintf(line, sizeof line, "%.*s", (int)word, text);
        }
        if (first && large && *line >= 'a' && *line <= 'z') *line -= 'a' - 'A';
        text += word + (text[word] == ' ');
    }
    if (*line) add_line(&p->cover, DO_NOTHING, line);
}

static void make_tip(lb_picture *p) {
    const part *q = &p->parts[p->hovered];
    const int is_value = q->kind == SLIDER || q->kind == STEPPER || q->kind == QUALITY || q->kind == PLUCK || q->kind == COIL;
    const char *tip = is_value && q->kind != COIL ? lb_tip_of(q->number) : lb_kinds[q->kind].tip;
    if (!tip && !is_value) return;
    p->cover = (lb_cover){.kind = TIP, .number = p->hovered, .lit = -1};
    if (is_value) add_value(p, q->number);
    if (q->kind == SONG_LINE) add_wrapped(p, p->song.line, 0);
    if (q->kind == LAMP) {
        char text[MAX_TEXT];
        const char *key = lb_note_name(lb_key_of(p, q->number));
        snprintf(text, sizeof text, *key ? "%s: key %s." : "%s.", lb_switch_of(q->number)->name, key);
        add_line(&p->cover, DO_NOTHING, text);
    }
    if (tip) add_wrapped(p, tip, 1);
    if (is_value && lb_is_idle(p, q->number)) add_line(&p->cover, DO_NOTHING, "This bass cannot use it.");
    place(p, q->x, q->y + q->h + px(p, 4));
}

void lb_follow_tip(lb_picture *p) {
    const int wanted = p->hovered >= 0 && p->held < 0 && !p->typing && p->seconds - p->rested > TIP_DELAY;
    if (p->cover.kind == TIP && !wanted) close_cover(p);
    else if (p->cover.kind == NO_COVER && wanted) make_tip(p);
}

lb_area lb_cover_area(const lb_picture *p) {
    const lb_cover *c = &p->cover;
    return c->kind ? lb_area_of(c->x, c->y, c->w, c->h) : (lb_area){0, 0, 0, 0};
}

uint64_t lb_cover_state(const lb_picture *p) {
    uint64_t hash = 1;
    mix(&hash, p->cover.kind * 1000.0 + p->cover.number);
    mix(&hash, p->cover.lit);
    mix(&hash, p->cover.x * 4096 + p->cover.y);
    return hash | 1;
}

void lb_draw_cover(lb_picture *p) {
    const lb_cover *c = &p->cover;
    const double high = px(p, c->kind == MENU ? LINE_HIGH : 15), thin = px(p, 1);
    lb_box(&p->sheet, c->x, c->y, c->w, c->h, p->t->edge);
    lb_box(&p->sheet, c->x + thin, c->y + thin, c->w - 2 * thin, c->h - 2 * thin, p->t->raised);
    for (int k = 0; k < c->count; k++) {
        const double y = c->y + px(p, 4) + k * high;
        const part room = {.x = c->x + px(p, 10), .y = y, .w = c->w - px(p, 20) + 1, .h = high};
        const int head = c->kind == MENU && c->does[k] == DO_NOTHING, lit = k == c->lit;
        if (lit) lb_box(&p->sheet, c->x + thin, y, c->w - 2 * thin, high, p->t->accent);
        lb_label(p, &p->sheet, &room, SMALL, lit ? p->t->on_accent : head ? p->t->soft : p->t->ink, c->lines[k], 0);
    }
}

/* --- the keyboard --- */

/* Takes what was typed, and ends that. */
static void take_typed(lb_picture *p) {
    double value;
    if (p->typing == VALUE && *p->typed && p->face.read(p->face.owner, p->typed_for, p->typed, &value))
        lb_change(p, p->typed_for, value);
    if (p->typing == SAVING) lb_save(p);
    if (p->typing == SEARCH) lb_take_found(p);
    lb_stop_typing(p);
}

int lb_wants_keys(const lb_picture *p) { return p->typing != NOT_TYPING; }

/* Adds a letter to the typed text, or takes its last one away. */
static void type(lb_picture *p, int key) {
    size_t end = strlen(p->typed);
    if (key == LB_KEY_BACK || key == LB_KEY_DELETE) {
        while (end && (p->typed[end - 1] & 0xC0) == 0x80) end--;
        p->typed[end ? end - 1 : 0] = 0;
    } else if (key >= ' ' && key < 0x800 && end + 3 < sizeof p->typed) {
        if (key >= 0x80) p->typed[end++] = (char)(0xC0 | key >> 6);
        p->typed[end++] = (char)(key < 0x80 ? key : 0x80 | (key & 0x3F));
        p->typed[end] = 0;
    }
}

/* Moves the focus to the next value on the page, or to the one before. */
static void move_focus(lb_picture *p, int way) {
    int values[MAX_PARTS], count = 0, at = -1;
    for (int k = 0; k < p->count; k++)
        if (p->parts[k].kind == SLIDER || p->parts[k].kind == STEPPER) {
            if (p->parts[k].number == p->focus) at = count;
            values[count++] = p->parts[k].number;
        }
    if (count) p->focus = values[at < 0 ? (way > 0 ? 0 : count - 1) : (at + way + count) % count];
}

static int key_in_menu(lb_picture *p, int key) {
    lb_cover *c = &p->cover;
    if (key == LB_KEY_ESCAPE) close_cover(p);
    else if (key == LB_KEY_ENTER) choose(p, c->lit);
    else if (key == LB_KEY_UP || key == LB_KEY_DOWN) {
        const int first = c->does[0] == DO_NOTHING, lines = c->count - first, way = key == LB_KEY_DOWN ? 1 : -1;
        c->lit = first + (c->lit < first ? (way > 0 ? 0 : lines - 1) : (c->lit - first + way + lines) % lines);
    } else return 0;
    return 1;
}

static int key_on_value(lb_picture *p, int key, int modifiers) {
    const int k = p->focus, fine = modifiers & LB_SHIFT;
    const int types = !lb_parameters[k].points && p->face.read;
    char text[2] = {(char)key, 0};
    if (key == LB_KEY_LEFT || key == LB_KEY_DOWN) lb_step(p, k, -1, fine);
    else if (key == LB_KEY_RIGHT || key == LB_KEY_UP) lb_step(p, k, 1, fine);
    else if (key == LB_KEY_BACK || key == LB_KEY_DELETE) lb_change(p, k, lb_parameters[k].default_value);
    else if (types && (key == LB_KEY_ENTER || (key > ' ' && key < 0x80 && strchr("-.0123456789", key))))
        lb_begin_typing(p, VALUE, k, key == LB_KEY_ENTER ? "" : text);
    else return 0;
    return 1;
}

int lb_key(lb_picture *p, int key, int modifiers) {
    if (p->cover.kind == TIP) close_cover(p);
    if (p->cover.kind == MENU) return key_in_menu(p, key);
    if (modifiers & (LB_CONTROL | LB_ALT)) return 0;
    if (key == LB_KEY_ESCAPE && (p->typing || p->listing || p->keyed)) {
        if (p->typing == SEARCH && !*p->typed) p->listing = 0;
        if (p->typing == SEARCH && *p->typed) *p->typed = 0, p->lists++;
        else lb_stop_typing(p);
        p->keyed = 0;
        return 1;
    }
    if (p->typing && (key == LB_KEY_ENTER || key == LB_KEY_TAB)) {
        take_typed(p);
        if (key == LB_KEY_ENTER) return 1;
    } else if (p->typing) {
        type(p, key);
        p->lists += p->typing == SEARCH; /* what is listed changes */
        return 1;
    }
    if (key == LB_KEY_TAB) {
        move_focus(p, modifiers & LB_SHIFT ? -1 : 1);
        p->keyed = 1;
        return 1;
    }
    return p->focus >= 0 && p->keyed && key_on_value(p, key, modifiers);
}
