/* A host of CLAP plugins for tests: claphost FILE.clap SECONDS SEED [THREADS [OUT [WINDOW]]]

   Plays random events of every kind in blocks of random sizes, changes basses, saves and loads states, starts anew now
   and then. It has THREADS for the tasks of plugins, if more than 0, and declines them now and then. Writes the sound
   to OUT unless that is -, float32, the same in every run. Opens the plugin's window in the one with the number WINDOW
   of X11, on Windows in one of its own, and closes and opens it again now and then. Prints the number of blocks, the
   allocations made and locks taken within process() and tasks (counted when compiled with -DCOUNT), and the greatest
   sample. With -DWITHIN the plugin is linked to it. */
#ifdef COUNT
#define _GNU_SOURCE
#endif
#include "abi/clap.h"
#include "chance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#define dlopen(path, how) ((void *)LoadLibraryA(path))
#define dlsym(library, name) ((void *)(intptr_t)GetProcAddress((HMODULE)(library), name))
#else
#include <dlfcn.h>
#include <pthread.h>
#endif
#ifdef WITHIN
extern const clap_plugin_entry clap_entry;
#endif

#ifdef COUNT
#include "counting.h"
static int (*lock)(pthread_mutex_t *), (*try_lock)(pthread_mutex_t *), (*wait_for)(pthread_cond_t *, pthread_mutex_t *);
int pthread_mutex_lock(pthread_mutex_t *m) { allocations += inside; return lock ? lock(m) : 0; }
int pthread_mutex_trylock(pthread_mutex_t *m) { allocations += inside; return try_lock ? try_lock(m) : 0; }
int pthread_cond_wait(pthread_cond_t *c, pthread_mutex_t *m) { allocations += inside; return wait_for(c, m); }
__attribute__((constructor)) static void find_locks(void) {
    *(void **)&try_lock = dlsym(RTLD_NEXT, "pthread_mutex_trylock");
    *(void **)&wait_for = dlsym(RTLD_NEXT, "pthread_cond_wait");
    *(void **)&lock = dlsym(RTLD_NEXT, "pthread_mutex_lock");
}
#else
static _Atomic int allocations;
static _Thread_local int inside;
#endif

enum { RATE = 48000, EVENTS = 8, MAXIMUM = 2048, OUTPUTS = 8, STATE = 1 << 20 };
typedef union {
    clap_event head;
    clap_note note;
    clap_note_expression expression;
    clap_param_value value;
    clap_midi midi;
} event;
static event events[EVENTS];
static uint32_t event_count;
static int requested, quiet;
static char state[STATE];
static uint64_t state_size, state_read;
static float sound[OUTPUTS][MAXIMUM];

static double random_between(double a, double b) { return a + (b - a) * random_below(1 << 20) / (1 << 20); }

static void say(const clap_host *h, int32_t severity, const char *line) {
    fprintf(stderr, "%s\n", line);
}

#ifndef _WIN32
/* --- threads for tasks of plugins --- */

static struct {
    pthread_mutex_t lock;
    pthread_cond_t given, done;
    const clap_plugin *plugin;
    const clap_thread_pool *tasks;
    uint32_t next, count, left;
} pool = {.lock = PTHREAD_MUTEX_INITIALIZER, .given = PTHREAD_COND_INITIALIZER, .done = PTHREAD_COND_INITIALIZER};

static void *work(void *nothing) {
    pthread_mutex_lock(&pool.lock);
    for (;;) {
        while (pool.next == pool.count) pthread_cond_wait(&pool.given, &pool.lock);
        const uint32_t task = pool.next++;
        pthread_mutex_unlock(&pool.lock);
        inside = 1;
        pool.tasks->exec(pool.plugin, task);
        inside = 0;
        pthread_mutex_lock(&pool.lock);
        if (!--pool.left) pthread_cond_signal(&pool.done);
    }
    return nothing;
}

static bool share(const clap_host *h, uint32_t count) {
    static uint32_t requested;
    if (requested++ % 8 == 7) return false;
    inside = 0; /* these locks are the host's */
    pthread_mutex_lock(&pool.lock);
    pool.next = 0;
    pool.count = pool.left = count;
    pthread_cond_broadcast(&pool.given);
    while (pool.left) pthread_cond_wait(&pool.done, &pool.lock);
    pthread_mutex_unlock(&pool.lock);
    inside = 1;
    return true;
}
#endif

static int threads;

static const void *extension(const clap_host *h, const char *id) {
    static const clap_host_log log = {say};
#ifndef _WIN32
    static const clap_host_thread_pool sharing = {share};
    if (threads && !strcmp(id, CLAP_THREAD_POOL)) return &sharing;
#endif
    return strcmp(id, CLAP_LOG) ? 0 : &log;
}

static void nothing(const clap_host *h) {}

static void ask(const clap_host *h) {
    requested = 1;
}

static uint32_t size(const clap_in_events *l) {
    return event_count;
}

static const clap_event *get(const clap_in_events *l, uint32_t k) {
    return &events[k].head;
}

static bool push(const clap_out_events *l, const clap_event *e) {
    return true;
}

static int64_t write_state(const clap_out_stream *s, const void *bytes, uint64_t n) {
    if (n > 11) n = 11;
    memcpy(state + state_size, bytes, n);
    state_size += n;
    return (int64_t)n;
}

static int64_t read_state(const clap_in_stream *s, void *bytes, uint64_t n) {
    if (n > state_size - state_read) n = state_size - state_read;
    if (n > 7) n = 7;
    memcpy(bytes, state + state_read, n);
    state_read += n;
    return (int64_t)n;
}

/* Fills in one random event for a frame. */
static void invent(event *e, const clap_plugin *p, const clap_params *params, uint32_t frame) {
    const uint32_t kind = random_below(16);
    const int16_t key = (int16_t)(24 + random_below(46));
    memset(e, 0, sizeof *e);
    e->head.time = frame;
    e->head.size = sizeof *e;
    if (kind < 6) {
        e->head.type = CLAP_NOTE_ON;
        e->note.key = key;
        e->note.note_id = key;
        e->note.velocity = random_between(0.0, 1.0);
    } else if (kind < 9) {
        e->head.type = kind == 8 ? CLAP_NOTE_CHOKE : CLAP_NOTE_OFF;
        e->note.key = random_below(20) ? key : -1;
    } else if (kind < 11) {
        e->head.type = CLAP_NOTE_EXPRESSION;
        e->expression.expression = (int32_t)random_below(7);
        e->expression.note_id = kind == 9 ? key : -1;
        e->expression.key = kind == 9 ? -1 : key;
        e->expression.value = random_between(-2.0, 2.0);
    } else if (kind < 14) {
        static const uint8_t statuses[] = {0x90, 0xB0, 0xE0, 0xD0, 0xC0, 0xF8};
        e->head.type = CLAP_MIDI;
        e->midi.data[0] = statuses[random_below(6)];
        e->midi.data[1] = (uint8_t)random_below(128);
        e->midi.data[2] = (uint8_t)random_below(128);
    } else {
        clap_param_info info;
        const uint32_t id = random_below(kind == 14 ? 8 : params->count(p));
        params->info(p, id, &info);
        e->head.type = CLAP_PARAM_VALUE;
        e->value.id = id;
        e->value.value = id == 0 ? random_between(-12.0, 6.0) : random_between(info.minimum, info.maximum);
        if (!random_below(40)) e->value.value = random_below(2) ? NAN : 1e30;
    }
}

/* The window that the word WINDOW is for. */
static uintptr_t parent_of(const char *word) {
#ifdef _WIN32
    return (uintptr_t)CreateWindowExW(0, L"STATIC", L"claphost", WS_POPUP | WS_VISIBLE, 0, 0, 900, 460, 0, 0, 0, 0);
#else
    return (uintptr_t)strtoull(word, 0, 10);
#endif
}

/* Has windows draw themselves that have no thread of their own. */
static void draw_windows(void) {
#ifdef _WIN32
    for (MSG message; PeekMessageW(&message, 0, 0, 0, PM_REMOVE);) DispatchMessageW(&message);
#endif
}

/* Opens the window in the one called `parent`. */
static int open_window(const clap_plugin *p, const clap_gui *gui, uintptr_t parent) {
    const char *api;
    bool floating;
    if (!gui->get_preferred_api(p, &api, &floating)) return 0;
    const clap_window window = {api, parent};
    return gui->create(p, window.api, false) && gui->set_parent(p, &window) && gui->show(p);
}

int main(int count, char **words) {
    if (count < 4) return 2;
#ifdef WITHIN
    const clap_plugin_entry *entry = &clap_entry;
#else
    void *library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL);
    const clap_plugin_entry *entry = library ? dlsym(library, "clap_entry") : 0;
#endif
    if (!entry || !entry->init(words[1])) return 3;
    const double seconds = atof(words[2]);
    seed = (uint32_t)atoi(words[3]);
    threads = count > 4 ? atoi(words[4]) : 0;
    FILE *out = count > 5 && strcmp(words[5], "-") ? fopen(words[5], "wb") : 0;
    const uintptr_t parent = count > 6 ? parent_of(words[6]) : 0;
    quiet = out != 0;
    const clap_plugin_factory *factory = entry->get_factory(CLAP_PLUGIN_FACTORY);
    const clap_host host = {CLAP_VERSION, 0, "claphost", "", "", "1", extension, nothing, nothing, ask};
    const uint32_t apart = seed & 1, outputs = apart ? OUTPUTS : 1;
    const clap_plugin *p = factory->create(factory, &host, factory->descriptor(factory, apart)->id);
    if (!p || !p->init(p) || !p->activate(p, RATE, 1, MAXIMUM) || !p->start_processing(p)) return 4;
    const clap_render *render = p->get_extension(p, CLAP_RENDER);
    if (quiet && !render->set(p, CLAP_OFFLINE)) return 4; /* relief and running ahead have a clock */
#ifndef _WIN32
    pool.plugin = p;
    pool.tasks = p->get_extension(p, CLAP_THREAD_POOL);
    pthread_t worker;
    for (int k = 0; k < threads; k++)
        if (pthread_create(&worker, 0, work, 0)) return 4;
#endif
    const clap_params *params = p->get_extension(p, CLAP_PARAMS);
    const clap_state *states = p->get_extension(p, "clap.state");
    const clap_gui *gui = p->get_extension(p, CLAP_GUI);
    if (parent && !open_window(p, gui, parent)) return 9;
    const clap_in_events in = {0, size, get};
    const clap_out_events taken = {0, push};
    const clap_out_stream to = {0, write_state};
    const clap_in_stream from = {0, read_state};
    clap_audio_buffer buffers[OUTPUTS];
    float *channels[OUTPUTS];
    double greatest = 0;
    int64_t done = 0, blocks = 0;
    while (done < (int64_t)(seconds * RATE)) {
        const uint32_t frames = random_below(8) ? 1 + random_below(512) : 1 + random_below(MAXIMUM);
        uint32_t frame = 0;
        event_count = random_below(EVENTS + 1);
        for (uint32_t k = 0; k < event_count; k++) {
            frame += random_below(frames - frame);
            invent(&events[k], p, params, frame);
        }
        for (uint32_t k = 0; k < outputs; k++) {
            channels[k] = sound[k];
            buffers[k] = (clap_audio_buffer){&channels[k], 0, 1, 0, 0};
        }
        const clap_process block = {done, frames, 0, 0, buffers, 0, outputs, &in, &taken};
        inside = 1;
        const int32_t status = p->process(p, &block);
        inside = 0;
        if (status == CLAP_PROCESS_ERROR) return 5;
        for (uint32_t k = 0; k < outputs; k++) {
            for (uint32_t j = 0; j < frames; j++) greatest = fmax(greatest, fabs(sound[k][j]));
            if (out) fwrite(sound[k], sizeof(float), frames, out);
        }
        if (requested && random_below(3)) {
            requested = 0;
            p->on_main_thread(p);
        }
        if (!random_below(200)) {
            state_size = 0;
            if (!states->save(p, &to)) return 6;
        }
        if (state_size && !random_below(150)) {
            state_read = 0;
            if (!states->load(p, &from)) return 7;
        }
        if (!random_below(400)) p->reset(p);
        if (!random_below(700)) {
            p->stop_processing(p);
            p->deactivate(p);
            if (!p->activate(p, RATE, 1, MAXIMUM) || !p->start_processing(p)) return 8;
        }
        done += frames;
        blocks++;
        draw_windows();
        if (parent && blocks % 100 == 0) {
            gui->destroy(p);
            if (!open_window(p, gui, parent)) return 9;
        }
    }
    if (parent) gui->destroy(p);
    p->stop_processing(p);
    p->deactivate(p);
    p->destroy(p);
    entry->deinit();
    if (out) fclose(out);
    printf("%lld %d %.3f\n", (long long)blocks, allocations, greatest);
    return 0;
}
