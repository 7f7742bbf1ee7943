/* Holds what the kernels work on: files, pools that basses share, basses, synths. Nothing here computes sound. */
#define LB_TABLES
#include "core.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
static SRWLOCK lock = SRWLOCK_INIT;
static void enter(void) { AcquireSRWLockExclusive(&lock); }
static void leave(void) { ReleaseSRWLockExclusive(&lock); }
#else
#include <pthread.h>
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static void enter(void) { pthread_mutex_lock(&lock); }
static void leave(void) { pthread_mutex_unlock(&lock); }
#endif

#define LINE 64      /* bytes in a cache line */
#define MESSAGES 4096 /* in each ring */
#define ADDRESS(x) ((int64_t)(intptr_t)(x))

/* Memory that begins on a cache line; 0 if there is none. */
static void *new_lines(int64_t bytes) {
    char *raw = malloc((size_t)bytes + LINE + sizeof(void *));
    if (!raw) return 0;
    char *place = raw + sizeof(void *);
    place += (LINE - ADDRESS(place) % LINE) % LINE;
    memcpy(place - sizeof(void *), &raw, sizeof(void *));
    return place;
}

static void free_lines(void *place) {
    void *raw;
    if (!place) return;
    memcpy(&raw, (char *)place - sizeof(void *), sizeof(void *));
    free(raw);
}

/* --- the processor --- */

#if defined(__x86_64__) || defined(_M_X64)
/* By hand: __builtin_cpu_supports knows nothing in libraries that zig links. */
static void cpuid(uint32_t leaf, uint32_t out[4]) {
    __asm__("cpuid" : "=a"(out[0]), "=b"(out[1]), "=c"(out[2]), "=d"(out[3]) : "a"(leaf), "c"(0));
}

static int has_v3(void) {
    const uint32_t first = 1u << 12 | 1u << 22 | 1u << 27 | 1u << 28 | 1u << 29; /* FMA MOVBE OSXSAVE AVX F16C */
    const uint32_t later = 1u << 3 | 1u << 5 | 1u << 8;                          /* BMI1 AVX2 BMI2 */
    uint32_t found[4], saved, high;
    cpuid(0, found);
    if (found[0] < 7) return 0;
    cpuid(1, found);
    if ((found[2] & first) != first) return 0;
    __asm__("xgetbv" : "=a"(saved), "=d"(high) : "c"(0)); /* registers that the system saves */
    if ((saved & 6) != 6) return 0;
    cpuid(7, found);
    if ((found[1] & later) != later) return 0;
    cpuid(0x80000000u, found);
    if (found[0] < 0x80000001u) return 0;
    cpuid(0x80000001u, found);
    return (found[2] >> 5 & 1) != 0; /* LZCNT */
}

const lb_kernels *lb_best_kernels(void) {
    const char *wanted = getenv("LIVEBASS_LEVEL");
    return has_v3() && !(wanted && !strcmp(wanted, "x86-64-v2")) ? &kernels_x86_64_v3 : &kernels_x86_64_v2;
}
#else
const lb_kernels *lb_best_kernels(void) { return &kernels_arm64; }
#endif

/* --- instrument files and their pools --- */

typedef struct {
    int64_t bytes;
    void *words;
} file;

typedef struct pool {
    struct pool *next;
    int users, tier;
    double rate;
    uint64_t of; /* checksum of the file */
    void *memory;
} pool;

static pool *pools; /* all of this process, under the lock */

struct lb_bass {
    LB_BUILDING building;
    const lb_kernels *kernels;
    file source;
    pool *pools[2];
};

static uint64_t checksum(const file *f) {
    uint64_t sum;
    memcpy(&sum, (const char *)f->words + f->bytes - 8, 8);
    return sum;
}

/* Reads a file whole; 0 after writing one line into `error`. */
static int read_file(file *f, const char *path, const lb_kernels *kernels, char *error, size_t room) {
    FILE *in = fopen(path, "rb");
    long size = 0;
    if (!in || fseek(in, 0, SEEK_END) || (size = ftell(in)) < 0 || fseek(in, 0, SEEK_SET)) {
        snprintf(error, room, "%s: cannot be read", path);
    } else if (size > LB_MOST_BYTES) {
        snprintf(error, room, "%s: not an instrument file", path);
    } else if (!(f->words = new_lines(size + 8))) {
        snprintf(error, room, "%s: no memory for it", path);
    } else {
        f->bytes = (int64_t)fread(f->words, 1, (size_t)size, in);
        const int64_t state = kernels->check_file(ADDRESS(f->words), f->bytes);
        if (state == LB_GOOD) {
            fclose(in);
            return 1;
        }
        const char *why = state == LB_FOREIGN         ? "not an instrument file"
                          : state == LB_OTHER_VERSION ? "made for another version of the plugin: export it anew"
                                                      : "damaged: export it anew";
        snprintf(error, room, "%s: %s", path, why);
    }
    if (in) fclose(in);
    free_lines(f->words);
    f->words = 0;
    return 0;
}

/* The pool of a file in a tier, its own or one that others use already; 0 if it cannot be made. */
static pool *take_pool(const file *f, int tier, double rate, const lb_kernels *kernels) {
    LB_POOL work = {.file = ADDRESS(f->words), .tier = tier, .rate = rate};
    pool *found;
    enter();
    for (found = pools; found; found = found->next)
        if (found->of == checksum(f) && found->tier == tier && found->rate == rate) break;
    if (!found && (found = calloc(1, sizeof *found))) {
        kernels->measure_pool(ADDRESS(&work));
        found->memory = new_lines(work.bytes);
        work.memory = ADDRESS(found->memory);
        if (!found->memory || kernels->fill_pool(ADDRESS(&work)) != LB_DONE) {
            free_lines(found->memory);
            free(found);
            found = 0;
        } else {
            found->of = checksum(f);
            found->tier = tier;
            found->rate = rate;
            found->next = pools;
            pools = found;
        }
    }
    if (found) found->users++;
    leave();
    return found;
}

static void give_pool_back(pool *p) {
    if (!p) return;
    enter();
    if (!--p->users) {
        pool **at = &pools;
        while (*at != p) at = &(*at)->next;
        *at = p->next;
        free_lines(p->memory);
        free(p);
    }
    leave();
}

/* --- basses --- */

lb_bass *lb_load_bass(const char *path, int tier, double rate, int64_t seed, const lb_kernels *kernels, char *error,
                      size_t room) {
    lb_bass *b = calloc(1, sizeof *b);
    if (!b) {
        snprintf(error, room, "%s: no memory for it", path);
        return 0;
    }
    b->kernels = kernels;
    if (!read_file(&b->source, path, kernels, error, room)) {
        free(b);
        return 0;
    }
    LB_BUILDING *building = &b->building;
    building->instrument = ADDRESS(&((LB_FILE *)b->source.words)->instrument);
    building->tier = tier;
    building->rate = rate;
    building->seed = seed;
    building->over_frets = ADDRESS(kernels->over_frets);
    building->over_board = ADDRESS(kernels->over_board);
    building->play_string = ADDRESS(kernels->play_string);
    for (int k = 0; k < 2; k++) {
        if (!(b->pools[k] = take_pool(&b->source, k ? LB_COARSE : tier, rate, kernels))) {
            snprintf(error, room, "%s: cannot be played at %g Hz, or there is no memory", path, rate);
            lb_free_bass(b);
            return 0;
        }
        building->operators[k] = ADDRESS(b->pools[k]->memory);
    }
    kernels->measure_bass(ADDRESS(building));
    /* The address of this struct stands in front: a synth gives back nothing but the address of the bass. */
    char *memory = new_lines(LINE + building->bytes);
    if (!memory) {
        snprintf(error, room, "%s: no memory for it", path);
        lb_free_bass(b);
        return 0;
    }
    memcpy(memory, &b, sizeof b);
    building->memory = ADDRESS(memory) + LINE;
    kernels->fill_bass(ADDRESS(building));
    return b;
}

void lb_free_bass(lb_bass *b) {
    if (!b) return;
    if (b->building.memory) free_lines((char *)(intptr_t)b->building.memory - LINE);
    for (int k = 0; k < 2; k++) give_pool_back(b->pools[k]);
    free_lines(b->source.words);
    free(b);
}

int64_t lb_address(const lb_bass *b) { return b->building.memory; }

lb_bass *lb_bass_at(int64_t address) {
    lb_bass *b = 0;
    if (address) memcpy(&b, (char *)(intptr_t)address - LINE, sizeof b);
    return b;
}

/* --- synths --- */

/* Makes the record as new, with a bass to begin with, 0: none. */
static void make_new(lb_synth *s, const lb_bass *b) {
    s->kernels->fill_synth(ADDRESS(&s->record), ADDRESS(s->rings), MESSAGES, s->record.rate, -1, 1.0,
                           ADDRESS(s->kernels->process));
    s->record.ceiling = INFINITY; /* hosts take what is beyond full scale, and may turn it down */
    s->record.next_bass = b ? lb_address(b) : 0;
}

lb_synth *lb_new_synth(double rate, const lb_kernels *kernels) {
    lb_synth *s = calloc(1, sizeof *s);
    if (!s) return 0;
    s->kernels = kernels;
    s->record.rate = rate;
    s->rings = new_lines(kernels->ring_bytes(MESSAGES));
    if (!s->rings) {
        free(s);
        return 0;
    }
    make_new(s, 0);
    return s;
}

/* Frees the basses of a synth but one. */
static void free_others(lb_synth *s, const lb_bass *but) {
    const LB_SYNTH *r = &s->record;
    const int64_t all[] = {r->bass, r->next_bass, r->old_bass, r->faded_bass};
    for (int k = 0; k < 4; k++)
        if (lb_bass_at(all[k]) != but) lb_free_bass(lb_bass_at(all[k]));
}

void lb_put_on(lb_synth *s, lb_bass *b) {
    free_others(s, b);
    make_new(s, b);
}

void lb_reset_synth(lb_synth *s) {
    lb_bass *b = lb_bass_at(s->record.next_bass ? s->record.next_bass : s->record.bass);
    free_others(s, b);
    if (b) b->kernels->fill_bass(ADDRESS(&b->building));
    make_new(s, b);
}

void lb_free_synth(lb_synth *s) {
    if (!s) return;
    free_lines(s->rings);
    free(s);
}

void lb_send(lb_synth *s, int64_t offset, const uint8_t *bytes, size_t count) {
    if (count < 1 || count > 3 || bytes[0] < 0x80 || bytes[0] >= 0xF0) return;
    s->kernels->push_message(s->record.midi_ring[LB_RINGS - 1], MESSAGES, s->record.frame + offset, bytes[0],
                             count > 1 ? bytes[1] : 0, count > 2 ? bytes[2] : 0);
}

void lb_play(lb_synth *s, float *out, int64_t n) { s->kernels->process(ADDRESS(&s->record), ADDRESS(out), n); }
