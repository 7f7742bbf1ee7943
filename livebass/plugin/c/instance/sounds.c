/* Sounds, one file each: the factory's, beside the plugin's instruments, and the user's, in the folder of the user's own
   instruments. */
#include "system/lock.h"
#include "instance/response.h"
#include "instance/text.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_SOUNDS = 4096, TITLE = LB_FILE_NAME - 16 };

struct lb_sound {
    char name[LB_FILE_NAME];
    int own; /* the user's */
};

/* The folder of the user's sounds, or of the factory's; returns 0 if there is none. */
static int folder_of(const lb_instance *i, int own, char folder[LB_PATH]) {
    return own ? lb_users_folder(folder) : lb_factory_sounds(lb_shelf_folder(i->shelf), folder);
}

int lb_factory_sounds(const char *instruments, char *folder) {
    return snprintf(folder, LB_PATH, "%s/sounds", instruments) < LB_PATH;
}

/* The path of a sound's file; returns 0 if there is no room for it. */
static int path_of(const lb_instance *i, const lb_sound *s, char path[LB_PATH]) {
    char folder[LB_PATH];
    return folder_of(i, s->own, folder) && snprintf(path, LB_PATH, "%s/%s." LB_SOUND_ENDING, folder, s->name) < LB_PATH;
}

static void say(const lb_instance *i, const char *path, const char *why) {
    lb_log(i, "%s: the sound %s", path, why);
}

/* Makes a response's path one from a folder, the first bytes of `path`, on. */
static void locate(lb_kept *to, const char *path, size_t count) {
    char own[LB_PATH];
    if (!*to->response_path || strchr("/\\", *to->response_path) || to->response_path[1] == ':') return;
    memcpy(own, to->response_path, sizeof own);
    if (snprintf(to->response_path, LB_PATH, "%.*s%s", (int)count, path, own) >= LB_PATH) *to->response_path = 0;
}

const char *lb_read_sound(const char *path, lb_kept *to) {
    char text[LB_MAX_TEXT + 1]; /* one byte more than a sound may have */
    FILE *in = lb_open_file(path, "rb");
    const size_t count = in ? fread(text, 1, LB_MAX_TEXT, in) : 0;
    if (in) fclose(in);
    text[count] = 0;
    if (!in) return "cannot be read";
    const char *why = lb_parse_text(text, to);
    locate(to, path, (size_t)(lb_file_name(path) - path));
    return why;
}

/* Finds the bass of a sound that was read with the fault `why` (0: none). Returns that fault, or that the bass is not
   on the shelf. */
static const char *known(const lb_instance *i, const char *why, lb_kept *to) {
    if (why) return why;
    const int bass = lb_shelf_find(i->shelf, to->bass);
    to->values[LB_BASS] = bass;
    return bass < 0 ? "has a bass that is not installed" : 0;
}

/* Reads a sound's file; returns 0 after a line in the log. */
static int read_file_of(const lb_instance *i, const lb_sound *s, lb_kept *to) {
    char path[LB_PATH];
    if (!path_of(i, s, path)) return 0;
    const char *why = known(i, lb_read_sound(path, to), to);
    if (why) say(i, path, why);
    return !why;
}

/* Reads a sound's response. Returns the fault `why`, or its own. */
static const char *with_response(const lb_instance *i, const char *why, lb_kept *to) {
    if (why || !*to->response_path) return why;
    if (!(why = lb_read_response(to->response_path, i->kernels, &to->response))) return 0;
    snprintf(to->why, sizeof to->why, "has a response, %.60s, that %s", lb_file_name(to->response_path), why);
    return to->why;
}

static void set(lb_instance *i, const lb_kept *kept) {
    lb_update_bass(i->shelf, (int)kept->values[LB_BASS]); /* a sound is one of the present bass */
    lb_set_values(i, kept->values, 0);
    lb_set_response(i, kept->response);
    __atomic_store_n(&i->missing, 0, __ATOMIC_RELAXED); /* even if that bass was already playing */
}

/* Loads a sound that was read; returns its fault. */
static const char *take(lb_instance *i, const char *why, lb_kept *kept) {
    if (!(why = with_response(i, known(i, why, kept), kept))) {
        lb_keep_all(i);
        set(i, kept);
        return 0;
    }
    snprintf(i->window.why, sizeof i->window.why, "%s", why);
    return i->window.why;
}

const char *lb_take_sound(lb_instance *i, const char *path) {
    lb_kept kept;
    return take(i, lb_read_sound(path, &kept), &kept);
}

const char *lb_take_response(lb_instance *i, const char *path) {
    LB_ALONE(i->window.owner);
    lb_response *r = 0;
    const char *why = *path ? lb_read_response(path, i->kernels, &r) : 0;
    if (why) {
        snprintf(i->window.why, sizeof i->window.why, "%.60s %s", lb_file_name(path), why);
        return i->window.why;
    }
    lb_keep_all(i);
    lb_set_response(i, r);
    i->moved(i->owner);
    return 0;
}

/* Copies the first path in a text, as file managers copy and drop it. */
static void copy_path(const char *text, char path[LB_PATH]) {
    text += strspn(text, " \"");
    const char *file = strncmp(text, "file://", 7) ? text : text + 7;
    if (file != text && *file && *file != '/' && strchr(file, '/')) file = strchr(file, '/'); /* of a host, this one */
    snprintf(path, LB_PATH, "%s", file);
    path[strcspn(path, "\r\n\"")] = 0;
    if (file != text) lb_decode(path, 0);
#ifdef _WIN32
    if (path[0] == '/' && path[1] && path[2] == ':') memmove(path, path + 1, strlen(path)); /* file:///C:/ */
#endif
}

static int ends_with(const char *path, const char *ending) {
    const size_t length = strlen(path), count = strlen(ending);
    if (length < count) return 0;
    for (size_t k = 0; k < count; k++)
        if ((path[length - count + k] | 32) != ending[k]) return 0;
    return 1;
}

/* Takes a file, by the ending of its name. */
static const char *take_file(lb_instance *i, const char *path) {
    if (ends_with(path, ".wav")) return lb_take_response(i, path);
    if (!ends_with(path, "." LB_SOUND_ENDING)) return lb_take_song(i, path);
    const char *why = lb_take_sound(i, path);
    if (!why) return 0;
    char fault[sizeof i->window.why];
    snprintf(fault, sizeof fault, "%s", why);
    snprintf(i->window.why, sizeof i->window.why, "%.60s %.130s", lb_file_name(path), fault);
    return i->window.why;
}

const char *lb_take_dropped(lb_instance *i, const char *text) {
    char path[LB_PATH];
    copy_path(text, path);
    return take_file(i, path);
}

const char *lb_take_text(lb_instance *i, const char *text) {
    static const char *const files[] = {".wav", LB_MIDI_ENDINGS};
    char folder[LB_PATH], path[LB_PATH];
    lb_kept kept;
    copy_path(text, path);
    for (size_t k = 0; k < sizeof files / sizeof *files; k++)
        if (ends_with(path, files[k])) return take_file(i, path);
    const char *why = lb_parse_text(text, &kept);
    if (lb_users_folder(path) && snprintf(folder, LB_PATH, "%s/", path) < LB_PATH) locate(&kept, folder, strlen(folder));
    why = take(i, why, &kept);
    if (why) lb_log(i, "the clipboard %s", why); /* the window may cut it */
    return why;
}

/* --- the list --- */

/* Sorts as file managers do: numbers in names by value. */
static int by_name(const void *one, const void *other) {
    const char *a = one, *b = other; /* a sound begins with its name */
    while (*a && *b) {
        const size_t digits_a = strspn(a, "0123456789"), digits_b = strspn(b, "0123456789");
        if (digits_a && digits_b) {
            const unsigned long long m = strtoull(a, 0, 10), n = strtoull(b, 0, 10);
            if (m != n) return m < n ? -1 : 1;
            a += digits_a;
            b += digits_b;
        } else if (*a != *b) return (unsigned char)*a < (unsigned char)*b ? -1 : 1;
        else a++, b++;
    }
    return *a || *b ? (*a ? 1 : -1) : strcmp(one, other);
}

static void add(lb_instance *i, const char *name, int own) {
    lb_kept kept;
    lb_sound made = {.own = own};
    strcpy(made.name, name);
    if (i->window.sound_count == MAX_SOUNDS || !read_file_of(i, &made, &kept)) return;
    if (i->window.sound_count % 64 == 0) { /* no room for more */
        lb_sound *more = realloc(i->window.sounds, (size_t)(i->window.sound_count + 64) * sizeof *more);
        if (!more) return;
        i->window.sounds = more;
    }
    i->window.sounds[i->window.sound_count++] = made;
}

static void add_factory(void *instance, const char *folder, const char *name) {
    (void)folder;
    add(instance, name, 0);
}

static void add_own(void *instance, const char *folder, const char *name) {
    (void)folder;
    add(instance, name, 1);
}

int lb_list_sounds(lb_instance *i) {
    LB_ALONE(i->window.owner);
    char folder[LB_PATH];
    i->window.sound_count = 0;
    for (int own = 0; own < 2; own++) {
        const int first = i->window.sound_count;
        if (folder_of(i, own, folder)) lb_each_file(folder, "." LB_SOUND_ENDING, own ? add_own : add_factory, i);
        const size_t count = (size_t)(i->window.sound_count - first);
        if (count) qsort(i->window.sounds + first, count, sizeof *i->window.sounds, by_name);
    }
    return i->window.sound_count;
}

int lb_sound_is_own(const lb_instance *i, int sound) {
    return sound < i->window.sound_count && i->window.sounds[sound].own;
}

const char *lb_sound_name(const lb_instance *i, int sound) {
    return sound < i->window.sound_count ? i->window.sounds[sound].name : ""; /* another view may have listed fewer */
}

void lb_forget_sounds(lb_instance *i) {
    free(i->window.sounds);
    i->window.sounds = 0;
    i->window.sound_count = 0;
}

/* --- one of them --- */

/* Makes a file name for any system from a bass's title. */
static void name_file(const char *title, char stem[TITLE]) {
    size_t n = 0;
    for (; title[n] && n < TITLE - 1; n++)
        stem[n] = (unsigned char)title[n] < ' ' || strchr("<>:\"/\\|?*\x7F", title[n]) ? '-' : title[n];
    while (n && title[n] && (title[n] & 0xC0) == 0x80) n--; /* cuts no letter */
    stem[n] = 0;
    if (*stem == '.') *stem = '-'; /* else it would be hidden */
}

/* Keeps a sound's name, and the present values, to tell whether they have changed since. */
static void keep_sound(lb_instance *i, const char *name) {
    snprintf(i->window.sound, sizeof i->window.sound, "%s", name);
    lb_read_values(i, i->window.values);
}

/* True while the bass is that of the sound that was loaded or saved last. */
static int is_sound(const lb_instance *i) {
    return *i->window.sound && i->window.values[LB_BASS] == lb_value(i, LB_BASS);
}

int lb_playing_sound(const lb_instance *i) {
    for (int k = 0; is_sound(i) && k < i->window.sound_count; k++)
        if (!strcmp(lb_sound_name(i, k), i->window.sound)) return k;
    return -1;
}

void lb_title(const lb_instance *i, char *text, size_t room) {
    const int sound = is_sound(i), bass = lb_bass_number(i, lb_value(i, LB_BASS));
    int changed = 0;
    for (int k = 0; k < LB_PARAMETERS; k++)
        changed |= lb_is_of_sides(k) && lb_value(i, k) != (sound ? i->window.values[k] : lb_parameters[k].default_value);
    const char *saved = __atomic_load_n(&i->kept_there, __ATOMIC_RELAXED) || lb_is_kept(i->shelf, bass) ? " (as saved)" : "";
    snprintf(text, room, "%s%s%s", sound ? i->window.sound : lb_shelf_title(i->shelf, bass), saved, changed ? " *" : "");
}

int lb_save_sound(lb_instance *i, char *name, size_t room) {
    char text[LB_MAX_TEXT], folder[LB_PATH] = "the user's folder", stem[TITLE], made[LB_FILE_NAME];
    double values[LB_PARAMETERS];
    lb_read_values(i, values);
    const int bass = lb_bass_number(i, values[LB_BASS]), named = *name != 0;
    name_file(named ? name : lb_shelf_title(i->shelf, bass), stem);
    lb_response *r = lb_use_response(i);
    char cabinet[LB_FILE_NAME], path[LB_FILE_NAME + 20] = "";
    const int kept = !r || lb_write_response(r, i->kernels, cabinet);
    if (r) snprintf(path, sizeof path, LB_RESPONSES "/%s.wav", cabinet);
    lb_free_response(r);
    const size_t count = lb_write_text(lb_shelf_name(i->shelf, bass), values, path, text);
    enter(); /* one at a time per process */
    const int good = kept && lb_users_folder(folder) && lb_write_numbered(folder, stem, "." LB_SOUND_ENDING, text, count, !named, made);
    leave();
    if (good) snprintf(name, room, "%s", made);
    if (good) keep_sound(i, made);
    else say(i, folder, "cannot be written");
    return good;
}

int lb_load_sound(lb_instance *i, int sound) {
    LB_ALONE(i->window.owner);
    lb_kept kept;
    if (sound < 0 || sound >= i->window.sound_count || !read_file_of(i, &i->window.sounds[sound], &kept)) return 0;
    const char *why = with_response(i, 0, &kept);
    if (why) say(i, lb_sound_name(i, sound), why);
    if (why) return 0;
    lb_keep_all(i);
    set(i, &kept);
    keep_sound(i, lb_sound_name(i, sound));
    return 1;
}

void lb_remove_sound(lb_instance *i, int sound) {
    char path[LB_PATH];
    if (sound < 0 || !lb_sound_is_own(i, sound) || !path_of(i, &i->window.sounds[sound], path)) return;
    if (!lb_remove_file(path)) say(i, path, "cannot be deleted");
}
