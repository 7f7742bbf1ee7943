/* A sound as text: a preset with `like` and sliders, as plugins and the page save it, or a page's link. */
#include "instance/text.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_DIGITS = 17 }; /* that distinguish all doubles */

/* Writes the fault into `to`; returns it. */
__attribute__((format(printf, 2, 3))) static const char *wrong(lb_kept *to, const char *form, ...) {
    va_list more;
    va_start(more, form);
    vsnprintf(to->why, sizeof to->why, form, more);
    va_end(more);
    return to->why;
}

static int is_digit(char c) { return c >= '0' && c <= '9'; }

/* Replaces the decimal point `from` by `to`: files and the host's language may differ. */
static void swap_point(char *text, char from, char to) {
    char *at = strchr(text, from);
    if (at) *at = to;
}

static char host_point(void) {
    char half[8];
    snprintf(half, sizeof half, "%.1f", 0.5);
    return half[1];
}

int lb_read_number(const char *text, double *to) {
    char copy[LB_NUMERAL], *end;
    *to = 0;
    if (strlen(text) >= sizeof copy || text[strspn(text, "+-.0123456789eE")] || !text[strcspn(text, "0123456789")]) return 0;
    strcpy(copy, text);
    swap_point(copy, '.', host_point());
    *to = strtod(copy, &end);
    return end != copy && !*end;
}

void lb_write_number(char to[LB_NUMERAL], double value) {
    double read;
    for (int digits = 1; digits <= MAX_DIGITS; digits++) {
        snprintf(to, LB_NUMERAL, "%.*g", digits, value);
        swap_point(to, host_point(), '.');
        if (!strchr(to, 'e') && lb_read_number(to, &read) && read == value) return;
    }
}

/* Takes a parameter's value; returns its fault. */
static const char *take_value(lb_kept *to, const char *symbol, const char *text) {
    const int k = lb_parameter_called(symbol);
    if (k < 0 || !lb_is_of_sides(k)) return wrong(to, "changes what a bass does not have: %.40s", symbol);
    const lb_parameter *p = &lb_parameters[k];
    if (!lb_read_number(text, &to->values[k]) || !(to->values[k] >= p->minimum && to->values[k] <= p->maximum)) {
        char minimum[LB_NUMERAL], maximum[LB_NUMERAL];
        lb_write_number(minimum, p->minimum);
        lb_write_number(maximum, p->maximum);
        const char *space = *p->unit ? " " : "";
        return wrong(to, "says %s = %.20s: it must be from %s to %s%s%s", symbol, text, minimum, maximum, space, p->unit);
    }
    return 0;
}

/* Takes the bass's name, which may be a preset's path. */
static const char *take_bass(lb_kept *to, const char *name) {
    name = lb_file_name(name);
    snprintf(to->bass, sizeof to->bass, "%s", name);
    char *ending = strstr(to->bass, ".toml");
    if (ending) *ending = 0;
    return *to->bass && strlen(name) < sizeof to->bass ? 0 : wrong(to, "does not say which bass it is like");
}

/* The fault of a text whose format is a later one. */
static const char *later(lb_kept *to, const char *format) {
    double number;
    if (lb_read_number(format, &number) && number == LB_TEXT_FORMAT) return 0;
    return wrong(to, "was made for a later livebass: this one, " LB_RELEASE ", reads format %d", LB_TEXT_FORMAT);
}

/* --- links --- */

static int hex(char c) { return is_digit(c) ? c - '0' : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1; }

void lb_decode(char *text, int plus) {
    char *to = text;
    for (; *text; text++) {
        if (*text == '%' && hex(text[1]) >= 0 && hex(text[2]) >= 0) {
            *to++ = (char)(16 * hex(text[1]) + hex(text[2]));
            text += 2;
        } else *to++ = plus && *text == '+' ? ' ' : *text;
    }
    *to = 0;
}

/* What a link says to pages alone. */
static int is_of_page(const char *name) {
    static const char *const names[] = {"riff", "stroke", "moment", "made", "revision"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (!strcmp(name, names[k])) return 1;
    return 0;
}

static const char *read_link(char *text, lb_kept *to) {
    const char *why = 0;
    char *hash = strrchr(text, '#');
    for (char *pair = hash ? hash + 1 : text, *next; pair && !why; pair = next) {
        if ((next = strchr(pair, '&'))) *next++ = 0;
        char *value = strchr(pair, '=');
        if (!value) return wrong(to, "is not a link of livebass, nor a sound");
        *value++ = 0;
        lb_decode(value, 1);
        if (is_of_page(pair)) continue;
        if (!strcmp(pair, "format")) {
            if ((why = later(to, value))) return why;
            continue;
        }
        if (*to->bass) why = take_value(to, pair, value);
        else if (!strcmp(pair, "like")) why = take_bass(to, value);
        else why = wrong(to, "does not say which bass it is like");
    }
    return why;
}

/* --- presets --- */

char *lb_trimmed(char *line) {
    int quoted = 0;
    char *end = line;
    while (*end && (quoted || *end != '#')) quoted ^= *end++ == '"';
    while (end > line && strchr(" \t\r", end[-1])) end--;
    *end = 0;
    return line + strspn(line, " \t");
}

char *lb_unquoted(char *value) {
    const size_t length = strlen(value);
    if (length < 2 || *value != '"' || value[length - 1] != '"') return 0;
    value[length - 1] = 0;
    return value + 1;
}

/* Takes the file of a response, which is made as loud as the bass without it. */
static const char *take_effect(lb_kept *to, const char *key, char *value) {
    const char *text = lb_unquoted(value);
    if (text && !strcmp(key, "response") && strlen(text) < sizeof to->response_path) strcpy(to->response_path, text);
    else if (!text || strcmp(key, "response_level") || strcmp(text, "normalized"))
        return wrong(to, "says more than sliders: export it as an instrument: %.40s", key);
    return 0;
}

static const char *read_preset(char *text, lb_kept *to) {
    enum { HEAD, SLIDERS, EFFECTS } section = HEAD;
    const char *why = 0;
    for (char *line = text, *next; line && !why; line = next) {
        if ((next = strchr(line, '\n'))) *next++ = 0;
        line = lb_trimmed(line);
        char *value = strchr(line, '=');
        if (!*line) continue;
        if (!strcmp(line, "[bench]") || !strcmp(line, "[plugin]")) section = SLIDERS;
        else if (!strcmp(line, "[effects]")) section = EFFECTS;
        else if (*line == '[' || !value) return wrong(to, "says more than sliders: export it as an instrument: %.40s", line);
        else {
            *value++ = 0;
            const char *key = lb_trimmed(line);
            value = lb_trimmed(value);
            if (section == HEAD && !strcmp(key, "format")) why = later(to, value);
            else if (section == SLIDERS) why = take_value(to, key, value);
            else if (section == EFFECTS) why = take_effect(to, key, value);
            else if (!strcmp(key, "name") || !strcmp(key, "description")) continue;
            else if (strcmp(key, "like")) why = wrong(to, "says more than sliders: export it as an instrument: %.40s", key);
            else why = take_bass(to, (value = lb_unquoted(value)) ? value : "");
        }
    }
    return why ? why : *to->bass ? 0 : take_bass(to, "");
}

const char *lb_parse_text(const char *text, lb_kept *to) {
    char copy[LB_MAX_TEXT];
    memset(to, 0, sizeof *to);
    for (int k = 0; k < LB_PARAMETERS; k++) to->values[k] = to->sides.aside[k] = lb_parameters[k].default_value;
    if (strlen(text) >= sizeof copy) return wrong(to, "is longer than a sound or a link");
    strcpy(copy, text + strspn(text, " \t\r\n"));
    if (!*copy) return wrong(to, "is empty");
    if (strchr(copy, '"')) return read_preset(copy, to);
    copy[strcspn(copy, " \t\r\n")] = 0;
    return read_link(copy, to);
}

size_t lb_append(char *text, size_t room, size_t end, const char *form, ...) {
    va_list more;
    va_start(more, form);
    const int count = vsnprintf(text + end, room - end, form, more);
    va_end(more);
    return end + (size_t)count < room ? end + (size_t)count : room - 1;
}

/* Adds the changed parameters, either sliders or all others, as a section. */
static size_t add_section(char *text, size_t end, const char *name, const double *values, int sliders) {
    char number[LB_NUMERAL];
    for (int k = 0, first = 1; k < LB_PARAMETERS; k++) {
        const lb_parameter *p = &lb_parameters[k];
        if (!lb_is_of_sides(k) || lb_is_slider(k) != sliders || values[k] == p->default_value) continue;
        if (first) end = lb_append(text, LB_MAX_TEXT, end, "\n[%s]\n", name);
        first = 0;
        lb_write_number(number, values[k]);
        end = lb_append(text, LB_MAX_TEXT, end, "%s = %s\n", p->symbol, number);
    }
    return end;
}

size_t lb_write_text(const char *bass, const double values[LB_PARAMETERS], const char *response,
                     char text[LB_MAX_TEXT]) {
    static const char *const head = "# Play it with `livebass play -p`, or open it in a plugin or on the page.\n";
    size_t end = lb_append(text, LB_MAX_TEXT, 0, "%slike = \"%s\"\n", head, bass);
    if (*response) end = lb_append(text, LB_MAX_TEXT, end, "\n[effects]\nresponse = \"%s\"\nresponse_level = \"normalized\"\n", response);
    end = add_section(text, end, "bench", values, 1);
    return add_section(text, end, "plugin", values, 0);
}
