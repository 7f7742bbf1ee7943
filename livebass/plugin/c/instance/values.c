/* An instance's parameter values, and their texts; and the host's log. */
#include "instance/instance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void lb_log(const lb_instance *i, const char *form, ...) {
    char line[1600];
    va_list more;
    va_start(more, form);
    vsnprintf(line, sizeof line, form, more);
    va_end(more);
    i->complain(i->owner, line);
}

double lb_value(const lb_instance *i, int parameter) {
    double value;
    __atomic_load(&i->values[parameter], &value, __ATOMIC_RELAXED);
    return value;
}

void lb_read_values(const lb_instance *i, double to[LB_PARAMETERS]) {
    for (int k = 0; k < LB_PARAMETERS; k++) to[k] = lb_value(i, k);
}

int lb_bass_number(const lb_instance *i, double bass) { return bass < lb_shelf_count(i->shelf) ? (int)bass : 0; }

static void keep(lb_instance *i, int parameter, double value) {
    if (parameter == LB_BASS && value != lb_value(i, LB_BASS)) {
        const double before = lb_shelf_quality(i->shelf, (int)lb_value(i, LB_BASS));
        __atomic_store_n(&i->missing, 0, __ATOMIC_RELAXED);
        if (!i->quality_stays && lb_value(i, LB_QUALITY) == before)
            keep(i, LB_QUALITY, lb_shelf_quality(i->shelf, (int)value));
    }
    __atomic_store(&i->values[parameter], &value, __ATOMIC_RELAXED);
}

double lb_maximum(const lb_instance *i, int parameter) {
    if (parameter != LB_BASS) return lb_parameters[parameter].maximum;
    const int last = lb_shelf_count(i->shelf) - 1;
    return last > 0 ? last : 1; /* a host may divide by the range */
}

double lb_default(const lb_instance *i, int parameter) {
    return parameter == LB_QUALITY ? lb_shelf_quality(i->shelf, 0) : lb_parameters[parameter].default_value;
}

int lb_parameter_called(const char *symbol) {
    for (size_t k = 0; k < sizeof lb_renamed / sizeof *lb_renamed; k++)
        if (*symbol && !strcmp(lb_renamed[k].before, symbol)) symbol = lb_renamed[k].symbol;
    for (int k = 0; k < LB_PARAMETERS; k++)
        if (k != LB_BASS && !strcmp(lb_parameters[k].symbol, symbol)) return k;
    return -1;
}

int lb_is_slider(int parameter) {
    for (int k = 0; k < LB_BUILT; k++)
        if (lb_sliders[k] == parameter) return 1;
    return 0;
}

double lb_allowed(const lb_instance *i, int parameter, double value) {
    const lb_parameter *p = &lb_parameters[parameter];
    if (!(value == value)) value = lb_default(i, parameter);
    value = fmin(fmax(value, p->minimum), lb_maximum(i, parameter));
    if (lb_is_slider(parameter)) return lb_hundredths(value);
    return p->whole ? rint(value) : value;
}

void lb_set_value(lb_instance *i, int parameter, double value) {
    keep(i, parameter, lb_allowed(i, parameter, value));
    lb_mark(&i->changed, parameter);
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
        lb_mark(&i->changed, parameter);
}

/* Musicians' measure of a parameter: `zero` for the value 0, and from there `up` more for each 1 above 0, or `down` less
   for each 1 below; or, `folds`, `zero` times that many powers of ten. */
typedef struct {
    double zero, up, down;
    int folds, places;
    const char *unit;
} measure;

/* Measures of a number of lb_own: it is added to, or, PER_CENT, grows by a hundredth for each 1. */
#define OWN(field) (uint8_t)(offsetof(lb_own, field) / sizeof(double))
enum { PLUS, PER_CENT, OF_100 = 255 /* in place of a number of lb_own: 100 is the bass's */ };
static const struct {
    uint8_t parameter, own, how, places;
    char unit[24];
} measures[] = {
    {LB_ACTION, OWN(action), PLUS, 2, "mm at fret 12"},
    {LB_NECK_RELIEF, OWN(relief), PLUS, 2, "mm"},
    {LB_NUT_HEIGHT, OWN(nut_height), PLUS, 2, "mm at fret 1"},
    {LB_CONTACT_LOSS, OF_100, PLUS, 0, "%"},
    {LB_GAUGE, OWN(thickest), PER_CENT, 3, ""},
    {LB_TENSION, OWN(tension), PER_CENT, 1, "kg on the lowest string"},
    {LB_WEAR, OF_100, PLUS, 0, "%"},
    {LB_FOAM, OWN(foam), PLUS, 1, "1/s"},
    {LB_PICKUP_1_PLACE, OWN(place[0]), PLUS, 0, "mm from the bridge"},
    {LB_PICKUP_2_PLACE, OWN(place[1]), PLUS, 0, "mm from the bridge"},
    {LB_CABLE, OWN(cable), PLUS, 0, "pF"},
    {LB_CONCERT_PITCH, OWN(a4), PLUS, 1, "Hz"},
    {LB_FINGER_WIDTH, OWN(finger_width), PER_CENT, 1, "mm"},
    {LB_PLUCK_ANGLE, OWN(pluck_angle), PLUS, 0, "deg"},
    {LB_HARDEST, OF_100, PLUS, 0, "%"},
    {LB_NECK_RESONANCE, OWN(resonance), PER_CENT, 0, "Hz"},
    {LB_NECK_MASS, OWN(mass), PER_CENT, 2, "kg"},
};

static measure slider_measure(const lb_instance *i, const lb_own *own, int parameter, measure m) {
    for (size_t k = 0; k < sizeof measures / sizeof *measures; k++) {
        if (measures[k].parameter != parameter) continue;
        double zero = measures[k].own == OF_100 ? 100 : ((const double *)own)[measures[k].own];
        const double thicker = 1 + lb_value(i, LB_GAUGE) / 100;
        if (!isfinite(zero)) return m;
        if (parameter == LB_TENSION) zero *= thicker * thicker; /* at the same pitch */
        if (parameter == LB_PICKUP_1_PLACE || parameter == LB_PICKUP_2_PLACE) zero += lb_value(i, LB_PICKUP_PLACE);
        const double per = measures[k].how == PER_CENT ? zero / 100 : 1;
        return (measure){zero, per, per, 0, measures[k].places, measures[k].unit};
    }
    return m;
}

/* The measure on the present bass. Without one, values show as they are, bench sliders with their sign. */
static measure measure_of(const lb_instance *i, int parameter) {
    const lb_parameter *p = &lb_parameters[parameter];
    const int bass = (int)lb_value(i, LB_BASS);
    const LB_INSTRUMENT *in = lb_shelf_instrument(i->shelf, bass);
    measure m = {0, 1, 1, 0, p->whole ? 0 : strcmp(p->unit, "dB") ? 2 : 1, p->unit};
    if (!in) return m;
    const LB_PLAYER *player = &in->player;
    const lb_own *own = lb_shelf_own(i->shelf, bass);
    const double tone = 10 * in->circuit.tone, place = player->pluck_position;
    if (lb_is_slider(parameter)) return slider_measure(i, own, parameter, m);
    switch (parameter) {
    case LB_TONE: return (measure){tone, 10 - tone, tone, 0, 1, "of 10"};
    case LB_HAND_DAMPING: return (measure){6.9e3 / player->hand_damping, 0, 0, -1, 0, "ms to silence"}; /* -60 dB */
    case LB_BLEND: return (measure){50, 50, 50, 0, 0, "% bridge"};
    case LB_UNEVENNESS: return (measure){100 * player->unevenness, 100, 100, 0, 0, "%"};
    case LB_PALM_MUTE:
    case LB_VIBRATO:
    case LB_COMPRESSION:
    case LB_CLEAN_BLEND:
    case LB_DRIVE: return (measure){0, 100, 0, 0, 0, "%"};
    case LB_PLUCK_POSITION: {
        const int known = isfinite(own->length);
        const double away = known ? own->length : 100, up = away * (place - player->pluck_nearest);
        const double down = away * (player->pluck_farthest - place);
        return (measure){away * (1 - place), up, down, 0, 0, known ? "mm from the bridge" : "% from the bridge"};
    }
    default: return m;
    }
}

static double measured(const measure *m, int parameter, double value) {
    if (parameter == LB_UNEVENNESS) value = fmin(fmax(value, -m->zero / 100), LB_MAX_UNEVENNESS - m->zero / 100);
    return m->folds ? m->zero * pow(10, m->folds * value) : m->zero + value * (value < 0 ? m->down : m->up);
}

/* A pickup's place, mm from the bridge, as far as there is room (change.py: move_pickups); other numbers stay. */
static double within_room(const lb_instance *i, int parameter, double shown) {
    const lb_own *own = lb_shelf_own(i->shelf, (int)lb_value(i, LB_BASS));
    const int k = parameter == LB_PICKUP_2_PLACE;
    if ((!k && parameter != LB_PICKUP_1_PLACE) || !isfinite(own->place[k])) return shown;
    return fmax(fmin(shown, own->farthest[k]), own->nearest[k]);
}

/* The value for which a measure shows a number. */
static double value_for(const measure *m, double shown) {
    if (m->folds) return log10(fmax(shown / m->zero, 1e-9)) / m->folds;
    const double more = shown - m->zero, per = more < 0 ? m->down : m->up;
    return per > 0 ? more / per : 0;
}

/* The number that the value 0 stands for, where it means the bass's own; NaN where it does not. */
static double own_value(const lb_instance *i, int parameter) {
    const LB_INSTRUMENT *in = lb_shelf_instrument(i->shelf, (int)lb_value(i, LB_BASS));
    if (!in) return NAN;
    switch (parameter) {
    case LB_BEND_RANGE: return in->player.bend_range;
    case LB_COMPRESSION: return 100 * in->compression;
    case LB_DRIVE: return 100 * in->drive;
    case LB_CLEAN_BLEND: return 100 * in->clean_blend;
    case LB_EQ_BASS: return in->eq_bass;
    case LB_EQ_LOW_MID: return in->eq_low_mid;
    case LB_EQ_HIGH_MID: return in->eq_high_mid;
    case LB_EQ_TREBLE: return in->eq_treble;
    default: return NAN;
    }
}

/* True for a text that older versions gave the preset's choice. */
static int is_older_preset(const char *text) { return !strcmp(text, "the bass's own") || !strcmp(text, "as it is"); }

void lb_value_to_text(const lb_instance *i, int parameter, double value, char *text, size_t room) {
    const lb_parameter *p = &lb_parameters[parameter];
    value = lb_allowed(i, parameter, value);
    if (parameter == LB_BASS) {
        snprintf(text, room, "%s", lb_shelf_title(i->shelf, lb_bass_number(i, value)));
        return;
    }
    if (p->points) {
        snprintf(text, room, "%s", p->points[(int)(value - p->minimum)]);
        return;
    }
    const measure m = measure_of(i, parameter);
    const double of_bass = own_value(i, parameter), own = value == 0 ? of_bass : NAN, digits = pow(10, m.places);
    const double whole = within_room(i, parameter, isfinite(own) ? own : measured(&m, parameter, value));
    double shown = rint(digits * whole) / digits + 0.0; /* no -0 */
    if (isfinite(of_bass) && value != 0 && fabs(shown) * digits < 1) /* else it would read back as the bass's own */
        shown = copysign(1 / digits, value);
    const int is_change = lb_is_slider(parameter) && m.zero == 0 && p->minimum < 0;
    if (parameter == LB_FRET && shown == 0) snprintf(text, room, "none");
    else if (is_change && value == 0) snprintf(text, room, "preset");
    else if (parameter == LB_GAUGE && m.zero > 0) {
        const double thinnest = lb_shelf_own(i->shelf, (int)lb_value(i, LB_BASS))->thinnest;
        snprintf(text, room, ".%03.0f-.%03.0f", 1e3 * thinnest * (1 + value / 100), 1e3 * shown);
    } else {
        snprintf(text, room, "%s%.*f%s%s%s", is_change && shown > 0 ? "+" : "", m.places, shown, *m.unit ? " " : "",
                 m.unit, isfinite(own) ? " (preset)" : "");
    }
}

/* Finds the value next to `value`, in hundredths, that has this text: two gauges tell more than the thickest alone. */
static double gauge_with(const lb_instance *i, const char *text, double value) {
    char other[256];
    for (int k = 0; k < 200; k++) {
        const int steps = (k + 1) / 2;
        const double near = lb_allowed(i, LB_GAUGE, value + (k % 2 ? 0.01 : -0.01) * steps);
        lb_value_to_text(i, LB_GAUGE, near, other, sizeof other);
        if (!strcmp(other, text)) return near;
    }
    return value;
}

int lb_text_to_value(const lb_instance *i, int parameter, const char *text, double *value) {
    const lb_parameter *p = &lb_parameters[parameter];
    char other[256], *end;
    if (parameter == LB_BASS && lb_shelf_find(i->shelf, text) >= 0) {
        *value = lb_shelf_find(i->shelf, text);
        return 1;
    }
    if (parameter == LB_BASS || p->points) {
        for (int k = 0; p->minimum + k <= lb_maximum(i, parameter); k++) {
            *value = p->minimum + k;
            lb_value_to_text(i, parameter, *value, other, sizeof other);
            if (!strcmp(other, text)) return 1;
        }
    }
    const char *last = parameter == LB_GAUGE ? strrchr(text, '-') : 0; /* of two gauges the thickest counts */
    if (parameter == LB_FRET && !strcmp(text, "none")) text = "0";
    if (p->points ? is_older_preset(text) : strstr(text, "preset") != 0) {
        *value = p->default_value;
        return 1;
    }
    const double read = strtod(last && last > text ? last + 1 : text, &end);
    if (end == text) return 0;
    const measure m = measure_of(i, parameter);
    const double shown = parameter == LB_GAUGE && m.zero > 0 && read > 1 ? 1e-3 * read : read;
    *value = lb_allowed(i, parameter, p->points ? read : value_for(&m, shown));
    if (last) *value = gauge_with(i, text, *value);
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
