/* The LV2 plugins: ports, MIDI, state and worker of an instance. run() allocates nothing and opens no file, but
   freewheeling it may load a bass.

   There are two: one with a mono output, one with one output per string. The bundle holds instrument files, NAME.lbass,
   and instruments.txt with their names, one per line; these and the user's own (lb_open_shelf) are the values of the
   port `bass`. instantiate() loads the first; the host's worker loads others, or restore() does. */
#include "system/lock.h"
#include "shells/lv2_ports.h"
#include "instance/text.h"

#include <math.h>
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

typedef struct {
    lb_instance instance;
    int requested;    /* the worker will call lb_serve */
    uint64_t restored; /* parameters that a state set, a bit each: their ports count once they move */
    int running;  /* the audio thread is in run() ... */
    int held;     /* ... and must stay out while restore() changes the bass */
    int outputs;
    const lv2_sequence *midi;
    float *outs[LB_STRINGS];
    const float *controls[CONTROLS];
    float seen[LB_PARAMETERS]; /* the ports' last values; NaN: not read yet */
    float *overload;           /* number of relieved strings */
    lv2_sequence *shown;       /* looks, for a window */
    uint64_t looks;            /* looks sent */
    double watched;            /* s until the window counts as closed, unless it reports again */
    lb_sides sides[2];         /* the present and the next: save() may read during run() */
    int sides_at, sides_requested; /* sides_requested: send them to the window */
    char titles[2][LB_STATE_NAME]; /* the present and the next name of the response */
    int title_at, title_requested;
    int update_requested, kept_requested; /* by a window; send it whether a kept bass plays */
    char wanted[LB_PATH], path[LB_PATH]; /* the response that a window wants ... */
    int is_wanted, path_full; /* ... and on its way to the worker; 1 + LB_GIVE or LB_PUT_AWAY: of a song instead */
    lb_song_view songs[2];    /* the present and the next view of the song, and what a window knows of it */
    int song_at, song_requested, song_reported;
    lb_response *earlier[LB_UNDONE]; /* that its Undo may bring back, and how many there were: under the lock */
    uint32_t replaced;
    uint32_t sequence, look_atom, watch_atom, touch_atom, sides_atom, response_atom, update_atom, song_atom, chunk;
    uint32_t midi_event, string, whole, real, error, key_bass, key_quality, key_seed, key_side, key_stroke;
    uint32_t key_format, key_made, key_instrument;
    uint32_t key_aside[LB_PARAMETERS]; /* for the other side's values; 0: it has none of its own */
    const lv2_schedule *worker;
    const lv2_log *log;
    const lv2_midnam_host *names; /* receives notice of new key switch names */
    int named;                    /* the bass with these names */
} plugin;

static void complain(void *owner, const char *line) {
    const plugin *p = owner;
    if (p->log) p->log->print(p->log->handle, p->error, "livebass: %s\n", line);
    else lb_complain(owner, line);
}

/* If the host takes no job, the next block asks again. */
static void ask(void *owner) {
    plugin *p = owner;
    const uint8_t job = 0;
    if (!p->worker || __atomic_exchange_n(&p->requested, 1, __ATOMIC_ACQ_REL)) return;
    if (p->worker->schedule(p->worker->handle, sizeof job, &job) != LV2_SUCCESS)
        __atomic_store_n(&p->requested, 0, __ATOMIC_RELEASE);
}

static void nothing(void *owner) {}

static void cleanup(void *handle) {
    plugin *p = handle;
    lb_close_instance(&p->instance);
    for (int k = 0; k < LB_UNDONE; k++) lb_free_response(p->earlier[k]);
    free(p);
}

/* Changes A and B. [one thread] */
static void set_sides(plugin *p, const lb_sides *to) {
    const int other = !p->sides_at;
    p->sides[other] = *to;
    __atomic_store_n(&p->sides_at, other, __ATOMIC_RELEASE);
}

static void map_names(plugin *p, const lv2_map *map) {
    const struct {
        uint32_t *number;
        const char *uri;
    } all[] = {
        {&p->error, LV2_LOG_ERROR},       {&p->midi_event, LV2_MIDI_EVENT},   {&p->sequence, LV2_SEQUENCE},
        {&p->look_atom, LOOK_ATOM},       {&p->watch_atom, WATCH_ATOM},       {&p->touch_atom, TOUCH_ATOM},
        {&p->sides_atom, SIDES_ATOM},     {&p->string, LV2_STRING},           {&p->whole, LV2_LONG},
        {&p->real, LV2_FLOAT},            {&p->key_bass, URI "#bass"},        {&p->key_quality, URI "#quality"},
        {&p->key_format, URI "#format"},  {&p->key_made, URI "#made"},
        {&p->key_instrument, URI "#instrument"},
        {&p->key_seed, URI "#seed"},      {&p->key_side, URI "#side"},
        {&p->key_stroke, URI "#technique"}, {&p->response_atom, RESPONSE_ATOM}, {&p->update_atom, UPDATE_ATOM}, {&p->song_atom, SONG_ATOM},
        {&p->chunk, LV2_CHUNK},
    };
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) *all[k].number = map->map(map->handle, all[k].uri);
    for (int k = 0; k < LB_PARAMETERS; k++) {
        char key[LINE];
        snprintf(key, sizeof key, URI "#aside-%s", lb_parameters[k].symbol);
        if (lb_is_of_sides(k)) p->key_aside[k] = map->map(map->handle, key);
    }
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
    if (map) map_names(p, map);
    p->outputs = strcmp(d->uri, URI) ? LB_STRINGS : 1;
    p->instance.owner = p;
    p->instance.complain = complain;
    p->instance.ask = ask;
    p->instance.moved = nothing; /* its window is elsewhere */
    p->instance.quality_stays = 1;
    if (!map || !lb_open_instance(&p->instance, folder) || !lb_activate_instance(&p->instance, rate)) {
        cleanup(p);
        return 0;
    }
    if (!p->worker)
        complain(p, "the host has no worker (work:schedule): another bass, quality or slider is heard only after a project "
                    "is loaded, or while it renders offline");
    lb_read_sides(&p->instance, &p->sides[0]);
    for (int k = 0; k < LB_PARAMETERS; k++) p->seen[k] = NAN;
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

/* Hosts must not call run() during restore(), as no state:threadSafeRestore is declared, but Ardour does, for presets:
   then nothing plays meanwhile. Returns 0 if the audio thread must stay out. */
static int begin_run(plugin *p) {
    __atomic_store_n(&p->running, 1, __ATOMIC_SEQ_CST);
    if (!__atomic_load_n(&p->held, __ATOMIC_SEQ_CST)) return 1;
    __atomic_store_n(&p->running, 0, __ATOMIC_SEQ_CST);
    return 0;
}
static void end_run(plugin *p) { __atomic_store_n(&p->running, 0, __ATOMIC_SEQ_CST); }

/* Keeps the audio thread out after its present block. */
static void hold(plugin *p) {
    __atomic_store_n(&p->held, 1, __ATOMIC_SEQ_CST);
    while (__atomic_load_n(&p->running, __ATOMIC_SEQ_CST)) rest();
}
static void let_in(plugin *p) { __atomic_store_n(&p->held, 0, __ATOMIC_SEQ_CST); }

static void activate(void *handle) {
    plugin *p = handle;
    lb_reset_instance(&p->instance);
    __atomic_store_n(&p->requested, 0, __ATOMIC_RELEASE); /* the host may have dropped the job */
}

static void deactivate(void *handle) {
    plugin *p = handle;
    lb_rest_instance(&p->instance);
}

/* True if the host has moved a port since the last block. */
static int is_moved(const plugin *p, int k) {
    const float *at = p->controls[k];
    return at && *at != p->seen[k] && isfinite(*at);
}

/* The value that the next block will have. An invalid choice of a port changes nothing, nor does a port's first value
   after a state. */
static double wanted(const plugin *p, int k) {
    const lb_instance *i = &p->instance;
    if (!is_moved(p, k) || p->restored >> k & 1) return lb_value(i, k);
    const double value = *p->controls[k], allowed = lb_allowed(i, k, value);
    const int chosen = lb_parameters[k].whole && lb_parameters[k].kind < 0;
    return chosen && rint(value) != allowed ? lb_value(i, k) : allowed;
}

/* Takes the values that the host has moved. */
static void follow_ports(plugin *p) {
    lb_instance *i = &p->instance;
    for (int k = 0; k < LB_PARAMETERS; k++) {
        if (!is_moved(p, k)) continue;
        if (!(p->restored >> k & 1)) lb_set_value(i, k, wanted(p, k));
        p->seen[k] = *p->controls[k];
    }
    p->restored = 0;
    const float *freewheeling = p->controls[FREEWHEELING];
    lb_set_offline(i, freewheeling && *freewheeling > 0.5f);
}

/* Takes an atom from a window. */
static void take_atom(plugin *p, const lv2_atom *atom) {
    lb_touch touch;
    lb_sides sides;
    if (atom->type == p->watch_atom) {
        int32_t asks = 0;
        if (atom->size == sizeof asks) memcpy(&asks, atom + 1, sizeof asks);
        int *const requested[] = {&p->sides_requested, &p->title_requested, &p->kept_requested, &p->song_requested};
        for (int k = 0; asks && k < 4; k++) __atomic_store_n(requested[k], 1, __ATOMIC_RELAXED);
        p->watched = WATCHED;
    }
    if (atom->type == p->sides_atom && atom->size == sizeof sides) {
        memcpy(&sides, atom + 1, sizeof sides);
        set_sides(p, &sides);
    }
    if (atom->type == p->response_atom && atom->size && atom->size <= sizeof p->wanted) {
        memcpy(p->wanted, atom + 1, atom->size);
        p->wanted[atom->size - 1] = 0;
        p->is_wanted = 1;
    }
    int32_t what;
    if (atom->type == p->song_atom && atom->size > sizeof what && atom->size <= sizeof what + sizeof p->wanted) {
        memcpy(&what, atom + 1, sizeof what);
        if (what == LB_ROLL || what == LB_LOOP) lb_turn_song(&p->instance, what);
        else if (what == LB_GIVE || what == LB_PUT_AWAY) {
            memcpy(p->wanted, (const char *)(atom + 1) + sizeof what, atom->size - sizeof what);
            p->wanted[atom->size - sizeof what - 1] = 0;
            p->is_wanted = 1 + what;
        }
    }
    if (atom->type == p->update_atom) {
        __atomic_store_n(&p->update_requested, 1, __ATOMIC_RELEASE);
        ask(p);
    }
    if (atom->type != p->touch_atom || atom->size != sizeof touch) return;
    memcpy(&touch, atom + 1, sizeof touch);
    if (touch.key < 128 && touch.velocity < 128) lb_play_touch(&p->instance, &touch);
}

/* Hands the file that a window wants to the worker, once that has read the last one. */
static void pass_path(plugin *p) {
    if (!p->is_wanted || __atomic_load_n(&p->path_full, __ATOMIC_ACQUIRE)) return;
    memcpy(p->path, p->wanted, sizeof p->path);
    __atomic_store_n(&p->path_full, p->is_wanted, __ATOMIC_RELEASE);
    p->is_wanted = 0;
    ask(p);
}

/* Writes an empty sequence of looks; returns the bytes in its head. */
static uint32_t clear_looks(const plugin *p) {
    const uint32_t head = sizeof(lv2_sequence) - sizeof(lv2_atom);
    p->shown->atom = (lv2_atom){head, p->sequence};
    p->shown->unit = p->shown->pad = 0;
    return head;
}

/* Counts down the time until the window counts as closed, unless it reports again. */
static void watch(plugin *p, uint32_t frames) {
    lb_look *look = &p->instance.look;
    const int watched = p->watched > 0;
    if (watched != look->watchers) lb_watch(look, watched);
    p->watched = watched ? p->watched - frames / p->instance.rate : 0;
}

/* The number of the bass that plays. */
static int bass_of(const plugin *p) { return lb_bass_number(&p->instance, lb_value(&p->instance, LB_BASS)); }

/* A word for all of the song that a window shows and that this thread moves. */
static int song_word(const lb_instance *i) {
    const int rolls = __atomic_load_n(&i->rolls, __ATOMIC_RELAXED), loops = __atomic_load_n(&i->loops, __ATOMIC_RELAXED);
    return __atomic_load_n(&i->song_part, __ATOMIC_RELAXED) << 2 | rolls << 1 | loops;
}

static void fill_song(const plugin *p, lb_song_view *to) {
    const int word = song_word(&p->instance);
    memcpy(to, &p->songs[__atomic_load_n(&p->song_at, __ATOMIC_ACQUIRE)], sizeof *to);
    to->part = word >> 2;
    to->rolls = word >> 1 & 1;
    to->loops = word & 1;
}

/* Sends an open window the newest look, or A and B if it asks for them. */
static void send_look(plugin *p) {
    const lb_look *look = &p->instance.look;
    if (!p->shown) return;
    const uint32_t room = p->shown->atom.size, head = clear_looks(p);
    const int sides = p->sides_requested, title = !sides && __atomic_load_n(&p->title_requested, __ATOMIC_ACQUIRE);
    const int kept = !sides && !title && __atomic_load_n(&p->kept_requested, __ATOMIC_ACQUIRE);
    const int word = song_word(&p->instance), other = sides || title || kept;
    const int song = !other && (__atomic_load_n(&p->song_requested, __ATOMIC_ACQUIRE) || word != p->song_reported);
    const int32_t outdated = lb_is_kept(p->instance.shelf, bass_of(p));
    const lv2_atom body = sides   ? (lv2_atom){sizeof(lb_sides), p->sides_atom}
                          : title ? (lv2_atom){LB_STATE_NAME, p->response_atom}
                          : kept  ? (lv2_atom){sizeof outdated, p->update_atom}
                          : song  ? (lv2_atom){sizeof(lb_song_view), p->song_atom}
                                  : (lv2_atom){sizeof(LB_LOOK), p->look_atom};
    const uint32_t size = (uint32_t)sizeof(lv2_event) + (body.size + 7) / 8 * 8;
    lv2_event *e = (lv2_event *)(p->shown + 1);
    if (!look->watchers || room < head + size || (!other && !song && p->looks == lb_looks_taken(look))) return;
    if (sides) memcpy(e + 1, &p->sides[p->sides_at], sizeof(lb_sides));
    else if (title) memcpy(e + 1, p->titles[__atomic_load_n(&p->title_at, __ATOMIC_ACQUIRE)], LB_STATE_NAME);
    else if (kept) memcpy(e + 1, &outdated, sizeof outdated);
    else if (song) fill_song(p, (lb_song_view *)(e + 1));
    else if (!lb_read_look(look, 0, (LB_LOOK *)(e + 1))) return;
    if (sides) p->sides_requested = 0;
    else if (title) __atomic_store_n(&p->title_requested, 0, __ATOMIC_RELAXED);
    else if (kept) __atomic_store_n(&p->kept_requested, 0, __ATOMIC_RELAXED);
    else if (song) {
        p->song_reported = word;
        __atomic_store_n(&p->song_requested, 0, __ATOMIC_RELAXED);
    }
    else p->looks = lb_looks_taken(look);
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
        if (e->body.type == p->midi_event) lb_take_midi(&p->instance, e->frame, (const uint8_t *)(e + 1), e->body.size);
        else take_atom(p, &e->body);
        const size_t whole = sizeof *e + ((size_t)e->body.size + 7) / 8 * 8;
        if (whole > (size_t)(end - at)) return;
        at += whole;
    }
}

/* Writes silence. */
static void be_silent(const plugin *p, uint32_t frames) {
    for (int k = 0; k < p->outputs; k++)
        if (p->outs[k]) memset(p->outs[k], 0, frames * sizeof *p->outs[k]);
    if (p->shown) clear_looks(p);
}

static void run(void *handle, uint32_t frames) {
    plugin *p = handle;
    lb_instance *i = &p->instance;
    if (!begin_run(p)) {
        be_silent(p, frames);
        return;
    }
    follow_ports(p);
    lb_begin_block(i);
    send_midi(p);
    pass_path(p);
    watch(p, frames);
    lb_play_block(i, p->outputs > 1, p->outs, frames);
    send_look(p);
    if (p->overload) *p->overload = (float)lb_overload(i->synth);
    const int bass = (int)lb_value(i, LB_BASS);
    if (p->named != bass) __atomic_store_n(&p->kept_requested, 1, __ATOMIC_RELAXED);
    if (p->names && p->named != bass) p->names->update(p->names->handle);
    p->named = bass;
    end_run(p);
}

/* Tells a window the response's name. [not the audio thread] */
static void tell_title(plugin *p) {
    const int other = !p->title_at;
    lb_response *r = lb_use_response(&p->instance);
    snprintf(p->titles[other], LB_STATE_NAME, "%s", r ? r->kept->name : "");
    lb_free_response(r);
    __atomic_store_n(&p->title_at, other, __ATOMIC_RELEASE);
    __atomic_store_n(&p->title_requested, 1, __ATOMIC_RELEASE);
}

/* Keeps the present response: a window may undo its change. [not the audio thread] */
static void keep_response(plugin *p) {
    enter();
    lb_response **place = &p->earlier[p->replaced++ % LB_UNDONE];
    lb_free_response(*place);
    *place = lb_use_response(&p->instance);
    leave();
}

/* Finds an earlier response by its name, the last one first; returns its fault. */
static const char *find_response(plugin *p, const char *name, lb_response **to) {
    enter();
    for (uint32_t k = 1; !*to && k <= LB_UNDONE; k++) {
        lb_response *r = p->earlier[(p->replaced - k) % LB_UNDONE];
        if (r && !strcmp(r->kept->name, name)) *to = r;
    }
    lb_hold_response(*to);
    leave();
    return *to ? 0 : "is not known any more";
}

/* Loads the response that a window wants. */
static void read_response(plugin *p) {
    lb_response *r = 0;
    const char *why = *p->path == EARLIER ? find_response(p, p->path + 1, &r)
                      : *p->path          ? lb_read_response(p->path, p->instance.kernels, &r)
                                          : 0;
    if (why) lb_log(&p->instance, "%.1200s: the response %s", p->path, why);
    else {
        keep_response(p);
        lb_set_response(&p->instance, r);
    }
    __atomic_store_n(&p->path_full, 0, __ATOMIC_RELEASE);
    tell_title(p);
}

/* Tells a window what plays. [not the audio thread] */
static void tell_song(plugin *p) {
    const int other = !p->song_at;
    const lb_song_view *now = &p->songs[p->song_at], *next = &p->songs[other];
    lb_view_song(&p->instance, &p->songs[other]);
    if (now->there == next->there && !strcmp(now->line, next->line)) return;
    __atomic_store_n(&p->song_at, other, __ATOMIC_RELEASE);
    __atomic_store_n(&p->song_requested, 1, __ATOMIC_RELEASE);
}

/* Plays the song that a window gives, or none. */
static void take_song(plugin *p, int give) {
    if (give) lb_take_song(&p->instance, p->path);
    else lb_steer_song(&p->instance, LB_PUT_AWAY);
    __atomic_store_n(&p->path_full, 0, __ATOMIC_RELEASE);
}

static int work(void *handle, lv2_respond respond, void *to, uint32_t size, const void *data) {
    plugin *p = handle;
    __atomic_store_n(&p->requested, 0, __ATOMIC_RELEASE);
    const int full = __atomic_load_n(&p->path_full, __ATOMIC_ACQUIRE);
    if (full > 1) take_song(p, full == 1 + LB_GIVE);
    else if (full) read_response(p);
    if (__atomic_exchange_n(&p->update_requested, 0, __ATOMIC_ACQ_REL)) {
        lb_update_bass(p->instance.shelf, bass_of(p));
        __atomic_store_n(&p->kept_requested, 1, __ATOMIC_RELEASE);
    }
    lb_serve(&p->instance);
    tell_song(p);
    return LV2_SUCCESS;
}

static int answered(void *handle, uint32_t size, const void *data) { /* the worker answers nothing */
    return LV2_SUCCESS;
}

static int save(void *handle, lv2_store store, void *to, uint32_t flags, const lv2_feature *const *features) {
    plugin *p = handle;
    const lb_instance *i = &p->instance;
    const int64_t format = LB_STATE_FORMAT;
    double values[LB_PARAMETERS];
    char name[LB_STATE_NAME];
    lb_sides all;
    int64_t seed;
    size_t size;
    __atomic_load(&i->seed, &seed, __ATOMIC_RELAXED);
    lb_read_present(i, values, &all, name);
    const int begun = isfinite(p->seen[LB_BASS]); /* before, a new instance's values count */
    const int64_t quality = (int64_t)(begun ? wanted(p, LB_QUALITY) : values[LB_QUALITY]);
    const double bass = begun ? wanted(p, LB_BASS) : values[LB_BASS];
    if (bass != values[LB_BASS] && bass < lb_shelf_count(i->shelf))
        snprintf(name, sizeof name, "%s", lb_shelf_name(i->shelf, (int)bass));
    store(to, p->key_format, &format, sizeof format, p->whole, LV2_PLAIN);
    store(to, p->key_made, LB_RELEASE, sizeof LB_RELEASE, p->string, LV2_PLAIN);
    store(to, p->key_seed, &seed, sizeof seed, p->whole, LV2_PLAIN);
    store(to, p->key_quality, &quality, sizeof quality, p->whole, LV2_PLAIN);
    const float stroke = (float)values[LB_TECHNIQUE];
    if (p->restored >> LB_TECHNIQUE & 1 || (!is_moved(p, LB_TECHNIQUE) && stroke != p->seen[LB_TECHNIQUE])) /* by a key */
        store(to, p->key_stroke, &stroke, sizeof stroke, p->real, LV2_PLAIN);
    const lb_sides *sides = &p->sides[__atomic_load_n(&p->sides_at, __ATOMIC_ACQUIRE)];
    if (sides->side) store(to, p->key_side, &sides->side, sizeof sides->side, p->whole, LV2_PLAIN);
    for (int k = 0; k < LB_PARAMETERS; k++) {
        const float value = (float)sides->aside[k];
        if (p->key_aside[k] && value != (float)lb_parameters[k].default_value)
            store(to, p->key_aside[k], &value, sizeof value, p->real, LV2_PLAIN);
    }
    lb_response *r = lb_use_response(&p->instance);
    if (r) store(to, p->response_atom, r->kept, r->size, p->chunk, LV2_PLAIN);
    lb_free_response(r);
    const int number = lb_shelf_find(i->shelf, name);
    const lb_source source = number < 0 ? (lb_source){0, 0, 0} : lb_shelf_source(i->shelf, number);
    void *bytes = number < 0 ? 0 : lb_source_bytes(&source, &size);
    if (bytes) store(to, p->key_instrument, bytes, size, p->chunk, LV2_PLAIN);
    free(bytes);
    return store(to, p->key_bass, name, strlen(name) + 1, p->string, LV2_PLAIN);
}

/* Reads a value of `size` bytes and a type from a state, if it has one. */
static void retrieve(lv2_retrieve get, void *from, uint32_t key, uint32_t type, void *to, size_t size) {
    size_t found = 0;
    uint32_t of = 0, flags = 0;
    const void *value = get(from, key, &found, &of, &flags);
    if (value && found == size && of == type) memcpy(to, value, size);
}

/* Reads a whole number from a state; `otherwise` if it has none. */
static int64_t kept(const plugin *p, lv2_retrieve get, void *from, uint32_t key, int64_t otherwise) {
    retrieve(get, from, key, p->whole, &otherwise, sizeof otherwise);
    return otherwise;
}

/* Reads a value from a state; `otherwise` if it has none. */
static double kept_real(const plugin *p, lv2_retrieve get, void *from, uint32_t key, double otherwise) {
    float value = NAN;
    retrieve(get, from, key, p->real, &value, sizeof value);
    return isfinite(value) ? value : otherwise;
}

/* Reads A and B from a state. It has only values that differ from a new instance's. */
static void read_sides(const plugin *p, lv2_retrieve get, void *from, lb_sides *sides) {
    sides->side = kept(p, get, from, p->key_side, 0) == 1;
    for (int k = 0; k < LB_PARAMETERS; k++)
        sides->aside[k] = p->key_aside[k] ? kept_real(p, get, from, p->key_aside[k], lb_parameters[k].default_value)
                                          : lb_parameters[k].default_value;
}

/* Loads the bass while the old one plays on; then resets the synth with it. */
static int restore(void *handle, lv2_retrieve get, void *from, uint32_t flags, const lv2_feature *const *features) {
    plugin *p = handle;
    lb_instance *i = &p->instance;
    lb_kept state = {0};
    size_t size = 0;
    uint32_t type = 0;
    const char *name = get(from, p->key_bass, &size, &type, &flags);
    if (!name || type != p->string || !memchr(name, 0, size)) return LV2_NO_PROPERTY;
    snprintf(state.bass, sizeof state.bass, "%s", name);
    if (kept(p, get, from, p->key_format, 0) > LB_STATE_FORMAT) {
        const char *made = get(from, p->key_made, &size, &type, &flags);
        lb_log(i, "the session's state was made by livebass %.*s; this one, " LB_RELEASE ", cannot read it",
               made && type == p->string ? (int)size : 0, made);
        return LV2_NO_PROPERTY;
    }
    const void *response = get(from, p->response_atom, &size, &type, &flags);
    if (response && (type != p->chunk || lb_parse_response(response, size, i->kernels, &state.response))) {
        complain(p, "the session's response is damaged");
        return LV2_NO_PROPERTY;
    }
    state.seed = kept(p, get, from, p->key_seed, 0);
    const void *instrument = get(from, p->key_instrument, &size, &type, &flags);
    if (instrument && type == p->chunk && (state.instrument = malloc(size + 1))) {
        memcpy(state.instrument, instrument, size);
        state.instrument_bytes = size;
    }
    lb_read_values(i, state.values); /* the host restores the ports */
    state.values[LB_QUALITY] = kept(p, get, from, p->key_quality, LB_LIVE) == LB_STUDIO;
    const double port = isfinite(p->seen[LB_TECHNIQUE]) ? p->seen[LB_TECHNIQUE] : lb_parameters[LB_TECHNIQUE].default_value;
    const double stroke = kept_real(p, get, from, p->key_stroke, NAN); /* by a key */
    state.values[LB_TECHNIQUE] = isfinite(stroke) ? stroke : port;
    read_sides(p, get, from, &state.sides);
    keep_response(p);
    lb_take_kept(i, &state);
    lb_serve(i);
    hold(p);
    set_sides(p, &state.sides);
    p->sides_requested = 1;
    tell_title(p);
    __atomic_store_n(&p->kept_requested, 1, __ATOMIC_RELEASE);
    p->restored = 1ull << LB_BASS | 1ull << LB_QUALITY | (uint64_t)isfinite(stroke) << LB_TECHNIQUE;
    lb_reset_instance(i);
    let_in(p);
    return LV2_SUCCESS;
}

/* A name that tells this instance's key switches from others'. */
static char *midnam_model(void *handle) {
    char *text = malloc(NAME);
    if (text) snprintf(text, NAME, "livebass %p", handle);
    return text;
}

/* The bass's key switches as a MIDI Name Document. */
static char *midnam(void *handle) {
    static const char *const head =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<!DOCTYPE MIDINameDocument PUBLIC \"-//MIDI Manufacturers Association//DTD MIDINameDocument 1.0//EN\""
        " \"http://dev.midi.org/dtds/MIDINameDocument10.dtd\">\n"
        "<MIDINameDocument><Author>livebass</Author><MasterDeviceNames><Manufacturer>livebass</Manufacturer>"
        "<Model>livebass %p</Model><CustomDeviceMode Name=\"Default\"><ChannelNameSetAssignments>\n";
    static const char *const middle = "</ChannelNameSetAssignments></CustomDeviceMode>\n"
                                      "<ChannelNameSet Name=\"Bass\"><AvailableForChannels>\n";
    static const char *const list =
        "</AvailableForChannels><UsesNoteNameList Name=\"Switches\"/></ChannelNameSet>\n"
        "<NoteNameList Name=\"Switches\">\n";
    const plugin *p = handle;
    const int bass = (int)lb_value(&p->instance, LB_BASS);
    char *text = malloc(MIDNAM);
    if (!text) return 0;
    size_t n = lb_append(text, MIDNAM, 0, head, handle);
    for (int k = 1; k <= 16; k++)
        n = lb_append(text, MIDNAM, n, "<ChannelNameSetAssign Channel=\"%d\" NameSet=\"Bass\"/>\n", k);
    n = lb_append(text, MIDNAM, n, "%s", middle);
    for (int k = 1; k <= 16; k++)
        n = lb_append(text, MIDNAM, n, "<AvailableChannel Channel=\"%d\" Available=\"true\"/>\n", k);
    n = lb_append(text, MIDNAM, n, "%s", list);
    for (int key = 0; key < LB_KEY_COUNT; key++) {
        const lb_switch *s = lb_shelf_switch(p->instance.shelf, bass, key);
        if (s) n = lb_append(text, MIDNAM, n, "<Note Number=\"%d\" Name=\"%s\"/>\n", key, s->name);
    }
    lb_append(text, MIDNAM, n, "</NoteNameList></MasterDeviceNames></MIDINameDocument>\n");
    return text;
}

static void free_midnam(char *text) { free(text); }

static const void *extension_data(const char *uri) {
    static const lv2_worker worker = {work, answered, 0};
    static const lv2_state state = {save, restore};
    static const lv2_midnam names = {midnam, midnam_model, free_midnam};
    if (!strcmp(uri, LV2_WORKER)) return &worker;
    if (!strcmp(uri, LV2_STATE)) return &state;
    return strcmp(uri, LV2_MIDNAM) ? 0 : &names;
}

LB_EXPORTED const lv2_plugin *lv2_descriptor(uint32_t index) {
    static const lv2_plugin plugins[] = {
        {URI, instantiate, connect_port, activate, run, deactivate, cleanup, extension_data},
        {URI "-strings", instantiate, connect_port, activate, run, deactivate, cleanup, extension_data},
    };
    return index < 2 ? &plugins[index] : 0;
}
