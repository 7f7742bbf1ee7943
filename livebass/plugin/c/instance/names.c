/* Reads names of tracks, and finds words in them. */
#include "instance/names.h"
#include "kernels.h"

#include <string.h>

/* --- letters --- */

/* Decodes a letter in UTF-8 from `at` on; returns its number of bytes, 0: it is not one. */
static size_t decode(const uint8_t *at, size_t left, int32_t *to) {
    const size_t bytes = *at < 0x80 ? 1 : *at >= 0xF0 ? 4 : *at >= 0xE0 ? 3 : 2;
    static const int32_t minimum[] = {0, 0, 0x80, 0x800, 0x10000};
    if (bytes > left || (*at >= 0x80 && *at < 0xC2) || *at > 0xF4) return 0;
    int32_t letter = bytes == 1 ? *at : *at & (0x7F >> bytes);
    for (size_t k = 1; k < bytes; k++) {
        if ((at[k] & 0xC0) != 0x80) return 0;
        letter = letter << 6 | (at[k] & 0x3F);
    }
    *to = letter;
    return letter < minimum[bytes] || letter > 0x10FFFF || (letter >= 0xD800 && letter < 0xE000) ? 0 : bytes;
}

static int is_utf8(const uint8_t *bytes, size_t count) {
    int32_t letter;
    size_t at = 0, step = 1;
    while (at < count && (step = decode(bytes + at, count - at, &letter))) at += step;
    return step != 0;
}

static int is_printed(int32_t c) {
    static const int32_t not[][2] = {{0, 0x1F}, {0x7F, 0xA0}, {0xAD, 0xAD}, {0x2000, 0x200F}, {0x2028, 0x202F},
                                     {0x205F, 0x206F}, {0x3000, 0x3000}, {0xE000, 0xF8FF}, {0xFEFF, 0xFEFF},
                                     {0xFFF0, 0xFFFB}};
    for (size_t k = 0; k < sizeof not / sizeof *not; k++)
        if (c >= not[k][0] && c <= not[k][1]) return 0;
    return 1;
}

void lb_read_name(lb_name *to, const uint8_t *bytes, size_t count) {
    const int utf8 = is_utf8(bytes, count);
    int32_t letter = 0;
    int kept = 0, all = 0; /* up to the last letter that is no space */
    to->count = 0;
    for (size_t at = 0; at < count;) {
        if (utf8) at += decode(bytes + at, count - at, &letter);
        else letter = bytes[at++];
        if (!is_printed(letter)) letter = ' ';
        if (letter == ' ' && !all) continue;
        if (all++ < LB_NAME) to->letters[all - 1] = letter;
        if (letter != ' ') kept = all;
    }
    to->count = kept < LB_NAME ? kept : LB_NAME;
    for (int k = LB_NAME - 3; kept > LB_NAME && k < LB_NAME; k++) to->letters[k] = '.';
}

void lb_write_name(const lb_name *name, char text[LB_NAME_BYTES]) {
    static const uint8_t heads[] = {0, 0xC0, 0xE0, 0xF0};
    for (int k = 0; k < name->count; k++) {
        const int32_t c = name->letters[k];
        const int more = c < 0x80 ? 0 : c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
        *text++ = (char)(heads[more] | c >> 6 * more);
        for (int j = more - 1; j >= 0; j--) *text++ = (char)(0x80 | (c >> 6 * j & 0x3F));
    }
    *text = 0;
}

/* The small letter of a large one; wide letters become those of ASCII. */
static int32_t small(int32_t c) {
    if (c >= 0xFF01 && c <= 0xFF5E) c -= 0xFEE0;
    const int large = (c >= 'A' && c <= 'Z') || (c >= 0xC0 && c <= 0xDE && c != 0xD7) || (c >= 0x391 && c <= 0x3A9) ||
                      (c >= 0x410 && c <= 0x42F);
    if (large) return c + 32;
    if (c >= 0x400 && c <= 0x40F) return c + 80;
    return c == 0x130 || c == 0x131 ? 'i' : c == 0x122 ? 0x123 : c == 0x386 ? 0x3AC : c;
}

/* --- the machine --- */

static int is_in(const int32_t *ranges, int32_t letter) {
    for (int32_t k = 0; k < ranges[0]; k++)
        if (letter >= ranges[1 + 2 * k] && letter <= ranges[2 + 2 * k]) return 1;
    return 0;
}

/* The step behind one with ranges. */
static const int32_t *behind(const int32_t *step) { return step + 2 + (ptrdiff_t)2 * step[1]; }

/* True if the program finds its words in a name from `at` on. */
static int finds(const int32_t *step, const lb_name *name, int at) {
    const int32_t letter = at < name->count ? name->letters[at] : -1;
    for (;; step += step[1]) switch (step[0]) {
        case LB_STEP_CHARACTER: return letter == step[1] && finds(step + 2, name, at + 1);
        case LB_STEP_RANGES: return letter >= 0 && is_in(step + 1, letter) && finds(behind(step), name, at + 1);
        case LB_STEP_EITHER: if (finds(step + 2, name, at)) return 1; break;
        case LB_STEP_JUMP: break;
        case LB_STEP_NOT_AHEAD: if (finds(step + 2, name, at)) return 0; break;
        case LB_STEP_NOT_BEHIND:
            return !(at && is_in(step + 1, name->letters[at - 1])) && finds(behind(step), name, at);
        case LB_STEP_END: return letter < 0 && finds(step + 1, name, at);
        default: return 1;
        }
}

int lb_name_has(const lb_name *name, const int32_t *program) {
    lb_name folded = {.count = name->count};
    for (int k = 0; k < name->count; k++) folded.letters[k] = small(name->letters[k]);
    for (int at = 0; at <= folded.count; at++)
        if (finds(program, &folded, at)) return 1;
    return 0;
}

int lb_name_is(const lb_name *name, const int32_t *program) { return finds(program, name, 0); }
