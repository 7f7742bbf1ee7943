/* The LV2 plugin: ports, MIDI, state and worker of a synth. run() allocates nothing and opens no file.

   The bundle holds instrument files, NAME.lbass, and instruments.txt, their names, a line each, in the order of the port
   `instrument`. The first one is loaded by instantiate(); others by the host's worker, or when a state is restored. */
#include "core.h"
#include "lv2_abi.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define URI "urn:livebass:bass"
enum { MIDI, OUT, GAIN, INSTRUMENT, QUALITY, PORTS }; /* new ports come last: sessions know the old ones */
enum { MOST_INSTRUMENTS = 128, NAME = 64, LINE = 1500 };
enum { LOAD, FREE };

typedef struct {
    int kind, instrument, quality;
    lb_bass *bass;
} job;

typedef struct {
    char folder[1024], names[MOST_INSTRUMENTS][NAME];
    int count;
    double rate;
    int64_t seed;
    const lb_kernels *kernels;
    lb_synth *synth;
    int instrument, quality; /* of the bass that was put on last */
    int seen_instrument, seen_quality; /* what the ports said last; -1: not looked at yet */
    int restored;            /* a state said what to play: ports count once they move */
    int loading;             /* a job is under way */
    const lv2_sequence *midi;
    float *out;
    const float *controls[PORTS];
    uint32_t midi_event, string, whole, error, key_instrument, key_quality, key_seed;
    const lv2_schedule *worker;
    const lv2_log *log;
} plugin;

static void complain(const plugin *p, const char *line) {
    if (p->log) p->log->print(p->log->handle, p->error, "livebass: %s\n", line);
    else fprintf(stderr, "livebass: %s\n", line);
}

/* Reads the names of the bundle's instruments; returns 0 if there is none. */
static int read_names(plugin *p) {
    char path[LINE], line[LINE];
    snprintf(path, sizeof path, "%s/instruments.txt", p->folder);
    FILE *in = fopen(path, "r");
    while (in && p->count < MOST_INSTRUMENTS && fgets(line, sizeof line, in)) {
        line[strcspn(line, "\r\n")] = 0;
        if (*line && strlen(line) < NAME) strcpy(p->names[p->count++], line);
    }
    if (in) fclose(in);
    if (!p->count) {
        snprintf(line, sizeof line, "%.1400s: names no instrument", path);
        complain(p, line);
    }
    return p->count;
}

/* Loads an instrument; says why if it cannot. [not the audio thread] */
static lb_bass *load(const plugin *p, int instrument, int quality) {
    char path[LINE], why[LINE + 100];
    snprintf(path, sizeof path, "%s/%s.lbass", p->folder, p->names[instrument]);
    lb_bass *b = lb_load_bass(path, quality, p->rate, p->seed, p->kernels, why, sizeof why);
    if (!b) complain(p, why);
    return b;
}

static void cleanup(void *handle) {
    plugin *p = handle;
    if (p->synth) lb_put_on(p->synth, 0);
    lb_free_synth(p->synth);
    free(p);
}

static void *instantiate(const lv2_plugin *d, double rate, const char *folder, const lv2_feature *const *features) {
    (void)d;
    const lv2_map *map = 0;
    plugin *p = calloc(1, sizeof *p);
    if (!p) return 0;
    for (; *features; features++) {
        if (!strcmp((*features)->uri, LV2_MAP)) map = (*features)->data;
        if (!strcmp((*features)->uri, LV2_SCHEDULE)) p->worker = (*features)->data;
        if (!strcmp((*features)->uri, LV2_LOG)) p->log = (*features)->data;
    }
    if (!map || strlen(folder) >= sizeof p->folder) {
        free(p);
        return 0;
    }
    strcpy(p->folder, folder);
    p->rate = rate;
    p->kernels = lb_best_kernels();
    p->error = map->map(map->handle, LV2_LOG_ERROR);
    p->midi_event = map->map(map->handle, LV2_MIDI_EVENT);
    p->string = map->map(map->handle, LV2_STRING);
    p->whole = map->map(map->handle, LV2_LONG);
    p->key_instrument = map->map(map->handle, URI "#instrument");
    p->key_quality = map->map(map->handle, URI "#quality");
    p->key_seed = map->map(map->handle, URI "#seed");
    lb_bass *b = read_names(p) ? load(p, 0, LB_LIVE) : 0;
    p->synth = b ? lb_new_synth(rate, p->kernels) : 0;
    if (!p->synth) {
        lb_free_bass(b);
        cleanup(p);
        return 0;
    }
    lb_put_on(p->synth, b);
    return p;
}

static void connect_port(void *handle, uint32_t port, void *data) {
    plugin *p = handle;
    if (port == MIDI) p->midi = data;
    else if (port == OUT) p->out = data;
    else if (port < PORTS) p->controls[port] = data;
}

static void activate(void *handle) {
    plugin *p = handle;
    lb_reset_synth(p->synth);
    p->seen_instrument = p->seen_quality = -1;
}

/* The value of a control port, a whole number from 0 to below `end`; `otherwise` if there is none. */
static int chosen(const plugin *p, int port, int end, int otherwise) {
    if (!p->controls[port] || !(*p->controls[port] >= -0.5f && *p->controls[port] < (float)end - 0.5f)) return otherwise;
    return (int)lrintf(*p->controls[port]);
}

/* Has the worker load another bass, if the ports ask for one and the change before is through. */
static void follow_ports(plugin *p) {
    const LB_SYNTH *r = &p->synth->record;
    const int instrument = chosen(p, INSTRUMENT, p->count, p->instrument);
    const int quality = chosen(p, QUALITY, LB_STUDIO + 1, p->quality);
    if (p->seen_instrument < 0 && p->restored) {
        p->seen_instrument = instrument;
        p->seen_quality = quality;
    }
    if (instrument == p->seen_instrument && quality == p->seen_quality) return;
    if (p->loading || r->next_bass || r->faded_bass || !p->worker) return;
    p->seen_instrument = instrument;
    p->seen_quality = quality;
    if (instrument == p->instrument && quality == p->quality) return;
    const job j = {LOAD, instrument, quality, 0};
    p->loading = p->worker->schedule(p->worker->handle, sizeof j, &j) == LV2_SUCCESS;
}

static void run(void *handle, uint32_t frames) {
    plugin *p = handle;
    LB_SYNTH *r = &p->synth->record;
    if (p->controls[GAIN]) {
        r->gain_target = *p->controls[GAIN] > -60.0f ? pow(10.0, *p->controls[GAIN] / 20.0) : 0.0;
        if (!r->frame) r->gain = r->gain_target;
    }
    follow_ports(p);
    if (p->midi) {
        const char *at = (const char *)(p->midi + 1), *end = (const char *)p->midi + sizeof(lv2_atom) + p->midi->atom.size;
        while (at + sizeof(lv2_event) <= end) {
            const lv2_event *e = (const lv2_event *)at;
            if (e->body.type == p->midi_event) lb_send(p->synth, e->frame, (const uint8_t *)(e + 1), e->body.size);
            at += sizeof *e + (e->body.size + 7) / 8 * 8;
        }
    }
    lb_play(p->synth, p->out, frames);
    if (r->faded_bass && p->worker) {
        const job j = {FREE, 0, 0, lb_bass_at(r->faded_bass)};
        if (p->worker->schedule(p->worker->handle, sizeof j, &j) == LV2_SUCCESS) r->faded_bass = 0;
    }
}

static void deactivate(void *handle) { (void)handle; }

static int work(void *handle, lv2_respond respond, void *to, uint32_t size, const void *data) {
    plugin *p = handle;
    job j;
    if (size != sizeof j) return LV2_UNKNOWN;
    memcpy(&j, data, sizeof j);
    if (j.kind == FREE) {
        lb_free_bass(j.bass);
        return LV2_SUCCESS;
    }
    j.bass = load(p, j.instrument, j.quality);
    return respond(to, sizeof j, &j);
}

static int work_response(void *handle, uint32_t size, const void *data) { /* audio thread */
    plugin *p = handle;
    job j;
    if (size != sizeof j) return LV2_UNKNOWN;
    memcpy(&j, data, sizeof j);
    p->loading = 0;
    if (j.bass) {
        p->synth->record.next_bass = lb_address(j.bass);
        p->instrument = j.instrument;
        p->quality = j.quality;
    }
    return LV2_SUCCESS;
}

static int save(void *handle, lv2_store store, void *to, uint32_t flags, const lv2_feature *const *features) {
    (void)flags;
    (void)features;
    plugin *p = handle;
    const char *name = p->names[p->instrument];
    const int64_t quality = p->quality;
    store(to, p->key_seed, &p->seed, sizeof p->seed, p->whole, LV2_PLAIN);
    store(to, p->key_quality, &quality, sizeof quality, p->whole, LV2_PLAIN);
    return store(to, p->key_instrument, name, strlen(name) + 1, p->string, LV2_PLAIN);
}

/* A whole number of a state; `otherwise` if it has none. */
static int64_t kept(const plugin *p, lv2_retrieve get, void *from, uint32_t key, int64_t otherwise) {
    size_t size = 0;
    uint32_t type = 0, flags = 0;
    const void *value = get(from, key, &size, &type, &flags);
    if (value && size == sizeof otherwise && type == p->whole) memcpy(&otherwise, value, size);
    return otherwise;
}

static int restore(void *handle, lv2_retrieve get, void *from, uint32_t flags, const lv2_feature *const *features) {
    (void)features; /* run() is not called meanwhile: no state:threadSafeRestore is declared */
    plugin *p = handle;
    size_t size = 0;
    uint32_t type = 0;
    const char *name = get(from, p->key_instrument, &size, &type, &flags);
    if (!name || type != p->string || !memchr(name, 0, size)) return LV2_NO_PROPERTY;
    const int64_t quality = kept(p, get, from, p->key_quality, LB_LIVE);
    for (int k = 0; k < p->count; k++) {
        if (strcmp(name, p->names[k])) continue;
        p->seed = kept(p, get, from, p->key_seed, 0);
        lb_bass *b = load(p, k, quality == LB_STUDIO ? LB_STUDIO : LB_LIVE);
        if (!b) return LV2_UNKNOWN;
        lb_put_on(p->synth, b);
        p->instrument = k;
        p->quality = quality == LB_STUDIO ? LB_STUDIO : LB_LIVE;
        p->restored = 1;
        p->seen_instrument = p->seen_quality = -1;
        return LV2_SUCCESS;
    }
    complain(p, "the session's instrument is not in this bundle");
    return LV2_UNKNOWN;
}

static const void *extension_data(const char *uri) {
    static const lv2_worker worker = {work, work_response, 0};
    static const lv2_state state = {save, restore};
    return !strcmp(uri, LV2_WORKER) ? (const void *)&worker : !strcmp(uri, LV2_STATE) ? (const void *)&state : 0;
}

#ifdef _WIN32
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
const lv2_plugin *lv2_descriptor(uint32_t index) {
    static const lv2_plugin only = {URI,        instantiate, connect_port, activate, run,
                                    deactivate, cleanup,     extension_data};
    return index ? 0 : &only;
}
