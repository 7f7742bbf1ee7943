/* An instance's parameter values, and their texts. */
#include "instance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

double lb_value(const lb_instance *i, int parameter) {
    double value;
    __atomic_load(&i->values[parameter], &value, __ATOMIC_RELAXED);
    return value;
}

static void keep(lb_instance *i, int parameter, double value) {
    if (parameter == LB_BASS && value != lb_value(i, LB_BASS)) {
        const double before = lb_shelf_quality(i->shelf, (int)lb_value(i, LB_BASS));
        __atomic_store_n(&i->missing, 0, __ATOMIC_RELAXED);
        if (!i->quality_stays && lb_value(i, LB_QUALITY) == before)
            keep(i, LB_QUALITY, lb_shelf_quality(i->shelf, (int)value));
    }
    __atomic_store(&i->values[parameter], &value, __ATOMIC_RELAXED);
}

double lb_most(const lb_instance *i, int parameter) {
    if (parameter != LB_BASS) return lb_parameters[parameter].most;
    const int last = lb_shelf_count(i->shelf) - 1;
    return last > 0 ? last : 1; /* a host may divide by the range */
}

double lb_usual(const lb_instance *i, int parameter) {
    return parameter == LB_QUALITY ? lb_shelf_quality(i->shelf, 0) : lb_parameters[parameter].usual;
}

int lb_is_slider(int parameter) { return parameter >= LB_ACTION && parameter < LB_ACTION + LB_BUILT; }

double lb_allowed(const lb_instance *i, int parameter, double value) {
    const lb_parameter *p = &lb_parameters[parameter];
    if (!(value == value)) value = lb_usual(i, parameter);
    value = fmin(fmax(value, p->least), lb_most(i, parameter));
    if (lb_is_slider(parameter)) return lb_hundredths(value);
    return p->whole ? rint(value) : value;
}

void lb_set_value(lb_instance *i, int parameter, double value) {
    keep(i, parameter, lb_allowed(i, parameter, value));
    __atomic_fetch_or(&i->changed, 1ull << parameter, __ATOMIC_RELEASE);
}

/* Offline, changes the bass at the value's frame within the block (lb_play_block); if there is no room for it, applies
   all earlier ones at once. */
static void turn_at(lb_instance *i, int64_t offset, int parameter, double value) {
    for (int k = 0; i->audio.turn_count == LB_TURNS && k < LB_TURNS; k++)
        lb_set_value(i, i->audio.turns[k].parameter, i->audio.turns[k].value);
    i->audio.turn_count %= LB_TURNS;
    i->audio.turns[i->audio.turn_count++] = (lb_turn){offset, parameter, value};
}

void lb_set_value_at(lb_instance *i, int64_t offset, int parameter, double value) {
    LB_ALONE(i->audio.owner);
    value = lb_allowed(i, parameter, value);
    if (lb_is_slider(parameter) && __atomic_load_n(&i->offline, __ATOMIC_RELAXED)) {
        turn_at(i, offset, parameter, value);
        return;
    }
    keep(i, parameter, value);
    if (lb_parameters[parameter].kind < 0 || !lb_set(i->synth, offset, parameter, value))
        __atomic_fetch_or(&i->changed, 1ull << parameter, __ATOMIC_RELEASE);
}

/* Writes a slider's result for a bass with its own values, in brackets. */
static void add_slider(const lb_own *own, int parameter, double value, char *text, size_t room) {
    const double more = 1 + value / 100;
    const struct {
        int parameter, places;
        double value;
        const char *unit;
    } all[] = {
        {LB_ACTION, 2, own->action + value, "mm at fret 12"},
        {LB_NUT_HEIGHT, 2, own->nut_height + value, "mm at fret 1"},
        {LB_FOAM, 1, own->foam + value, "1/s"},
        {LB_PICKUP_1_PLACE, 0, own->place[0] + value, "mm from the bridge"},
        {LB_PICKUP_2_PLACE, 0, own->place[1] + value, "mm from the bridge"},
        {LB_CABLE, 0, own->cable + value, "pF"},
        {LB_FINGER_WIDTH, 1, own->finger_width * more, "mm"},
        {LB_PLUCK_ANGLE, 0, own->pluck_angle + value, "deg"},
    };
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        if (all[k].parameter == parameter && isfinite(all[k].value))
            snprintf(text, room, " (%.*f %s)", all[k].places, all[k].value, all[k].unit);
    if (parameter == LB_GAUGE && isfinite(own->thickest))
        snprintf(text, room, " (.%03.0f to .%03.0f)", 1e3 * more * own->thinnest, 1e3 * more * own->thickest);
}

/* Writes a relative value's result for this bass, in brackets; nothing if the value says it all. */
static void add_real_value(const lb_instance *i, int parameter, double value, char *text, size_t room) {
    const int bass = (int)lb_value(i, LB_BASS);
    const LB_PLAYER *p = bass < lb_shelf_count(i->shelf) ? lb_shelf_player(i->shelf, bass) : 0;
    if (!p) return;
    if (lb_is_slider(parameter)) {
        add_slider(lb_shelf_own(i->shelf, bass), parameter, value, text, room);
        return;
    }
    const double most = value < 0 ? p->pluck_farthest : p->pluck_nearest;
    if (parameter == LB_BEND_RANGE && value == 0) snprintf(text, room, " (the bass has %g)", p->bend_range);
    else if (parameter == LB_PLUCK_POSITION) {
        const double place = p->pluck_position + fabs(value) * (most - p->pluck_position);
        snprintf(text, room, " (%.0f %% of the string)", 100 * place);
    } else if (parameter == LB_HAND_DAMPING) snprintf(text, room, " (%.3g 1/s)", p->hand_damping * pow(10, value));
    else if (parameter == LB_UNEVENNESS) {
        const double all = fmin(fmax(p->unevenness + value, 0), LB_MOST_UNEVENNESS);
        snprintf(text, room, " (%.2f)", value == 0 ? p->unevenness : all);
    }
}

void lb_value_to_text(const lb_instance *i, int parameter, double value, char *text, size_t room) {
    const lb_parameter *p = &lb_parameters[parameter];
    value = lb_allowed(i, parameter, value);
    if (!p->whole) value = rint(100 * value) / 100 + 0.0; /* rounded like its text, which then reads back the same */
    if (parameter == LB_BASS) {
        const int number = (int)value < lb_shelf_count(i->shelf) ? (int)value : 0;
        snprintf(text, room, "%s", lb_shelf_title(i->shelf, number));
    } else if (p->points) snprintf(text, room, "%s", p->points[(int)(value - p->least)]);
    else {
        snprintf(text, room, p->whole ? "%.0f%s%s" : "%.2f%s%s", value, *p->unit ? " " : "", p->unit);
        add_real_value(i, parameter, value, text + strlen(text), room - strlen(text));
    }
}

int lb_text_to_value(const lb_instance *i, int parameter, const char *text, double *value) {
    const lb_parameter *p = &lb_parameters[parameter];
    char other[256], *end;
    if (parameter == LB_BASS && lb_shelf_find(i->shelf, text) >= 0) {
        *value = lb_shelf_find(i->shelf, text);
        return 1;
    }
    if (parameter == LB_BASS || p->points) {
        for (int k = 0; p->least + k <= lb_most(i, parameter); k++) {
            *value = p->least + k;
            lb_value_to_text(i, parameter, *value, other, sizeof other);
            if (!strcmp(other, text)) return 1;
        }
    }
    const double read = strtod(text, &end);
    if (end == text) return 0;
    *value = lb_allowed(i, parameter, read);
    return 1;
}

int lb_switch_key(const lb_instance *i, uint32_t *index) {
    uint32_t found = 0;
    for (int key = 0; key < LB_KEY_COUNT; key++)
        if (lb_shelf_switch(i->shelf, (int)lb_value(i, LB_BASS), key) && found++ == *index) return key;
    *index = found;
    return -1;
}

const char *lb_switch_name(const lb_instance *i, int key) {
    return lb_shelf_switch(i->shelf, (int)lb_value(i, LB_BASS), key)->name;
}
