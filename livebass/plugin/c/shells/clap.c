/* The CLAP plugin: ports, events, parameters, state and presets of an instance. process() allocates nothing, but
   offline it may load a bass.

   There are two plugins: one with a mono output, one with an output per string. Instruments lie beside the file
   livebass.clap (macOS: in its Contents/Resources), or in the user's directory. */
#include "abi/clap.h"
#include "window/editor.h"
#include "system/files.h"
#include "instance/response.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MONO "org.livebass.bass" /* must never change: sessions use them */
#define APART "org.livebass.strings"
#define PROVIDER "org.livebass.presets"
enum { TAIL = 12 /* s */ };
enum { OVERLOAD = 500 }; /* id of the read-only parameter that counts relieved strings */

static char folder[CLAP_PATH]; /* with the plugin's own instruments */

typedef struct {
    clap_plugin plugin; /* first: hosts know its address */
    const clap_host *host;
    const clap_host_log *log;
    const clap_host_thread_pool *pool;
    const clap_host_params *params;
    int apart; /* has one output per string */
    int requested; /* on_main_thread() will be called */
    int overload, bass, quality; /* as the host knows them */
    lb_editor *editor;
    int width, height; /* of the window, pixels (Cocoa: points) ... */
    double scale;      /* ... and its scale; 0: the system's */
    lb_instance instance;
} clap;

static clap *of(const clap_plugin *p) { return p->data; }

static void complain(void *owner, const char *line) {
    const clap *c = owner;
    if (c->log) c->log->log(c->host, CLAP_LOG_ERROR, line);
    else lb_complain(owner, line);
}

static void ask(void *owner) {
    clap *c = owner;
    if (!__atomic_exchange_n(&c->requested, 1, __ATOMIC_ACQ_REL)) c->host->request_callback(c->host);
}

/* --- strings side by side --- */

/* Lets the host's threads call `help`, and waits for them; the host may decline. */
static void share(int64_t owner, int64_t strings) {
    const clap *c = (const clap *)(intptr_t)owner;
    c->pool->request_exec(c->host, (uint32_t)strings);
}

/* Plays any string; the task's number does not matter. */
static void help(const clap_plugin *p, uint32_t task) {
    lb_help(of(p)->instance.synth);
}

/* --- the plugin --- */

static bool init(const clap_plugin *p) {
    clap *c = of(p);
    c->log = c->host->get_extension(c->host, CLAP_LOG);
    c->pool = c->host->get_extension(c->host, CLAP_THREAD_POOL);
    c->params = c->host->get_extension(c->host, CLAP_PARAMS);
    if (c->pool) c->instance.pool = share;
    if (!lb_open_instance(&c->instance, folder)) return false;
    c->quality = (int)lb_value(&c->instance, LB_QUALITY);
    return true;
}

static void destroy(const clap_plugin *p) {
    lb_close_editor(of(p)->editor);
    lb_close_instance(&of(p)->instance);
    free(of(p));
}

/* Blocks may be of any size. */
static bool activate(const clap_plugin *p, double rate, uint32_t minimum, uint32_t maximum) {
    return lb_activate_instance(&of(p)->instance, rate);
}

static void deactivate(const clap_plugin *p) { lb_deactivate_instance(&of(p)->instance); }

static bool start_processing(const clap_plugin *p) { return true; }

static void stop_processing(const clap_plugin *p) {}

static void reset(const clap_plugin *p) { lb_reset_instance(&of(p)->instance); }

/* Tells the host that another bass may have other switches. */
static void tell_names(const clap *c) {
    const clap_host_note_names *names = c->host->get_extension(c->host, CLAP_NOTE_NAMES);
    if (names) names->changed(c->host);
}

static void on_main_thread(const clap_plugin *p) {
    __atomic_store_n(&of(p)->requested, 0, __ATOMIC_RELEASE);
    lb_serve(&of(p)->instance);
    tell_names(of(p));
}

static lb_named meant(const clap_note *n) { return (lb_named){n->port, n->channel, n->key, n->note_id}; }

static lb_named shaped(const clap_note_expression *x) { return (lb_named){x->port, x->channel, x->key, x->note_id}; }

/* Takes one event; notes need an active instance. */
static void take(clap *c, const clap_event *e) {
    lb_instance *i = &c->instance;
    if (e->space != CLAP_CORE_EVENTS) return;
    if (e->type == CLAP_PARAM_VALUE) {
        const clap_param_value *v = (const clap_param_value *)e;
        if (v->id >= LB_PARAMETERS) return;
        if (i->synth) lb_set_value_at(i, e->time, (int)v->id, v->value);
        else lb_set_value(i, (int)v->id, v->value);
        if (v->id == LB_QUALITY) c->quality = (int)lb_value(i, LB_QUALITY);
    }
    if (!i->synth) return;
    const clap_note *note = (const clap_note *)e;
    const clap_note_expression *x = (const clap_note_expression *)e;
    if (e->type == CLAP_NOTE_ON) lb_start_note(i, e->time, meant(note), note->velocity);
    else if (e->type == CLAP_NOTE_OFF) lb_stop_note(i, e->time, meant(note), note->velocity);
    else if (e->type == CLAP_NOTE_CHOKE) lb_choke_note(i, e->time, meant(note));
    else if (e->type == CLAP_MIDI) lb_take_midi(i, e->time, ((const clap_midi *)e)->data, 3);
    if (e->type != CLAP_NOTE_EXPRESSION) return;
    if (x->expression == CLAP_TUNING) lb_express(i, e->time, shaped(x), LB_EXPRESS_BEND, x->value);
    else if (x->expression == CLAP_VIBRATO || x->expression == CLAP_PRESSURE)
        lb_express(i, e->time, shaped(x), LB_EXPRESS_VIBRATO, x->value);
    else if (x->expression == CLAP_BRIGHTNESS) lb_express_place(i, e->time, shaped(x), x->value);
}

/* True if event `x` is the brightness of the note that event `e` starts in the same frame: it places that note. */
static int places(const clap_event *e, const clap_event *x) {
    const clap_note *n = (const clap_note *)e;
    const clap_note_expression *b = (const clap_note_expression *)x;
    if (e->space || x->space || e->type != CLAP_NOTE_ON || x->type != CLAP_NOTE_EXPRESSION) return 0;
    if (b->expression != CLAP_BRIGHTNESS || e->time != x->time) return 0;
    return (b->key >= 0 || b->note_id >= 0) && lb_is_named(shaped(b), meant(n));
}

/* Takes all events of a block. */
static void take_all(clap *c, const clap_in_events *in) {
    const uint32_t events = in ? in->size(in) : 0;
    for (uint32_t k = 0; k < events; k++) {
        const clap_event *e = in->get(in, k);
        const clap_note *n = (const clap_note *)e;
        for (uint32_t j = k + 1; e->type == CLAP_NOTE_ON && j < events && in->get(in, j)->time == e->time; j++)
            if (places(e, in->get(in, j)))
                lb_express_place(&c->instance, e->time, (lb_named){-1, -1, n->key, -1},
                                 ((const clap_note_expression *)in->get(in, j))->value);
        int placed = 0; /* an earlier note has used it */
        for (uint32_t j = k; e->type == CLAP_NOTE_EXPRESSION && !placed && j && in->get(in, j - 1)->time == e->time; j--)
            placed = places(in->get(in, j - 1), e);
        if (!placed) take(c, e);
    }
}

/* Tells the host of a value that it did not change. */
static void tell_value(const clap_out_events *out, uint32_t id, double value) {
    const clap_param_value v = {
        .head = {sizeof v, 0, CLAP_CORE_EVENTS, CLAP_PARAM_VALUE, 0},
        .id = id, .note_id = -1, .port = -1, .channel = -1, .key = -1, .value = value,
    };
    if (out) out->try_push(out, &v.head);
}

/* Tells the host of changes made in the window. */
static void tell_moves(clap *c, const clap_out_events *out) {
    static const uint16_t types[] = {[LB_BEGIN] = CLAP_GESTURE_BEGIN, [LB_END] = CLAP_GESTURE_END};
    for (lb_move m; out && lb_take_move(&c->instance.moves, &m);) {
        const clap_param_gesture g = {{sizeof g, 0, CLAP_CORE_EVENTS, types[m.phase], 0}, (uint32_t)m.parameter};
        if (m.phase == LB_MOVE) tell_value(out, (uint32_t)m.parameter, m.value);
        else out->try_push(out, &g.head);
    }
}

static void tell_changes(clap *c, const clap_out_events *out) {
    const int overload = lb_overload(c->instance.synth), bass = (int)lb_value(&c->instance, LB_BASS);
    for (int moved; (moved = lb_next_moved(&c->instance)) >= 0;)
        tell_value(out, (uint32_t)moved, lb_value(&c->instance, moved));
    if (overload != c->overload) tell_value(out, OVERLOAD, overload);
    c->overload = overload;
    if (bass != c->bass) tell_value(out, LB_BASS, bass);
    c->bass = bass;
    const int quality = (int)lb_value(&c->instance, LB_QUALITY); /* may follow the bass */
    if (quality != c->quality) tell_value(out, LB_QUALITY, quality);
    c->quality = quality;
}

static int32_t process(const clap_plugin *p, const clap_process *b) {
    clap *c = of(p);
    lb_instance *i = &c->instance;
    float *outs[LB_STRINGS] = {0};
    if (!i->synth) return CLAP_PROCESS_ERROR;
    lb_begin_block(i);
    take_all(c, b->in_events);
    c->bass = (int)lb_value(i, LB_BASS); /* the host has set it itself */
    for (uint32_t k = 0; k < b->output_count && k < LB_STRINGS; k++)
        if (b->outputs[k].data32 && b->outputs[k].channels) {
            outs[k] = b->outputs[k].data32[0];
            b->outputs[k].constant_mask = 0;
        }
    lb_play_block(i, c->apart, outs, b->frames);
    tell_moves(c, b->out_events);
    tell_changes(c, b->out_events);
    return lb_may_sleep(i) ? CLAP_PROCESS_SLEEP : CLAP_PROCESS_CONTINUE;
}

/* --- ports --- */

static uint32_t audio_count(const clap_plugin *p, bool is_input) {
    return is_input ? 0 : of(p)->apart ? LB_STRINGS : 1;
}

static bool audio_port(const clap_plugin *p, uint32_t index, bool is_input, clap_audio_port *port) {
    if (index >= audio_count(p, is_input)) return false;
    memset(port, 0, sizeof *port);
    port->id = index;
    port->flags = index ? 0 : CLAP_PORT_IS_MAIN;
    port->channels = 1;
    port->type = CLAP_MONO;
    port->in_place_pair = CLAP_NO_ID;
    if (of(p)->apart) snprintf(port->name, sizeof port->name, "%s", lb_outputs[index]);
    else snprintf(port->name, sizeof port->name, "Out");
    return true;
}

static uint32_t note_count(const clap_plugin *p, bool is_input) { return is_input; }

static bool note_port(const clap_plugin *p, uint32_t index, bool is_input, clap_note_port *port) {
    if (index >= note_count(p, is_input)) return false;
    memset(port, 0, sizeof *port);
    port->supported = CLAP_DIALECT_CLAP | CLAP_DIALECT_MIDI | CLAP_DIALECT_MPE;
    port->preferred = CLAP_DIALECT_CLAP;
    snprintf(port->name, sizeof port->name, "Notes");
    return true;
}

/* --- parameters --- */

static uint32_t param_count(const clap_plugin *p) { return LB_PARAMETERS + 1; }

static bool param_info(const clap_plugin *p, uint32_t index, clap_param_info *info) {
    memset(info, 0, sizeof *info);
    if (index == LB_PARAMETERS) {
        info->id = OVERLOAD;
        info->flags = CLAP_PARAM_STEPPED | CLAP_PARAM_READONLY;
        info->maximum = LB_STRINGS;
        snprintf(info->name, sizeof info->name, "Overload");
        snprintf(info->module, sizeof info->module, "Processor");
        return true;
    }
    if (index > LB_PARAMETERS) return false;
    const lb_parameter *known = &lb_parameters[index];
    snprintf(info->module, sizeof info->module, "%s", known->group);
    info->id = index;
    const int built = lb_is_slider((int)index); /* it takes effect from the next block on, or later */
    info->flags = known->kind >= 0 || built ? CLAP_PARAM_AUTOMATABLE : 0;
    if (known->whole) info->flags |= CLAP_PARAM_STEPPED;
    if (known->points || index == LB_BASS) info->flags |= CLAP_PARAM_ENUM;
    snprintf(info->name, sizeof info->name, "%s", known->name);
    info->minimum = known->minimum;
    info->maximum = lb_maximum(&of(p)->instance, (int)index);
    info->default_value = lb_default(&of(p)->instance, (int)index);
    return true;
}

static bool param_value(const clap_plugin *p, uint32_t id, double *value) {
    if (id == OVERLOAD) *value = __atomic_load_n(&of(p)->overload, __ATOMIC_RELAXED);
    if (id >= LB_PARAMETERS) return id == OVERLOAD;
    *value = lb_value(&of(p)->instance, (int)id);
    return true;
}

static bool param_to_text(const clap_plugin *p, uint32_t id, double value, char *text, uint32_t room) {
    if (id == OVERLOAD) return snprintf(text, room, "%.0f", value) > 0;
    if (id >= LB_PARAMETERS) return false;
    lb_value_to_text(&of(p)->instance, (int)id, value, text, room);
    return true;
}

static bool param_from_text(const clap_plugin *p, uint32_t id, const char *text, double *value) {
    char *end = 0;
    if (id == OVERLOAD) {
        *value = strtod(text, &end);
        return end != text;
    }
    return id < LB_PARAMETERS && lb_text_to_value(&of(p)->instance, (int)id, text, value);
}

static void flush(const clap_plugin *p, const clap_in_events *in, const clap_out_events *out) {
    for (uint32_t k = 0; k < in->size(in); k++) {
        const clap_param_value *v = (const clap_param_value *)in->get(in, k);
        if (v->head.space != CLAP_CORE_EVENTS || v->head.type != CLAP_PARAM_VALUE || v->id >= LB_PARAMETERS) continue;
        lb_set_value(&of(p)->instance, (int)v->id, v->value);
        if (v->id == LB_QUALITY) of(p)->quality = (int)lb_value(&of(p)->instance, LB_QUALITY);
    }
    tell_moves(of(p), out); /* not while process() runs */
}

/* Tells the host that values have changed. [main thread] */
static void tell_values(const clap *c) {
    const clap_host_params *params = c->host->get_extension(c->host, CLAP_PARAMS);
    if (params) params->rescan(c->host, CLAP_RESCAN_VALUES);
    tell_names(c);
}

/* --- parameter pages for the knobs of hosts and keyboards: the parameters of each group, eight per page --- */

/* Finds the parameters of a page of a group, counted from 0; returns how many pages the group has. */
static uint32_t find_page(uint32_t group, uint32_t page, uint32_t found[CLAP_CONTROLS]) {
    uint32_t count = 0;
    for (uint32_t k = 0; k < CLAP_CONTROLS; k++) found[k] = CLAP_NO_ID;
    for (uint32_t k = 0; k < LB_PARAMETERS; k++) {
        if (strcmp(lb_parameters[k].group, lb_groups[group])) continue;
        if (count / CLAP_CONTROLS == page) found[count % CLAP_CONTROLS] = k;
        count++;
    }
    return (count + CLAP_CONTROLS - 1) / CLAP_CONTROLS;
}

static uint32_t page_count(const clap_plugin *p) {
    uint32_t count = 0, unused[CLAP_CONTROLS];
    for (uint32_t group = 0; group < LB_GROUPS; group++) count += find_page(group, 0, unused);
    return count;
}

static bool remote_page(const clap_plugin *p, uint32_t index, clap_remote_page *page) {
    memset(page, 0, sizeof *page);
    for (uint32_t group = 0; group < LB_GROUPS; group++) {
        const uint32_t pages = find_page(group, index, page->parameters);
        if (index >= pages) {
            index -= pages;
            continue;
        }
        page->id = group << 8 | index;
        snprintf(page->section, sizeof page->section, "%s", lb_groups[group]);
        if (pages > 1) snprintf(page->name, sizeof page->name, "%s %d", lb_groups[group], (int)index + 1);
        else snprintf(page->name, sizeof page->name, "%s", lb_groups[group]);
        return true;
    }
    return false;
}

/* --- state --- */

static bool save(const clap_plugin *p, const clap_out_stream *to) {
    size_t count, done = 0;
    char *state = lb_new_state(&of(p)->instance, &count);
    for (int64_t written; done < count; done += (size_t)written)
        if ((written = to->write(to, state + done, count - done)) <= 0) break;
    free(state);
    return state && done == count;
}

static bool load(const clap_plugin *p, const clap_in_stream *from) {
    size_t count = 0;
    int64_t got;
    char *bytes = malloc(LB_MAX_STATE);
    if (!bytes) return false;
    while (count < LB_MAX_STATE && (got = from->read(from, bytes + count, LB_MAX_STATE - count)) > 0) count += (size_t)got;
    const bool good = lb_load_state(&of(p)->instance, bytes, count);
    free(bytes);
    if (good) {
        lb_serve(&of(p)->instance);
        tell_values(of(p));
    }
    return good;
}

/* --- the rest --- */

static uint32_t switch_count(const clap_plugin *p) {
    uint32_t count = LB_KEY_COUNT;
    lb_switch_key(&of(p)->instance, &count);
    return count;
}

/* Names a key below the bass's notes that switches a technique. */
static bool switch_name(const clap_plugin *p, uint32_t index, clap_note_name *name) {
    const lb_instance *i = &of(p)->instance;
    const int key = lb_switch_key(i, &index);
    if (key < 0) return false;
    *name = (clap_note_name){.port = -1, .key = (int16_t)key, .channel = -1};
    snprintf(name->name, sizeof name->name, "%s", lb_switch_name(i, key));
    return true;
}

static bool needs_real_time(const clap_plugin *p) { return false; }

static bool set_rendering(const clap_plugin *p, int32_t mode) {
    lb_set_offline(&of(p)->instance, mode == CLAP_OFFLINE);
    return true;
}

static uint32_t latency(const clap_plugin *p) { return 0; }

static uint32_t tail(const clap_plugin *p) { return (uint32_t)(TAIL * of(p)->instance.rate); }

/* Chooses a bass, with the default value of every parameter; returns 0 if no bass has that name. */
static int take_bass(lb_instance *i, const char *name) {
    const int bass = name ? lb_shelf_find(i->shelf, name) : -1;
    if (bass < 0) return 0;
    for (int k = 0; k < LB_PARAMETERS; k++)
        if (lb_is_of_sides(k)) lb_set_value(i, k, lb_parameters[k].default_value);
    lb_set_value(i, LB_BASS, bass);
    lb_set_response(i, 0);
    __atomic_store_n(&i->missing, 0, __ATOMIC_RELAXED); /* even if that bass was already playing */
    return 1;
}

/* Loads a preset: the bass `key`, or the sound in a file. */
static bool preset(const clap_plugin *p, uint32_t kind, const char *location, const char *key) {
    clap *c = of(p);
    lb_instance *i = &c->instance;
    const clap_host_preset_load *host = c->host->get_extension(c->host, CLAP_PRESET_LOAD);
    if (!host) host = c->host->get_extension(c->host, CLAP_PRESET_LOAD_DRAFT);
    const char *why = "there is no such instrument";
    if (kind == CLAP_LOCATION_PLUGIN && take_bass(i, key)) why = 0;
    if (kind == CLAP_LOCATION_FILE && location) why = lb_take_sound(i, location);
    if (why) {
        if (host) host->on_error(c->host, kind, location, key, 0, why);
        return false;
    }
    lb_serve(i);
    if (host) host->loaded(c->host, kind, location, key);
    tell_values(c);
    return true;
}

/* --- the window --- */

static bool has_windows(const clap_plugin *p, const char *api, bool floating) {
    (void)p;
    return !floating && !strcmp(api, LB_WINDOWS);
}

static bool preferred_windows(const clap_plugin *p, const char **api, bool *floating) {
    *api = LB_WINDOWS;
    *floating = false;
    return true;
}

static bool create_window(const clap_plugin *p, const char *api, bool floating) {
    clap *c = of(p);
    if (!has_windows(p, api, floating)) return false;
    if (c->scale <= 0) c->scale = lb_system_scale();
    lb_default_size(c->scale, &c->width, &c->height);
    return true;
}

static void destroy_window(const clap_plugin *p) {
    clap *c = of(p);
    lb_close_editor(c->editor);
    c->editor = 0;
    c->scale = 0;
}

/* The host calls this before it gives the window a parent. */
static bool set_scale(const clap_plugin *p, double scale) {
    clap *c = of(p);
    if (c->editor || !(scale >= 0.5 && scale <= 4) || !strcmp(LB_WINDOWS, "cocoa")) return false;
    c->scale = scale;
    lb_default_size(scale, &c->width, &c->height);
    return true;
}

static bool window_size(const clap_plugin *p, uint32_t *width, uint32_t *height) {
    *width = (uint32_t)of(p)->width;
    *height = (uint32_t)of(p)->height;
    return true;
}

static bool can_resize(const clap_plugin *p) { return true; }

static bool resize_hints(const clap_plugin *p, clap_resize_hints *hints) {
    *hints = (clap_resize_hints){true, true, false, LB_WIDTH, LB_HEIGHT};
    return true;
}

static bool adjust_size(const clap_plugin *p, uint32_t *width, uint32_t *height) {
    int w = *width < LB_MAX_SIZE ? (int)*width : LB_MAX_SIZE, h = *height < LB_MAX_SIZE ? (int)*height : LB_MAX_SIZE;
    lb_allowed_size(of(p)->scale, &w, &h);
    *width = (uint32_t)w;
    *height = (uint32_t)h;
    return true;
}

static bool set_size(const clap_plugin *p, uint32_t width, uint32_t height) {
    clap *c = of(p);
    uint32_t w = width, h = height;
    adjust_size(p, &w, &h);
    if (w != width || h != height) return false;
    c->width = (int)w;
    c->height = (int)h;
    if (c->editor) lb_resize_editor(c->editor, c->width, c->height, c->scale);
    return true;
}

static bool set_parent(const clap_plugin *p, const clap_window *parent) {
    clap *c = of(p);
    if (c->editor || strcmp(parent->api, LB_WINDOWS)) return false;
    c->editor = lb_edit_instance(&c->instance, parent->handle, c->width, c->height, c->scale);
    return c->editor != 0;
}

static bool set_transient(const clap_plugin *p, const clap_window *parent) { /* for floating windows */
    return false;
}

static void suggest_title(const clap_plugin *p, const char *title) {}

/* Answers both show and hide: the window is its parent's. */
static bool is_open(const clap_plugin *p) {
    return of(p)->editor != 0;
}

/* Asks the host to take changes made in the window, and to play them. [the window's thread] */
static void moved(void *owner) {
    const clap *c = owner;
    if (c->params) c->params->request_flush(c->host);
    c->host->request_process(c->host);
}

static const void *extension(const clap_plugin *p, const char *id) {
    static const clap_audio_ports audio = {audio_count, audio_port};
    static const clap_note_ports notes = {note_count, note_port};
    static const clap_note_names names = {switch_count, switch_name};
    static const clap_params params = {param_count, param_info, param_value, param_to_text, param_from_text, flush};
    static const clap_state state = {save, load};
    static const clap_render render = {needs_real_time, set_rendering};
    static const clap_frames late = {latency}, after = {tail};
    static const clap_preset_load presets = {preset};
    static const clap_thread_pool pool = {help};
    static const clap_gui gui = {
        has_windows, preferred_windows, create_window, destroy_window, set_scale, window_size, can_resize, resize_hints,
        adjust_size, set_size, set_parent, set_transient, suggest_title, is_open, is_open,
    };
    static const clap_remote_controls controls = {page_count, remote_page};
    static const struct {
        const char *id;
        const void *extension;
    } all[] = {
        {CLAP_AUDIO_PORTS, &audio}, {CLAP_NOTE_PORTS, &notes},    {CLAP_PARAMS, &params},
        {CLAP_STATE, &state},       {CLAP_RENDER, &render},       {CLAP_LATENCY, &late},
        {CLAP_TAIL, &after},        {CLAP_PRESET_LOAD, &presets}, {CLAP_PRESET_LOAD_DRAFT, &presets},
        {CLAP_NOTE_NAMES, &names},  {CLAP_THREAD_POOL, &pool},
        {CLAP_GUI, &gui},
        {CLAP_REMOTE_CONTROLS, &controls}, {CLAP_REMOTE_CONTROLS_DRAFT, &controls},
    };
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        if (!strcmp(id, all[k].id)) return all[k].extension;
    return 0;
}

/* --- presets in the host's browser: the instruments, and the user's sounds --- */

static bool provider_init(const clap_preset_provider *p) {
    const clap_preset_indexer *to = p->data;
    const clap_preset_location here = {CLAP_FACTORY_CONTENT, "livebass", CLAP_LOCATION_PLUGIN, 0};
    const clap_preset_filetype sounds = {"livebass sound", "", LB_SOUND_ENDING};
    char own[LB_PATH], factory[LB_PATH];
    if (!to->declare_location(to, &here)) return false;
    if (!to->declare_filetype(to, &sounds)) return true;
    const clap_preset_location ours = {CLAP_FACTORY_CONTENT, "livebass sounds", CLAP_LOCATION_FILE, factory};
    if (lb_factory_sounds(folder, factory)) to->declare_location(to, &ours);
    if (!lb_users_folder(own)) return true;
    const clap_preset_location there = {CLAP_USER_CONTENT, "livebass", CLAP_LOCATION_FILE, own};
    to->declare_location(to, &there); /* a host may refuse a folder that does not exist yet */
    return true;
}

static void provider_destroy(const clap_preset_provider *p) { free((void *)p); }

static const clap_universal_id users[] = {{"clap", MONO}, {"clap", APART}};

static void describe(const clap_preset_receiver *to) {
    to->add_plugin_id(to, &users[0]);
    to->add_plugin_id(to, &users[1]);
    to->add_feature(to, "bass");
}

/* Describes the sound in a file, with the file's name as its name. */
static bool provide_sound(const char *path, const clap_preset_receiver *to) {
    char name[LB_PATH];
    lb_kept kept;
    snprintf(name, sizeof name, "%s", lb_file_name(path));
    char *dot = strrchr(name, '.');
    if (dot) *dot = 0;
    const char *why = lb_read_sound(path, &kept);
    if (why) to->on_error(to, 0, why);
    else if (to->begin_preset(to, name, 0)) describe(to);
    return !why;
}

static bool provide(const clap_preset_provider *p, uint32_t kind, const char *location,
                    const clap_preset_receiver *to) {
    if (kind == CLAP_LOCATION_FILE) return location && provide_sound(location, to);
    lb_shelf *shelf = kind == CLAP_LOCATION_PLUGIN ? lb_open_shelf(folder) : 0;
    if (!shelf) return false;
    for (int k = 0; k < lb_shelf_count(shelf); k++) {
        if (!to->begin_preset(to, lb_shelf_title(shelf, k), lb_shelf_name(shelf, k))) break;
        describe(to);
    }
    lb_close_shelf(shelf);
    return true;
}

static const void *no_extension(const clap_preset_provider *p, const char *id) { return 0; }

static const clap_provider_descriptor provider = {CLAP_VERSION, PROVIDER, "livebass", "livebass"};

static uint32_t provider_count(const clap_preset_factory *f) { return 1; }

static const clap_provider_descriptor *provider_descriptor(const clap_preset_factory *f, uint32_t index) {
    return index ? 0 : &provider;
}

static const clap_preset_provider *provider_create(const clap_preset_factory *f, const clap_preset_indexer *indexer,
                                                   const char *id) {
    clap_preset_provider *p = strcmp(id, PROVIDER) ? 0 : malloc(sizeof *p);
    if (p)
        *p = (clap_preset_provider){
            &provider, (void *)indexer, provider_init, provider_destroy, provide, no_extension,
        };
    return p;
}

/* --- the file's entry --- */

static const char *const features[] = {"instrument", "synthesizer", "mono", 0};
static const clap_descriptor descriptors[] = {
    {CLAP_VERSION, MONO, "livebass", "livebass", "", "", "", LB_RELEASE, "A physical-model electric bass", features},
    {CLAP_VERSION, APART, "livebass strings", "livebass", "", "", "", LB_RELEASE,
     "A physical-model electric bass with an output a string", features},
};

static uint32_t plugin_count(const clap_plugin_factory *f) { return sizeof descriptors / sizeof *descriptors; }

static const clap_descriptor *plugin_descriptor(const clap_plugin_factory *f, uint32_t index) {
    return index < plugin_count(f) ? &descriptors[index] : 0;
}

static const clap_plugin *create(const clap_plugin_factory *f, const clap_host *host, const char *id) {
    for (uint32_t k = 0; k < plugin_count(f); k++) {
        if (strcmp(id, descriptors[k].id) || host->version.major < 1) continue;
        clap *c = calloc(1, sizeof *c);
        if (!c) return 0;
        c->plugin = (clap_plugin){
            &descriptors[k], c, init, destroy, activate, deactivate, start_processing, stop_processing, reset, process,
            extension, on_main_thread,
        };
        c->host = host;
        c->apart = k == 1;
        c->instance.owner = c;
        c->instance.complain = complain;
        c->instance.ask = ask;
        c->instance.moved = moved;
        c->instance.learns = 1;
        return &c->plugin;
    }
    return 0;
}

static bool entry_init(const char *path) {
#ifdef __APPLE__
    return snprintf(folder, sizeof folder, "%s/Contents/Resources", path) < (int)sizeof folder;
#else
    if (strlen(path) >= sizeof folder) return false;
    strcpy(folder, path);
    const size_t behind = (size_t)(lb_file_name(folder) - folder);
    if (behind) folder[behind - 1] = 0;
    else strcpy(folder, ".");
    return true;
#endif
}

static void entry_deinit(void) {}

static const void *get_factory(const char *id) {
    static const clap_plugin_factory plugins = {plugin_count, plugin_descriptor, create};
    static const clap_preset_factory presets = {provider_count, provider_descriptor, provider_create};
    if (!strcmp(id, CLAP_PLUGIN_FACTORY)) return &plugins;
    return strcmp(id, CLAP_PRESET_FACTORY) && strcmp(id, CLAP_PRESET_FACTORY_DRAFT) ? 0 : &presets;
}

LB_EXPORTED const clap_plugin_entry clap_entry = {CLAP_VERSION, entry_init, entry_deinit, get_factory};
