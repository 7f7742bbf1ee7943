/* A sound as text: a preset that says `like` and sliders, as plugins and the page save it, and the link of a page. */
#include "text.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { DIGITS = 15, NAME_ROOM = 40 };
#define NANO 1e9 /* numbers are written with nine digits behind the point */

/* Says what is wrong; returns it. */
static const char *wrong(lb_kept *to, const char *form, ...) {
    va_list more;
    va_start(more, form);
    vsnprintf(to->why, sizeof to->why, form, more);
    va_end(more);
    return to->why;
}

static int is_digit(char c) { return c >= '0' && c <= '9'; }

/* Reads a whole text as a decimal number, whatever the language of the host; returns 0 if it is none. */
static int read_number(const char *text, double *to) {
    double number = 0, scale = 1;
    int digits = 0, point = 0;
    const int minus = *text == '-';
    for (text += minus || *text == '+'; is_digit(*text) || (*text == '.' && !point); text++) {
        if (*text == '.') point = 1;
        else {
            number = 10 * number + (*text - '0');
            if (point) scale *= 10;
            digits++;
        }
    }
    *to = (minus ? -number : number) / scale;
    return !*text && digits > 0 && digits <= DIGITS;
}

static void add_number(char *to, size_t room, double value) {
    const long long whole = llrint(fabs(value) * NANO), unit = (long long)NANO;
    int end = snprintf(to, room, "%s%lld.%09lld", value < 0 && whole ? "-" : "", whole / unit, whole % unit);
    while (to[end - 1] == '0') to[--end] = 0;
    if (to[end - 1] == '.') to[end - 1] = 0;
}

/* Takes the value of a parameter; returns what is wrong with it. */
static const char *take_value(lb_kept *to, const char *symbol, const char *text) {
    int k = 0;
    while (k < LB_PARAMETERS && !(lb_is_of_sides(k) && !strcmp(lb_parameters[k].symbol, symbol))) k++;
    if (k == LB_PARAMETERS) return wrong(to, "changes what a bass does not have: %.40s", symbol);
    const lb_parameter *p = &lb_parameters[k];
    if (!read_number(text, &to->values[k]) || to->values[k] < p->least || to->values[k] > p->most) {
        char least[NAME_ROOM], most[NAME_ROOM];
        add_number(least, sizeof least, p->least);
        add_number(most, sizeof most, p->most);
        const char *space = *p->unit ? " " : "";
        return wrong(to, "says %s = %.20s: it must be from %s to %s%s%s", symbol, text, least, most, space, p->unit);
    }
    return 0;
}

/* Takes the name of the bass, which may be the path of a preset. */
static const char *take_bass(lb_kept *to, const char *name) {
    name = lb_file_name(name);
    snprintf(to->bass, sizeof to->bass, "%s", name);
    char *ending = strstr(to->bass, ".toml");
    if (ending) *ending = 0;
    return *to->bass && strlen(name) < sizeof to->bass ? 0 : wrong(to, "does not say which bass it is like");
}

/* --- links --- */

static int hex(char c) { return is_digit(c) ? c - '0' : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1; }

/* Decodes what an address encodes, in place. */
static void decode(char *text) {
    char *to = text;
    for (; *text; text++) {
        if (*text == '%' && hex(text[1]) >= 0 && hex(text[2]) >= 0) {
            *to++ = (char)(16 * hex(text[1]) + hex(text[2]));
            text += 2;
        } else *to++ = *text == '+' ? ' ' : *text;
    }
    *to = 0;
}

static const char *read_link(char *text, lb_kept *to) {
    const char *why = 0;
    char *hash = strrchr(text, '#');
    for (char *pair = hash ? hash + 1 : text, *next; pair && !why; pair = next) {
        if ((next = strchr(pair, '&'))) *next++ = 0;
        char *value = strchr(pair, '=');
        if (!value) return wrong(to, "is not a link of livebass, nor a sound");
        *value++ = 0;
        decode(value);
        if (*to->bass) why = take_value(to, pair, value);
        else if (!strcmp(pair, "bass") && next)
            why = wrong(to, "is of an earlier version, whose sliders counted otherwise: set them again");
        else if (!strcmp(pair, "like") || !strcmp(pair, "bass")) why = take_bass(to, value);
        else why = wrong(to, "does not say which bass it is like");
    }
    return why;
}

/* --- presets --- */

/* Cuts white space and what is behind a `#` outside of quotes off a line; returns where it begins. */
static char *trimmed(char *line) {
    int quoted = 0;
    char *end = line;
    while (*end && (quoted || *end != '#')) quoted ^= *end++ == '"';
    while (end > line && strchr(" \t\r", end[-1])) end--;
    *end = 0;
    return line + strspn(line, " \t");
}

static const char *read_preset(char *text, lb_kept *to) {
    const char *why = 0;
    int sliders = 0; /* the section has values */
    for (char *line = text, *next; line && !why; line = next) {
        if ((next = strchr(line, '\n'))) *next++ = 0;
        line = trimmed(line);
        char *value = strchr(line, '=');
        if (!*line) continue;
        if (!strcmp(line, "[bench]") || !strcmp(line, "[plugin]")) sliders = 1;
        else if (*line == '[' || !value) return wrong(to, "says more than sliders: export it as an instrument: %.40s", line);
        else {
            *value++ = 0;
            const char *key = trimmed(line);
            value = trimmed(value);
            const size_t length = strlen(value);
            if (sliders) why = take_value(to, key, value);
            else if (strcmp(key, "like")) why = wrong(to, "says more than sliders: export it as an instrument: %.40s", key);
            else if (length < 2 || *value != '"' || value[length - 1] != '"') why = take_bass(to, "");
            else {
                value[length - 1] = 0;
                why = take_bass(to, value + 1);
            }
        }
    }
    return why ? why : *to->bass ? 0 : take_bass(to, "");
}

const char *lb_parse_text(const char *text, lb_kept *to) {
    char copy[LB_MOST_TEXT];
    memset(to, 0, sizeof *to);
    for (int k = 0; k < LB_PARAMETERS; k++) to->values[k] = to->sides.aside[k] = lb_parameters[k].usual;
    text += strspn(text, " \t\r\n");
    if (!*text) return wrong(to, "is empty");
    if (snprintf(copy, sizeof copy, "%s", text) >= (int)sizeof copy) return wrong(to, "is longer than a sound or a link");
    if (strchr(copy, '"')) return read_preset(copy, to);
    copy[strcspn(copy, " \t\r\n")] = 0;
    return read_link(copy, to);
}

static size_t add(char *text, size_t end, const char *form, ...) {
    va_list more;
    va_start(more, form);
    const int count = vsnprintf(text + end, LB_MOST_TEXT - end, form, more);
    va_end(more);
    return end + (size_t)count < LB_MOST_TEXT ? end + (size_t)count : LB_MOST_TEXT - 1;
}

/* Adds the parameters that are moved, of the sliders or of all others, as a section. */
static size_t add_section(char *text, size_t end, const char *name, const double *values, int sliders) {
    char number[NAME_ROOM];
    for (int k = 0, first = 1; k < LB_PARAMETERS; k++) {
        const lb_parameter *p = &lb_parameters[k];
        if (!lb_is_of_sides(k) || lb_is_slider(k) != sliders || values[k] == p->usual) continue;
        if (first) end = add(text, end, "\n[%s]\n", name);
        first = 0;
        add_number(number, sizeof number, values[k]);
        end = add(text, end, "%s = %s\n", p->symbol, number);
    }
    return end;
}

size_t lb_write_text(const char *bass, const double values[LB_PARAMETERS], char text[LB_MOST_TEXT]) {
    size_t end = add(text, 0, "# Play it with `livebass play -p`, or open it in a plugin or on the page.\nlike = \"%s\"\n", bass);
    end = add_section(text, end, "bench", values, 1);
    return add_section(text, end, "plugin", values, 0);
}
