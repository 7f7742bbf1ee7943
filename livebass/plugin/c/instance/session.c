/* The state that a session keeps of an instance: words that later plugins read too, with the bass itself.

   It is a text of lines `name = value` in sections, as sounds are, in the engine's units. What this plugin does not know
   is kept and written again. The last line has a checksum of all bytes before. LV2 keeps properties instead (lv2.c). */
#include "instance/response.h"
#include "instance/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define OLD "LBSTATE\n" /* before format 1 */
#define SUM "sum = "
enum { SUM_BYTES = sizeof SUM + 17, MAX_UNKNOWN = 8192, NAMED = 200 };
static const size_t WORDS = 1 << 16; /* bytes for all but files */

static const char *const sides[] = {"A", "B"};

/* FNV-1a, of bytes. */
static uint64_t sum_of(const char *bytes, size_t count) {
    uint64_t sum = 0xCBF29CE484222325u;
    for (size_t k = 0; k < count; k++) sum = (sum ^ (unsigned char)bytes[k]) * 0x100000001B3u;
    return sum;
}

/* --- bytes as text (RFC 4648) --- */

static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

static size_t in_text(size_t count) { return (count + 2) / 3 * 4; }

static size_t add_bytes(char *to, const unsigned char *bytes, size_t count) {
    size_t end = 0;
    for (size_t k = 0; k < count; k += 3) {
        const size_t left = count - k;
        const uint32_t three = (uint32_t)bytes[k] << 16 | (left > 1 ? (uint32_t)bytes[k + 1] << 8 : 0) | (left > 2 ? bytes[k + 2] : 0);
        for (int j = 0; j < 4; j++) to[end++] = (size_t)j > left ? '=' : digits[three >> (18 - 6 * j) & 63];
    }
    return end;
}

/* Decodes a text in place; returns the number of bytes, or -1 if it is not one. */
static int64_t take_bytes(char *text) {
    size_t count = strlen(text);
    int64_t end = 0;
    if (count % 4) return -1;
    for (size_t k = 0; k < count; k += 4) {
        uint32_t three = 0;
        int fill = 0;
        for (int j = 0; j < 4; j++) {
            const char c = text[k + (size_t)j], *found = c == '=' ? 0 : strchr(digits, c);
            if (!found && (c != '=' || k + 4 < count || j < 2)) return -1;
            if (found && fill) return -1;
            fill += !found;
            three = three << 6 | (found ? (uint32_t)(found - digits) : 0);
        }
        for (int j = 0; j < 3 - fill; j++) text[end++] = (char)(three >> (16 - 8 * j));
    }
    return end;
}

/* --- writing --- */

static size_t add_value(char *text, size_t room, size_t end, const char *symbol, double value) {
    char number[LB_NUMERAL];
    lb_write_number(number, value);
    return lb_append(text, room, end, "%s = %s\n", symbol, number);
}

/* Adds bytes as a value. */
static size_t add_kept(char *text, size_t room, size_t end, const char *name, const void *bytes, size_t count) {
    end = lb_append(text, room, end, "%s = \"", name);
    end += add_bytes(text + end, bytes, count);
    return lb_append(text, room, end, "\"\n");
}

/* Adds what was unknown in a section. */
static size_t add_unknown(char *text, size_t room, size_t end, const char *unknown, const char *section) {
    const size_t length = strlen(section);
    for (const char *line = unknown; line && *line;) {
        const char *next = strchr(line, '\n'), *word = line + length + 1;
        if (!strncmp(line, section, length) && line[length] == '\t') end = lb_append(text, room, end, "%.*s\n", (int)(next - word), word);
        line = next + 1;
    }
    return end;
}

/* Adds the unknown sections. */
static size_t add_others(char *text, size_t room, size_t end, const char *unknown) {
    static const char *const known[] = {"", "A", "B", "processor", "controllers", "response", "instrument"};
    char section[NAMED], last[NAMED] = "";
    for (const char *line = unknown; line && *line; line = strchr(line, '\n') + 1) {
        size_t k = 0;
        snprintf(section, sizeof section, "%.*s", (int)strcspn(line, "\t"), line);
        while (k < sizeof known / sizeof *known && strcmp(known[k], section)) k++;
        if (k < sizeof known / sizeof *known || !strcmp(section, last)) continue;
        snprintf(last, sizeof last, "%s", section);
        end = add_unknown(text, room, lb_append(text, room, end, "\n[%s]\n", section), unknown, section);
    }
    return end;
}

/* Reads the bytes of the bass that plays, allocated by malloc; 0: it has none. */
static void *bass_bytes(const lb_instance *i, int bass, size_t *count) {
    const lb_source source = lb_shelf_source(i->shelf, bass);
    return lb_source_bytes(&source, count);
}

void *lb_new_state(lb_instance *i, size_t *count) {
    double values[LB_PARAMETERS];
    uint8_t learned[LB_CONTROLLERS];
    lb_sides kept;
    char name[LB_STATE_NAME];
    int64_t seed;
    size_t bytes = 0;
    __atomic_load(&i->seed, &seed, __ATOMIC_RELAXED);
    lb_write_learned(i, learned);
    lb_read_present(i, values, &kept, name);
    const int known = lb_shelf_find(i->shelf, name);
    void *bass = known < 0 ? 0 : bass_bytes(i, known, &bytes);
    lb_response *r = lb_use_response(i);
    char *unknown = lb_read_unknown(i);
    const size_t room = WORDS + in_text(bytes) + in_text(r ? r->size : 0) + (unknown ? 2 * strlen(unknown) : 0);
    char *text = malloc(room);
    *count = 0;
    if (text) {
        size_t end = lb_append(text, room, 0, LB_STATE_TITLE "format = %d\nmade = \"" LB_RELEASE "\"\nbass = \"%s\"\nseed = %lld\nside = \"%s\"\n", LB_STATE_FORMAT,
                               name, (long long)seed, sides[kept.side]);
        end = add_unknown(text, room, end, unknown, "");
        for (int side = 0; side < 2; side++) {
            end = lb_append(text, room, end, "\n[%s]\n", sides[side]);
            for (int k = 0; k < LB_PARAMETERS; k++)
                if (lb_is_of_sides(k)) end = add_value(text, room, end, lb_parameters[k].symbol, side == kept.side ? values[k] : kept.aside[k]);
            end = add_unknown(text, room, end, unknown, sides[side]);
        }
        end = lb_append(text, room, end, "\n[processor]\n");
        for (int k = 0; k < LB_PARAMETERS; k++)
            if (!lb_is_of_sides(k) && k != LB_BASS) end = add_value(text, room, end, lb_parameters[k].symbol, values[k]);
        end = add_unknown(text, room, end, unknown, "processor");
        end = lb_append(text, room, end, "\n[controllers]\n");
        for (int k = 0; k < LB_CONTROLLERS; k++)
            if (learned[k]) end = lb_append(text, room, end, "%d = \"%s\"\n", k, lb_parameters[learned[k] - 1].symbol);
        end = add_unknown(text, room, end, unknown, "controllers");
        if (r) end = add_kept(text, room, lb_append(text, room, end, "\n[response]\n"), "file", r->kept, r->size);
        if (bass) end = add_kept(text, room, lb_append(text, room, end, "\n[instrument]\n"), "file", bass, bytes);
        end = add_others(text, room, end, unknown);
        *count = lb_append(text, room, end, SUM "%016llx\n", (unsigned long long)sum_of(text, end));
    }
    lb_free_response(r);
    free(unknown);
    free(bass);
    return text;
}

/* --- reading --- */

typedef struct {
    const lb_instance *i;
    lb_kept *to;
    double of[2][LB_PARAMETERS]; /* A's and B's values, and the processor's */
    size_t unknown;              /* bytes */
    char held[NAMED];            /* names of values that were beyond their limits */
    char strange[NAMED];         /* names that are unknown */
} reading;

/* Adds a name to a list of names. */
static void add_name(char list[NAMED], const char *name) {
    const size_t end = strlen(list);
    if (strlen(name) + end + 8 < NAMED) sprintf(list + end, "%s%s", end ? ", " : "", name);
    else if (end + 6 < NAMED && strcmp(list + end - 4, " ...")) strcpy(list + end, " ...");
}

/* Keeps a line that is unknown. */
static void keep(reading *r, const char *section, const char *name, const char *value) {
    const size_t more = strlen(section) + strlen(name) + strlen(value) + 8;
    add_name(r->strange, name);
    if (r->unknown + more > MAX_UNKNOWN) return;
    if (!r->to->unknown && !(r->to->unknown = calloc(1, MAX_UNKNOWN))) return;
    r->unknown += (size_t)sprintf(r->to->unknown + r->unknown, "%s\t%s = %s\n", section, name, value);
}

/* The text in a value, in a copy: what is unknown stays as it is; 0: it has none. */
static const char *text_in(const char *value, char copy[NAMED]) {
    if (snprintf(copy, NAMED, "%s", value) >= NAMED) return 0;
    return lb_unquoted(copy);
}

/* Takes a parameter's value for a side; returns 0 if it has no such value. */
static int take_value(reading *r, int side, int of_sides, const char *symbol, const char *text) {
    double value;
    const int k = lb_parameter_called(symbol);
    if (k < 0 || lb_is_of_sides(k) != of_sides || !lb_read_number(text, &value)) return 0;
    r->of[side][k] = lb_allowed(r->i, k, value);
    if (r->of[side][k] != value) add_name(r->held, symbol);
    return 1;
}

static int take_controller(reading *r, const char *name, const char *value) {
    char copy[NAMED];
    double number;
    const char *symbol = text_in(value, copy);
    const int k = symbol ? lb_parameter_called(symbol) : -1;
    if (k < 0 || !lb_read_number(name, &number) || number != floor(number) || !(number >= 0 && number < LB_CONTROLLERS)) return 0;
    r->to->learned[(int)number] = (uint8_t)(k + 1);
    return 1;
}

/* Takes a line of the head; returns 0 if it has no such name. */
static int take_head(reading *r, const char *name, const char *value) {
    char copy[NAMED];
    lb_kept *to = r->to;
    if (!strcmp(name, "format") || !strcmp(name, "made")) return 1;
    if (!strcmp(name, "seed")) {
        to->seed = strtoll(value, 0, 10);
        return 1;
    }
    const char *text = text_in(value, copy);
    if (!text) return 0;
    if (!strcmp(name, "side")) to->sides.side = !strcmp(text, sides[1]);
    else if (!strcmp(name, "bass")) snprintf(to->bass, sizeof to->bass, "%s", text);
    else return 0;
    return 1;
}

/* Takes the bytes of a response or an instrument; returns the fault. */
static const char *take_file(reading *r, const char *section, char *value) {
    char *text = lb_unquoted(value);
    const int64_t count = text ? take_bytes(text) : -1;
    lb_kept *to = r->to;
    if (count < 0) return "is damaged";
    if (!strcmp(section, "response")) {
        if (to->response) return "is damaged";
        void *whole = malloc((size_t)count + 8); /* aligned */
        if (!whole) return "has no memory";
        memcpy(whole, text, (size_t)count);
        const char *why = lb_parse_response(whole, (size_t)count, r->i->kernels, &to->response);
        free(whole);
        return why;
    }
    free(to->instrument);
    if (!(to->instrument = malloc((size_t)count + 1))) return "has no memory";
    memcpy(to->instrument, text, (size_t)count);
    to->instrument_bytes = (size_t)count;
    return 0;
}

/* Takes a line of a section; returns the fault. */
static const char *take_line(reading *r, const char *section, const char *name, char *value) {
    const int side = !strcmp(section, "B");
    int known = 0;
    if (!strcmp(name, "file") && (!strcmp(section, "response") || !strcmp(section, "instrument"))) return take_file(r, section, value);
    if (!*section) known = take_head(r, name, value);
    else if (side || !strcmp(section, "A")) known = take_value(r, side, 1, name, value);
    else if (!strcmp(section, "processor")) known = take_value(r, 0, 0, name, value);
    else if (!strcmp(section, "controllers")) known = take_controller(r, name, value);
    if (!known) keep(r, section, name, value);
    return 0;
}

/* What follows `words` in a text; 0: it does not begin with them. */
static const char *after(const char *text, const char *words) {
    const size_t length = strlen(words);
    return text && !strncmp(text, words, length) ? text + length : 0;
}

/* Checks what stands around the words: whose state it is, its format and its checksum; returns the fault, perhaps in
   `why`. */
static const char *check(const char *text, size_t count, char why[NAMED]) {
    if (after(text, OLD)) return "was made by a livebass before 0.1.0, whose states no later one reads";
    const char *format = after(text, LB_STATE_TITLE "format = ");
    if (!format || count < strlen(LB_STATE_TITLE) + SUM_BYTES) return "is not one of this plugin";
    char *end;
    const long number = strtol(format, &end, 10);
    const char *made = after(end, "\nmade = \"");
    if (number > LB_STATE_FORMAT && made) {
        const int length = (int)strcspn(made, "\"\n");
        snprintf(why, NAMED, "was made by livebass %.*s; this one, " LB_RELEASE ", cannot read it", length < 32 ? length : 32, made);
        return why;
    }
    const char *last = text + count - (SUM_BYTES - 1), *sum = after(last, SUM);
    if (number != LB_STATE_FORMAT || text[count - 1] != '\n' || !sum) return "is damaged";
    return strtoull(sum, &end, 16) != sum_of(text, (size_t)(last - text)) ? "is damaged" : 0;
}

/* Says what of a state was not taken as it is. */
static void say(const lb_instance *i, const reading *r) {
    if (*r->strange) lb_log(i, "the session's state: kept, but unknown to livebass " LB_RELEASE ": %s", r->strange);
    if (*r->held) lb_log(i, "the session's state: held within the limits: %s", r->held);
}

/* Reads a state's words, `text` with a final zero, which it changes; returns the fault. */
static const char *parse(const lb_instance *i, char *text, lb_kept *to) {
    const char *section = "", *why = 0;
    reading *r = calloc(1, sizeof *r);
    if (!r) return "has no memory";
    r->i = i;
    r->to = to;
    for (int side = 0; side < 2; side++)
        for (int k = 0; k < LB_PARAMETERS; k++) r->of[side][k] = lb_parameters[k].default_value;
    for (char *line = text, *next; line && !why; line = next) {
        if ((next = strchr(line, '\n'))) *next++ = 0;
        line = lb_trimmed(line);
        char *value = strchr(line, '='), *end = strchr(line, ']');
        if (!*line || !strncmp(line, SUM, strlen(SUM))) continue;
        if (*line == '[' && end) {
            *end = 0;
            section = line + 1;
        } else if (!value) why = "is damaged";
        else {
            *value++ = 0;
            why = take_line(r, section, lb_trimmed(line), lb_trimmed(value));
        }
    }
    const int side = to->sides.side != 0;
    for (int k = 0; k < LB_PARAMETERS; k++) {
        to->values[k] = r->of[lb_is_of_sides(k) ? side : 0][k];
        to->sides.aside[k] = r->of[lb_is_of_sides(k) ? !side : 0][k];
    }
    if (!why && !*to->bass) why = "is damaged";
    if (!why) say(i, r);
    free(r);
    return why;
}

int lb_load_state(lb_instance *i, const void *bytes, size_t count) {
    char fault[NAMED];
    lb_kept kept = {0};
    char *text = malloc(count + 1);
    const char *why = text ? 0 : "has no memory";
    if (text) {
        memcpy(text, bytes, count);
        text[count] = 0;
        why = check(text, count, fault);
        if (!why) why = strlen(text) == count ? parse(i, text, &kept) : "is damaged";
    }
    free(text);
    if (!why) {
        lb_take_kept(i, &kept);
        return 1;
    }
    lb_free_response(kept.response);
    free(kept.instrument);
    free(kept.unknown);
    lb_log(i, "the session's state %s", why);
    return 0;
}
