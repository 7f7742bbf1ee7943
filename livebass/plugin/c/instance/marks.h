/* A mark for each parameter, which threads set and take with atomic operations. */
#ifndef LB_MARKS_H
#define LB_MARKS_H
#include "kernels.h"

#include <stdint.h>

enum { LB_MARK_BITS = 64, LB_MARK_WORDS = (LB_PARAMETERS + LB_MARK_BITS - 1) / LB_MARK_BITS };
typedef struct {
    uint64_t words[LB_MARK_WORDS];
} lb_marks;

static inline void lb_mark(lb_marks *m, int parameter) {
    __atomic_fetch_or(&m->words[parameter / LB_MARK_BITS], 1ull << parameter % LB_MARK_BITS, __ATOMIC_RELEASE);
}

static inline void lb_mark_all(lb_marks *m) {
    for (int k = 0; k < LB_PARAMETERS; k++) lb_mark(m, k);
}

static inline int lb_is_marked(const lb_marks *m) {
    int any = 0;
    for (int w = 0; w < LB_MARK_WORDS; w++) any |= __atomic_load_n(&m->words[w], __ATOMIC_RELAXED) != 0;
    return any;
}

/* Takes the first mark; returns its parameter, -1: there is none. */
static inline int lb_take_mark(lb_marks *m) {
    for (int w = 0; w < LB_MARK_WORDS; w++) {
        const uint64_t bits = __atomic_load_n(&m->words[w], __ATOMIC_ACQUIRE);
        if (!bits) continue;
        __atomic_fetch_and(&m->words[w], ~(bits & -bits), __ATOMIC_ACQUIRE);
        return w * LB_MARK_BITS + __builtin_ctzll(bits);
    }
    return -1;
}

/* Takes all marks. */
static inline lb_marks lb_take_marks(lb_marks *m) {
    lb_marks taken;
    for (int w = 0; w < LB_MARK_WORDS; w++) taken.words[w] = __atomic_exchange_n(&m->words[w], 0, __ATOMIC_ACQUIRE);
    return taken;
}
#endif
