/* The LV2 plugins: ports, MIDI, state and worker of a synth. run() allocates nothing and opens no file.

   There are two: one with a mono output, one with an output a string. The bundle holds instrument files, NAME.lbass, and
   instruments.txt, their names, a line each; they and the user's own (lb_open_shelf) are the values of the port `bass`.
   The first one is loaded by instantiate(); others by the host's worker, or when a state is restored. */
#include "lv2_ports.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
static void rest(void) { Sleep(1); }
#else
#include <time.h>
static void rest(void) { nanosleep(&(struct timespec){0, 1000000}, 0); }
#endif

enum { LINE = 1500, NAME = 64, MIDNAM = 1 << 14 };
enum { LOAD, FREE, HELP };

typedef struct {
    int bass, quality, ahead;
    float built[LB_BUILT]; /* values from LB_ACTION on */
} choice;

typedef struct {
    int kind, generation; /* void if p->generation, of HELP p->activation, has changed since */
    choice of;
    lb_bass *bass;
    int cores;
} job;

typedef struct {
    lb_shelf *shelf;
    double rate;
    int64_t seed;
    const lb_kernels *kernels;
    lb_synth *synth;
    choice playing; /* the bass that was put on last */
    choice wanted;  /* the bass that shall play */
    choice seen;    /* what the ports said last; -1: not looked at yet */
    int missing;    /* the state named a bass that is not there, `missing_name`: saved until another is chosen */
    char missing_name[NAME];
    int restored;   /* a state said what to play: the ports `bass` and `quality` count once they move */
    int running;    /* the audio thread is in run() or work_response() ... */
    int held;       /* ... and must stay out, as restore() changes what plays */
    int loading;    /* a job of this generation is under way */
    int generation; /* changed by restore(): jobs before that are void but those of threads, which outlast it ... */
    int activation; /* ... and by activate() and deactivate(), as this: all are, the host may have dropped them */
    lb_bass *faded; /* waits for the worker to free it */
    int cores;      /* that the worker was asked for last */
    int outputs;
    const lv2_sequence *midi;
    float *outs[LB_STRINGS];
    const float *controls[CONTROLS];
    float *overload;  /* the strings that are relieved */
    lv2_sequence *shown;    /* looks, for a window */
    lb_look look;
    uint64_t looks;         /* that were sent */
    double watched;         /* s until there is no window, unless it says again that there is one */
    lb_sides sides[2];      /* the one that counts, and the next: save() may read while run() is called */
    int sides_at, sides_asked; /* the window is to be told of them */
    lb_taps taps;           /* what was played in it */
    uint32_t sequence, look_atom, watch_atom, touch_atom, sides_atom;
    int64_t programs; /* program changes that have been answered */
    float sent[LB_PARAMETERS]; /* what the synth was told last; NaN: nothing */
    uint32_t midi_event, string, whole, real, error, key_bass, key_quality, key_seed, key_side;
    uint32_t key_aside[LB_PARAMETERS]; /* of the other side's values; 0: it has none of its own */
    const lv2_schedule *worker;
    const lv2_log *log;
    const lv2_midnam_host *names; /* takes notice of the names of other key switches */
    int named;                    /* the bass whose switches they are */
} plugin;

static void complain(const plugin *p, const char *line) {
    if (p->log) p->log->print(p->log->handle, p->error, "livebass: %s\n", line);
    else fprintf(stderr, "livebass: %s\n", line);
}

/* Loads a bass of the shelf, with a seed; says why if it cannot. [not the audio thread] */
static lb_bass *load(const plugin *p, choice c, int64_t seed) {
    char why[LINE];
    double built[LB_BUILT];
    for (int k = 0; k < LB_BUILT; k++) built[k] = c.built[k];
    const char *path = lb_shelf_path(p->shelf, c.bass);
    lb_bass *b = lb_load_bass(path, c.quality, p->rate, seed, c.ahead, built, p->kernels, why, sizeof why);
    if (!b) complain(p, why);
    return b;
}

static void cleanup(void *handle) {
    plugin *p = handle;
    lb_free_bass(p->faded);
    lb_free_synth(p->synth);
    lb_close_shelf(p->shelf);
    free(p);
}

/* Changes A and B. [one thread] */
static void set_sides(plugin *p, const lb_sides *to) {
    const int other = !p->sides_at;
    p->sides[other] = *to;
    __atomic_store_n(&p->sides_at, other, __ATOMIC_RELEASE);
}

static void begin_sides(lb_sides *s) {
    s->side = 0;
    for (int k = 0; k < LB_PARAMETERS; k++) s->aside[k] = lb_parameters[k].usual;
}

static void forget_ports(plugin *p) {
    p->programs = 0; /* the synth is as new */
    memset(&p->taps, 0, sizeof p->taps);
    p->seen = (choice){-1, -1, -1, {0}};
    for (int k = 0; k < LB_BUILT; k++) p->seen.built[k] = NAN;
    for (int k = 0; k < LB_PARAMETERS; k++) p->sent[k] = NAN;
}

static void *instantiate(const lv2_plugin *d, double rate, const char *folder, const lv2_feature *const *features) {
    const lv2_map *map = 0;
    plugin *p = calloc(1, sizeof *p);
    if (!p) return 0;
    for (; *features; features++) {
        if (!strcmp((*features)->uri, LV2_MAP)) map = (*features)->data;
        if (!strcmp((*features)->uri, LV2_SCHEDULE)) p->worker = (*features)->data;
        if (!strcmp((*features)->uri, LV2_LOG)) p->log = (*features)->data;
        if (!strcmp((*features)->uri, LV2_MIDNAM_UPDATE)) p->names = (*features)->data;
    }
    if (!map) {
        free(p);
        return 0;
    }
    p->outputs = strcmp(d->uri, URI) ? LB_STRINGS : 1;
    p->rate = rate;
    p->kernels = lb_best_kernels();
    p->error = map->map(map->handle, LV2_LOG_ERROR);
    p->midi_event = map->map(map->handle, LV2_MIDI_EVENT);
    p->sequence = map->map(map->handle, LV2_SEQUENCE);
    p->look_atom = map->map(map->handle, LOOK_ATOM);
    p->watch_atom = map->map(map->handle, WATCH_ATOM);
    p->touch_atom = map->map(map->handle, TOUCH_ATOM);
    p->sides_atom = map->map(map->handle, SIDES_ATOM);
    p->string = map->map(map->handle, LV2_STRING);
    p->whole = map->map(map->handle, LV2_LONG);
    p->real = map->map(map->handle, LV2_FLOAT);
    p->key_bass = map->map(map->handle, URI "#bass");
    p->key_quality = map->map(map->handle, URI "#quality");
    p->key_seed = map->map(map->handle, URI "#seed");
    p->key_side = map->map(map->handle, URI "#side");
    for (int k = 0; k < LB_PARAMETERS; k++) {
        char key[LINE];
        snprintf(key, sizeof key, URI "#aside-%s", lb_parameters[k].symbol);
        if (lb_is_of_sides(k)) p->key_aside[k] = map->map(map->handle, key);
    }
    begin_sides(&p->sides[0]);
    p->shelf = lb_open_shelf(folder);
    lb_bass *b = 0;
    if (!p->shelf || !lb_shelf_count(p->shelf)) {
        char line[LINE];
        snprintf(line, sizeof line, "%.1400s: there is no instrument", folder);
        complain(p, line);
    } else {
        p->playing.quality = p->wanted.quality = lb_shelf_quality(p->shelf, 0);
        b = load(p, p->playing, p->seed);
    }
    p->synth = b ? lb_new_synth(rate, p->kernels) : 0;
    if (!p->synth) {
        lb_free_bass(b);
        cleanup(p);
        return 0;
    }
    lb_put_on(p->synth, b);
    lb_begin_looks(&p->look, p->synth);
    forget_ports(p);
    return p;
}

static void connect_port(void *handle, uint32_t port, void *data) {
    plugin *p = handle;
    const uint32_t first_control = FIRST_OUT + (uint32_t)p->outputs;
    if (port == MIDI) p->midi = data;
    else if (port < first_control) p->outs[port - FIRST_OUT] = data;
    else if (port < first_control + CONTROLS) p->controls[port - first_control] = data;
    else if (port == first_control + CONTROLS) p->overload = data;
    else if (port == first_control + CONTROLS + 1) p->shown = data;
}

/* A host is not to call run() while it calls restore(), as no state:threadSafeRestore is declared, but Ardour does, for
   presets: then nothing plays meanwhile. Returns 0 if the audio thread must stay out. */
static int begin_run(plugin *p) {
    __atomic_store_n(&p->running, 1, __ATOMIC_SEQ_CST);
    if (!__atomic_load_n(&p->held, __ATOMIC_SEQ_CST)) return 1;
    __atomic_store_n(&p->running, 0, __ATOMIC_SEQ_CST);
    return 0;
}
static void end_run(plugin *p) { __atomic_store_n(&p->running, 0, __ATOMIC_SEQ_CST); }

/* Keeps the audio thread out, once it is through with its block, and lets it in again. */
static void hold(plugin *p) {
    __atomic_store_n(&p->held, 1, __ATOMIC_SEQ_CST);
    while (__atomic_load_n(&p->running, __ATOMIC_SEQ_CST)) rest();
}
static void let_in(plugin *p) { __atomic_store_n(&p->held, 0, __ATOMIC_SEQ_CST); }

/* Makes the answers that are still to come stale. [not while run() is called] */
static void void_jobs(plugin *p) {
    __atomic_fetch_add(&p->generation, 1, __ATOMIC_RELEASE);
    p->loading = 0;
}

/* Has no threads that play strings, and makes all jobs stale. [not while run() is called] */
static void end_help(plugin *p) {
    void_jobs(p);
    __atomic_fetch_add(&p->activation, 1, __ATOMIC_RELEASE);
    lb_set_helpers(p->synth, 0);
    p->cores = 1;
}

static int is_stale(const plugin *p, const job *j) {
    return j->generation != __atomic_load_n(j->kind == HELP ? &p->activation : &p->generation, __ATOMIC_ACQUIRE);
}

static void activate(void *handle) {
    plugin *p = handle;
    end_help(p);
    lb_reset_synth(p->synth);
    lb_begin_looks(&p->look, p->synth);
    forget_ports(p);
}

/* The value of a control port, a whole number from 0 to below `end`; `otherwise` if there is none. */
static int chosen(const plugin *p, int control, int end, int otherwise) {
    const float *at = p->controls[control];
    return at && *at >= -0.5f && *at < (float)end - 0.5f ? (int)lrintf(*at) : otherwise;
}

/* Has the worker load a bass, if the ports ask for another and the change before is through. */
static void follow_ports(plugin *p) {
    choice now = {chosen(p, LB_BASS, lb_shelf_count(p->shelf), p->wanted.bass),
                  chosen(p, LB_QUALITY, LB_STUDIO + 1, p->wanted.quality),
                  chosen(p, LB_RUNNING_AHEAD, 2, p->wanted.ahead), {0}};
    for (int k = 0; k < LB_BUILT; k++) {
        const lb_parameter *known = &lb_parameters[LB_ACTION + k];
        const float *at = p->controls[LB_ACTION + k];
        if (at && *at == *at) now.built[k] = (float)lb_hundredths(fmin(fmax(*at, known->least), known->most));
    }
    if (p->seen.bass < 0 && p->restored) {
        p->seen.bass = now.bass;
        p->seen.quality = now.quality;
    }
    if (now.bass != p->seen.bass) {
        p->wanted.bass = now.bass;
        __atomic_store_n(&p->missing, 0, __ATOMIC_RELAXED);
    }
    if (now.quality != p->seen.quality) p->wanted.quality = now.quality;
    if (now.ahead != p->seen.ahead) p->wanted.ahead = now.ahead;
    if (memcmp(now.built, p->seen.built, sizeof now.built)) memcpy(p->wanted.built, now.built, sizeof now.built);
    p->seen = now;
    if (p->loading || lb_changing(p->synth) || !p->worker) return;
    if (!memcmp(&p->wanted, &p->playing, sizeof p->wanted)) return;
    const job j = {LOAD, p->generation, p->wanted, 0, 0};
    p->loading = p->worker->schedule(p->worker->handle, sizeof j, &j) == LV2_SUCCESS;
}

/* Tells the synth which parameters the host has moved. */
static void send_parameters(plugin *p) {
    for (int k = 0; k < LB_PARAMETERS; k++) {
        if (lb_parameters[k].kind < 0 || !p->controls[k] || *p->controls[k] == p->sent[k]) continue;
        if (lb_set(p->synth, 0, k, *p->controls[k])) p->sent[k] = *p->controls[k];
    }
    lb_relieve(p->synth, chosen(p, LB_RELIEF, 2, 1));
    lb_offline(p->synth, chosen(p, FREEWHEELING, 2, 0));
}

/* Takes what a window says. */
static void take_atom(plugin *p, const lv2_atom *atom) {
    lb_touch touch;
    lb_sides sides;
    if (atom->type == p->watch_atom) {
        int32_t asks = 0;
        if (atom->size == sizeof asks) memcpy(&asks, atom + 1, sizeof asks);
        if (asks) p->sides_asked = 1;
        p->watched = WATCHED;
    }
    if (atom->type == p->sides_atom && atom->size == sizeof sides) {
        memcpy(&sides, atom + 1, sizeof sides);
        set_sides(p, &sides);
    }
    if (atom->type != p->touch_atom || atom->size != sizeof touch) return;
    memcpy(&touch, atom + 1, sizeof touch);
    if (touch.key < 128 && touch.velocity < 128) lb_play_touch(p->synth, &p->taps, &touch);
}

/* Writes an empty sequence of looks; returns the bytes that its head takes. */
static uint32_t clear_looks(const plugin *p) {
    const uint32_t head = sizeof(lv2_sequence) - sizeof(lv2_atom);
    p->shown->atom = (lv2_atom){head, p->sequence};
    p->shown->unit = p->shown->pad = 0;
    return head;
}

/* Sends a window what is to be seen, or A and B if it asks for them, if there is one and something new. */
static void send_look(plugin *p, const float *out, uint32_t frames) {
    const int watched = p->watched > 0;
    if (watched != p->look.watchers) lb_watch(&p->look, watched);
    p->watched = watched ? p->watched - frames / p->rate : 0;
    lb_take_look(&p->look, p->synth, out, frames < LB_CHUNK ? frames : LB_CHUNK);
    if (!p->shown) return;
    const uint32_t room = p->shown->atom.size, head = clear_looks(p);
    const int sides = p->sides_asked;
    const lv2_atom body = {sides ? sizeof(lb_sides) : sizeof(LB_LOOK), sides ? p->sides_atom : p->look_atom};
    const uint32_t size = (uint32_t)sizeof(lv2_event) + (body.size + 7) / 8 * 8;
    lv2_event *e = (lv2_event *)(p->shown + 1);
    if (!watched || room < head + size || (!sides && p->looks == lb_looks_taken(&p->look))) return;
    if (sides) memcpy(e + 1, &p->sides[p->sides_at], sizeof(lb_sides));
    else if (!lb_read_look(&p->look, 0, (LB_LOOK *)(e + 1))) return;
    if (sides) p->sides_asked = 0;
    else p->looks = lb_looks_taken(&p->look);
    e->frame = 0;
    e->body = body;
    p->shown->atom.size = head + size;
}

static void send_midi(plugin *p) {
    if (!p->midi) return;
    const char *at = (const char *)(p->midi + 1), *end = (const char *)p->midi + sizeof(lv2_atom) + p->midi->atom.size;
    while (end - at >= (ptrdiff_t)sizeof(lv2_event)) {
        const lv2_event *e = (const lv2_event *)at;
        if (e->body.size > (size_t)(end - at) - sizeof *e) return;
        if (e->body.type == p->midi_event) lb_send(p->synth, e->frame, (const uint8_t *)(e + 1), e->body.size);
        else take_atom(p, &e->body);
        const size_t whole = sizeof *e + ((size_t)e->body.size + 7) / 8 * 8;
        if (whole > (size_t)(end - at)) return;
        at += whole;
    }
}

/* Has the worker free a bass; returns 0 if the host takes no job. */
static int free_elsewhere(const plugin *p, lb_bass *b) {
    const job j = {FREE, 0, {0, 0, 0, {0}}, b, 0};
    return p->worker->schedule(p->worker->handle, sizeof j, &j) == LV2_SUCCESS;
}

/* Has the worker start and end threads that play strings; none while the host renders. */
static void follow_cores(plugin *p) {
    const int asked = chosen(p, LB_CORES, (int)lb_parameters[LB_CORES].most + 1, 1);
    const int cores = asked && !p->synth->offline ? asked : 1;
    if (cores == p->cores || !p->worker) return;
    const job j = {HELP, p->activation, {0, 0, 0, {0}}, 0, cores};
    if (p->worker->schedule(p->worker->handle, sizeof j, &j) == LV2_SUCCESS) p->cores = cores;
}

/* Wants the bass of a program change that was played, as `play` does; one of none that is here changes nothing. */
static void answer_program(plugin *p) {
    const LB_SYNTH *r = &p->synth->record;
    if (r->program_count == p->programs) return;
    p->programs = r->program_count;
    const int bass = lb_shelf_program(p->shelf, r->program);
    if (bass < 0) return;
    p->wanted.bass = bass;
    __atomic_store_n(&p->missing, 0, __ATOMIC_RELAXED);
}

/* Plays nothing. */
static void be_silent(const plugin *p, uint32_t frames) {
    for (int k = 0; k < p->outputs; k++)
        if (p->outs[k]) memset(p->outs[k], 0, frames * sizeof *p->outs[k]);
    if (p->shown) clear_looks(p);
}

static void run(void *handle, uint32_t frames) {
    plugin *p = handle;
    if (!begin_run(p)) {
        be_silent(p, frames);
        return;
    }
    follow_ports(p);
    send_parameters(p);
    follow_cores(p);
    lb_end_taps(p->synth, &p->taps);
    send_midi(p);
    if (p->outputs > 1) lb_play_strings(p->synth, p->outs, frames);
    else if (p->outs[0]) lb_play(p->synth, p->outs[0], frames);
    answer_program(p);
    send_look(p, p->outputs > 1 ? p->synth->mix : p->outs[0], frames);
    if (p->overload) *p->overload = (float)lb_overload(p->synth);
    if (!p->faded && p->worker) p->faded = lb_take_faded(p->synth);
    if (p->faded && free_elsewhere(p, p->faded)) p->faded = 0;
    if (p->names && p->named != p->playing.bass) p->names->update(p->names->handle);
    p->named = p->playing.bass;
    end_run(p);
}

static void deactivate(void *handle) {
    end_help(handle);
}

static int work(void *handle, lv2_respond respond, void *to, uint32_t size, const void *data) {
    plugin *p = handle;
    job j;
    if (size != sizeof j) return LV2_UNKNOWN;
    memcpy(&j, data, sizeof j);
    if (j.kind == FREE) {
        lb_free_bass(j.bass);
        return LV2_SUCCESS;
    }
    if (is_stale(p, &j)) return LV2_SUCCESS;
    if (j.kind == HELP) {
        if (!lb_set_helpers(p->synth, j.cores - 1)) complain(p, LB_NO_HELPERS);
        return LV2_SUCCESS;
    }
    j.bass = load(p, j.of, p->seed);
    return respond(to, sizeof j, &j);
}

static int work_response(void *handle, uint32_t size, const void *data) { /* audio thread */
    plugin *p = handle;
    job j;
    if (size != sizeof j) return LV2_UNKNOWN;
    memcpy(&j, data, sizeof j);
    const int in = begin_run(p); /* else restore() makes all answers stale */
    if (!in || is_stale(p, &j)) {
        if (!p->faded) p->faded = j.bass;
        else if (!free_elsewhere(p, j.bass)) lb_free_bass(j.bass); /* a host that drops jobs: rather late than never */
        if (in) end_run(p);
        return LV2_SUCCESS;
    }
    p->loading = 0;
    if (j.bass) {
        lb_change_bass(p->synth, j.bass);
        p->playing = j.of;
    } else if (!memcmp(&j.of, &p->wanted, sizeof j.of)) {
        p->wanted = p->playing; /* it cannot be loaded: not tried again until a port moves */
    }
    end_run(p);
    return LV2_SUCCESS;
}

static int save(void *handle, lv2_store store, void *to, uint32_t flags, const lv2_feature *const *features) {
    (void)flags;
    (void)features;
    plugin *p = handle;
    const int missing = __atomic_load_n(&p->missing, __ATOMIC_RELAXED);
    const char *name = missing ? p->missing_name : lb_shelf_name(p->shelf, p->playing.bass);
    const int64_t quality = p->playing.quality;
    store(to, p->key_seed, &p->seed, sizeof p->seed, p->whole, LV2_PLAIN);
    store(to, p->key_quality, &quality, sizeof quality, p->whole, LV2_PLAIN);
    const lb_sides *sides = &p->sides[__atomic_load_n(&p->sides_at, __ATOMIC_ACQUIRE)];
    if (sides->side) store(to, p->key_side, &sides->side, sizeof sides->side, p->whole, LV2_PLAIN);
    for (int k = 0; k < LB_PARAMETERS; k++) {
        const float value = (float)sides->aside[k];
        if (p->key_aside[k] && value != (float)lb_parameters[k].usual)
            store(to, p->key_aside[k], &value, sizeof value, p->real, LV2_PLAIN);
    }
    return store(to, p->key_bass, name, strlen(name) + 1, p->string, LV2_PLAIN);
}

/* A whole number of a state; `otherwise` if it has none. */
static int64_t kept(const plugin *p, lv2_retrieve get, void *from, uint32_t key, int64_t otherwise) {
    size_t size = 0;
    uint32_t type = 0, flags = 0;
    const void *value = get(from, key, &size, &type, &flags);
    if (value && size == sizeof otherwise && type == p->whole) memcpy(&otherwise, value, size);
    return otherwise;
}

/* A and B of a state, of which it has what is not as in a new instance. */
static void restore_sides(plugin *p, lv2_retrieve get, void *from) {
    lb_sides sides;
    begin_sides(&sides);
    sides.side = kept(p, get, from, p->key_side, 0) == 1;
    for (int k = 0; k < LB_PARAMETERS; k++) {
        size_t size = 0;
        uint32_t type = 0, flags = 0;
        float value;
        const void *at = p->key_aside[k] ? get(from, p->key_aside[k], &size, &type, &flags) : 0;
        if (!at || type != p->real || size != sizeof value) continue;
        memcpy(&value, at, sizeof value);
        if (isfinite(value)) sides.aside[k] = value;
    }
    set_sides(p, &sides);
    p->sides_asked = 1;
}

static int restore(void *handle, lv2_retrieve get, void *from, uint32_t flags, const lv2_feature *const *features) {
    (void)features;
    plugin *p = handle;
    size_t size = 0;
    uint32_t type = 0;
    const char *name = get(from, p->key_bass, &size, &type, &flags);
    if (!name || type != p->string || !memchr(name, 0, size)) return LV2_NO_PROPERTY;
    const int64_t quality = kept(p, get, from, p->key_quality, LB_LIVE);
    const int found = lb_shelf_find(p->shelf, name), missing = found < 0;
    choice c = p->playing; /* built as the ports say, which the host restores */
    c.bass = missing ? p->playing.bass : found;
    c.quality = quality == LB_STUDIO ? LB_STUDIO : LB_LIVE;
    if (missing && !(p->missing && !strcmp(p->missing_name, name))) { /* hosts may bring a state several times */
        char line[LINE];
        snprintf(line, sizeof line, LB_NOT_INSTALLED, name);
        complain(p, line);
    }
    const int64_t seed = kept(p, get, from, p->key_seed, 0);
    lb_bass *b = load(p, c, seed);
    if (!b) return LV2_UNKNOWN;
    hold(p);
    lb_put_on(p->synth, b);
    lb_begin_looks(&p->look, p->synth);
    p->playing = p->wanted = c;
    p->seed = seed;
    p->missing = missing; /* all else is as the state says */
    if (missing) snprintf(p->missing_name, NAME, "%s", name);
    restore_sides(p, get, from);
    p->restored = 1;
    void_jobs(p);
    forget_ports(p);
    let_in(p);
    return LV2_SUCCESS;
}

/* The name of this instance's key switches among others. */
static char *midnam_model(void *handle) {
    char *text = malloc(NAME);
    if (text) snprintf(text, NAME, "livebass %p", handle);
    return text;
}

/* Prints behind the n characters that a text of MIDNAM has; returns how many more it has then. */
static size_t print(char *text, size_t n, const char *form, ...) {
    va_list arguments;
    va_start(arguments, form);
    const int written = vsnprintf(text + n, MIDNAM - n, form, arguments);
    va_end(arguments);
    return written < 0 || (size_t)written >= MIDNAM - n ? 0 : (size_t)written;
}

/* What the keys of the bass switch, as a MIDI Name Document. */
static char *midnam(void *handle) {
    static const char *const head =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<!DOCTYPE MIDINameDocument PUBLIC \"-//MIDI Manufacturers Association//DTD MIDINameDocument 1.0//EN\""
        " \"http://dev.midi.org/dtds/MIDINameDocument10.dtd\">\n"
        "<MIDINameDocument><Author>livebass</Author><MasterDeviceNames><Manufacturer>livebass</Manufacturer>"
        "<Model>livebass %p</Model><CustomDeviceMode Name=\"Default\"><ChannelNameSetAssignments>\n";
    const plugin *p = handle;
    char *text = malloc(MIDNAM);
    if (!text) return 0;
    size_t n = 0;
    n += print(text, n, head, handle);
    for (int k = 1; k <= 16; k++) n += print(text, n, "<ChannelNameSetAssign Channel=\"%d\" NameSet=\"Bass\"/>\n", k);
    n += print(text, n, "</ChannelNameSetAssignments></CustomDeviceMode>\n"
                        "<ChannelNameSet Name=\"Bass\"><AvailableForChannels>\n");
    for (int k = 1; k <= 16; k++) n += print(text, n, "<AvailableChannel Channel=\"%d\" Available=\"true\"/>\n", k);
    n += print(text, n, "</AvailableForChannels><UsesNoteNameList Name=\"Switches\"/></ChannelNameSet>\n"
                        "<NoteNameList Name=\"Switches\">\n");
    for (int key = 0; key < LB_KEY_COUNT; key++) {
        const lb_switch *s = lb_shelf_switch(p->shelf, p->playing.bass, key);
        if (s) n += print(text, n, "<Note Number=\"%d\" Name=\"%s\"/>\n", key, s->name);
    }
    print(text, n, "</NoteNameList></MasterDeviceNames></MIDINameDocument>\n");
    return text;
}

static void free_midnam(char *text) { free(text); }

static const void *extension_data(const char *uri) {
    static const lv2_worker worker = {work, work_response, 0};
    static const lv2_state state = {save, restore};
    static const lv2_midnam names = {midnam, midnam_model, free_midnam};
    if (!strcmp(uri, LV2_WORKER)) return &worker;
    if (!strcmp(uri, LV2_STATE)) return &state;
    return strcmp(uri, LV2_MIDNAM) ? 0 : &names;
}

#ifdef _WIN32
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
const lv2_plugin *lv2_descriptor(uint32_t index) {
    static const lv2_plugin plugins[] = {
        {URI, instantiate, connect_port, activate, run, deactivate, cleanup, extension_data},
        {URI "-strings", instantiate, connect_port, activate, run, deactivate, cleanup, extension_data},
    };
    return index < 2 ? &plugins[index] : 0;
}
