/* Lays out the picture's parts. */
#include "picture/drawing.h"

#include <stdio.h>

int lb_basses(const lb_picture *p) {
    char first[MAX_TEXT], second[MAX_TEXT];
    const int count = (int)maximum_of(p, LB_BASS) + 1;
    text_of(p, LB_BASS, 0, first);
    text_of(p, LB_BASS, 1, second);
    return count == 2 && !strcmp(first, second) ? 1 : count;
}

static part *add(lb_picture *p, int kind, int number, double x, double y, double w, double h) {
    static part none;
    if (p->count == MAX_PARTS || w <= 0 || h <= 0) return &none;
    part *q = &p->parts[p->count++];
    *q = (part){kind, number, x, y, w, h, 0};
    return q;
}

/* The parameters' places in sections of a page, section by section. Any that is left out is on the last page. */
static const char pages[LB_PAGES][9] = {"Play", "Bench", "Tone", "Settings"};
enum { RIGHT_HAND, HANDS, SOUND_OF, NECK, FRETS, STRINGS, EACH_PICKUP, PICKUPS, PLUCKING, TONE, EFFECTS, LOWS, HIGHS, SPEAKERS,
       PROCESSOR, PLAYING, UNEVEN, MORE_OF, SECTIONS };
static const char sections[SECTIONS][15] = {
    "Right hand", "Hands", "Sound", "Neck", "Frets and wood", "Strings", "Each pickup", "All pickups", "Plucking", "Tone",
    "Effects", "Low EQ", "High EQ", "Cabinet", "Processor", "Playing", "Human", "More",
};
static const struct {
    int page, section, count, parameters[6];
} places[] = {
    {LB_PLAY, RIGHT_HAND, 3, {LB_TECHNIQUE, LB_PLUCK_POSITION, LB_DYNAMICS}},
    {LB_PLAY, HANDS, 3, {LB_PALM_MUTE, LB_VIBRATO, LB_HAND_DAMPING}},
    {LB_PLAY, SOUND_OF, 3, {LB_GAIN, LB_TONE, LB_DRIVE}},
    {LB_BENCH_PAGE, NECK, 4, {LB_ACTION, LB_NECK_RELIEF, LB_NUT_HEIGHT, LB_CONTACT_LOSS}},
    {LB_BENCH_PAGE, FRETS, 4, {LB_FRET, LB_FRET_HEIGHT, LB_NECK_RESONANCE, LB_NECK_MASS}},
    {LB_BENCH_PAGE, STRINGS, 6, {LB_NAMED_TUNING, LB_CONCERT_PITCH, LB_GAUGE, LB_TENSION, LB_WEAR, LB_FOAM}},
    {LB_BENCH_PAGE, EACH_PICKUP, 4, {LB_PICKUP_1_PLACE, LB_PICKUP_1_HEIGHT, LB_PICKUP_2_PLACE, LB_PICKUP_2_HEIGHT}},
    {LB_BENCH_PAGE, PICKUPS, 3, {LB_PICKUP_PLACE, LB_PICKUP_HEIGHT, LB_CABLE}},
    {LB_BENCH_PAGE, PLUCKING, 3, {LB_FINGER_WIDTH, LB_PLUCK_ANGLE, LB_HARDEST}},
    {LB_TONE_PAGE, TONE, 3, {LB_GAIN, LB_TONE, LB_BLEND}},
    {LB_TONE_PAGE, EFFECTS, 3, {LB_COMPRESSION, LB_DRIVE, LB_CLEAN_BLEND}},
    {LB_TONE_PAGE, LOWS, 3, {LB_EQ_BASS, LB_EQ_LOW_MID, LB_EQ_LOW_MID_FREQUENCY}},
    {LB_TONE_PAGE, HIGHS, 3, {LB_EQ_HIGH_MID, LB_EQ_HIGH_MID_FREQUENCY, LB_EQ_TREBLE}},
    {LB_TONE_PAGE, SPEAKERS, 3, {LB_CABINET, LB_PARAMETERS /* the response */, LB_LIMITER}},
    {LB_SETTINGS, PROCESSOR, 4, {LB_QUALITY, LB_CORES, LB_RUNNING_AHEAD, LB_RELIEF}},
    {LB_SETTINGS, PLAYING, 4, {LB_BEND_RANGE, LB_VELOCITY_CURVE, LB_HAND_POSITION, LB_AVOID_OPEN}},
    {LB_SETTINGS, UNEVEN, 3, {LB_UNEVENNESS, LB_HUMANISE_TIME, LB_HUMANISE_FORCE}},
};
enum { PLACED = sizeof places / sizeof *places };
static const char *const tips[LB_PARAMETERS] = { /* in place of a parameter's own help */
    [LB_TECHNIQUE] = "What plucks the strings. The buttons above choose it, too.",
    [LB_PLUCK_POSITION] = "Where the strings are plucked. Drag the mark over the body, too.",
    [LB_DYNAMICS] = "Force of every note.",
    [LB_PALM_MUTE] = "How firmly the palm rests on the strings.",
    [LB_VIBRATO] = "Depth of the vibrato.",
    [LB_HAND_DAMPING] = "How fast a finger stops a note.",
    [LB_GAIN] = "Level. 0 dB is the preset's.",
    [LB_TONE] = "The tone pot: 0 is closed, 10 is open.",
    [LB_DRIVE] = "A valve stage behind the bass.",
    [LB_BLEND] = "From the pickup at the neck to the one at the bridge.",
    [LB_COMPRESSION] = "A compressor behind the bass.",
    [LB_CLEAN_BLEND] = "How much clean sound stays beside the drive, and keeps the lows.",
    [LB_EQ_BASS] = "The amp's equaliser: below 80 Hz.",
    [LB_EQ_LOW_MID] = "The amp's equaliser: around the low mid frequency.",
    [LB_EQ_LOW_MID_FREQUENCY] = "Centre of the low mid.",
    [LB_EQ_HIGH_MID] = "The amp's equaliser: around the high mid frequency.",
    [LB_EQ_HIGH_MID_FREQUENCY] = "Centre of the high mid.",
    [LB_EQ_TREBLE] = "The amp's equaliser: above 4 kHz.",
    [LB_CABINET] = "A cabinet, computed from its loudspeakers. A response follows it.",
    [LB_LIMITER] = "Keeps loud sounds under -1 dB. amp: only with equaliser, blend or cabinet.",
    [LB_QUALITY] = "Studio plays more modes, at more load.",
    [LB_CORES] = "Threads that play strings side by side.",
    [LB_RUNNING_AHEAD] = "Computes strings ahead in quiet times. The sound stays the same.",
    [LB_RELIEF] = "Simplifies strings for a moment if time runs out. Never in a bounce.",
    [LB_BEND_RANGE] = "Range of the pitch wheel.",
    [LB_VELOCITY_CURVE] = "Below 0 a soft touch plays louder, above 0 softer.",
    [LB_HAND_POSITION] = "The fret near which the left hand plays. At 0 it moves freely.",
    [LB_AVOID_OPEN] = "Frets notes that open strings have.",
    [LB_UNEVENNESS] = "How much notes differ from each other.",
    [LB_HUMANISE_TIME] = "How late notes may come.",
    [LB_HUMANISE_FORCE] = "How much the force of notes may differ.",
};

/* Names in place of a parameter's own, where a page's section says the rest. */
static const struct {
    int parameter;
    char name[20];
} shorter[] = {
    {LB_PICKUP_PLACE, "To the neck"}, {LB_PICKUP_HEIGHT, "To the strings"},
    {LB_EQ_BASS, "Bass"}, {LB_EQ_LOW_MID, "Low mid"}, {LB_EQ_HIGH_MID, "High mid"}, {LB_EQ_TREBLE, "Treble"},
};

const char *lb_name_of(int parameter) {
    for (size_t k = 0; k < sizeof shorter / sizeof *shorter; k++)
        if (shorter[k].parameter == parameter) return shorter[k].name;
    return lb_parameters[parameter].name;
}

const char *lb_tip_of(int parameter) { return tips[parameter] ? tips[parameter] : lb_parameters[parameter].help; }

/* A parameter without a place; techniques are lamps, and the bass is in the header. */
static int is_left(int k) {
    for (size_t j = 0; j < PLACED; j++)
        for (int n = 0; n < places[j].count; n++)
            if (places[j].parameters[n] == k) return 0;
    return k != LB_BASS && strcmp(lb_parameters[k].group, "Techniques") != 0;
}

int lb_is_narrow(const lb_picture *p) { return p->sheet.width < px(p, NARROW); }

static void lay_out_header(lb_picture *p, double width) {
    const double y = px(p, 9), h = px(p, 28), left = px(p, 122), right = width - px(p, EDGE);
    const double save = px(p, lb_is_narrow(p) ? 44 : 84), quality = px(p, lb_is_narrow(p) ? 56 : 104);
    const double after = px(p, 154 + 6) + quality, room = right - after - px(p, 6) - save - left;
    const double wide = floor(fmin(fmin(px(p, 330), width * 0.36), room)); /* whole: parts clear what is beside them */
    add(p, WORDMARK, 0, px(p, EDGE), y, px(p, 100), h);
    add(p, PREVIOUS, 0, left, y, h, h);
    add(p, TITLE, 0, left + h + px(p, 2), y, wide - 2 * h - px(p, 4), h); /* each clears a small margin */
    add(p, NEXT, 0, left + wide - h, y, h, h);
    if (p->face.save) add(p, SAVE, 0, left + wide + px(p, 6), y, save, h);
    add(p, OVERLOAD, 0, right - px(p, 78), y, px(p, 78), h);
    add(p, LOAD, 0, right - px(p, 154), y, px(p, 72), h);
    add(p, QUALITY, LB_QUALITY, right - after, y, quality, h);
}

/* A page's cells: sections by section, each led by its heading. */
typedef struct {
    int count, sections, longest;           /* cells and headings together; the cells of the longest section */
    int kind[MAX_CELLS], number[MAX_CELLS]; /* HEAD: a section */
} cells;

static void add_cell(cells *c, int kind, int number) {
    if (c->count == MAX_CELLS) return;
    c->kind[c->count] = kind;
    c->number[c->count++] = number;
}

/* Adds a parameter's cell to a section, after the heading if it is the first. */
static void add_value(cells *c, int section, int first, int k) {
    if (c->count == first) add_cell(c, HEAD, section);
    add_cell(c, k >= LB_PARAMETERS ? RESPONSE : lb_parameters[k].points ? STEPPER : SLIDER, k);
}

static cells cells_of(const lb_picture *p, int page) {
    cells c = {0, 0, 0, {0}, {0}};
    for (int section = 0; section < SECTIONS; section++) {
        const int first = c.count;
        for (size_t j = 0; j < PLACED; j++) {
            const int here = places[j].page == page && places[j].section == section;
            for (int n = 0; here && n < places[j].count; n++)
                if (places[j].parameters[n] < LB_PARAMETERS || p->face.response)
                    add_value(&c, section, first, places[j].parameters[n]);
        }
        for (int k = 0; section == MORE_OF && page == LB_SETTINGS && k < LB_PARAMETERS; k++)
            if (is_left(k)) add_value(&c, section, first, k);
        c.sections += c.count > first;
        if (c.count - first - 1 > c.longest) c.longest = c.count - first - 1;
    }
    return c;
}

const char *lb_section_name(int section) { return sections[section]; }

/* The columns and rows of a page's cells, headings among them: a column for each section, if there is room, or all in
   a row, one column after the other. */
typedef struct {
    int columns, rows, apart;
    double wide;
} grid;

static grid grid_of(const lb_picture *p, const cells *c) {
    const double units = p->sheet.width / p->scale - EDGE;
    const int fitting = (int)fmin(fmax(floor(units / MIN_CELL), 1), MAX_COLUMNS);
    grid g = {c->sections, c->longest + 1, 1, 0};
    if (fitting < c->sections) {
        g = (grid){fitting, (c->count + fitting - 1) / fitting, 0, 0};
        for (int again = 1; again; g.rows += again) { /* a heading at a column's end moves on, and may need a row more */
            int at = 0, columns = 1;
            for (int k = 0; k < c->count; k++, at++)
                if (at == g.rows || (at == g.rows - 1 && c->kind[k] == HEAD)) at = 0, columns++;
            again = columns > g.columns;
        }
    }
    g.wide = px(p, units / g.columns);
    return g;
}

/* The cells of a page, `tall` pixels each. */
static void lay_out_cells(lb_picture *p, const cells *c, const grid *g, double top, double tall) {
    int column = 0, row = 0;
    for (int k = 0; k < c->count; k++, row++) {
        const int head = c->kind[k] == HEAD;
        if (k && (g->apart ? head : row == g->rows || (head && row == g->rows - 1))) column++, row = 0;
        const double x = px(p, EDGE) + column * g->wide, high = px(p, HEADING), above = tall - high;
        const double y = top + row * tall - (g->apart && row ? above : 0) + (head && !g->apart ? above : 0);
        add(p, c->kind[k], c->number[k], x, y, g->wide - px(p, EDGE), head ? high : tall);
    }
}

int lb_is_outdated(const lb_picture *p) { return p->face.kept && p->face.kept(p->face.owner); }

const char *lb_tab_name(int page) { return pages[page]; }

/* The song's bar: its buttons, what plays, and the cross that puts it away. */
static void lay_out_song(lb_picture *p, double width, double top) {
    const double h = px(p, SONG_BAR - 4), right = width - px(p, EDGE), wide = px(p, 48);
    double x = px(p, EDGE);
    for (int k = LB_ROLL; p->song.there && k <= LB_LOOP; k++, x += wide + px(p, 4)) add(p, SONG_BUTTON, k, x, top, wide, h);
    add(p, SONG_LINE, 0, x + px(p, 4), top, right - h - x - px(p, 12), h);
    add(p, SONG_CROSS, LB_PUT_AWAY, right - h, top, h, h);
}

static void lay_out_tabs(lb_picture *p, double width, double top) {
    const double h = px(p, TABS - 4), right = width - px(p, EDGE), paste = px(p, lb_is_narrow(p) ? 48 : 84);
    for (int k = 0; p->face.swap && k < 2; k++)
        add(p, SIDE, k, right - px(p, 26) * (2 - k), top, px(p, 24), h);
    if (p->face.copy) add(p, COPY, 0, right - px(p, 104), top, px(p, 48), h);
    if (p->face.undo) add(p, UNDO, 0, right - px(p, 156), top, px(p, 48), h);
    if (p->face.paste) add(p, PASTE, 0, right - px(p, 160) - paste, top, paste, h);
    if (lb_is_outdated(p)) add(p, UPDATE, 0, right - px(p, 220) - paste, top, px(p, 56), h);
    for (int k = 0; k < LB_PAGES; k++) add(p, TAB, k, px(p, EDGE) + px(p, 84) * k, top, px(p, 80), h);
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

/* Rows of lamps by what they are about, the most used first: always all, in the same places. */
enum { LAMP_ROWS = 4, ACROSS = 7 };
static const char lamp_rows[LAMP_ROWS][10] = {"Stroke", "Left hand", "Damping", "Harmonics"};
static const int lamps[LAMP_ROWS][ACROSS] = { /* 0: none */
    {LB_SWITCH_FINGER, LB_SWITCH_PICK, LB_SWITCH_SLAP, LB_SWITCH_THUMB_ON_ALL, LB_SWITCH_POP_ON_ALL, LB_SWITCH_DOWN_STROKE,
     LB_SWITCH_UP_STROKE},
    {LB_SWITCH_LEGATO, LB_SWITCH_SLIDE, LB_SWITCH_VIBRATO, LB_SWITCH_TAP, LB_SWITCH_LEFT_SLAP, LB_SWITCH_SLIDE_OFF_DOWN,
     LB_SWITCH_SLIDE_OFF_UP},
    {LB_SWITCH_PALM_MUTE, LB_SWITCH_GHOST, LB_SWITCH_LET_RING, LB_SWITCH_DETACH, LB_SWITCH_STOP_ALL},
    {LB_SWITCH_HARMONIC, LB_SWITCH_ARTIFICIAL, LB_SWITCH_ARTIFICIAL_12TH, LB_SWITCH_ARTIFICIAL_15TH, LB_SWITCH_PINCH},
};

const char *lb_lamp_row_name(int row) { return lamp_rows[row]; }

/* True in a window without room for cells and lamps of the usual size. */
static int is_low(const lb_picture *p) { return p->sheet.height < px(p, LOW); }

static double lamp_height(const lb_picture *p) { return px(p, is_low(p) ? SMALL_LAMP : LAMP_HEIGHT); }

/* The width of a lamp's name, for a low window; in others lamps stand in columns. */
static double name_width(const lb_picture *p, int lamp) {
    return is_low(p) ? lb_text_width(px(p, TINY), lb_switch_of(lamp)->name) + px(p, 6) : 0;
}

/* A row's heading, then its lamps: in a low window each as wide as its name, and its share of what is left. */
static void lay_out_lamps(lb_picture *p, double width, double top) {
    const double begin = px(p, EDGE + LAMP_HEAD), tall = lamp_height(p), gap = px(p, is_low(p) ? 2 : 4), all = width - px(p, EDGE - 4) - begin;
    for (int row = 0; row < LAMP_ROWS; row++) {
        const double y = top + row * tall;
        double x = begin, left = all;
        int count = 0;
        for (; count < ACROSS && lamps[row][count]; count++) left -= name_width(p, lamps[row][count]);
        const double share = fmin(left / (is_low(p) ? count : ACROSS), px(p, is_low(p) ? 24 : MAX_LAMP));
        add(p, LAMP_ROW, row, px(p, EDGE), y, px(p, LAMP_HEAD - 4), tall - gap);
        for (int k = 0; k < count; k++) {
            const double wide = name_width(p, lamps[row][k]) + share;
            add(p, LAMP, lamps[row][k], x, y, wide - px(p, 4), tall - gap);
            x += wide;
        }
    }
}

/* True if a name has the searched text in it, small or large letters alike. */
static int is_found(const lb_picture *p, const char *name) {
    if (p->typing != SEARCH || !*p->typed) return 1;
    for (; *name; name++) {
        size_t k = 0;
        for (; p->typed[k]; k++) {
            const char a = name[k], b = p->typed[k];
            if ((a >= 'A' && a <= 'Z' ? a | 32 : a) != (b >= 'A' && b <= 'Z' ? b | 32 : b)) break;
        }
        if (!p->typed[k]) return 1;
    }
    return 0;
}

static int list_group(lb_picture *p, int group, listed *rows, int count) {
    const int basses = lb_basses(p), first = count++;
    char name[MAX_TEXT];
    rows[first] = (listed){SOUNDS, group};
    for (int k = 0; k < basses && count < MAX_LISTED; k++) {
        text_of(p, LB_BASS, k, name);
        const int of = p->face.group ? p->face.group(p->face.owner, k) : LB_SHIPPED;
        if (of == group && is_found(p, name)) rows[count++] = (listed){ITEM, k};
    }
    for (int k = 0; k < p->sounds && count < MAX_LISTED; k++) {
        const int of = !p->face.is_own || p->face.is_own(p->face.owner, k) ? LB_MINE : LB_FACTORY;
        if (of == group && is_found(p, p->face.sound(p->face.owner, k))) rows[count++] = (listed){SOUND, k};
    }
    return count == first + 1 ? first : count; /* no heading for nothing */
}

/* Lays out the search, then group by group, column by column. If not all fit, the last place has the button that
   scrolls by a column. */
static void lay_out_list(lb_picture *p, double x, double y, double w, double h) {
    enum { MAX_PLACES = MAX_PARTS / 2, MAX_ROWS = MAX_PLACES / 2 }; /* parts after the list need places, too */
    const int rows = (int)fmin(fmax(h / px(p, 24), 1), MAX_ROWS);
    const int fitting = MAX_PLACES / rows, columns = (int)fmin(fmax(w / px(p, 200), 1), fitting), room = rows * columns;
    listed *all = p->listed;
    int count = 1;
    all[0] = (listed){SEARCHED, 0};
    for (int group = 0; group < LB_SOUND_GROUPS; group++) count = list_group(p, group, all, count);
    const int full = count > room;
    p->columns = full ? (count + rows) / rows - columns : 0;
    if (p->scrolled > p->columns) p->scrolled = 0;
    for (int k = 0; k < room; k++) {
        const int at = k + p->scrolled * rows, column = k / rows, row = k % rows, more = full && k == room - 1;
        if (at >= count && !more) break;
        const listed one = more ? (listed){MORE, 0} : all[at];
        add(p, one.kind, one.number, x + column * w / columns, y + row * px(p, 24), w / columns - px(p, 6), px(p, 22));
    }
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
    const double width = p->sheet.width, height = p->sheet.height, bar = *p->song.line ? px(p, SONG_BAR) : 0;
    const double top = px(p, HEADER + TABS) + bar;
    const int bench = p->page == LB_BENCH_PAGE;
    const cells c = cells_of(p, p->page);
    const grid g = grid_of(p, &c);
    const int lit = p->page == LB_PLAY && !(p->listing && is_low(p)); /* there the list takes the lamps' room */
    const double switches = lit ? lamp_height(p) * LAMP_ROWS + px(p, 2) : 0;
    const double heads = g.apart ? px(p, HEADING) : 0, room = height - top - px(p, FOOT) - switches - heads;
    const int rows = g.apart ? g.rows - 1 : g.rows, both = room - rows * px(p, SMALL_CELL) >= px(p, 2 * MIN_NECK);
    const int large = room - rows * px(p, CELL) >= px(p, bench ? 2 * MIN_NECK : MIN_NECK);
    const double cell = px(p, large ? CELL : SMALL_CELL), minimum = px(p, bench && !p->listing ? 0 : 60);
    const double tall = fmax(room - rows * cell, minimum), panel = top + tall;
    const double side = !bench || p->listing ? 0 : both ? fmin(tall * 0.45, px(p, 190)) : tall;
    p->count = 0;
    p->hovered = -1;
    lay_out_header(p, width);
    if (p->listing) lay_out_list(p, px(p, EDGE), top + px(p, 4), width - 2 * px(p, EDGE), tall - px(p, 8));
    p->board = p->count;
    part *board = add(p, BOARD, 0, 0, top, width, p->listing ? 0 : tall - side);
    lay_out_neck(p, &(part){.x = 0, .y = top, .w = width, .h = fmax(tall - side, 1)});
    if (board->h <= 0) p->board = -1;
    else {
        add(p, PLUCK, LB_PLUCK_POSITION, 0, top, px(p, 16), px(p, 18));
        add(p, MOTION, 0, p->nut, top + tall - side - px(p, 17), px(p, MOTION_WIDTH), px(p, 15));
        if (p->face.zoom) add(p, ENLARGED, 0, px(p, EDGE), top + tall - side - px(p, 17), px(p, 36), px(p, 15));
        for (int i = 0; i < strings_of(p); i++) {
            const double lane = 2 * p->half[0] / (double)strings_of(p);
            add(p, NAME, i, p->nut - px(p, 44), lane_at(p, i, p->nut) - lane / 2, px(p, 36), lane);
        }
    }
    p->coils = -1;
    if (side > px(p, 40)) {
        add(p, CROWNS, 0, 1, top + tall - side + 1, width - 3, side - 3);
        p->coils = p->count; /* where the view is drawn, they get their places */
        for (int k = 0; k < 2; k++) add(p, COIL, lb_pickup_slider(k), -2, top, 1, 1);
    }
    lay_out_tabs(p, width, px(p, HEADER));
    if (bar > 0) lay_out_song(p, width, top - bar);
    if (switches > 0) lay_out_lamps(p, width, panel);
    lay_out_cells(p, &c, &g, panel + switches, cell);
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
    mix(&hash, lb_is_outdated(p));
    mix(&hash, 2 * p->song.there + (*p->song.line != 0));
    return hash | 1;
}
