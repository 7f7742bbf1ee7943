/* The hidden parameters: the first channel's controllers, then each channel's own wheel, pressure and place, then the
   other channels' other controllers. */
#include "shells/vst3_midi.h"

#include <stdio.h>
#include <string.h>

enum { CONTROLLERS = 1000 };               /* id of controller 0 of the first channel */
enum { CHANNELS = 2000 };                  /* id of the first channel's wheel: + channel * LB_OWN + way */
enum { OTHERS = 3000, EACH = LB_OTHER + 1 }; /* + channel * EACH + controller, except PLACED */
enum { FIRST_OWN = VST3_CONTROLLERS, FIRST_OTHER = FIRST_OWN + LB_CHANNELS * LB_OWN }; /* indices */
enum { PLACED = 74 };                      /* MPE's controller for places */
enum { VOLUME = 7, EXPRESSION = 11 }; /* of these, in the usual key map, a new bass has 127 ... */
static const uint8_t at_0[] = {19, 64, 65, 68, VST3_PRESSURE}; /* ... and of these 0 */
static const int own[LB_OWN] = {VST3_BEND, VST3_PRESSURE, PLACED};
static const char *const own_names[LB_OWN] = {"Pitch bend", "Pressure", "Plucking place"};

static double default_of(int controller) {
    if (controller == VST3_BEND) return 0.5;
    if (controller == VOLUME || controller == EXPRESSION) return 1;
    return memchr(at_0, controller, sizeof at_0) ? 0 : LB_UNMOVED;
}

lb_hidden lb_hidden_at(int index) {
    if (index < FIRST_OWN) return (lb_hidden){(uint32_t)(CONTROLLERS + index), 0, index, default_of(index)};
    if (index < FIRST_OTHER) {
        const int k = index - FIRST_OWN, controller = own[k % LB_OWN];
        const double default_value = controller == PLACED ? 64.0 / 127 : default_of(controller);
        return (lb_hidden){(uint32_t)(CHANNELS + k), k / LB_OWN, controller, default_value};
    }
    const int k = index - FIRST_OTHER, channel = 1 + k / LB_OTHER, number = k % LB_OTHER;
    const int controller = number + (number >= PLACED);
    return (lb_hidden){(uint32_t)(OTHERS + channel * EACH + controller), channel, controller, default_of(controller)};
}

void lb_hidden_name(int index, char name[64]) {
    const lb_hidden h = lb_hidden_at(index);
    const int is_own = index >= FIRST_OWN && index < FIRST_OTHER;
    if (is_own) snprintf(name, 64, "%s, channel %d", own_names[(index - FIRST_OWN) % LB_OWN], h.channel + 1);
    else if (h.controller == VST3_BEND) snprintf(name, 64, "%s", own_names[0]);
    else if (h.controller == VST3_PRESSURE) snprintf(name, 64, "%s", own_names[1]);
    else if (h.channel) snprintf(name, 64, "MIDI CC %d, channel %d", h.controller, h.channel + 1);
    else snprintf(name, 64, "MIDI CC %d", h.controller);
}

int lb_find_hidden(uint32_t id) {
    if (id >= CONTROLLERS && id < CONTROLLERS + VST3_CONTROLLERS) return (int)(id - CONTROLLERS);
    if (id >= CHANNELS && id < CHANNELS + LB_CHANNELS * LB_OWN) return (int)(FIRST_OWN + id - CHANNELS);
    const int k = (int)(id - OTHERS), controller = k % EACH;
    if (id < OTHERS + EACH || id >= OTHERS + LB_CHANNELS * EACH || controller == PLACED) return -1;
    return FIRST_OTHER + (k / EACH - 1) * LB_OTHER + controller - (controller > PLACED);
}

uint32_t lb_hidden_id(int channel, int controller) {
    for (int way = 0; way < LB_OWN && channel >= 0; way++)
        if (own[way] == controller) return (uint32_t)(CHANNELS + channel * LB_OWN + way);
    return (uint32_t)(channel > 0 ? OTHERS + channel * EACH + controller : CONTROLLERS + controller);
}
