/* Plays a MIDI file in an instance. */
#include "instance/song.h"
#include "instance/score.h"
#include "system/lock.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SHORTEST 0.1 /* s, of a turn of the loop */
#define RATE 48000.0 /* Hz, of an instance that has not played yet */
#define ADDRESS(x) ((int64_t)(intptr_t)(x))
enum { MAX_FILE = 64 << 20 /* bytes */, WHY = 400 };

struct lb_song_file { /* the file that plays: its bytes, as its song depends on the bass and the rate */
    size_t size;
    char name[LB_FILE_NAME];
    uint8_t bytes[];
};

/* --- its messages --- */

lb_song *lb_new_song(int64_t count, int64_t **frames, int64_t **words) {
    LB_MAY_WAIT();
    lb_song *s = calloc(1, sizeof *s + (4 * (size_t)count + 1) * sizeof *s->memory);
    if (!s) return 0;
    s->desk.count = count; /* until it is loaded */
    *frames = s->memory;
    *words = s->memory + count;
    return s;
}

void lb_load_song(lb_song *s, double rate, int64_t end, const lb_kernels *kernels) {
    const int64_t count = s->desk.count, shortest = (int64_t)(SHORTEST * rate);
    s->end = end > shortest ? end : shortest;
    s->desk.speed = 1;
    s->desk.loop_to = (double)s->end;
    kernels->load_desk(ADDRESS(&s->desk), ADDRESS(s->memory), ADDRESS(s->memory + count), count,
                       ADDRESS(s->memory + 2 * count), -1, rate);
}

static void free_song(lb_song *s) {
    LB_MAY_WAIT();
    free(s);
}

void lb_put_song(lb_instance *i, lb_song *s) {
    lb_song *unplayed = __atomic_exchange_n(&i->next_song, s, __ATOMIC_ACQ_REL);
    if (unplayed) free_song(unplayed);
}

void lb_free_songs(lb_instance *i) {
    lb_song *old = __atomic_exchange_n(&i->old_song, 0, __ATOMIC_ACQ_REL);
    if (old) free_song(old);
}

/* --- from a file --- */

static uint32_t range_word(int64_t lowest, int64_t highest) {
    return (uint32_t)(lowest & 0xFF) | (uint32_t)(highest & 0xFF) << 8;
}

/* The lowest and the highest key, in one word, of the bass that plays; before, of the chosen one. */
static uint32_t range_of(const lb_instance *i) {
    const LB_INSTRUMENT *own = lb_shelf_instrument(i->shelf, lb_bass_number(i, lb_value(i, LB_BASS)));
    const uint32_t range = __atomic_load_n(&i->song_range, __ATOMIC_RELAXED);
    int64_t high = 0;
    for (int k = 0; own && k < own->strings; k++) high = own->open_note[k] > high ? own->open_note[k] : high;
    return range || !own ? range : range_word(own->open_note[0], high + own->frets);
}

static void find_keys(const lb_instance *i, lb_keys *keys) {
    const int bass = lb_bass_number(i, lb_value(i, LB_BASS));
    const LB_INSTRUMENT *own = lb_shelf_instrument(i->shelf, bass);
    const uint32_t range = range_of(i);
    memset(keys, 0, sizeof *keys);
    keys->lowest = (int)(range & 0xFF);
    keys->highest = (int)(range >> 8);
    for (int key = 0; own && key < LB_KEY_COUNT; key++) {
        const int outside = key < keys->lowest || key >= LB_TOP_KEYS;
        keys->switches[key] = (own->key_map.over_notes || outside) && lb_shelf_switch(i->shelf, bass, key);
    }
}

/* A word for all that a song depends on; never 0. */
static uint64_t wish(const lb_instance *i) {
    const int bass = lb_bass_number(i, lb_value(i, LB_BASS));
    const uint64_t plain = (uint64_t)lrint(i->rate) << 32 | (uint64_t)bass << 16 | range_of(i);
    return (plain ^ lb_kept_sum(i->shelf, bass) << 1) | 1ull << 63;
}

/* Makes a song of a file, and the line about it; 0 after writing the fault into that. */
static lb_song *make_song(const lb_instance *i, const lb_song_file *file, char line[LB_SONG_LINE]) {
    const double rate = i->rate > 0 ? i->rate : RATE;
    int64_t *frames, *words, count = 0;
    lb_keys keys;
    lb_score *read = calloc(1, sizeof *read);
    char why[WHY] = "there is no memory for it";
    lb_song *s = 0;
    find_keys(i, &keys);
    const int good = read && lb_read_score(read, file->bytes, file->size, (int)lrint(rate), i->kernels, why, sizeof why);
    if (good && lb_fit_score(read, &keys)) {
        const LB_PLAYED *played = (const LB_PLAYED *)(intptr_t)read->score.played;
        s = lb_new_song(read->score.played_count, &frames, &words);
        for (int64_t k = 0; s && k < read->score.played_count; k++) {
            if ((played[k].status & 0xF0) == 0xC0) continue; /* the host chooses the bass */
            frames[count] = played[k].frame;
            words[count++] = played[k].status | played[k].first << 8 | played[k].second << 16;
        }
        if (s) {
            const int64_t last = count ? frames[count - 1] : 0;
            s->desk.count = count;
            lb_load_song(s, rate, read->score.end > last ? read->score.end : last, i->kernels);
            lb_describe_score(read, why, sizeof why);
        }
    }
    snprintf(line, LB_SONG_LINE, "%s: %s", file->name, why);
    if (read) lb_free_score(read);
    free(read);
    return s;
}

/* Reads a file; 0 after writing the fault. */
static lb_song_file *read_file(const char *path, char line[LB_SONG_LINE]) {
    FILE *in = lb_open_file(path, "rb");
    long size = -1;
    lb_song_file *file = 0;
    const char *why = "cannot be read";
    if (in && !fseek(in, 0, SEEK_END) && (size = ftell(in)) >= 0 && size < LONG_MAX && !fseek(in, 0, SEEK_SET)) {
        if (size > MAX_FILE) {
            const char *name = lb_file_name(path);
            snprintf(line, LB_SONG_LINE, "%.150s: has %ld MB, more than %d MB", name, size >> 20, MAX_FILE >> 20);
            fclose(in);
            return 0;
        }
        file = malloc(sizeof *file + (size_t)size + 1);
        if (!file) why = "there is no memory for it";
        else {
            file->size = fread(file->bytes, 1, (size_t)size, in);
            snprintf(file->name, sizeof file->name, "%.*s", (int)sizeof file->name - 1, lb_file_name(path));
        }
    }
    if (in) fclose(in);
    if (!file) snprintf(line, LB_SONG_LINE, "%.150s: %s", lb_file_name(path), why);
    return file;
}

/* Prepares the file's song and hands it over; under the lock. */
static int put(lb_instance *i, const lb_song_file *file, int continues, char line[LB_SONG_LINE]) {
    const uint64_t wanted = wish(i);
    lb_song *s = make_song(i, file, line);
    if (!s) return 0;
    s->continues = continues;
    __atomic_store_n(&i->song_for, wanted, __ATOMIC_RELEASE);
    lb_put_song(i, s);
    return 1;
}

/* Keeps what a hand wants of a song that plays in another process. */
static void want(lb_instance *i, int what, const char *path) {
    enter();
    if (what == LB_GIVE) snprintf(i->there->path, LB_PATH, "%s", path);
    i->there->wants |= 1 << what;
    leave();
}

int lb_take_wants(lb_instance *i, char path[LB_PATH]) {
    enter();
    const int wants = i->there->wants;
    strcpy(path, i->there->path);
    i->there->wants = 0;
    leave();
    return wants;
}

void lb_show_song(lb_instance *i, const lb_song_view *view) {
    enter();
    i->there->view = *view;
    i->there->view.line[LB_SONG_LINE - 1] = 0;
    leave();
}

const char *lb_take_song(lb_instance *i, const char *path) {
    LB_ALONE(i->window.owner);
    char line[LB_SONG_LINE];
    if (i->there) {
        want(i, LB_GIVE, path);
        return 0;
    }
    lb_song_file *file = read_file(path, line), *old = file;
    enter();
    const int good = file && put(i, file, 0, line);
    if (good) {
        old = i->song_file;
        i->song_file = file;
        strcpy(i->song_line, line);
    }
    snprintf(i->song_fault, sizeof i->song_fault, "%s", good ? "" : line);
    leave();
    free(old);
    if (good) __atomic_store_n(&i->rolls, 1, __ATOMIC_RELEASE);
    i->moved(i->owner);
    if (good) return 0;
    snprintf(i->window.why, sizeof i->window.why, "%.190s", line);
    return i->window.why;
}

/* True if the song is prepared for another bass or another rate. */
static int is_old(const lb_instance *i) {
    const uint64_t now = __atomic_load_n(&i->song_for, __ATOMIC_ACQUIRE);
    return now && now != wish(i);
}

int lb_song_asks(const lb_instance *i) { return __atomic_load_n(&i->old_song, __ATOMIC_RELAXED) || is_old(i); }

void lb_renew_song(lb_instance *i) {
    char line[LB_SONG_LINE];
    if (!is_old(i)) return;
    enter();
    if (i->song_file && put(i, i->song_file, 1, line)) strcpy(i->song_line, line);
    else __atomic_store_n(&i->song_for, wish(i), __ATOMIC_RELEASE); /* the last one plays on */
    leave();
}

/* Replaces the song by none. */
static void put_away(lb_instance *i) {
    int64_t *none;
    enter();
    lb_song_file *old = i->song_file;
    const int only_fault = old && *i->song_fault;
    *i->song_fault = 0;
    lb_song *s = only_fault ? 0 : lb_new_song(0, &none, &none);
    if (s) {
        i->song_file = 0;
        *i->song_line = 0;
        __atomic_store_n(&i->song_for, 0, __ATOMIC_RELEASE);
        __atomic_store_n(&i->rolls, 0, __ATOMIC_RELEASE);
        lb_load_song(s, RATE, 0, i->kernels);
        lb_put_song(i, s);
    }
    leave();
    if (s) free(old);
}

void lb_turn_song(lb_instance *i, int what) {
    __atomic_fetch_xor(what == LB_ROLL ? &i->rolls : &i->loops, 1, __ATOMIC_ACQ_REL);
}

void lb_steer_song(lb_instance *i, int what) {
    LB_ALONE(i->window.owner);
    if (i->there) want(i, what, "");
    else if (what == LB_PUT_AWAY) put_away(i);
    else lb_turn_song(i, what);
    i->moved(i->owner);
}

void lb_view_song(lb_instance *i, lb_song_view *to) {
    enter();
    if (i->there) {
        *to = i->there->view;
        leave();
        return;
    }
    to->wrong = *i->song_fault != 0;
    to->there = i->song_file != 0;
    strcpy(to->line, to->wrong ? i->song_fault : i->song_line);
    leave();
    to->rolls = __atomic_load_n(&i->rolls, __ATOMIC_RELAXED);
    to->loops = __atomic_load_n(&i->loops, __ATOMIC_RELAXED);
    to->part = __atomic_load_n(&i->song_part, __ATOMIC_RELAXED);
}

/* --- [audio thread] --- */

/* Tells other threads the lowest and the highest key of the bass that plays: a tuning may have moved them. */
static void tell_range(lb_instance *i) {
    const LB_LOOK *l = &i->look.now;
    if (!l->strings) return;
    int64_t high = 0;
    for (int k = 0; k < l->strings; k++) high = l->string[k].open > high ? l->string[k].open : high;
    __atomic_store_n(&i->song_range, range_word(l->string[0].open, high + l->frets), __ATOMIC_RELAXED);
}

static void play(const lb_instance *i, lb_song *s, int64_t n) {
    i->kernels->play_desk(ADDRESS(&s->desk), ADDRESS(&i->synth->record), n);
}

/* Makes a song end what it holds, and go to a place. */
static void move(lb_song *s, int64_t place) {
    s->desk.seek = place;
    s->desk.seek_count++;
}

/* Replaces the song by the next one, if there is one and the last one replaced has been freed. */
static void take_next(lb_instance *i) {
    if (!__atomic_load_n(&i->next_song, __ATOMIC_RELAXED) || __atomic_load_n(&i->old_song, __ATOMIC_ACQUIRE)) return;
    lb_song *old = i->audio.song, *next = __atomic_exchange_n(&i->next_song, 0, __ATOMIC_ACQ_REL);
    i->audio.song = next;
    if (!old || !next) return;
    if (next->continues) move(next, (int64_t)old->desk.position);
    old->desk.rolling = 0;
    move(old, 0);
    play(i, old, 0);
    __atomic_store_n(&i->old_song, old, __ATOMIC_RELEASE);
}

void lb_play_song(lb_instance *i, int64_t n) {
    tell_range(i);
    take_next(i);
    lb_song *s = i->audio.song;
    if (!s) return;
    const int rolls = __atomic_load_n(&i->rolls, __ATOMIC_ACQUIRE);
    if (!rolls && s->desk.rolling) move(s, 0);
    s->desk.rolling = rolls;
    s->desk.once = !__atomic_load_n(&i->loops, __ATOMIC_RELAXED);
    play(i, s, n);
    if (rolls && !s->desk.rolling) __atomic_store_n(&i->rolls, 0, __ATOMIC_RELEASE);
    __atomic_store_n(&i->song_part, (int)(1000 * s->desk.position / (double)s->end), __ATOMIC_RELAXED);
}

int lb_song_waits(const lb_instance *i) {
    const int rolls = __atomic_load_n(&i->rolls, __ATOMIC_RELAXED);
    return __atomic_load_n(&i->next_song, __ATOMIC_RELAXED) || (i->audio.song && (rolls || i->audio.song->desk.rolling));
}

void lb_stop_song(lb_instance *i) {
    lb_song *s = i->audio.song;
    __atomic_store_n(&i->rolls, 0, __ATOMIC_RELAXED);
    if (!s) return;
    LB_DESK *d = &s->desk;
    d->rolling = d->running = d->received = d->next = 0;
    d->position = 0;
    memset(d->held, 0, sizeof d->held);
    memset(d->pedal, 0, sizeof d->pedal);
    memset(d->bent, 0, sizeof d->bent);
}

void lb_close_song(lb_instance *i) {
    lb_put_song(i, 0);
    lb_free_songs(i);
    if (i->audio.song) free_song(i->audio.song);
    i->audio.song = 0;
    free(i->song_file);
    i->song_file = 0;
    i->song_for = 0;
}
