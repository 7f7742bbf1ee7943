/* The VST3 plugin: one object with nine interfaces, around an instance. process() allocates nothing but offline.

   Instruments lie in the bundle's folder Contents/Resources, or in the user's directory. Each active object has a
   thread that loads basses. VST3 knows no MIDI controllers: each is a hidden parameter. The host sends parameter points
   and notes in separate lists; the synth gets them in the order of their frames. */
#define _GNU_SOURCE
#include "shells/loader.h"
#include "instance/response.h"
#include "abi/vst3.h"
#include "shells/vst3_midi.h"
#include "shells/vst3_view.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

enum { TAIL = 12 /* s */, CHANGES = 2048, LINE = 1500 };
enum { OVERLOAD = 500 }; /* id of the read-only parameter that counts relieved strings */
enum { SEMITONES = 240 };     /* in the tuning's range */
enum { PROGRAMS = 1 }; /* the list of instruments */
enum { MIDI_UNIT = LB_GROUPS + 1 }; /* a unit for each group, and one for the hidden parameters */

static const vst3_id classes[] = { /* must never change: sessions use them. Mono, and one output per string */
    VST3_ID(0x6C697665u, 0x62617373u, 0x9D3F0C51u, 0x00000001u),
    VST3_ID(0x6C697665u, 0x62617373u, 0x9D3F0C51u, 0x00000002u),
};
static const char *const names[] = {"livebass", "livebass strings"};

typedef struct {
    int64_t order; /* offset; points before events; place in the host's list */
    int kind;      /* of vst3_event.type, or CHANGE */
    uint32_t id;
    double value;
    vst3_event event;
} change;
enum { CHANGE = 1 << 16, PLACES = 1 << 20, MAX_REPEATS = PLACES / (2 * CHANGES) - 1 };
#define FRAME (2 * (int64_t)PLACES) /* of `order` */

static const vst3_id interface_ids[] = {
    VST3_COMPONENT, VST3_PROCESSOR, VST3_CONTROLLER, VST3_MIDI_MAPPING, VST3_UNITS, VST3_EXPRESSIONS,
    VST3_SWITCHES, VST3_CONTEXT, VST3_PHYSICAL,
};
enum { INTERFACES = sizeof interface_ids / sizeof *interface_ids };

typedef struct { /* a host's handle for an interface */
    const void *table;
    struct vst3 *object;
} face;
typedef struct vst3 {
    face faces[INTERFACES];
    int32_t users;
    int apart; /* has one output per string */
    int stereo;
    /* The host's control values: */
    double shown[LB_PARAMETERS], hidden[LB_HIDDEN];
    uint8_t moved[LB_HIDDEN]; /* hidden parameters that were told other values than their defaults */
    int overload, quality; /* as the host knows them */
    int switched;          /* the bass whose key switches the host knows */
    vst3_handler **handler; /* the host's; 0: none */
    int attached;           /* one of its views is in a window */
    int timed;              /* a host timer collects the window's moves */
    lb_instance instance;
    change changes[CHANGES];
    int change_count;
    lb_loader loader;
} vst3;

/* An interface's object. */
static vst3 *of(const void *self) { return ((const face *)self)->object; }

static void ask(void *owner) { lb_ask_loader(&((vst3 *)owner)->loader); }

/* Finds the folder of the plugin's own instruments: Contents/X/livebass -> Contents/Resources. */
static void find_folder(char *folder, size_t room) {
    char path[LINE] = "";
#ifdef _WIN32
    HMODULE here;
    const DWORD how = GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT;
    wchar_t wide[LINE];
    const int found = GetModuleHandleExW(how, (LPCWSTR)(void *)find_folder, &here);
    const DWORD length = found ? GetModuleFileNameW(here, wide, LINE) : 0;
    if (!length || length == LINE || !WideCharToMultiByte(CP_UTF8, 0, wide, -1, path, LINE, 0, 0)) *path = 0;
    for (char *c = path; *c; c++)
        if (*c == '\\') *c = '/';
#else
    Dl_info here;
    if (dladdr((void *)find_folder, &here) && here.dli_fname && strlen(here.dli_fname) < sizeof path)
        strcpy(path, here.dli_fname);
#endif
    for (int k = 0; k < 2; k++) {
        char *end = strrchr(path, '/');
        if (end) *end = 0;
    }
    snprintf(folder, room, "%.1400s/Resources", path);
}

/* --- text --- */

static void to_wide(vst3_text to, const char *from) { /* UTF-8; letters that take two words in UTF-16 become ? */
    int k = 0;
    while (*from && k < 127) {
        const uint8_t first = (uint8_t)*from++;
        uint32_t code = first < 0x80 ? first : first < 0xE0 ? first & 0x1Fu : first < 0xF0 ? first & 0x0Fu : 0;
        while ((*from & 0xC0) == 0x80) code = code << 6 | ((uint8_t)*from++ & 0x3Fu);
        to[k++] = (int16_t)(first < 0xF0 ? code : '?');
    }
    to[k] = 0;
}

static void to_narrow(char *to, size_t room, const int16_t *from) {
    size_t k = 0;
    for (int j = 0; j < 127 && from[j] && k + 4 < room; j++) {
        const uint16_t code = (uint16_t)from[j];
        if (code >= 0x800) to[k++] = (char)(0xE0 | code >> 12);
        if (code >= 0x80) to[k++] = (char)(code >= 0x800 ? 0x80 | (code >> 6 & 0x3F) : 0xC0 | code >> 6);
        to[k++] = (char)(code >= 0x80 ? 0x80 | (code & 0x3F) : code);
    }
    to[k] = 0;
}

/* --- values: from 0 to 1 in hosts --- */

static double plain(const vst3 *v, uint32_t id, double x) {
    if (id >= LB_PARAMETERS) return x;
    const double minimum = lb_parameters[id].minimum;
    return lb_allowed(&v->instance, (int)id, minimum + x * (lb_maximum(&v->instance, (int)id) - minimum));
}

static double normal(const vst3 *v, uint32_t id, double x) {
    if (id >= LB_PARAMETERS) return x;
    const double minimum = lb_parameters[id].minimum;
    return (x - minimum) / (lb_maximum(&v->instance, (int)id) - minimum);
}

static void show_all(vst3 *v) {
    lb_read_values(&v->instance, v->shown);
    v->quality = (int)v->shown[LB_QUALITY];
}

/* Tells the host that another bass has other key switches. [main thread] */
static void tell_switches(vst3 *v) {
    const int bass = (int)lb_value(&v->instance, LB_BASS);
    if (bass == v->switched) return;
    v->switched = bass;
    if (v->handler) (*v->handler)->restart(v->handler, VST3_SWITCHES_CHANGED);
}

/* --- the object --- */

static void shut(vst3 *v) {
    lb_stop_loader(&v->loader);
    if (v->handler) (*v->handler)->unknown.drop(v->handler);
    v->handler = 0;
    lb_close_instance(&v->instance);
}

static uint32_t take(void *self) { return (uint32_t)__atomic_add_fetch(&of(self)->users, 1, __ATOMIC_ACQ_REL); }

static uint32_t drop(void *self) {
    vst3 *v = of(self);
    const int32_t users = __atomic_sub_fetch(&v->users, 1, __ATOMIC_ACQ_REL);
    if (!users) {
        shut(v);
        free(v);
    }
    return (uint32_t)users;
}

static vst3_result query(void *self, const vst3_id id, void **out) {
    static const vst3_id unknown = VST3_UNKNOWN, base = VST3_BASE;
    vst3 *v = of(self);
    for (int k = 0; k < INTERFACES; k++) {
        const int same = !memcmp(id, interface_ids[k], sizeof(vst3_id));
        if (!same && (k || (memcmp(id, unknown, sizeof unknown) && memcmp(id, base, sizeof base)))) continue;
        take(self);
        *out = &v->faces[k];
        return VST3_OK;
    }
    *out = 0;
    return VST3_NO_INTERFACE;
}

/* --- component --- */

static vst3_result initialize(void *self, void *context) {
    vst3 *v = of(self);
    char folder[LINE];
    if (v->instance.shelf) return VST3_OK;
    find_folder(folder, sizeof folder);
    if (!lb_open_instance(&v->instance, folder)) return VST3_NO;
    show_all(v);
    v->switched = (int)lb_value(&v->instance, LB_BASS);
    return VST3_OK;
}

static vst3_result terminate(void *self) {
    shut(of(self));
    return VST3_OK;
}

static vst3_result controller_class(void *self, vst3_id id) { /* this object is its own controller */
    return VST3_MISSING;
}

static vst3_result set_io_mode(void *self, int32_t mode) { return VST3_MISSING; }

static int32_t bus_count(void *self, int32_t media, int32_t direction) {
    if (media == VST3_EVENTS) return direction == VST3_INPUT;
    if (media != VST3_AUDIO || direction != VST3_OUTPUT) return 0;
    return of(self)->apart ? LB_STRINGS : 1;
}

static vst3_result bus_info(void *self, int32_t media, int32_t direction, int32_t index, vst3_bus *bus) {
    const vst3 *v = of(self);
    char name[32] = "Notes";
    if (index < 0 || index >= bus_count(self, media, direction)) return VST3_INVALID;
    memset(bus, 0, sizeof *bus);
    bus->media = media;
    bus->direction = direction;
    bus->channels = media == VST3_EVENTS ? 16 : v->stereo ? 2 : 1;
    bus->type = index ? VST3_AUX : VST3_MAIN;
    bus->flags = VST3_DEFAULT_ACTIVE;
    if (media == VST3_AUDIO && v->apart) snprintf(name, sizeof name, "%s", lb_outputs[index]);
    else if (media == VST3_AUDIO) snprintf(name, sizeof name, "Out");
    to_wide(bus->name, name);
    return VST3_OK;
}

static vst3_result routing(void *self, void *in, void *out) { return VST3_MISSING; }

/* Inactive buses have no memory: their strings' sound is discarded. */
static vst3_result activate_bus(void *self, int32_t media, int32_t direction, int32_t index, uint8_t on) {
    return index >= 0 && index < bus_count(self, media, direction) ? VST3_OK : VST3_INVALID;
}

static vst3_result set_active(void *self, uint8_t on) {
    vst3 *v = of(self);
    lb_stop_loader(&v->loader);
    if (!on) {
        lb_deactivate_instance(&v->instance);
        return VST3_OK;
    }
    if (!v->instance.shelf || !lb_activate_instance(&v->instance, v->instance.rate)) return VST3_NO;
    lb_start_loader(&v->loader, &v->instance);
    return VST3_OK;
}

static vst3_result set_state(void *self, vst3_stream **from) {
    vst3 *v = of(self);
    char *bytes = malloc(LB_MAX_STATE);
    int32_t got = 0, count = 0;
    if (!bytes || !v->instance.shelf) {
        free(bytes);
        return VST3_NO;
    }
    while (count < LB_MAX_STATE && (*from)->read(from, bytes + count, LB_MAX_STATE - count, &got) == VST3_OK && got > 0) count += got;
    const int good = lb_load_state(&v->instance, bytes, (size_t)count);
    free(bytes);
    if (!good) return VST3_NO;
    show_all(v);
    lb_serve(&v->instance);
    if (v->handler) (*v->handler)->restart(v->handler, VST3_VALUES_CHANGED); /* JUCE asks for none after a preset */
    tell_switches(v);
    return VST3_OK;
}

static vst3_result get_state(void *self, vst3_stream **to) {
    vst3 *v = of(self);
    size_t count;
    int32_t written = 0;
    void *state = v->instance.shelf ? lb_new_state(&v->instance, &count) : 0;
    if (!state) return VST3_NO;
    const vst3_result result = (*to)->write(to, state, (int32_t)count, &written);
    free(state);
    return result;
}

/* --- processor --- */

static vst3_result set_arrangements(void *self, uint64_t *in, int32_t ins, uint64_t *out, int32_t outs) {
    vst3 *v = of(self);
    if (ins || outs != bus_count(self, VST3_AUDIO, VST3_OUTPUT)) return VST3_NO;
    const int stereo = !v->apart && out[0] == VST3_SPEAKERS_STEREO; /* for hosts without mono: the same twice */
    for (int32_t k = 0; k < outs; k++)
        if (out[k] != VST3_SPEAKER_MONO && !stereo) return VST3_NO;
    v->stereo = stereo;
    return VST3_OK;
}

static vst3_result arrangement(void *self, int32_t direction, int32_t index, uint64_t *out) {
    vst3 *v = of(self);
    if (index < 0 || index >= bus_count(self, VST3_AUDIO, direction)) return VST3_INVALID;
    *out = v->stereo ? VST3_SPEAKERS_STEREO : VST3_SPEAKER_MONO;
    return VST3_OK;
}

static vst3_result can_sample_size(void *self, int32_t size) { return size == VST3_SAMPLE_32 ? VST3_OK : VST3_NO; }

static uint32_t latency(void *self) { return 0; }

static uint32_t tail(void *self) { return (uint32_t)(TAIL * of(self)->instance.rate); }

static vst3_result setup(void *self, vst3_setup *s) {
    vst3 *v = of(self);
    if (s->sample_size != VST3_SAMPLE_32) return VST3_NO;
    v->instance.rate = s->rate;
    lb_set_offline(&v->instance, s->mode == VST3_OFFLINE);
    return VST3_OK;
}

static vst3_result set_processing(void *self, uint8_t on) {
    vst3 *v = of(self);
    if (on && v->instance.synth && v->instance.synth->record.frame) lb_reset_instance(&v->instance);
    return VST3_OK;
}

/* Returns 0 for a note, 1 for a note's expression, 2 for any other event. */
static int use_of(const vst3_event *e) {
    if (e->type == VST3_NOTE_ON || e->type == VST3_NOTE_OFF) return 0;
    if (e->type == VST3_NOTE_PRESSURE) return 1;
    const uint32_t x = e->expression.type;
    const int known = x == VST3_TUNING || x == VST3_VIBRATO || x == VST3_BRIGHTNESS;
    return e->type == VST3_NOTE_EXPRESSION && known ? 1 : 2;
}

/* Returns a place for a frame's change number k; 0 if there are too many. */
static change *add(vst3 *v, int32_t offset, int kind, int32_t k) {
    if (v->change_count == CHANGES) return 0;
    change *c = &v->changes[v->change_count];
    const int64_t at = offset > 0 ? offset : 0;
    c->order = (2 * at + (kind != CHANGE)) * PLACES + (k < PLACES ? k : PLACES - 1);
    c->kind = kind;
    v->change_count++;
    return c;
}

/* Returns a block's queue of points number k, and its id, if the parameter is ours; else 0. */
static vst3_queue **queue_of(const vst3_process_data *d, int32_t k, uint32_t *id) {
    vst3_queue **q = (*d->changes)->queue(d->changes, k);
    if (q) *id = (*q)->id(q);
    return q && (*id < LB_PARAMETERS || lb_find_hidden(*id) >= 0) ? q : 0;
}

/* A point's number in its frame. If a queue has several points in a frame, each goes with the other queues' points of
   the same turn; an RPN's selection always comes before its data, regardless of the host's order. */
static int32_t number_of(const vst3 *v, uint32_t id, int repeat) {
    const int hidden = lb_find_hidden(id), controller = hidden < 0 ? -1 : lb_hidden_at(hidden).controller;
    const int selects = controller == RPN_LOW || controller == RPN_HIGH;
    return (2 * (repeat < MAX_REPEATS ? repeat : MAX_REPEATS) + !selects) * CHANGES + v->change_count;
}

/* Collects the host's notes; then their last bends, while half of the places are free; then its parameter points. If
   these outnumber the places left, it takes every `step`-th of each queue, and its last. */
static void collect(vst3 *v, const vst3_process_data *d) {
    vst3_event event;
    vst3_queue **q;
    uint32_t id;
    int32_t offset;
    double value;
    v->change_count = 0;
    const int32_t events = d->events ? (*d->events)->count(d->events) : 0;
    for (int use = 0; use < 2; use++) {
        for (int32_t k = events - 1; k >= 0 && (use == 0 || v->change_count < CHANGES / 2); k--) {
            if ((*d->events)->get(d->events, k, &event) != VST3_OK || use_of(&event) != use) continue;
            change *c = add(v, event.offset, event.type, k);
            if (c) c->event = event;
        }
    }
    const int32_t queues = d->changes ? (*d->changes)->count(d->changes) : 0;
    int64_t points = 0, places = CHANGES - v->change_count;
    for (int32_t k = 0; k < queues; k++)
        if ((q = queue_of(d, k, &id))) points += (*q)->count(q);
    const int64_t thin = places - 2 * (int64_t)queues; /* a queue may take two above its share: its first and last */
    const int64_t step = points <= places ? 1 : points / (thin > 1 ? thin : 1) + 1;
    for (int32_t k = 0; k < queues; k++) {
        if (!(q = queue_of(d, k, &id))) continue;
        const int32_t last = (*q)->count(q) - 1;
        int64_t before = -1;
        int repeat = 0;
        for (int32_t j = 0; j <= last; j++) {
            if ((j % step && j != last) || (*q)->point(q, j, &offset, &value) != VST3_OK) continue;
            repeat = offset == before ? repeat + 1 : 0;
            before = offset;
            change *c = add(v, offset, CHANGE, number_of(v, id, repeat));
            if (!c) continue;
            c->id = id;
            c->value = value;
        }
    }
}

/* Sorts the changes by frame, in order of arrival within a frame (Shell's sort: qsort may allocate). */
static void sort(vst3 *v) {
    for (int gap = 701; gap; gap = gap == 2 ? 1 : gap * 4 / 9) {
        for (int k = gap; k < v->change_count; k++) {
            const change c = v->changes[k];
            int j = k;
            for (; j >= gap && v->changes[j - gap].order > c.order; j -= gap) v->changes[j] = v->changes[j - gap];
            v->changes[j] = c;
        }
    }
}

static void tell_controller(lb_instance *i, int64_t offset, lb_hidden to, double value) {
    const int wheel = (int)lrint(fmin(fmax(value, 0), 1) * 16383), seven = (int)lrint(fmin(fmax(value, 0), 1) * 127);
    const int channel = to.channel, number = to.controller;
    const uint8_t bend[] = {(uint8_t)(0xE0 | channel), wheel & 127, (uint8_t)(wheel >> 7)};
    const uint8_t pressure[] = {(uint8_t)(0xD0 | channel), (uint8_t)seven};
    const uint8_t other[] = {(uint8_t)(0xB0 | channel), (uint8_t)number, (uint8_t)seven};
    if (number == VST3_BEND) lb_take_midi(i, offset, bend, sizeof bend);
    else if (number == VST3_PRESSURE) lb_take_midi(i, offset, pressure, sizeof pressure);
    else lb_take_midi(i, offset, other, sizeof other);
}

static void express(vst3 *v, int64_t at, uint32_t type, int32_t id, double value) {
    lb_instance *i = &v->instance;
    if (type == VST3_TUNING) lb_express(i, at, (lb_named){-1, -1, -1, id}, LB_EXPRESS_BEND, SEMITONES * (value - 0.5));
    else if (type == VST3_VIBRATO) lb_express(i, at, (lb_named){-1, -1, -1, id}, LB_EXPRESS_VIBRATO, value);
    else lb_express_place(i, at, (lb_named){-1, -1, -1, id}, value);
}

/* Places the note of change k by a later expression in the same frame. */
static void place_note(vst3 *v, int k) {
    const change *c = &v->changes[k];
    for (int j = k + 1; j < v->change_count && v->changes[j].order / PLACES == c->order / PLACES; j++) {
        const vst3_event *e = &v->changes[j].event;
        if (v->changes[j].kind == VST3_NOTE_EXPRESSION && e->expression.type == VST3_BRIGHTNESS &&
            e->expression.id == c->event.on.id)
            lb_express_place(&v->instance, c->order / FRAME, (lb_named){-1, -1, c->event.on.key, -1},
                             e->expression.value);
    }
}

/* True if change k is the brightness of a note beginning in its frame: place_note has used it. */
static int is_placed(const vst3 *v, int k) {
    const change *c = &v->changes[k];
    if (c->kind != VST3_NOTE_EXPRESSION || c->event.expression.type != VST3_BRIGHTNESS) return 0;
    for (int j = k - 1; j >= 0 && v->changes[j].order / PLACES == c->order / PLACES; j--)
        if (v->changes[j].kind == VST3_NOTE_ON && v->changes[j].event.on.id == c->event.expression.id) return 1;
    return 0;
}

/* Moves a hidden parameter's controller. Hosts may write every default back, which must change nothing: LB_UNMOVED only
   returns the hand to its place; and until they are moved, the default of a wheel begins no vibrato again, nor does a
   controller's move a parameter that it has learned. MIDI's middle of a wheel is a 33 000th above its default. */
static void tell_hidden(vst3 *v, int64_t at, int hidden, double value) {
    lb_instance *i = &v->instance;
    const lb_hidden to = lb_hidden_at(hidden);
    const int is_default = fabs(value - to.default_value) < (to.controller == VST3_BEND ? 1e-5 : 1e-3);
    if (is_default && to.default_value == LB_UNMOVED) {
        const LB_INSTRUMENT *in = lb_shelf_instrument(i->shelf, (int)lb_value(i, LB_BASS));
        if (in && to.controller < LB_CONTROLLERS && in->key_map.function[to.controller] == LB_CC_PLACE)
            lb_set_value_at(i, at, LB_PLUCK_POSITION, lb_value(i, LB_PLUCK_POSITION));
        return;
    }
    const int learned = to.controller < LB_CONTROLLERS && lb_learned_by(i, to.controller) >= 0;
    if (is_default && (learned || to.controller == VST3_BEND) && !v->moved[hidden]) return;
    v->moved[hidden] = 1;
    tell_controller(i, at, to, value);
}

/* Sets a parameter, or moves a hidden parameter's controller. */
static void tell_value_of(vst3 *v, int64_t at, uint32_t id, double value) {
    lb_instance *i = &v->instance;
    const int hidden = lb_find_hidden(id);
    if (hidden >= 0) {
        tell_hidden(v, at, hidden, value);
        return;
    }
    lb_set_value_at(i, at, (int)id, plain(v, id, value));
    if (id == LB_QUALITY) v->quality = (int)lb_value(i, LB_QUALITY);
}

static void tell(vst3 *v, const change *c) {
    lb_instance *i = &v->instance;
    const int64_t at = c->order / FRAME;
    const vst3_event *e = &c->event;
    const lb_named on = {-1, e->on.channel, e->on.key, e->on.id}, off = {-1, e->off.channel, e->off.key, e->off.id};
    const lb_named pressed = {-1, e->pressure.channel, e->pressure.key, e->pressure.id};
    if (c->kind == CHANGE) tell_value_of(v, at, c->id, c->value);
    else if (c->kind == VST3_NOTE_ON) {
        lb_start_note(i, at, on, e->on.velocity);
        if (e->on.tuning != 0) lb_express(i, at, on, LB_EXPRESS_BEND, e->on.tuning / 100);
    } else if (c->kind == VST3_NOTE_OFF) lb_stop_note(i, at, off, e->off.velocity);
    else if (c->kind == VST3_NOTE_PRESSURE) lb_express(i, at, pressed, LB_EXPRESS_VIBRATO, e->pressure.pressure);
    else if (c->kind == VST3_NOTE_EXPRESSION) express(v, at, e->expression.type, e->expression.id, e->expression.value);
}

/* Tells the host a parameter's value, 0 to 1, that it did not change; returns 0 if the host does not take it. */
static int tell_value(const vst3_process_data *d, uint32_t id, double value) {
    int32_t index;
    vst3_queue **q = d->output_changes ? (*d->output_changes)->add(d->output_changes, &id, &index) : 0;
    return q && (*q)->add(q, 0, value, &index) == VST3_OK;
}

static void tell_changes(vst3 *v, const vst3_process_data *d) {
    const lb_instance *i = &v->instance;
    const int overload = lb_overload(i->synth), quality = (int)lb_value(i, LB_QUALITY); /* may follow the bass */
    for (int moved; (moved = lb_next_moved(&v->instance)) >= 0;)
        tell_value(d, (uint32_t)moved, normal(v, (uint32_t)moved, lb_value(i, moved)));
    if (overload != v->overload && tell_value(d, OVERLOAD, (double)overload / LB_STRINGS)) v->overload = overload;
    if (quality != v->quality && tell_value(d, LB_QUALITY, quality)) v->quality = quality;
}

static vst3_result process(void *self, vst3_process_data *d) {
    vst3 *v = of(self);
    lb_instance *i = &v->instance;
    float *outs[LB_STRINGS] = {0};
    if (!i->synth) return VST3_NO;
    if ((d->mode == VST3_OFFLINE) != i->offline) lb_set_offline(i, d->mode == VST3_OFFLINE);
    lb_begin_block(i);
    collect(v, d);
    sort(v);
    for (int k = 0; k < v->change_count; k++) {
        if (v->changes[k].kind == VST3_NOTE_ON) place_note(v, k);
        if (!is_placed(v, k)) tell(v, &v->changes[k]);
    }
    for (int32_t k = 0; k < d->output_count && k < LB_STRINGS; k++) {
        if (d->outputs[k].channels > 0 && d->outputs[k].data) outs[k] = d->outputs[k].data[0];
        d->outputs[k].silence = 0;
    }
    if (d->frames <= 0) { /* the host only sends parameters */
        lb_play_block(i, v->apart, outs, 0);
        return VST3_OK;
    }
    lb_play_block(i, v->apart, outs, d->frames);
    tell_changes(v, d);
    for (int32_t k = 0; k < d->output_count && k < LB_STRINGS; k++) {
        int32_t j = 0;
        while (outs[k] && j < d->frames && outs[k][j] == 0) j++;
        if (outs[k] && j == d->frames) d->outputs[k].silence = ((uint64_t)1 << d->outputs[k].channels) - 1;
    }
    for (int32_t k = 1; !v->apart && outs[0] && k < d->outputs[0].channels; k++)
        if (d->outputs[0].data[k]) memcpy(d->outputs[0].data[k], outs[0], sizeof(float) * (size_t)d->frames);
    return VST3_OK;
}

/* --- controller --- */

static vst3_result nothing(void *self, void *x) { return VST3_OK; }

static vst3_result nothing_to_end(void *self) { return VST3_OK; }

static vst3_result nothing_kept(void *self, vst3_stream **stream) { /* the component keeps everything */
    return VST3_OK;
}

/* The unit of a parameter group. */
static int32_t group_of(const char *group) {
    for (int32_t k = 0; k < LB_GROUPS; k++)
        if (!strcmp(lb_groups[k], group)) return k + 1;
    return VST3_ROOT_UNIT;
}

static int32_t parameter_count(void *self) { return LB_PARAMETERS + LB_HIDDEN + 1; }

/* The unit that hosts add to a value's text; those of sliders are in the text, as a bass has them. */
static const char *unit_of(uint32_t id) { return lb_is_slider((int)id) ? "" : lb_parameters[id].unit; }

static vst3_result parameter_info(void *self, int32_t index, vst3_parameter *p) {
    const vst3 *v = of(self);
    char name[64];
    if (index < 0 || index >= parameter_count(self)) return VST3_INVALID;
    memset(p, 0, sizeof *p);
    if (index == LB_PARAMETERS + LB_HIDDEN) {
        p->id = OVERLOAD;
        p->steps = LB_STRINGS;
        p->flags = VST3_IS_READ_ONLY;
        p->unit = group_of("Processor");
        to_wide(p->title, "Overload");
        return VST3_OK;
    }
    if (index >= LB_PARAMETERS) {
        const lb_hidden hidden = lb_hidden_at(index - LB_PARAMETERS);
        lb_hidden_name(index - LB_PARAMETERS, name);
        p->id = hidden.id;
        p->default_value = hidden.default_value;
        p->flags = VST3_IS_HIDDEN;
        p->unit = MIDI_UNIT; /* some hosts list hidden parameters, too */
        to_wide(p->title, name);
        return VST3_OK;
    }
    const lb_parameter *known = &lb_parameters[index];
    p->id = (uint32_t)index;
    p->unit = index == LB_BASS ? VST3_ROOT_UNIT : group_of(known->group); /* the root has the list of programs */
    to_wide(p->title, known->name);
    to_wide(p->unit_name, unit_of(p->id));
    p->default_value = normal(v, p->id, lb_default(&v->instance, index));
    /* The bass is not automatable: on a longer shelf the same value from 0 to 1 is another bass; sessions save its
       name. Others must be: Ardour hides parameters that are not, except programs. */
    p->flags = index == LB_BASS || index == LB_CORES ? 0 : VST3_CAN_AUTOMATE;
    if (known->whole) p->steps = (int32_t)(lb_maximum(&v->instance, index) - known->minimum);
    if (known->points || index == LB_BASS) p->flags |= VST3_IS_LIST;
    if (index == LB_BASS) p->flags |= VST3_IS_PROGRAM_CHANGE;
    return VST3_OK;
}

/* Cuts a value's text off before that unit. */
static void cut_unit(char *text, const char *unit) {
    char *at = *unit ? strstr(text, unit) : 0;
    if (at) at[-1] = 0;
}

static vst3_result value_to_text(void *self, uint32_t id, double x, vst3_text out) {
    const vst3 *v = of(self);
    char text[256];
    if (id < LB_PARAMETERS) {
        lb_value_to_text(&v->instance, (int)id, plain(v, id, x), text, sizeof text);
        cut_unit(text, unit_of(id));
    } else if (id == OVERLOAD) snprintf(text, sizeof text, "%.0f", x * LB_STRINGS);
    else snprintf(text, sizeof text, "%.3f", x);
    to_wide(out, text);
    return VST3_OK;
}

static vst3_result text_to_value(void *self, uint32_t id, int16_t *in, double *x) {
    const vst3 *v = of(self);
    char text[512], *end;
    double value;
    to_narrow(text, sizeof text, in);
    if (id < LB_PARAMETERS) {
        if (!lb_text_to_value(&v->instance, (int)id, text, &value)) return VST3_NO;
        *x = normal(v, id, value);
        return VST3_OK;
    }
    if (id != OVERLOAD && lb_find_hidden(id) < 0) return VST3_NO;
    value = strtod(text, &end);
    if (end == text || !isfinite(value)) return VST3_NO;
    *x = fmin(fmax(id == OVERLOAD ? value / LB_STRINGS : value, 0), 1);
    return VST3_OK;
}

static double to_plain(void *self, uint32_t id, double x) { return plain(of(self), id, x); }

static double to_normal(void *self, uint32_t id, double x) { return normal(of(self), id, x); }

static double value(void *self, uint32_t id) {
    vst3 *v = of(self);
    if (id < LB_PARAMETERS) return normal(v, id, v->shown[id]);
    if (id == OVERLOAD) return (double)v->overload / LB_STRINGS;
    const int hidden = lb_find_hidden(id);
    return hidden < 0 ? 0 : v->hidden[hidden];
}

static vst3_result set_value(void *self, uint32_t id, double x) {
    vst3 *v = of(self);
    const int hidden = lb_find_hidden(id);
    if (hidden >= 0) v->hidden[hidden] = x;
    if (id >= LB_PARAMETERS) return hidden >= 0 || id == OVERLOAD ? VST3_OK : VST3_INVALID;
    v->shown[id] = plain(v, id, x);
    if (v->instance.synth && id != LB_BASS) return VST3_OK; /* process() gets it */
    lb_set_value(&v->instance, (int)id, v->shown[id]);
    if (!v->instance.synth) /* quality may follow the bass; else process() tells it */
        v->quality = (int)(v->shown[LB_QUALITY] = lb_value(&v->instance, LB_QUALITY));
    if (id == LB_BASS) tell_switches(v);
    return VST3_OK;
}

static vst3_result set_handler(void *self, void *handler) {
    static const vst3_id wanted = VST3_HANDLER;
    vst3 *v = of(self);
    vst3_unknown **given = handler;
    void *found = 0;
    if (given && (*given)->query(given, wanted, &found) != VST3_OK) found = 0;
    if (v->handler) (*v->handler)->unknown.drop(v->handler);
    v->handler = found;
    return VST3_OK;
}

/* --- the window --- */

static void tell_moves(void *owner) {
    vst3 *v = owner;
    for (lb_move m; lb_take_move(&v->instance.moves, &m);) {
        const uint32_t id = (uint32_t)m.parameter;
        v->shown[id] = m.value;
        if (!v->handler) continue;
        if (m.phase == LB_BEGIN) (*v->handler)->begin(v->handler, id);
        else if (m.phase == LB_MOVE) (*v->handler)->perform(v->handler, id, normal(v, id, m.value));
        else (*v->handler)->end(v->handler, id);
    }
}

/* [main thread] */
static void tell_by_hand(void *owner) {
    tell_moves(owner);
    tell_switches(owner);
}

/* Used without a timer; with X11, in the window's own thread, which is not the main thread. */
static void moved(void *owner) {
    vst3 *v = owner;
    if (__atomic_load_n(&v->timed, __ATOMIC_RELAXED)) return;
    if (strcmp(LB_WINDOWS, "x11")) tell_by_hand(v);
    else tell_moves(v);
}

static void take_owner(void *owner) { take(((vst3 *)owner)->faces); }
static void drop_owner(void *owner) { drop(((vst3 *)owner)->faces); }

static void *create_view(void *self, const char *name) {
    vst3 *v = of(self);
    const lb_view_owner owner = {v, &v->instance, take_owner, drop_owner, tell_by_hand, &v->attached, &v->timed};
    return strcmp(name, "editor") || !v->instance.shelf ? 0 : lb_new_vst3_view(&owner);
}

/* --- MIDI controllers --- */

static vst3_result mapped(void *self, int32_t bus, int16_t channel, int16_t number, uint32_t *id) {
    if (bus || number < 0 || number >= VST3_CONTROLLERS) return VST3_NO;
    *id = lb_hidden_id(channel >= 0 && channel < LB_CHANNELS ? channel : -1, number);
    return VST3_OK;
}

/* --- instruments as programs --- */

static int32_t one(void *self) { return 1; }

static int32_t unit_count(void *self) { return 1 + MIDI_UNIT; }

static vst3_result unit_info(void *self, int32_t index, vst3_unit *unit) {
    if (index < 0 || index >= unit_count(self)) return VST3_INVALID;
    memset(unit, 0, sizeof *unit);
    if (index) {
        unit->id = index;
        unit->parent = VST3_ROOT_UNIT;
        unit->programs = VST3_NO_UNIT;
        to_wide(unit->name, index == MIDI_UNIT ? "MIDI" : lb_groups[index - 1]);
        return VST3_OK;
    }
    unit->id = VST3_ROOT_UNIT;
    unit->parent = VST3_NO_UNIT;
    unit->programs = PROGRAMS;
    to_wide(unit->name, "livebass");
    return VST3_OK;
}

static vst3_result programs_info(void *self, int32_t index, vst3_programs *list) {
    if (index) return VST3_INVALID;
    memset(list, 0, sizeof *list);
    list->id = PROGRAMS;
    list->count = lb_shelf_count(of(self)->instance.shelf);
    to_wide(list->name, "Instruments");
    return VST3_OK;
}

static vst3_result program_name(void *self, int32_t list, int32_t program, vst3_text name) {
    const lb_shelf *shelf = of(self)->instance.shelf;
    if (list != PROGRAMS || program < 0 || program >= lb_shelf_count(shelf)) return VST3_INVALID;
    to_wide(name, lb_shelf_title(shelf, program));
    return VST3_OK;
}

static vst3_result program_info(void *self, int32_t list, int32_t program, const char *attribute, vst3_text out) {
    out[0] = 0;
    return VST3_NO;
}

static vst3_result has_pitch_names(void *self, int32_t list, int32_t program) {
    return list == PROGRAMS && program >= 0 && program < lb_shelf_count(of(self)->instance.shelf) ? VST3_OK
                                                                                                       : VST3_NO;
}

/* Names the switch on an instrument's key. */
static vst3_result pitch_name(void *self, int32_t list, int32_t program, int16_t key, vst3_text out) {
    const int known = has_pitch_names(self, list, program) == VST3_OK && key >= 0 && key < LB_KEY_COUNT;
    const lb_switch *s = known ? lb_shelf_switch(of(self)->instance.shelf, program, key) : 0;
    to_wide(out, s ? s->name : "");
    return s ? VST3_OK : VST3_NO;
}

static int32_t selected_unit(void *self) { return VST3_ROOT_UNIT; }

static vst3_result select_unit(void *self, int32_t unit) {
    return unit >= VST3_ROOT_UNIT && unit <= MIDI_UNIT ? VST3_OK : VST3_INVALID;
}

static vst3_result unit_of_bus(void *self, int32_t media, int32_t direction, int32_t bus, int32_t channel,
                               int32_t *unit) {
    *unit = VST3_ROOT_UNIT;
    return VST3_OK;
}

static vst3_result set_program_data(void *self, int32_t list, int32_t program, vst3_stream **data) { return VST3_NO; }

/* --- the expressions of notes --- */

static const struct {
    uint32_t type, physical; /* physical: its motion on a keyboard */
    const char *name;
    double default_value;
} known_expressions[] = {
    {VST3_TUNING, VST3_MOVED_X, "Tuning", 0.5},
    {VST3_VIBRATO, VST3_PRESSED, "Vibrato", 0},
    {VST3_BRIGHTNESS, VST3_MOVED_Y, "Plucking place", 0.5},
};
enum { EXPRESSION_COUNT = sizeof known_expressions / sizeof *known_expressions };

/* A type's index in that list; -1: there is none. */
static int find_expression(uint32_t type) {
    int k = EXPRESSION_COUNT - 1;
    while (k >= 0 && known_expressions[k].type != type) k--;
    return k;
}

/* Needs nothing from the host's transport. */
static uint32_t requirements(void *self) { return 0; }

static vst3_result physical_mapping(void *self, int32_t bus, int16_t channel, vst3_physicals *requested) {
    if (bus) return VST3_INVALID;
    for (uint32_t j = 0; j < requested->count; j++) {
        requested->map[j].expression = UINT32_MAX;
        for (int k = 0; k < EXPRESSION_COUNT; k++)
            if (known_expressions[k].physical == requested->map[j].physical)
                requested->map[j].expression = known_expressions[k].type;
    }
    return VST3_OK;
}

static int32_t expression_count(void *self, int32_t bus, int16_t channel) { return bus ? 0 : EXPRESSION_COUNT; }

static vst3_result expression_info(void *self, int32_t bus, int16_t channel, int32_t index, vst3_expression *e) {
    if (index < 0 || index >= expression_count(self, bus, channel)) return VST3_INVALID;
    memset(e, 0, sizeof *e);
    e->type = known_expressions[index].type;
    e->unit = VST3_NO_UNIT;
    e->default_value = known_expressions[index].default_value;
    e->maximum = 1;
    e->flags = e->type == VST3_VIBRATO ? 0 : VST3_IS_BIPOLAR;
    to_wide(e->title, known_expressions[index].name);
    to_wide(e->unit_name, e->type == VST3_TUNING ? "semitones" : "");
    return VST3_OK;
}

static vst3_result expression_to_text(void *self, int32_t bus, int16_t channel, uint32_t type, double x,
                                      vst3_text out) {
    char text[64];
    if (find_expression(type) < 0 || !expression_count(self, bus, channel)) return VST3_INVALID;
    snprintf(text, sizeof text, "%.2f", type == VST3_TUNING ? SEMITONES * (x - 0.5) : x);
    to_wide(out, text);
    return VST3_OK;
}

static vst3_result expression_from_text(void *self, int32_t bus, int16_t channel, uint32_t type, const int16_t *in,
                                        double *x) {
    char text[512], *end;
    if (find_expression(type) < 0 || !expression_count(self, bus, channel)) return VST3_INVALID;
    to_narrow(text, sizeof text, in);
    const double semitones = strtod(text, &end);
    if (end == text) return VST3_NO;
    *x = fmin(fmax(type == VST3_TUNING ? semitones / SEMITONES + 0.5 : semitones, 0), 1);
    return VST3_OK;
}

/* --- the key switches of the bass --- */

static int32_t switch_count(void *self, int32_t bus, int16_t channel) {
    uint32_t count = LB_KEY_COUNT;
    lb_switch_key(&of(self)->instance, &count);
    return bus ? 0 : (int32_t)count;
}

static vst3_result switch_info(void *self, int32_t bus, int16_t channel, int32_t index, vst3_switch *s) {
    const lb_instance *i = &of(self)->instance;
    uint32_t number = (uint32_t)index;
    const int key = bus || index < 0 ? -1 : lb_switch_key(i, &number);
    if (key < 0) return VST3_INVALID;
    memset(s, 0, sizeof *s);
    s->type = VST3_BEFORE_NOTES;
    s->minimum = s->maximum = key;
    s->remapped = -1;
    s->unit = VST3_NO_UNIT;
    to_wide(s->title, lb_switch_name(i, key));
    to_wide(s->short_title, lb_switch_name(i, key));
    return VST3_OK;
}

/* --- the factory --- */

static const vst3_component component_table = {
    {query, take, drop}, initialize, terminate, controller_class, set_io_mode, bus_count,
    bus_info, routing, activate_bus, set_active, set_state, get_state,
};
static const vst3_processor processor_table = {
    {query, take, drop}, set_arrangements, arrangement, can_sample_size, latency, setup,
    set_processing, process, tail,
};
static const vst3_controller controller_table = {
    {query, take, drop}, nothing, nothing_to_end, nothing_kept, nothing_kept,
    nothing_kept, parameter_count, parameter_info, value_to_text, text_to_value, to_plain, to_normal, value, set_value,
    set_handler, create_view,
};
static const vst3_midi_mapping mapping_table = {{query, take, drop}, mapped};
static const vst3_units units_table = {
    {query, take, drop}, unit_count, unit_info, one, programs_info, program_name, program_info,
    has_pitch_names, pitch_name, selected_unit, select_unit, unit_of_bus, set_program_data,
};
static const vst3_expressions expressions_table = {
    {query, take, drop}, expression_count, expression_info, expression_to_text,
    expression_from_text,
};
static const vst3_context context_table = {{query, take, drop}, requirements};
static const vst3_physical_mapping physical_table = {{query, take, drop}, physical_mapping};
static const vst3_switches switches_table = {{query, take, drop}, switch_count, switch_info};

static vst3_result factory_query(void *self, const vst3_id id, void **out) {
    static const vst3_id known[] = {VST3_UNKNOWN, VST3_FACTORY, VST3_FACTORY_2};
    for (int k = 0; k < 3; k++)
        if (!memcmp(id, known[k], sizeof(vst3_id))) {
            *out = self;
            return VST3_OK;
        }
    *out = 0;
    return VST3_NO_INTERFACE;
}

static uint32_t factory_users(void *self) { /* it is never freed */
    return 1;
}

static vst3_result factory_info(void *self, vst3_factory_info *info) {
    memset(info, 0, sizeof *info);
    snprintf(info->vendor, sizeof info->vendor, "livebass");
    info->flags = VST3_UNICODE;
    return VST3_OK;
}

static int32_t class_count(void *self) { return sizeof classes / sizeof *classes; }

static vst3_result class_info_2(void *self, int32_t index, vst3_class_2 *c) {
    if (index < 0 || index >= class_count(self)) return VST3_INVALID;
    memset(c, 0, sizeof *c);
    memcpy(c->id, classes[index], sizeof c->id);
    c->cardinality = VST3_MANY;
    snprintf(c->category, sizeof c->category, "Audio Module Class");
    snprintf(c->name, sizeof c->name, "%s", names[index]);
    snprintf(c->sub_categories, sizeof c->sub_categories, "Instrument|Synth");
    snprintf(c->vendor, sizeof c->vendor, "livebass");
    snprintf(c->release, sizeof c->release, "%s", LB_RELEASE);
    snprintf(c->sdk, sizeof c->sdk, "VST 3.7");
    return VST3_OK;
}

static vst3_result class_info(void *self, int32_t index, vst3_class *c) {
    vst3_class_2 all;
    const vst3_result result = class_info_2(self, index, &all);
    if (result == VST3_OK) memcpy(c, &all, sizeof *c); /* the same fields come first */
    return result;
}

static vst3_result create(void *self, const vst3_id class_id, const vst3_id interface_id, void **out) {
    *out = 0;
    for (int32_t k = 0; k < class_count(self); k++) {
        if (memcmp(class_id, classes[k], sizeof(vst3_id))) continue;
        vst3 *v = calloc(1, sizeof *v);
        if (!v) return VST3_NO;
        const void *tables[] = {
            &component_table, &processor_table, &controller_table, &mapping_table, &units_table, &expressions_table,
            &switches_table, &context_table, &physical_table,
        };
        for (int t = 0; t < INTERFACES; t++) v->faces[t] = (face){tables[t], v};
        v->users = 1;
        v->apart = k == 1;
        for (int h = 0; h < LB_HIDDEN; h++) v->hidden[h] = lb_hidden_at(h).default_value;
        v->instance.owner = v;
        v->instance.complain = lb_complain; /* VST3 has no log */
        v->instance.ask = ask;
        v->instance.moved = moved;
        v->instance.learns = 1;
        v->instance.rate = 48000;
        const vst3_result result = query(v->faces, interface_id, out);
        drop(v->faces);
        return result;
    }
    return VST3_INVALID;
}

LB_EXPORTED void *GetPluginFactory(void) {
    static const vst3_factory table = {
        {factory_query, factory_users, factory_users}, factory_info, class_count, class_info, create, class_info_2,
    };
    static const void *only = &table;
    return &only;
}

#if defined(_WIN32)
LB_EXPORTED bool InitDll(void) { return true; }
LB_EXPORTED bool ExitDll(void) { return true; }
#elif defined(__APPLE__)
LB_EXPORTED bool bundleEntry(void *bundle) { return true; }
LB_EXPORTED bool bundleExit(void) { return true; }
#else
LB_EXPORTED bool ModuleEntry(void *library) { return true; }
LB_EXPORTED bool ModuleExit(void) { return true; }
#endif
