/* A picture in a window. */
#include "window/editor.h"
#include "instance/response.h"

#include <math.h>
#include <stdlib.h>

struct lb_editor {
    lb_picture *picture;
    lb_window *window;
    lb_look *look;
};

lb_editor *lb_open_editor(const lb_face *face, lb_look *look, uintptr_t parent, int width, int height, double scale) {
    lb_editor *e = calloc(1, sizeof *e);
    if (!e) return 0;
    e->look = look;
    lb_watch(look, 1);
    e->picture = lb_new_picture(face);
    e->window = e->picture ? lb_open_window(e->picture, parent, width, height, scale) : 0;
    if (e->window) return e;
    lb_close_editor(e);
    return 0;
}

void lb_close_editor(lb_editor *e) {
    if (!e) return;
    lb_close_window(e->window);
    lb_free_picture(e->picture);
    lb_watch(e->look, 0);
    free(e);
}

void lb_resize_editor(lb_editor *e, int width, int height, double scale) {
    lb_resize_window(e->window, width, height, scale);
}

uintptr_t lb_editor_handle(const lb_editor *e) { return lb_window_handle(e->window); }

/* The zoom is kept in a file in the user's folder. */
#define ZOOM_FILE "window.txt"
static double zoom(void *owner, double to) {
    char folder[LB_PATH], path[LB_PATH], text[16] = "";
    if (!lb_users_folder(folder)) return to > 0 ? to : 1;
    if (to > 0) {
        lb_write_file(folder, ZOOM_FILE, text, (size_t)snprintf(text, sizeof text, "%.0f\n", 100 * to));
        return to;
    }
    FILE *in = snprintf(path, sizeof path, "%s/" ZOOM_FILE, folder) < LB_PATH ? lb_open_file(path, "rb") : 0;
    if (in && !fgets(text, sizeof text, in)) *text = 0;
    if (in) fclose(in);
    const long kept = strtol(text, 0, 10);
    return kept >= 75 && kept <= 200 ? (double)kept / 100 : 1;
}

void lb_default_size(double scale, int *width, int *height) {
    const double whole = scale * zoom(0, 0);
    *width = (int)(LB_WIDTH * whole);
    *height = (int)(LB_HEIGHT * whole);
}

void lb_allowed_size(double scale, int *width, int *height) {
    const int min_width = (int)ceil(LB_MIN_WIDTH * scale), min_height = (int)ceil(LB_MIN_HEIGHT * scale);
    if (*width < min_width) *width = min_width;
    if (*height < min_height) *height = min_height;
}

/* --- of an instance --- */

static double value(void *i, int parameter) { return lb_value(i, parameter); }
static double maximum(void *i, int parameter) { return lb_maximum(i, parameter); }
static void set(void *instance, int parameter, double value, int phase) {
    lb_instance *i = instance;
    if (parameter == LB_BASS) *i->window.sound = 0; /* a bass is chosen, not a sound */
    if (phase == LB_BEGIN) lb_keep_values(i);
    lb_move_value(i, parameter, value, phase);
}
static void text(void *i, int parameter, double value, char *to, size_t room) {
    lb_value_to_text(i, parameter, value, to, room);
}
static void note(void *i, int on, int string, int key, double velocity) {
    lb_instance *to = i;
    lb_put_touch(&to->touches, on, string, key, velocity);
    to->moved(to->owner);
}
static const lb_own *own(void *instance) {
    const lb_instance *i = instance;
    const int bass = (int)lb_value(i, LB_BASS);
    return bass < lb_shelf_count(i->shelf) ? lb_shelf_own(i->shelf, bass) : 0;
}
static const lb_switch *switched(void *instance, int key) {
    const lb_instance *i = instance;
    const int bass = (int)lb_value(i, LB_BASS);
    return bass < lb_shelf_count(i->shelf) ? lb_shelf_switch(i->shelf, bass, key) : 0;
}

/* Tells the host which values have changed. */
static void tell_changes(lb_instance *i, const double before[LB_PARAMETERS]) {
    for (int k = 0; k < LB_PARAMETERS; k++)
        for (int phase = LB_BEGIN; lb_value(i, k) != before[k] && phase <= LB_END; phase++)
            lb_put_move(&i->moves, k, phase, lb_value(i, k));
    i->moved(i->owner);
}
static void note_values(const lb_instance *i, double to[LB_PARAMETERS]) {
    for (int k = 0; k < LB_PARAMETERS; k++) to[k] = lb_value(i, k);
}
static void undo(void *i) {
    double before[LB_PARAMETERS];
    note_values(i, before);
    lb_undo(i);
    tell_changes(i, before);
}
static void swap(void *i) {
    double before[LB_PARAMETERS];
    note_values(i, before);
    lb_swap_sides(i);
    tell_changes(i, before);
}
static int kept(void *instance) {
    const lb_instance *i = instance;
    const int bass = (int)lb_value(i, LB_BASS);
    return __atomic_load_n(&i->kept_there, __ATOMIC_RELAXED) || (bass < lb_shelf_count(i->shelf) && lb_is_kept(i->shelf, bass));
}
static void update(void *instance) {
    lb_instance *i = instance;
    lb_keep_values(i);
    lb_update_bass(i->shelf, (int)lb_value(i, LB_BASS));
    __atomic_store_n(&i->kept_there, 0, __ATOMIC_RELAXED);
    i->updates++;
    i->moved(i->owner);
}
static void copy(void *instance) {
    lb_instance *i = instance;
    lb_copy_side(i);
    i->moved(i->owner);
}
static int read(void *i, int parameter, const char *text, double *value) {
    return lb_text_to_value(i, parameter, text, value);
}
static void title(void *i, char *text, size_t room) { lb_title(i, text, room); }
static int playing(void *i) { return lb_playing_sound(i); }
static int group(void *instance, int bass) {
    const lb_instance *i = instance;
    return lb_shelf_group(i->shelf, bass);
}
static int side(void *i) { return lb_side(i); }
static int list(void *i) { return lb_list_sounds(i); }
static const char *sound(void *i, int k) { return lb_sound_name(i, k); }
static int is_own(void *i, int k) { return lb_sound_is_own(i, k); }
static int save(void *i, char *name, size_t room) { return lb_save_sound(i, name, room); }
static int load(void *i, int k) {
    double before[LB_PARAMETERS];
    note_values(i, before);
    if (!lb_load_sound(i, k)) return 0;
    tell_changes(i, before);
    return 1;
}
static void response(void *i, char *text, size_t room) { lb_response_title(i, text, room); }
static char response_names[LB_MAX_RESPONSES][LB_FILE_NAME]; /* of the window that listed them last */
static int responses(void *i) {
    (void)i;
    return lb_list_responses(response_names);
}
static const char *response_name(void *i, int file) {
    (void)i;
    return response_names[file];
}
static const char *respond(void *i, int file) {
    char path[LB_PATH] = "";
    return file < 0 || lb_response_path(response_names[file], path) ? lb_take_response(i, path) : "The path is too long";
}
/* Takes a text by a function, and tells the host what has changed. */
static const char *take(lb_instance *i, const char *(*by)(lb_instance *, const char *), const char *text) {
    double before[LB_PARAMETERS];
    note_values(i, before);
    const char *why = by(i, text);
    if (!why) tell_changes(i, before);
    return why;
}
static const char *paste(void *i, const char *text) { return take(i, lb_take_text, text); }
static const char *drop(void *i, const char *text) { return take(i, lb_take_dropped, text); }
static void song(void *i, lb_song_view *to) { lb_view_song(i, to); }
static void steer(void *i, int what) { lb_steer_song(i, what); }
static void discard(void *i, int k) { lb_remove_sound(i, k); }
static int controller(void *i, int parameter) {
    if (lb_learning(i) == parameter) return LB_WAITS;
    int k = LB_CONTROLLERS - 1;
    while (k >= 0 && lb_learned_by(i, k) != parameter) k--;
    return k;
}
static void learn(void *i, int parameter) {
    const int now = controller(i, parameter);
    if (now >= 0) lb_forget(i, parameter);
    else lb_learn(i, now == LB_WAITS ? -1 : parameter);
}

lb_face lb_face_of(lb_instance *i) {
    return (lb_face){.owner = i, .look = &i->look, .value = value, .maximum = maximum, .set = set, .text = text,
                     .note = note, .own = own, .switched = switched, .undo = undo, .swap = swap, .side = side,
                     .kept = kept, .update = update, .copy = copy, .read = read, .title = title, .playing = playing, .group = group, .zoom = zoom,
                     .learn = i->learns ? learn : 0, .controller = controller, .list = list, .sound = sound,
                     .is_own = is_own, .save = save, .load = load, .remove = discard, .paste = paste, .response = response,
                     .responses = responses, .response_name = response_name, .respond = respond, .drop = drop,
                     .song = song, .steer = steer};
}

lb_editor *lb_edit_instance(lb_instance *i, uintptr_t parent, int width, int height, double scale) {
    const lb_face face = lb_face_of(i);
    return lb_open_editor(&face, &i->look, parent, width, height, scale);
}
