/* Looks at a synth for windows, each with a sequence counter: the audio thread writes them, others read them. */
#include "instance/look.h"

#include <math.h>

/* Words in a look with `strings` strings. */
static size_t words(int64_t strings) {
    return (offsetof(LB_LOOK, string) + (size_t)strings * sizeof(LB_STRING_LOOK)) / sizeof(uint64_t);
}

/* Copies words that another thread may be writing or reading. */
static void copy(uint64_t *to, const uint64_t *from, size_t count) {
    for (size_t k = 0; k < count; k++)
        __atomic_store_n(&to[k], __atomic_load_n(&from[k], __ATOMIC_RELAXED), __ATOMIC_RELAXED);
}

void lb_watch(lb_look *l, int on) { __atomic_fetch_add(&l->watchers, on ? 1 : -1, __ATOMIC_RELAXED); }

uint64_t lb_looks_taken(const lb_look *l) { return __atomic_load_n(&l->taken, __ATOMIC_ACQUIRE); }

void lb_put_look(lb_look *l, const LB_LOOK *look) {
    uint64_t *seen = &l->seen[l->taken % LB_LOOKS];
    __atomic_store_n(seen, *seen + 1, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE);
    copy((uint64_t *)&l->looks[l->taken % LB_LOOKS], (const uint64_t *)look, words(look->strings));
    __atomic_store_n(seen, *seen + 1, __ATOMIC_RELEASE);
    __atomic_store_n(&l->taken, l->taken + 1, __ATOMIC_RELEASE);
}

int lb_read_look(const lb_look *l, int before, LB_LOOK *to) {
    const uint64_t taken = lb_looks_taken(l), back = (uint64_t)before + 1;
    if (before < 0 || before >= LB_LOOKS || taken < back) return 0;
    const uint64_t number = taken - back, at = number % LB_LOOKS, whole = 2 * (number / LB_LOOKS + 1);
    if (__atomic_load_n(&l->seen[at], __ATOMIC_ACQUIRE) != whole) return 0;
    const LB_LOOK *from = &l->looks[at];
    const int64_t strings = __atomic_load_n(&from->strings, __ATOMIC_RELAXED);
    if (strings < 0 || strings > LB_STRINGS) return 0; /* being written */
    copy((uint64_t *)to, (const uint64_t *)from, words(strings));
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    return __atomic_load_n(&l->seen[at], __ATOMIC_RELAXED) == whole;
}

static void look(lb_look *l, const lb_synth *s) {
    s->kernels->see_synth((int64_t)(intptr_t)&s->record, (int64_t)(intptr_t)&l->now);
    l->now.peak = l->peak;
    l->peak = 0;
    lb_put_look(l, &l->now);
}

void lb_begin_looks(lb_look *l, const lb_synth *s) {
    l->now.bass = 0; /* a new bass may have the old one's address */
    l->peak = 0;
    look(l, s);
}

void lb_take_look(lb_look *l, const lb_synth *s, const float *out, int64_t n) {
    const LB_SYNTH *r = &s->record;
    const int other = r->bass && r->bass != l->now.bass;
    if (!other && !__atomic_load_n(&l->watchers, __ATOMIC_RELAXED)) return;
    for (int64_t k = 0; out && k < n; k++) l->peak = fmax(l->peak, fabs((double)out[k]));
    if (other || (double)(r->frame - l->now.frame) * LB_LOOK_RATE >= r->rate) look(l, s);
}
