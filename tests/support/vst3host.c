/* A host of VST3 plugins for tests: vst3host FILE SECONDS SEED OUT [WINDOW]

   Plays random notes and changes of parameters offline, in blocks of random sizes, and writes the sound to OUT,
   float32, the same in every run. The plugin is that with a mono output, or with an output a string for an odd SEED.
   With WINDOW, on Windows, its view is open meanwhile, in a window of the host's own, and closed and opened again now
   and then. Prints the number of blocks and the greatest sample. */
#include "abi/vst3.h"
#include "chance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#define ENTRY "InitDll"
#define dlopen(path, how) ((void *)LoadLibraryA(path))
#define dlsym(library, name) ((void *)(intptr_t)GetProcAddress((HMODULE)(library), name))
#else
#include <dlfcn.h>
#define ENTRY "ModuleEntry"
#endif

enum { RATE = 48000, MAXIMUM = 2048, EVENTS = 6, OUTPUTS = 8, AUTOMATED = 8, OLDEST = 64 };
static vst3_event events[EVENTS];
static int32_t event_count, moved;
static uint32_t parameter;
static double value;
static float sound[OUTPUTS][MAXIMUM];

/* --- what the host gives: events, and at most one parameter that moves at the beginning of a block --- */

static vst3_result no_other(void *self, const vst3_id id, void **out) {
    *out = 0;
    return VST3_NO_INTERFACE;
}
static uint32_t users(void *self) {
    return 1;
}
#define UNKNOWN {no_other, users, users}

static int32_t count_events(void *self) {
    return event_count;
}
static vst3_result give_event(void *self, int32_t index, vst3_event *to) {
    *to = events[index];
    return VST3_OK;
}
static const vst3_events event_table = {UNKNOWN, count_events, give_event};

static uint32_t id_of_parameter(void *self) {
    return parameter;
}
static int32_t one(void *self) {
    return 1;
}
static vst3_result give_point(void *self, int32_t index, int32_t *offset, double *to) {
    *offset = 0;
    *to = value;
    return VST3_OK;
}
static const vst3_queue queue_table = {UNKNOWN, id_of_parameter, one, give_point, 0};
static const vst3_queue *queue = &queue_table;

static int32_t count_moved(void *self) {
    return moved;
}
static vst3_queue **give_queue(void *self, int32_t index) {
    return (vst3_queue **)&queue;
}
static vst3_queue **no_queue(void *self, const uint32_t *id, int32_t *index) {
    return 0;
}
static const vst3_changes change_table = {UNKNOWN, count_moved, give_queue, no_queue};

/* Fills in what happens in a block of n frames: notes that begin, and end by their numbers. */
static void invent(int32_t n) {
    static int32_t last;
    int32_t at = 0;
    event_count = (int32_t)random_below(EVENTS + 1);
    for (int32_t k = 0; k < event_count; k++) {
        vst3_event *e = &events[k];
        memset(e, 0, sizeof *e);
        at += (int32_t)random_below((uint32_t)(n - at));
        e->offset = at;
        e->type = random_below(3) ? VST3_NOTE_ON : VST3_NOTE_OFF;
        if (e->type == VST3_NOTE_ON) {
            e->on.id = ++last;
            e->on.key = (int16_t)(28 + last * 7 % 36);
            e->on.velocity = (float)(1 + random_below(127)) / 127;
        } else {
            e->off.id = last > 0 ? last - (int32_t)random_below((uint32_t)(last < OLDEST ? last : OLDEST)) : 1;
            e->off.key = (int16_t)(28 + e->off.id * 7 % 36);
        }
    }
    moved = !random_below(4);
    parameter = random_below(AUTOMATED);
    value = (0.5 + random_below(128)) / 128;
}

#ifdef _WIN32
/* Opens a view in a window of the host's, or draws, or with 0 closes it. */
static int see(vst3_controller **controller, int on) {
    static vst3_view **view;
    static HWND frame;
    if (!frame) frame = CreateWindowExW(0, L"STATIC", L"vst3host", WS_POPUP | WS_VISIBLE, 0, 0, 900, 460, 0, 0, 0, 0);
    for (MSG message; PeekMessageW(&message, 0, 0, 0, PM_REMOVE);) DispatchMessageW(&message);
    if (on == (view != 0)) return 1;
    if (on) return (view = (*controller)->create_view(controller, "editor")) != 0 &&
                   (*view)->attached(view, frame, "HWND") == VST3_OK;
    const vst3_result closed = (*view)->removed(view);
    (*view)->unknown.drop(view);
    view = 0;
    return closed == VST3_OK;
}
#else
static int see(vst3_controller **controller, int on) {
    return !on;
}
#endif

int main(int count, char **words) {
    if (count < 5) return 2;
    void *library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL);
    if (!library || !dlsym(library, ENTRY)) return 3;
    const int seconds = atoi(words[2]), seen = count > 5;
    seed = (uint32_t)atoi(words[3]);
    FILE *out = fopen(words[4], "wb");
    void *(*get_factory)(void) = (void *(*)(void))dlsym(library, "GetPluginFactory");
    vst3_factory **factory = get_factory ? get_factory() : 0;
    const vst3_id component_id = VST3_COMPONENT, processor_id = VST3_PROCESSOR, controller_id = VST3_CONTROLLER;
    const int32_t apart = seed & 1, outputs = apart ? OUTPUTS : 1;
    vst3_class class;
    vst3_component **c;
    vst3_processor **p;
    vst3_controller **controller;
    if (!out || !factory || (*factory)->class_info(factory, apart, &class) != VST3_OK) return 3;
    if ((*factory)->create(factory, class.id, component_id, (void **)&c) != VST3_OK) return 4;
    if ((*c)->unknown.query(c, processor_id, (void **)&p) != VST3_OK) return 4;
    if ((*c)->unknown.query(c, controller_id, (void **)&controller) != VST3_OK) return 4;
    vst3_setup setup = {VST3_OFFLINE, VST3_SAMPLE_32, MAXIMUM, RATE};
    if ((*c)->initialize(c, 0) != VST3_OK || (*p)->setup(p, &setup) != VST3_OK) return 5;
    for (int32_t k = 0; k < outputs; k++) (*c)->activate_bus(c, VST3_AUDIO, VST3_OUTPUT, k, 1);
    (*c)->activate_bus(c, VST3_EVENTS, VST3_INPUT, 0, 1);
    if ((*c)->set_active(c, 1) != VST3_OK) return 5;
    (*p)->set_processing(p, 1);
    const vst3_events *in = &event_table;
    const vst3_changes *changes = &change_table;
    float *channels[OUTPUTS];
    vst3_buffers buffers[OUTPUTS];
    double greatest = 0;
    int blocks = 0;
    for (int64_t done = 0; done < (int64_t)seconds * RATE; blocks++) {
        const int32_t n = 1 + (int32_t)random_below(random_below(8) ? 512 : MAXIMUM);
        invent(n);
        for (int k = 0; k < outputs; k++) {
            channels[k] = sound[k];
            buffers[k] = (vst3_buffers){1, 0, &channels[k]};
        }
        vst3_process_data block = {
            .mode = VST3_OFFLINE, .sample_size = VST3_SAMPLE_32, .frames = n, .output_count = outputs,
            .outputs = buffers, .changes = (vst3_changes **)&changes, .events = (vst3_events **)&in,
        };
        if ((*p)->process(p, &block) != VST3_OK) return 6;
        for (int k = 0; k < outputs; k++) {
            for (int32_t j = 0; j < n; j++) greatest = fmax(greatest, fabs(sound[k][j]));
            fwrite(sound[k], sizeof(float), (size_t)n, out);
        }
        if (!see(controller, seen && blocks % 100 < 80)) return 7;
        done += n;
    }
    if (!see(controller, 0)) return 7;
    (*p)->set_processing(p, 0);
    (*c)->set_active(c, 0);
    (*c)->terminate(c);
    (*controller)->unknown.drop(controller);
    (*p)->unknown.drop(p);
    (*c)->unknown.drop(c);
    fclose(out);
    printf("%d %.3f\n", blocks, greatest);
    return 0;
}
