/* Passes actions in the window on to the host and to the audio thread. */
#include "instance/instance.h"

#include <math.h>
#include <string.h>

enum { SPARE = 32 }; /* places that only ends of moves may take */

/* The rings of moves and touches: how many wait, and the step past one that was put or taken. */
uint32_t lb_waiting(const lb_ring *r) {
    return __atomic_load_n(&r->put, __ATOMIC_ACQUIRE) - __atomic_load_n(&r->taken, __ATOMIC_ACQUIRE);
}
static void step(uint32_t *count) { __atomic_store_n(count, *count + 1, __ATOMIC_RELEASE); }

void lb_put_move(lb_moves *m, int parameter, int phase, double value) {
    const uint32_t used = lb_waiting(&m->ring);
    if (used >= LB_MOVES || (phase != LB_END && used >= LB_MOVES - SPARE)) return;
    m->moves[m->ring.put % LB_MOVES] = (lb_move){parameter, phase, value};
    step(&m->ring.put);
}

int lb_take_move(lb_moves *m, lb_move *to) {
    if (!lb_waiting(&m->ring)) return 0;
    *to = m->moves[m->ring.taken % LB_MOVES];
    step(&m->ring.taken);
    return 1;
}

void lb_put_touch(lb_touches *t, int on, int string, int key, double velocity) {
    if (lb_waiting(&t->ring) >= LB_BY_HAND) return;
    const int seven = on ? (int)fmin(fmax(rint(127 * velocity), 1), 127) : 0;
    t->touches[t->ring.put % LB_BY_HAND] = (lb_touch){(uint8_t)string, (uint8_t)key, (uint8_t)seven};
    step(&t->ring.put);
}

int lb_take_touch(lb_touches *t, lb_touch *to) {
    if (!lb_waiting(&t->ring)) return 0;
    *to = t->touches[t->ring.taken % LB_BY_HAND];
    step(&t->ring.taken);
    return 1;
}

static void let_go(lb_instance *i, int key) { lb_take_midi(i, 0, (const uint8_t[]){0x80, (uint8_t)key, 64}, 3); }

/* Ends the first `count` waiting notes. */
static void end_first(lb_instance *i, int count) {
    lb_taps *t = &i->audio.taps;
    for (int k = 0; k < count; k++) let_go(i, t->keys[k]);
    t->count -= count;
    memmove(t->keys, t->keys + count, (size_t)t->count * sizeof *t->keys);
    memmove(t->due, t->due + count, (size_t)t->count * sizeof *t->due);
}

void lb_end_taps(lb_instance *i) {
    const lb_taps *t = &i->audio.taps;
    int count = 0;
    while (count < t->count && t->due[count] <= i->synth->record.frame) count++;
    end_first(i, count);
}

/* Notes end in the order of their release: a bound note ends after the next one has begun. */
static void end_later(lb_instance *i, int key) {
    lb_taps *t = &i->audio.taps;
    const LB_SYNTH *s = &i->synth->record;
    const int64_t due = t->began[key] + (int64_t)(LB_SHORTEST * s->rate);
    const int64_t before = t->count ? t->due[t->count - 1] : s->frame;
    if (due <= s->frame && !t->count) {
        let_go(i, key);
        return;
    }
    if (t->count == LB_BY_HAND) end_first(i, 1);
    t->keys[t->count] = (uint8_t)key;
    t->due[t->count++] = due > before ? due : before;
}

void lb_play_touch(lb_instance *i, const lb_touch *t) {
    lb_taps *taps = &i->audio.taps;
    if (!t->velocity) {
        end_later(i, t->key);
        return;
    }
    if (lb_is_left_out(i, 0, t->key)) return;
    int last = taps->count; /* up to the key's own end, if it is struck again */
    while (last && taps->keys[last - 1] != t->key) last--;
    end_first(i, last);
    taps->began[t->key] = i->synth->record.frame;
    if (t->string < LB_STRINGS) lb_choose_string(i->synth, 0, t->key, t->string); /* else any, or a switch */
    lb_take_midi(i, 0, (const uint8_t[]){0x90, t->key, t->velocity}, 3);
}

void lb_move_value(lb_instance *i, int parameter, double value, int phase) {
    LB_ALONE(i->window.owner);
    const double quality = lb_value(i, LB_QUALITY);
    if (phase == LB_MOVE) lb_set_value(i, parameter, value);
    lb_put_move(&i->moves, parameter, phase, lb_value(i, parameter));
    for (int p = LB_BEGIN; parameter == LB_BASS && lb_value(i, LB_QUALITY) != quality && p <= LB_END; p++)
        lb_put_move(&i->moves, LB_QUALITY, p, lb_value(i, LB_QUALITY)); /* it followed: LV2 learns of it only here */
    i->moved(i->owner);
}
