/* An instance's values now: A and B, Undo, and taking over what a session kept, which session.c reads and writes. */
#include "instance/instance.h"
#include "system/lock.h"
#include "instance/response.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE = 1600 };

/* --- A and B, undo: the lock keeps the two sides together --- */

int lb_is_of_sides(int parameter) {
    return parameter != LB_BASS && strcmp(lb_parameters[parameter].group, "Processor") != 0;
}

void lb_begin_sides(lb_instance *i) {
    i->sides.side = 0;
    for (int k = 0; k < LB_PARAMETERS; k++) i->sides.aside[k] = lb_parameters[k].default_value;
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
    lb_read_values(i, to->values);
    to->sides = i->sides;
    to->bass = lb_present_bass(i->shelf, lb_bass_number(i, to->values[LB_BASS]));
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
        lb_put_bass(i->shelf, lb_bass_number(i, b->values[LB_BASS]), b->bass);
        lb_set_values(i, b->values, 1);
        lb_write_sides(i, &b->sides);
        note_missing(i, b->missing);
        if (responds) lb_set_response(i, b->response);
        else lb_free_response(b->response);
        b->response = 0;
        i->window.undone = (i->window.undone + LB_UNDONE - 1) % LB_UNDONE;
    }
}

/* --- what a session keeps --- */

void lb_read_present(const lb_instance *i, double values[LB_PARAMETERS], lb_sides *sides, char name[LB_STATE_NAME]) {
    enter();
    *sides = i->sides;
    lb_read_values(i, values);
    const int bass = lb_bass_number(i, values[LB_BASS]);
    const int missing = __atomic_load_n(&i->missing, __ATOMIC_RELAXED);
    snprintf(name, LB_STATE_NAME, "%s", missing ? i->missing_name : lb_shelf_name(i->shelf, bass));
    leave();
}

char *lb_read_unknown(const lb_instance *i) {
    enter();
    char *copy = i->unknown ? malloc(strlen(i->unknown) + 1) : 0;
    if (copy) strcpy(copy, i->unknown);
    leave();
    return copy;
}

/* Gives the instance the words that are unknown here, which it takes over. */
static void write_unknown(lb_instance *i, char *unknown) {
    enter();
    char *before = i->unknown;
    i->unknown = unknown;
    leave();
    free(before);
}

/* The number of a session's bass, as it kept it if it did; -1: there is none. */
static int find_bass(lb_instance *i, const lb_kept *kept) {
    char line[LINE];
    const int number = lb_shelf_find(i->shelf, kept->bass);
    if (!kept->instrument) {
        if (number >= 0) lb_update_bass(i->shelf, number);
        return number;
    }
    const int found = lb_keep_bass(i->shelf, kept->bass, kept->instrument, kept->instrument_bytes, line, sizeof line);
    if (found < 0) i->complain(i->owner, line);
    return found < 0 ? number : found;
}

void lb_take_kept(lb_instance *i, lb_kept *kept) {
    const int number = find_bass(i, kept), missing = number < 0;
    if (missing && !(i->missing && !strcmp(i->missing_name, kept->bass))) /* hosts may load a state several times */
        lb_log(i, LB_NOT_INSTALLED, kept->bass);
    __atomic_store_n(&i->seed, kept->seed, __ATOMIC_RELAXED);
    kept->values[LB_BASS] = missing ? lb_value(i, LB_BASS) : number;
    lb_set_values(i, kept->values, 1);
    lb_write_sides(i, &kept->sides);
    lb_read_learned(i, kept->learned);
    lb_set_response(i, kept->response);
    note_missing(i, missing ? kept->bass : "");
    write_unknown(i, kept->unknown);
    free(kept->instrument);
    kept->instrument = kept->unknown = 0;
}
