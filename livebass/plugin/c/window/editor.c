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
static double zoom(lb_instance *i, double to) {
    (void)i;
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

/* Tells the host which values have changed. */
static void tell_changes(lb_instance *i, const double before[LB_PARAMETERS]) {
    for (int k = 0; k < LB_PARAMETERS; k++)
        for (int phase = LB_BEGIN; lb_value(i, k) != before[k] && phase <= LB_END; phase++)
            lb_put_move(&i->moves, k, phase, lb_value(i, k));
    i->moved(i->owner);
}
/* The plugin, in another process, cannot move its ports: this window does. */
static void stop_sliders(lb_instance *i) {
    double before[LB_PARAMETERS];
    lb_read_values(i, before);
    lb_stop_sliders(i);
    tell_changes(i, before);
}

static void set(lb_instance *i, int parameter, double value, int phase) {
    if (parameter == LB_BASS) *i->window.sound = 0; /* a bass is chosen, not a sound */
    if (phase == LB_BEGIN) lb_keep_values(i);
    lb_move_value(i, parameter, value, phase);
    if (phase == LB_END && i->there && lb_is_slider(parameter)) stop_sliders(i);
}
static void note(lb_instance *i, int on, int string, int key, double velocity) {
    lb_put_touch(&i->touches, on, string, key, velocity);
    i->moved(i->owner);
}
static const lb_own *own(const lb_instance *i) {
    const int bass = (int)lb_value(i, LB_BASS);
    return bass < lb_shelf_count(i->shelf) ? lb_shelf_own(i->shelf, bass) : 0;
}
static const lb_switch *switched(const lb_instance *i, int key) {
    return lb_shelf_switch(i->shelf, (int)lb_value(i, LB_BASS), key);
}

static void undo(lb_instance *i) {
    double before[LB_PARAMETERS];
    lb_read_values(i, before);
    lb_undo(i);
    tell_changes(i, before);
}
static void swap(lb_instance *i) {
    double before[LB_PARAMETERS];
    lb_read_values(i, before);
    lb_swap_sides(i);
    tell_changes(i, before);
}
static int kept(const lb_instance *i) {
    return __atomic_load_n(&i->kept_there, __ATOMIC_RELAXED) || lb_is_kept(i->shelf, (int)lb_value(i, LB_BASS));
}
static void update(lb_instance *i) {
    lb_keep_values(i);
    lb_update_bass(i->shelf, (int)lb_value(i, LB_BASS));
    __atomic_store_n(&i->kept_there, 0, __ATOMIC_RELAXED);
    i->updates++;
    i->moved(i->owner);
}
static void copy(lb_instance *i) {
    lb_copy_side(i);
    i->moved(i->owner);
}
static int group(const lb_instance *i, int bass) { return lb_shelf_group(i->shelf, bass); }
static int load(lb_instance *i, int k) {
    double before[LB_PARAMETERS];
    lb_read_values(i, before);
    if (!lb_load_sound(i, k)) return 0;
    tell_changes(i, before);
    return 1;
}
static char response_names[LB_MAX_RESPONSES][LB_FILE_NAME]; /* of the window that listed them last */
static int responses(lb_instance *i) {
    (void)i;
    return lb_list_responses(response_names);
}
static const char *response_name(lb_instance *i, int file) {
    (void)i;
    return response_names[file];
}
static const char *respond(lb_instance *i, int file) {
    char path[LB_PATH] = "";
    return file < 0 || lb_response_path(response_names[file], path) ? lb_take_response(i, path) : "The path is too long";
}
/* Takes a text by a function, and tells the host what has changed. */
static const char *take(lb_instance *i, const char *(*by)(lb_instance *, const char *), const char *text) {
    double before[LB_PARAMETERS];
    lb_read_values(i, before);
    const char *why = by(i, text);
    if (!why) tell_changes(i, before);
    return why;
}
static const char *paste(lb_instance *i, const char *text) { return take(i, lb_take_text, text); }
static const char *drop(lb_instance *i, const char *text) { return take(i, lb_take_dropped, text); }
static int controller(const lb_instance *i, int parameter) {
    if (lb_learning(i) == parameter) return LB_WAITS;
    int k = LB_CONTROLLERS - 1;
    while (k >= 0 && lb_learned_by(i, k) != parameter) k--;
    return k;
}
static void learn(lb_instance *i, int parameter) {
    const int now = controller(i, parameter);
    if (now >= 0) lb_forget(i, parameter);
    else lb_learn(i, now == LB_WAITS ? -1 : parameter);
}

lb_face lb_face_of(lb_instance *i) {
    return (lb_face){.owner = i, .look = &i->look, .value = lb_value, .maximum = lb_maximum, .set = set,
                     .text = lb_value_to_text, .read = lb_text_to_value, .note = note, .own = own, .switched = switched,
                     .undo = undo, .swap = swap, .side = lb_side, .kept = kept, .update = update, .copy = copy,
                     .learn = i->learns ? learn : 0, .controller = controller, .title = lb_title,
                     .playing = lb_playing_sound, .group = group, .list = lb_list_sounds, .sound = lb_sound_name,
                     .is_own = lb_sound_is_own, .save = lb_save_sound, .load = load, .remove = lb_remove_sound,
                     .response = lb_response_title, .responses = responses, .response_name = response_name,
                     .respond = respond, .zoom = zoom, .paste = paste, .drop = drop, .song = lb_view_song,
                     .steer = lb_steer_song, .stopped = lb_last_stop, .fault = lb_fault_to_text};
}

lb_editor *lb_edit_instance(lb_instance *i, uintptr_t parent, int width, int height, double scale) {
    const lb_face face = lb_face_of(i);
    lb_editor *e = calloc(1, sizeof *e);
    if (!e) return 0;
    e->look = &i->look;
    lb_watch(e->look, 1);
    e->picture = lb_new_picture(&face);
    e->window = e->picture ? lb_open_window(e->picture, parent, width, height, scale) : 0;
    if (e->window) return e;
    lb_close_editor(e);
    return 0;
}
