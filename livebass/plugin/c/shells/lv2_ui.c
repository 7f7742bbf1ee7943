/* The window of the LV2 plugin. They communicate only through ports: values, and atoms (lv2_ports.h). */
#include "window/editor.h"
#include "shells/lv2_ports.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct {
    lb_instance instance; /* shelf, values and look: it plays nothing */
    lb_editor *editor;
    lv2_ui_write write;
    void *controller;
    const lv2_ui_touch *touch;
    double scale;
    uint32_t outputs, event_transfer, look, watch, touched, sides_atom, response, update, song;
    lb_song_there there;
    time_t reported;    /* when it last told the plugin that it is open */
    double stroke;  /* the plugin's, as last seen */
    uint32_t responses; /* told of those set */
    uint32_t updates;   /* known of those to the present bass */
    lb_sides sides; /* as the plugin knows them ... */
    int32_t asks;   /* ... unless it must still be asked */
} ui;

static void nothing(void *owner) {}

static void *instantiate(const lv2_ui *d, const char *plugin, const char *folder, lv2_ui_write write, void *controller,
                         void **widget, const lv2_feature *const *features) {
    const lv2_map *map = 0;
    const lv2_ui_resize *resize = 0;
    void *parent = 0;
    ui *u = calloc(1, sizeof *u);
    for (; u && *features; features++) {
        if (!strcmp((*features)->uri, LV2_MAP)) map = (*features)->data;
        if (!strcmp((*features)->uri, LV2_UI_PARENT)) parent = (*features)->data;
        if (!strcmp((*features)->uri, LV2_UI_RESIZE)) resize = (*features)->data;
        if (!strcmp((*features)->uri, LV2_UI_TOUCH)) u->touch = (*features)->data;
    }
    if (!u || !map) {
        free(u);
        return 0;
    }
    u->write = write;
    u->controller = controller;
    u->outputs = strcmp(plugin, URI) ? LB_STRINGS : 1;
    u->event_transfer = map->map(map->handle, LV2_EVENT_TRANSFER);
    u->look = map->map(map->handle, LOOK_ATOM);
    u->watch = map->map(map->handle, WATCH_ATOM);
    u->touched = map->map(map->handle, TOUCH_ATOM);
    u->sides_atom = map->map(map->handle, SIDES_ATOM);
    u->response = map->map(map->handle, RESPONSE_ATOM);
    u->update = map->map(map->handle, UPDATE_ATOM);
    u->song = map->map(map->handle, SONG_ATOM);
    u->instance.there = &u->there;
    u->asks = 1;
    u->instance.owner = u;
    u->instance.complain = lb_complain;
    u->instance.moved = nothing; /* `idle` looks for moves */
    u->scale = lb_system_scale();
    int width, height;
    lb_default_size(u->scale, &width, &height);
    if (lb_open_instance(&u->instance, folder)) {
        lb_read_sides(&u->instance, &u->sides);
        u->editor = lb_edit_instance(&u->instance, (uintptr_t)parent, width, height, u->scale);
    }
    if (!u->editor) {
        lb_close_instance(&u->instance);
        free(u);
        return 0;
    }
    *widget = (void *)lb_editor_handle(u->editor);
    if (resize) resize->resize(resize->handle, width, height);
    return u;
}

static void cleanup(void *handle) {
    ui *u = handle;
    lb_close_editor(u->editor);
    lb_close_instance(&u->instance);
    free(u);
}

/* Tells the host the stroke that a key has chosen: the plugin cannot move its port. */
static void follow_stroke(ui *u, double stroke) {
    if (stroke == u->stroke) return;
    u->stroke = stroke;
    if (stroke != lb_value(&u->instance, LB_TECHNIQUE))
        lb_move_value(&u->instance, LB_TECHNIQUE, stroke, LB_MOVE);
}

/* Shows the plugin's response, unless this window has it. */
static void take_title(ui *u, const char *title) {
    lb_response *r = lb_use_response(&u->instance);
    const int same = r ? !strcmp(r->kept->name, title) : !*title;
    lb_free_response(r);
    if (same || __atomic_load_n(&u->instance.responses, __ATOMIC_ACQUIRE) != u->responses) return;
    lb_set_response(&u->instance, *title ? lb_name_response(title) : 0);
    u->responses = __atomic_load_n(&u->instance.responses, __ATOMIC_ACQUIRE);
}

static void port_event(void *handle, uint32_t port, uint32_t size, uint32_t format, const void *data) {
    ui *u = handle;
    const uint32_t first = FIRST_OUT + u->outputs;
    if (!format && port >= first && port < first + LB_PARAMETERS && size == sizeof(float)) {
        float value;
        memcpy(&value, data, sizeof value);
        const double quality = lb_value(&u->instance, LB_QUALITY); /* it follows a bass only if chosen here */
        lb_set_value(&u->instance, (int)(port - first), value);
        if (port - first == LB_BASS) lb_set_value(&u->instance, LB_QUALITY, quality);
    }
    const lv2_atom *atom = data;
    if (format != u->event_transfer || size < sizeof *atom || size < sizeof *atom + atom->size) return;
    if (atom->type == u->look && atom->size == sizeof(LB_LOOK)) {
        LB_LOOK look;
        memcpy(&look, atom + 1, sizeof look);
        if (look.strings >= 0 && look.strings <= LB_STRINGS) lb_put_look(&u->instance.look, &look);
        follow_stroke(u, look.technique);
    }
    if (atom->type == u->response && atom->size == LB_STATE_NAME) take_title(u, (const char *)(atom + 1));
    if (atom->type == u->update && atom->size == sizeof(int32_t)) {
        int32_t kept;
        memcpy(&kept, atom + 1, sizeof kept);
        __atomic_store_n(&u->instance.kept_there, kept != 0, __ATOMIC_RELAXED);
    }
    if (atom->type == u->song && atom->size == sizeof(lb_song_view)) {
        lb_song_view view;
        memcpy(&view, atom + 1, sizeof view);
        lb_show_song(&u->instance, &view);
    }
    if (atom->type == u->sides_atom && atom->size == sizeof u->sides) {
        memcpy(&u->sides, atom + 1, sizeof u->sides);
        lb_write_sides(&u->instance, &u->sides);
        lb_read_sides(&u->instance, &u->sides); /* clamped */
        u->asks = 0;
    }
}

/* Sends the plugin an atom. */
static void send(const ui *u, uint32_t type, const void *body, uint32_t size) {
    struct {
        lv2_atom atom;
        uint8_t body[LB_PATH + sizeof(int32_t)];
    } message = {{size, type}, {0}};
    memcpy(message.body, body, size);
    u->write(u->controller, MIDI, (uint32_t)sizeof message.atom + size, u->event_transfer, &message);
}

/* Sends what a hand wants of the song. */
static void send_song(ui *u) {
    struct {
        int32_t what;
        char path[LB_PATH];
    } body;
    const int wants = lb_take_wants(&u->instance, body.path);
    for (body.what = LB_ROLL; body.what <= LB_GIVE; body.what++)
        if (wants >> body.what & 1) send(u, u->song, &body, (uint32_t)(sizeof body.what + strlen(body.path) + 1));
}

static int idle(void *handle) {
    ui *u = handle;
    const time_t now = time(0);
    lb_sides sides;
    for (lb_move m; lb_take_move(&u->instance.moves, &m);) {
        const uint32_t port = FIRST_OUT + u->outputs + (uint32_t)m.parameter;
        const float value = (float)m.value;
        if (m.phase == LB_MOVE) u->write(u->controller, port, sizeof value, 0, &value);
        else if (u->touch) u->touch->touch(u->touch->handle, port, m.phase == LB_BEGIN);
    }
    for (lb_touch t; lb_take_touch(&u->instance.touches, &t);) send(u, u->touched, &t, sizeof t);
    lb_read_sides(&u->instance, &sides);
    if (memcmp((const void *)&sides, (const void *)&u->sides, sizeof sides)) {
        send(u, u->sides_atom, &sides, sizeof sides);
        u->sides = sides;
        u->asks = 0;
    }
    const uint32_t responses = __atomic_load_n(&u->instance.responses, __ATOMIC_ACQUIRE);
    if (responses != u->responses) {
        char text[LB_PATH];
        lb_response *r = lb_use_response(&u->instance);
        if (r && !*r->path) snprintf(text, sizeof text, "%c%s", EARLIER, r->kept->name);
        else snprintf(text, sizeof text, "%s", r ? r->path : "");
        send(u, u->response, text, (uint32_t)strlen(text) + 1);
        lb_free_response(r);
    }
    u->responses = responses;
    if (u->updates != u->instance.updates) send(u, u->update, &u->asks, sizeof u->asks);
    u->updates = u->instance.updates;
    send_song(u);
    if (now != u->reported) send(u, u->watch, &u->asks, sizeof u->asks);
    u->reported = now;
    return 0;
}

static int resized(void *handle, int width, int height) {
    const ui *u = handle;
    lb_allowed_size(u->scale, &width, &height);
    lb_resize_editor(u->editor, width, height, u->scale);
    return 0;
}

static const void *extension_data(const char *uri) {
    static const lv2_ui_idle idling = {idle};
    static const lv2_ui_resize resizing = {0, resized};
    if (!strcmp(uri, LV2_UI_IDLE)) return &idling;
    return strcmp(uri, LV2_UI_RESIZE) ? 0 : &resizing;
}

LB_EXPORTED const lv2_ui *lv2ui_descriptor(uint32_t index) {
    static const lv2_ui only = {URI "#ui", instantiate, cleanup, port_event, extension_data};
    return index ? 0 : &only;
}
