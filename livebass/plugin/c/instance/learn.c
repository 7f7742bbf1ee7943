/* MIDI learn: controllers that move parameters of an instance instead of acting as in the key map. */
#include "instance/instance.h"

#include <math.h>
#include <string.h>

enum { CONTROLLER = 0xB0, MIDDLE = 64, MAXIMUM = 127, VOLUME_LAW = 40 /* dB for a factor of ten */ };
static const uint8_t reserved[] = {LB_RESERVED}; /* controllers that come in sequences, not from knobs */

static int may_learn(int parameter) {
    return parameter >= 0 && parameter < LB_PARAMETERS && lb_parameters[parameter].kind >= 0;
}

int lb_learn(lb_instance *i, int parameter) {
    const int good = may_learn(parameter);
    __atomic_store_n(&i->learned.wanted, good ? parameter + 1 : 0, __ATOMIC_RELAXED);
    return good;
}

int lb_learning(const lb_instance *i) { return __atomic_load_n(&i->learned.wanted, __ATOMIC_RELAXED) - 1; }

void lb_forget(lb_instance *i, int parameter) {
    for (int k = 0; k < LB_CONTROLLERS; k++)
        if (lb_learned_by(i, k) == parameter) __atomic_store_n(&i->learned.of[k], 0, __ATOMIC_RELAXED);
}

int lb_learned_by(const lb_instance *i, int controller) {
    return __atomic_load_n(&i->learned.of[controller], __ATOMIC_RELAXED) - 1;
}

/* The parameter value for a controller's value, as in the kernels (value_at of kernels/player/parameters.py): gain as a
   volume controller, names in equal parts (here all strokes), the middle as 0 if a parameter has both signs. */
static double value_of(const lb_instance *i, int parameter, int seven) {
    const double minimum = lb_parameters[parameter].minimum, maximum = lb_maximum(i, parameter);
    if (parameter == LB_GAIN) return seven ? fmax(VOLUME_LAW * log10((double)seven / MAXIMUM), minimum) : minimum;
    const int names = (int)(maximum - minimum + 1), name = seven * names / (MAXIMUM + 1);
    if (lb_parameters[parameter].points) return minimum + name;
    if (minimum >= 0) return minimum + (maximum - minimum) * seven / MAXIMUM;
    return seven <= MIDDLE ? minimum * (MIDDLE - seven) / MIDDLE : maximum * (seven - MIDDLE) / (MAXIMUM - MIDDLE);
}

int lb_take_learned(lb_instance *i, int64_t offset, const uint8_t *bytes, size_t count) {
    const int controller = count == 3 && (bytes[0] & 0xF0) == CONTROLLER && bytes[1] < LB_CONTROLLERS ? bytes[1] : -1;
    if (controller < 0 || memchr(reserved, controller, sizeof reserved)) return 0;
    const int wanted = __atomic_exchange_n(&i->learned.wanted, 0, __ATOMIC_RELAXED);
    if (wanted) {
        lb_forget(i, wanted - 1);
        __atomic_store_n(&i->learned.of[controller], (uint8_t)wanted, __ATOMIC_RELAXED);
    }
    const int parameter = lb_learned_by(i, controller);
    if (parameter < 0) return 0;
    lb_set_value_at(i, offset, parameter, value_of(i, parameter, bytes[2] & MAXIMUM));
    lb_mark(&i->unsent, parameter);
    return 1;
}

int lb_next_moved(lb_instance *i) {
    LB_ALONE(i->audio.owner);
    return lb_take_mark(&i->unsent);
}

void lb_write_learned(const lb_instance *i, uint8_t to[LB_CONTROLLERS]) {
    for (int k = 0; k < LB_CONTROLLERS; k++) to[k] = (uint8_t)(lb_learned_by(i, k) + 1);
}

void lb_read_learned(lb_instance *i, const uint8_t from[LB_CONTROLLERS]) {
    for (int k = 0; k < LB_CONTROLLERS; k++)
        __atomic_store_n(&i->learned.of[k], may_learn(from[k] - 1) ? from[k] : 0, __ATOMIC_RELAXED);
}
