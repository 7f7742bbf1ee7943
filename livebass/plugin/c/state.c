/* An instance's kept values: A and B, Undo, and the state of sessions. */
#include "instance.h"
#include "lock.h"
#include "response.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC "LBSTATE\n"
enum { VERSION = 4, LINE = 1600 };

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
    lb_keep_values(i);
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

void lb_copy_side(lb_instance *i) {
    LB_ALONE(i->window.owner);
    lb_keep_values(i);
    enter();
    for (int k = 0; k < LB_PARAMETERS; k++)
        if (lb_is_of_sides(k)) i->sides.aside[k] = lb_value(i, k);
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

static void note_present(lb_instance *i, lb_before *to) {
    enter();
    for (int k = 0; k < LB_PARAMETERS; k++) to->values[k] = lb_value(i, k);
    to->sides = i->sides;
    memset(to->missing, 0, LB_STATE_NAME);
    if (__atomic_load_n(&i->missing, __ATOMIC_RELAXED)) memcpy(to->missing, i->missing_name, LB_STATE_NAME);
    leave();
}

void lb_keep_values(lb_instance *i) {
    LB_ALONE(i->window.owner);
    i->window.undone = (i->window.undone + 1) % LB_UNDONE;
    if (i->window.undoable < LB_UNDONE) i->window.undoable++;
    lb_before *b = &i->window.before[i->window.undone];
    lb_free_response(b->response);
    *b = (lb_before){0};
    note_present(i, b);
}

void lb_keep_all(lb_instance *i) {
    lb_keep_values(i);
    lb_before *b = &i->window.before[i->window.undone];
    b->responded = 1;
    b->response = lb_use_response(i);
}

void lb_forget_kept(lb_instance *i) {
    i->window.undoable = 0;
    for (int k = 0; k < LB_UNDONE; k++) {
        lb_free_response(i->window.before[k].response);
        i->window.before[k].response = 0;
    }
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
    lb_before now;
    note_present(i, &now);
    for (int changed = 0; i->window.undoable && !changed; i->window.undoable--) {
        lb_before *b = &i->window.before[i->window.undone];
        lb_response *r = lb_use_response(i);
        const int responds = b->responded && !lb_same_response(r, b->response);
        lb_free_response(r);
        changed = responds || memcmp((const void *)b, (const void *)&now, offsetof(lb_before, responded)) != 0;
        lb_set_values(i, b->values, 1);
        lb_write_sides(i, &b->sides);
        note_missing(i, b->missing);
        if (responds) lb_set_response(i, b->response);
        else lb_free_response(b->response);
        b->response = 0;
        i->window.undone = (i->window.undone + LB_UNDONE - 1) % LB_UNDONE;
    }
}

/* --- states --- */

/* The checksum of the first bytes of a state, a multiple of 8. */
static uint64_t checksum(const lb_kernels *kernels, const void *bytes, size_t count) {
    return kernels->checksum((int64_t)(intptr_t)bytes, (int64_t)(count / 8));
}

/* The chosen bass's name. */
static const char *name_of(const lb_instance *i, double bass) {
    return lb_shelf_name(i->shelf, bass < lb_shelf_count(i->shelf) ? (int)bass : 0);
}

void lb_save_state(lb_instance *i, lb_state *s) {
    memset(s, 0, sizeof *s);
    memcpy(s->magic, MAGIC, sizeof s->magic);
    s->version = VERSION;
    s->count = LB_PARAMETERS;
    __atomic_load(&i->seed, &s->seed, __ATOMIC_RELAXED);
    lb_write_learned(i, s->learned);
    enter();
    s->side = i->sides.side;
    for (int k = 0; k < LB_PARAMETERS; k++) {
        s->values[k][0] = lb_value(i, k);
        s->values[k][1] = i->sides.aside[k];
    }
    const int missing = __atomic_load_n(&i->missing, __ATOMIC_RELAXED);
    snprintf(s->bass, sizeof s->bass, "%s", missing ? i->missing_name : name_of(i, s->values[LB_BASS][0]));
    leave();
    s->checksum = checksum(i->kernels, s, offsetof(lb_state, checksum));
}

void *lb_new_state(lb_instance *i, size_t *count) {
    lb_response *r = lb_use_response(i);
    char *made = malloc(sizeof(lb_state) + (r ? r->size : 0));
    *count = made ? sizeof(lb_state) + (r ? r->size : 0) : 0;
    if (made) lb_save_state(i, (lb_state *)made);
    if (made && r) memcpy(made + sizeof(lb_state), r->kept, r->size);
    lb_free_response(r);
    return made;
}

/* Reads a state, with the response that may follow it; returns its fault. */
static const char *parse(const lb_kernels *kernels, const lb_state *s, size_t whole, lb_kept *to) {
    static const char *const damaged = "is damaged";
    const size_t head = offsetof(lb_state, values);
    uint64_t sum;
    if (whole < head || memcmp(s->magic, MAGIC, sizeof s->magic)) return "is not one of this plugin";
    if (s->version != VERSION) return "was written by another version of the plugin";
    if (s->count < 1 || s->count > 1000) return damaged;
    const size_t count = head + (size_t)s->count * sizeof *s->values + sizeof sum;
    if (whole < count) return damaged;
    memcpy(&sum, (const char *)s + count - sizeof sum, sizeof sum);
    if (sum != checksum(kernels, s, count - sizeof sum) || !memchr(s->bass, 0, sizeof s->bass)) return damaged;
    memset(to, 0, sizeof *to);
    memcpy(to->bass, s->bass, sizeof to->bass);
    memcpy(to->learned, s->learned, sizeof to->learned);
    to->seed = s->seed;
    to->sides.side = s->side;
    for (int k = 0; k < LB_PARAMETERS; k++) {
        const int known = k < s->count;
        to->values[k] = known ? s->values[k][0] : lb_parameters[k].usual;
        to->sides.aside[k] = known ? s->values[k][1] : lb_parameters[k].usual;
        if (!isfinite(to->values[k]) || !isfinite(to->sides.aside[k])) return damaged;
    }
    if (s->side != 0 && s->side != 1) return damaged;
    return whole == count ? 0 : lb_parse_response((const char *)s + count, whole - count, kernels, &to->response);
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
    lb_set_response(i, kept->response);
    note_missing(i, missing ? kept->bass : "");
}

int lb_load_state(lb_instance *i, const void *bytes, size_t count) {
    char line[LINE];
    lb_kept kept;
    const char *why = parse(i->kernels, bytes, count, &kept);
    if (why) {
        snprintf(line, sizeof line, "the session's state %s", why);
        i->complain(i->owner, line);
    } else lb_take_kept(i, &kept);
    return !why;
}
