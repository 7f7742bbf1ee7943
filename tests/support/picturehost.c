/* An instance of the plugin without a host, for tests of the picture: plays notes into blocks, and is looked at. */
#include "instance/instance.h"
#include "window/editor.h"
#include "instance/names.h"
#include "instance/score.h"
#include "instance/song.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    lb_instance instance;
    int requested; /* to load a bass, behind the block */
} host;

static void complain(void *owner, const char *line) {
    (void)owner;
    fprintf(stderr, "%s\n", line);
}
static void ask(void *owner) { ((host *)owner)->requested = 1; }
static void moved(void *owner) { (void)owner; }

host *new_host(const char *folder, double rate) {
    host *h = calloc(1, sizeof *h);
    h->instance.owner = h;
    h->instance.complain = complain;
    h->instance.ask = ask;
    h->instance.moved = moved;
    if (!lb_open_instance(&h->instance, folder) || !lb_activate_instance(&h->instance, rate)) return 0;
    return h;
}
void free_host(host *h) {
    lb_close_instance(&h->instance);
    free(h);
}
lb_look *look_of_host(host *h) { return &h->instance.look; }
void set_host(host *h, int parameter, double value) { lb_set_value(&h->instance, parameter, value); }
double host_value(host *h, int parameter) { return lb_value(&h->instance, parameter); }
int host_is_kept(host *h) { return lb_face_of(&h->instance).kept(&h->instance); }
void host_update(host *h) { lb_face_of(&h->instance).update(&h->instance); }
double host_max(host *h, int parameter) { return lb_maximum(&h->instance, parameter); }
void host_text(host *h, int parameter, double value, char *text, size_t room) {
    lb_value_to_text(&h->instance, parameter, value, text, room);
}
int host_group(host *h, int bass) { return lb_shelf_group(h->instance.shelf, bass); }
const lb_own *host_own(host *h) { return lb_shelf_own(h->instance.shelf, (int)lb_value(&h->instance, LB_BASS)); }
const lb_switch *host_switched(host *h, int key) {
    return lb_shelf_switch(h->instance.shelf, (int)lb_value(&h->instance, LB_BASS), key);
}
void play_host(host *h, float *out, int64_t n) {
    float *outs[LB_STRINGS] = {out};
    lb_begin_block(&h->instance);
    lb_play_block(&h->instance, 0, outs, n);
    if (h->requested) lb_serve(&h->instance);
    h->requested = 0;
}
void note_host(host *h, int on, int key, double velocity) {
    if (on) lb_start_note(&h->instance, 0, (lb_named){-1, 0, key, -1}, velocity);
    else lb_stop_note(&h->instance, 0, (lb_named){-1, 0, key, -1}, 0.5);
}

void touch_host(host *h, int on, int string, int key) { lb_put_touch(&h->instance.touches, on, string, key, 0.75); }
int move_host(host *h, lb_move *to) { return lb_take_move(&h->instance.moves, to); }

/* Plays `count` messages, packed as for rings, from the next block on. */
void song_host(host *h, const int64_t *frames, const int64_t *words, int64_t count, int64_t end) {
    int64_t *at, *packed;
    lb_song *s = lb_new_song(count, &at, &packed);
    memcpy(at, frames, (size_t)count * sizeof *at);
    memcpy(packed, words, (size_t)count * sizeof *packed);
    lb_load_song(s, h->instance.rate, end, h->instance.kernels);
    lb_put_song(&h->instance, s);
}
void roll_host(host *h, int rolls, int loops) {
    __atomic_store_n(&h->instance.loops, loops, __ATOMIC_RELAXED);
    __atomic_store_n(&h->instance.rolls, rolls, __ATOMIC_RELAXED);
}
int host_rolls(host *h) { return __atomic_load_n(&h->instance.rolls, __ATOMIC_RELAXED); }
int host_may_sleep(host *h) { return lb_may_sleep(&h->instance); }

/* --- names of tracks --- */

/* Writes a name as it is shown; returns 1: bass, 2: another low instrument, 4: drums, 8: a game's. */
int read_name(const uint8_t *bytes, size_t count, char text[LB_NAME_BYTES]) {
    lb_name name;
    lb_read_name(&name, bytes, count);
    lb_write_name(&name, text);
    return lb_name_has(&name, lb_bass_words) | lb_name_has(&name, lb_other_words) << 1 |
           lb_name_has(&name, lb_drum_words) << 2 | lb_name_is(&name, lb_game_track) << 3;
}

/* --- MIDI files --- */

typedef struct {
    int64_t count, end, left_out, raised, parts;
    char line[4096]; /* what plays, or the fault */
    char text[64][400]; /* the parts */
} a_reading;

/* Reads a file for a bass; its messages, at most `room`, are PLAYED. Returns 0 with the fault in the line. */
int read_song(const uint8_t *bytes, size_t size, int rate, const lb_keys *keys, LB_PLAYED *rows, int64_t room, a_reading *to) {
    lb_score s;
    memset(to, 0, sizeof *to);
    int good = lb_read_score(&s, bytes, size, rate, lb_best_kernels(), to->line, sizeof to->line);
    if (good) {
        const int64_t before = s.score.played_count;
        const LB_PLAYED *played = (const LB_PLAYED *)(intptr_t)s.score.played;
        to->end = s.score.end > played[before - 1].frame ? s.score.end : played[before - 1].frame;
        good = lb_fit_score(&s, keys);
        to->count = s.score.played_count;
        memcpy(rows, played, (size_t)(to->count < room ? to->count : room) * sizeof *rows);
        to->left_out = s.left_out;
        to->raised = s.raised;
        to->parts = s.score.parts_count;
        for (int64_t k = 0; k < to->parts && k < 64; k++) lb_describe_part(&s, k, to->text[k], sizeof to->text[k]);
        lb_describe_score(&s, to->line, sizeof to->line);
    }
    lb_free_score(&s);
    return good;
}
void view_song(host *h, lb_song_view *to) { lb_view_song(&h->instance, to); }
void steer_song(host *h, int what) { lb_steer_song(&h->instance, what); }
/* Begins again at another rate. */
int restart_host(host *h, double rate) { return lb_activate_instance(&h->instance, rate); }

/* --- looks without an instance --- */

lb_look *new_looks(void) { return calloc(1, sizeof(lb_look)); }
size_t size_of_look(void) { return sizeof(LB_LOOK); }

typedef struct {
    lb_look *look;
    int64_t count;
} writer;
static void *write_looks(void *of) {
    writer *w = of;
    LB_LOOK l;
    memset(&l, 0, sizeof l);
    for (int64_t k = 1; k <= w->count; k++) {
        l.strings = 1 + k % LB_STRINGS;
        l.frame = k;
        for (int i = 0; i < LB_STRINGS; i++) {
            l.string[i].key = k * l.strings;
            l.string[i].sight.slot[1].v[LB_SEEN - 1] = (float)k;
            l.string[i].light[LB_PLACES - 1] = (float)k;
        }
        lb_put_look(w->look, &l);
    }
    return 0;
}
/* Writes looks in one thread and reads them in another; returns how many were read, -1: one was torn or older. */
int64_t race(int64_t count) {
    writer w = {new_looks(), count};
    pthread_t thread;
    int64_t read = 0, newest = 0;
    LB_LOOK *l = malloc(sizeof *l);
    pthread_create(&thread, 0, write_looks, &w);
    while (newest < count && read >= 0) {
        for (int before = 0; before < LB_LOOKS && read >= 0; before++) {
            if (!lb_read_look(w.look, before, l)) continue;
            read++;
            int good = l->strings == 1 + l->frame % LB_STRINGS && (before || l->frame >= newest);
            for (int i = 0; i < l->strings; i++) {
                const LB_STRING_LOOK *s = &l->string[i];
                good = good && s->key == l->frame * l->strings && s->light[LB_PLACES - 1] == (float)l->frame &&
                       s->sight.slot[1].v[LB_SEEN - 1] == (float)l->frame;
            }
            if (!good) read = -1;
            if (!before && good) newest = l->frame;
        }
    }
    pthread_join(thread, 0);
    free(w.look);
    free(l);
    return read;
}
