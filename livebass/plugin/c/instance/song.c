/* Plays a MIDI file in an instance. */
#include "instance/song.h"

#include <stdlib.h>
#include <string.h>

#define SHORTEST 0.1 /* s, of a turn of the loop */
#define ADDRESS(x) ((int64_t)(intptr_t)(x))

/* --- made in any thread --- */

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

/* --- [audio thread] --- */

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
    const int rolls = __atomic_load_n(&i->rolls, __ATOMIC_RELAXED), next = __atomic_load_n(&i->next_song, __ATOMIC_RELAXED) != 0;
    return next || (i->audio.song && (rolls || i->audio.song->desk.rolling));
}

void lb_stop_song(lb_instance *i) {
    lb_song *s = i->audio.song;
    __atomic_store_n(&i->rolls, 0, __ATOMIC_RELAXED);
    if (!s) return;
    LB_DESK *d = &s->desk;
    d->rolling = d->running = d->told = d->next = 0;
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
}
