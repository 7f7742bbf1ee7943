/* An instance's kept values: A and B, Undo, and the state of sessions. */
#include "instance.h"
#include "lock.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MAGIC "LBSTATE\n"
enum { PLAIN = 1, WITH_LEARNED, WITH_SIDES, LINE = 1600 }; /* versions: each only if the one before lacks room */

/* --- A and B, undo: the lock keeps the two sides together --- */

int lb_is_of_sides(int parameter) {
    return parameter != LB_BASS && strcmp(lb_parameters[parameter].group, "Processor") != 0;
}

void lb_begin_sides(lb_instance *i) {
    i->sides.side = 0;
    for (int k = 0; k < LB_PARAMETERS; k++) i->sides.aside[k] = lb_parameters[k].usual;
}

void lb_swap_sides(lb_instance *i) {
    LB_ALONE(i->window.owner);
    enter();
    for (int k = 0; k < LB_PARAMETERS; k++) {
        if (!lb_is_of_sides(k)) continue;
        const double other = i->sides.aside[k];
        i->sides.aside[k] = lb_value(i, k);
        lb_set_value(i, k, other);
    }
    __atomic_store_n(&i->sides.side, !i->sides.side, __ATOMIC_RELAXED);
    leave();
}

int lb_side(const lb_instance *i) { return (int)__atomic_load_n(&i->sides.side, __ATOMIC_RELAXED); }

void lb_read_sides(lb_instance *i, lb_sides *to) {
    enter();
    *to = i->sides;
    leave();
}

void lb_write_sides(lb_instance *i, const lb_sides *from) {
    enter();
    for (int k = 0; k < LB_PARAMETERS; k++)
        if (lb_is_of_sides(k)) i->sides.aside[k] = lb_allowed(i, k, from->aside[k]);
    __atomic_store_n(&i->sides.side, from->side != 0, __ATOMIC_RELAXED);
    leave();
}

void lb_keep_values(lb_instance *i) {
    LB_ALONE(i->window.owner);
    i->window.undone = (i->window.undone + 1) % LB_UNDONE;
    if (i->window.undoable < LB_UNDONE) i->window.undoable++;
    enter();
    for (int k = 0; k < LB_PARAMETERS; k++) i->window.before[i->window.undone][k] = lb_value(i, k);
    char *missing = i->window.missing_before[i->window.undone];
    memset(missing, 0, LB_STATE_NAME);
    if (__atomic_load_n(&i->missing, __ATOMIC_RELAXED)) memcpy(missing, i->missing_name, LB_STATE_NAME);
    leave();
}

/* Notes the name of a missing bass; "": none is missing. */
static void note_missing(lb_instance *i, const char name[LB_STATE_NAME]) {
    enter();
    if (name[0]) memcpy(i->missing_name, name, LB_STATE_NAME);
    __atomic_store_n(&i->missing, name[0] != 0, __ATOMIC_RELAXED);
    leave();
}

void lb_set_values(lb_instance *i, const double values[LB_PARAMETERS], int all) {
    enter();
    lb_set_value(i, LB_BASS, values[LB_BASS]); /* quality may follow; `all` sets it too */
    for (int k = 0; k < LB_PARAMETERS; k++)
        if (k != LB_BASS && (all || lb_is_of_sides(k))) lb_set_value(i, k, values[k]);
    leave();
}

void lb_undo(lb_instance *i) {
    LB_ALONE(i->window.owner);
    if (!i->window.undoable) return;
    lb_set_values(i, i->window.before[i->window.undone], 1);
    note_missing(i, i->window.missing_before[i->window.undone]);
    i->window.undone = (i->window.undone + LB_UNDONE - 1) % LB_UNDONE;
    i->window.undoable--;
}

/* --- states --- */

/* The checksum of the first bytes of a state, a multiple of 8. */
static uint64_t checksum(const lb_kernels *kernels, const void *bytes, size_t count) {
    return kernels->checksum((int64_t)(intptr_t)bytes, (int64_t)(count / 8));
}

/* The bytes in a state of a version with this many parameters, with the checksum. */
static size_t size_of(int64_t version, size_t parameters) {
    const size_t learned = version >= WITH_LEARNED ? LB_CONTROLLERS : 0;
    const size_t sides = version >= WITH_SIDES ? 8 * (parameters + 1) : 0;
    return offsetof(lb_state, values) + 8 * parameters + learned + sides + sizeof(uint64_t);
}

static size_t seal(const lb_instance *i, lb_state *s) {
    const size_t count = size_of(s->version, LB_PARAMETERS) - sizeof(uint64_t);
    const uint64_t sum = checksum(i->kernels, s, count);
    memcpy((char *)s + count, &sum, sizeof sum);
    return count + sizeof sum;
}

/* The chosen bass's name. */
static const char *name_of(const lb_instance *i, double bass) {
    return lb_shelf_name(i->shelf, bass < lb_shelf_count(i->shelf) ? (int)bass : 0);
}

/* True if A and B have anything to keep. [under the lock] */
static int has_sides(const lb_instance *i) {
    int k = 0;
    while (k < LB_PARAMETERS && i->sides.aside[k] == lb_parameters[k].usual) k++;
    return i->sides.side || k < LB_PARAMETERS;
}

size_t lb_save_state(lb_instance *i, lb_state *s) {
    memset(s, 0, sizeof *s);
    memcpy(s->magic, MAGIC, sizeof s->magic);
    s->version = PLAIN;
    s->count = LB_PARAMETERS;
    __atomic_load(&i->seed, &s->seed, __ATOMIC_RELAXED);
    if (lb_write_learned(i, s->rest)) s->version = WITH_LEARNED;
    enter();
    for (int k = 0; k < LB_PARAMETERS; k++) s->values[k] = lb_value(i, k);
    if (has_sides(i)) s->version = WITH_SIDES;
    memcpy(s->rest + LB_CONTROLLERS, &i->sides, sizeof i->sides);
    const int missing = __atomic_load_n(&i->missing, __ATOMIC_RELAXED);
    snprintf(s->bass, sizeof s->bass, "%s", missing ? i->missing_name : name_of(i, s->values[LB_BASS]));
    leave();
    return seal(i, s);
}

/* Reads the values of a state's `count` parameters; returns 0 if one is not a number. */
static int read_values(double to[LB_PARAMETERS], const uint8_t *from, int64_t count) {
    int good = 1;
    for (int k = 0; k < LB_PARAMETERS; k++) {
        to[k] = lb_parameters[k].usual;
        if (k < count) memcpy(&to[k], from + 8 * (size_t)k, sizeof to[k]);
        good = good && isfinite(to[k]);
    }
    return good;
}

const char *lb_parse_state(const lb_kernels *kernels, const void *bytes, size_t count, const char *magic, lb_kept *to) {
    const lb_state *s = bytes;
    const uint8_t *at = (const uint8_t *)s->values;
    static const char *const damaged = "is damaged";
    uint64_t sum;
    if (count < offsetof(lb_state, values) || memcmp(s->magic, magic, sizeof s->magic)) return "is not one of this plugin";
    if (s->version < PLAIN || s->version > WITH_SIDES) return "was written by another version of the plugin";
    if (s->count < 1 || s->count > 1000 || count != size_of(s->version, (size_t)s->count)) return damaged;
    memcpy(&sum, (const char *)bytes + count - sizeof sum, sizeof sum);
    if (sum != checksum(kernels, bytes, count - sizeof sum) || !memchr(s->bass, 0, sizeof s->bass)) return damaged;
    memset(to, 0, sizeof *to);
    memcpy(to->bass, s->bass, sizeof to->bass);
    to->seed = s->seed;
    if (!read_values(to->values, at, s->count)) return damaged;
    at += 8 * (size_t)s->count;
    if (s->version >= WITH_LEARNED) memcpy(to->learned, at, LB_CONTROLLERS);
    at += LB_CONTROLLERS;
    if (s->version >= WITH_SIDES) memcpy(&to->sides.side, at, sizeof to->sides.side);
    const int good = read_values(to->sides.aside, at + 8, s->version >= WITH_SIDES ? s->count : 0);
    return good && (to->sides.side == 0 || to->sides.side == 1) ? 0 : damaged;
}

void lb_take_kept(lb_instance *i, lb_kept *kept) {
    char line[LINE];
    const int number = lb_shelf_find(i->shelf, kept->bass), missing = number < 0;
    if (missing && !(i->missing && !strcmp(i->missing_name, kept->bass))) { /* hosts may load a state several times */
        snprintf(line, sizeof line, LB_NOT_INSTALLED, kept->bass);
        i->complain(i->owner, line);
    }
    __atomic_store_n(&i->seed, kept->seed, __ATOMIC_RELAXED);
    kept->values[LB_BASS] = missing ? lb_value(i, LB_BASS) : number;
    lb_set_values(i, kept->values, 1);
    lb_write_sides(i, &kept->sides);
    lb_read_learned(i, kept->learned);
    note_missing(i, missing ? kept->bass : "");
}

int lb_load_state(lb_instance *i, const void *bytes, size_t count) {
    char line[LINE];
    lb_kept kept;
    const char *why = lb_parse_state(i->kernels, bytes, count, MAGIC, &kept);
    if (why) {
        snprintf(line, sizeof line, "the session's state %s", why);
        i->complain(i->owner, line);
    } else lb_take_kept(i, &kept);
    return !why;
}
