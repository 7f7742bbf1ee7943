/* Holds the kernels' data: files, pools that basses share, basses, synths. Nothing here computes sound. */
#define LB_TABLES
#include "instance/core.h"
#include "system/files.h"
#include "system/lock.h"
#include "instance/response.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifndef _WIN32
#include <time.h>
#include <unistd.h>
#endif

#define LINE 64      /* bytes in a cache line */
#define MESSAGES 4096 /* in each ring */
#define AT_ONCE 48 /* most parameters and bends taken at once ... */
#define EACH 16    /* ... plus one per so many frames */
_Static_assert(AT_ONCE + LB_CHUNK / EACH < LB_MAX_MESSAGES, "the rest is for notes");
#define ENDING ".lbass"
#define OLD_MAGIC "LIVEBASS" /* of instrument files before format 1 */
#define ADDRESS(x) ((int64_t)(intptr_t)(x))

/* Allocates memory that begins on a cache line; 0 if there is none. */
static void *new_lines(int64_t bytes) {
    LB_MAY_WAIT();
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
    LB_MAY_WAIT();
    memcpy(&raw, (char *)place - sizeof(void *), sizeof(void *));
    free(raw);
}

/* --- the processor --- */

#if defined(__x86_64__) || defined(_M_X64)
/* __builtin_cpu_supports does not work in libraries that zig links. */
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

static pool *pools; /* all in this process, under the lock */

struct lb_bass {
    LB_BUILDING building;
    const lb_kernels *kernels;
    file image;
    lb_response *response; /* 0: the file's */
    pool *pools[2];
};

static uint64_t checksum(const file *f) {
    uint64_t sum;
    memcpy(&sum, (const char *)f->words + f->bytes - 8, 8);
    return sum;
}

/* Reads all bytes of a file; 0 after writing one line into `error`. */
static int read_bytes(file *f, const char *path, char *error, size_t room) {
    FILE *in = lb_open_file(path, "rb");
    long size = 0;
    f->words = 0;
    if (!in || fseek(in, 0, SEEK_END) || (size = ftell(in)) < 0 || fseek(in, 0, SEEK_SET)) {
        snprintf(error, room, "%s: cannot be read", path);
    } else if (size > LB_MAX_BYTES) {
        snprintf(error, room, "%s: not an instrument file", path);
    } else if (!(f->words = new_lines(size + 8))) {
        snprintf(error, room, "%s: no memory for it", path);
    } else {
        f->bytes = (int64_t)fread(f->words, 1, (size_t)size, in);
    }
    if (in) fclose(in);
    return f->words != 0;
}

/* Reads a source's bytes, and its fields into `change`; 0 after writing one line into `error`. */
static int read_source(file *f, const lb_source *source, LB_CHANGE *change, const lb_kernels *kernels, char *error,
                       size_t room) {
    if (!source->bytes && !read_bytes(f, source->path, error, room)) return 0;
    if (source->bytes) {
        *f = (file){(int64_t)source->size, new_lines((int64_t)source->size + 8)};
        if (f->words) memcpy(f->words, source->bytes, source->size);
        else snprintf(error, room, "%s: no memory for it", source->path);
    }
    if (!f->words) return 0;
    memset(change, 0, offsetof(LB_CHANGE, kept));
    change->file = ADDRESS(f->words);
    change->size = f->bytes;
    const int64_t state = kernels->measure_change(ADDRESS(change));
    if (state == LB_GOOD) return 1;
    const LB_HEAD *head = f->words;
    if (state == LB_LATER)
        snprintf(error, room, "%s: made by livebass %.*s; this one, " LB_RELEASE ", cannot read it", source->path,
                 (int)sizeof head->made - 1, (const char *)head->made);
    else if (state == LB_FOREIGN && f->bytes > 8 && !memcmp(head, OLD_MAGIC, 8))
        snprintf(error, room, "%s: made by an older livebass: export it again", source->path);
    else snprintf(error, room, "%s: %s", source->path, state == LB_FOREIGN ? "not an instrument file" : "damaged: export it again");
    free_lines(f->words);
    f->words = 0;
    return 0;
}

/* What stands above a string at rest: the `state` of a bass whose BENCH could not be made (bench.py). */
static lb_fault fault_of(const LB_KEPT *kept, int64_t state) {
    const LB_BENCH *b = &kept->bench;
    const int crown = state == LB_MADE + 1 && !kept->instrument.fretless[b->fault_string]; /* CROWN_ABOVE, or else BOARD_ABOVE */
    const int fret = crown ? (int)b->fault_place : 0;
    return (lb_fault){(int)b->string[b->fault_string].open_note, fret, 1e3 * b->fault_height};
}

size_t lb_fault_to_text(const lb_fault *f, char *text, size_t room) {
    const double height = fmax(f->height, 0.01);
    int end = 0;
    if (f->open < 0 || f->open > 127) end = snprintf(text, room, "the strings would lie on the neck");
    else if (f->fret <= 0) end = snprintf(text, room, "the board would stand %.2f mm above string %s", height, lb_note_names[f->open]);
    else end = snprintf(text, room, "fret %d would stand %.2f mm above string %s", f->fret, height, lb_note_names[f->open]);
    return (size_t)end < room ? (size_t)end : room - 1;
}

/* Makes the image of a source's bass for the sliders' values (0: none is moved), and its file's checksum; 0 after
   writing one line into `error`, and what stands above a string into `fault`, if it is not 0. */
static int make_image(file *image, const lb_source *source, const double *sliders, uint64_t *of, const lb_kernels *kernels,
                      char *error, size_t room, lb_fault *fault) {
    file f = {0, 0};
    LB_CHANGE change;
    image->words = 0;
    if (!read_source(&f, source, &change, kernels, error, room)) return 0;
    *of = checksum(&f);
    if (sliders) memcpy(change.value, sliders, sizeof change.value);
    void *memory = new_lines(change.bytes);
    change.memory = ADDRESS(memory);
    const int64_t state = memory ? kernels->make_change(ADDRESS(&change)) : LB_MADE;
    if (!memory) snprintf(error, room, "%s: no memory for it", source->path);
    else if (state != LB_MADE) {
        const lb_fault found = fault_of(&change.kept, state);
        if (fault) *fault = found;
        const size_t end = lb_fault_to_text(&found, error, room);
        snprintf(error + end, room - end, ": change action, relief, nut or fret height");
    } else if (kernels->check_file(change.made, 8 * change.words) != LB_GOOD || !(image->words = new_lines(8 * change.words)))
        snprintf(error, room, "a bass with these sliders cannot be played");
    if (image->words) {
        image->bytes = 8 * change.words;
        memcpy(image->words, (const void *)(intptr_t)change.made, (size_t)image->bytes);
    }
    free_lines(memory);
    free_lines(f.words);
    return image->words != 0;
}

double lb_hundredths(double value) { return rint(100 * value) / 100 + 0.0; /* + 0: not -0 */ }

/* Returns the pool of a file in a tier, new or already shared; 0 if it cannot be made. */
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

lb_bass *lb_load_bass(const lb_source *source, int tier, double rate, int64_t seed, int ahead, const double *built,
                      lb_response *response, const lb_kernels *kernels, char *error, size_t room) {
    lb_bass *b = calloc(1, sizeof *b);
    snprintf(error, room, "%s: no memory for it", source->path);
    if (!b) return 0;
    b->kernels = kernels;
    LB_BUILDING *building = &b->building;
    uint64_t of;
    if (!make_image(&b->image, source, built, &of, kernels, error, room, 0)) {
        lb_free_bass(b);
        return 0;
    }
    building->of = (int64_t)of; /* its versions carry on each other's notes */
    if (response) {
        b->response = response;
        lb_hold_response(response);
        building->response = ADDRESS(response->played);
        building->response_count = response->count;
        building->response_rate = response->kept->rate;
        building->of ^= (int64_t)response->sum; /* the old effects ring out: no version can carry them on */
    }
    building->file = ADDRESS(b->image.words);
    building->tier = tier;
    building->rate = rate;
    building->seed = seed;
    building->ahead = ahead != 0;
    building->log_room = LB_LOGGED;
    building->over_frets = ADDRESS(kernels->over_frets);
    building->over_board = ADDRESS(kernels->over_board);
    building->play_string = ADDRESS(kernels->play_string);
    for (int k = 0; k < 2; k++) {
        if (!(b->pools[k] = take_pool(&b->image, k ? LB_COARSE : tier, rate, kernels))) {
            snprintf(error, room, "%s: cannot be played at %g Hz, or there is no memory", source->path, rate);
            lb_free_bass(b);
            return 0;
        }
        building->operators[k] = ADDRESS(b->pools[k]->memory);
    }
    kernels->measure_bass(ADDRESS(building));
    /* This struct's address precedes the bass: a synth gives back only the bass's address. */
    char *memory = new_lines(LINE + building->bytes);
    if (!memory) {
        lb_free_bass(b);
        return 0;
    }
    memcpy(memory, &b, sizeof b);
    building->memory = ADDRESS(memory) + LINE;
    kernels->fill_bass(ADDRESS(building));
    return b;
}

int lb_fits(const lb_source *source, const double *built, lb_fault *fault, const lb_kernels *kernels) {
    char error[LB_PATH];
    file image;
    uint64_t of;
    const int good = make_image(&image, source, built, &of, kernels, error, sizeof error, fault);
    free_lines(image.words);
    return good;
}

int lb_fit_sliders(const lb_source *source, const double *from, double *built, lb_fault *fault,
                   const lb_kernels *kernels) {
    enum { HALVINGS = 8 };
    double wanted[LB_BUILT], tried[LB_BUILT], low = 0, step = 0;
    int fits = 0;
    memcpy(wanted, built, sizeof wanted);
    for (int k = 0; k <= HALVINGS; k++, step = step == 0 ? 0.5 : step / 2) { /* first `from` itself */
        for (int j = 0; j < LB_BUILT; j++) tried[j] = lb_hundredths(from[j] + (low + step) * (wanted[j] - from[j]));
        const int good = lb_fits(source, tried, fault, kernels);
        if (!good && k == 0) return 0;
        if (!good) continue;
        memcpy(built, tried, sizeof tried);
        low += step;
        fits = 1;
    }
    return fits;
}

void lb_free_bass(lb_bass *b) {
    if (!b) return;
    if (b->building.memory) free_lines((char *)(intptr_t)b->building.memory - LINE);
    for (int k = 0; k < 2; k++) give_pool_back(b->pools[k]);
    free_lines(b->image.words);
    lb_free_response(b->response);
    free(b);
}

/* The address of a bass for a synth ... */
static int64_t address_of(const lb_bass *b) { return b->building.memory; }

/* ... and the bass at that address. */
static lb_bass *bass_at(int64_t address) {
    lb_bass *b = 0;
    if (address) memcpy(&b, (char *)(intptr_t)address - LINE, sizeof b);
    return b;
}

/* --- the clock --- */

enum { TIME, WORK }; /* clocks: the time; the time that this thread has worked, where the system tells it */

/* A monotonic clock, in the shape of clock_gettime: seconds and nanoseconds. */
static int read_clock(int which, int64_t time[2]) {
#ifdef _WIN32
    LARGE_INTEGER now, second;
    QueryPerformanceCounter(&now);
    QueryPerformanceFrequency(&second);
    time[0] = now.QuadPart / second.QuadPart;
    time[1] = now.QuadPart % second.QuadPart * 1000000000 / second.QuadPart;
#else
    struct timespec now;
    clock_gettime(which == WORK ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC, &now);
    time[0] = now.tv_sec;
    time[1] = now.tv_nsec;
#endif
    return 0;
}

/* Without a clock, strings neither run ahead nor are relieved. Offline, the host's threads do not help either. */
static void set_clock(lb_synth *s) {
    s->record.team.pool = s->offline ? 0 : s->pool;
    s->record.adaptive = s->relief;
    s->record.clock = !s->offline && (s->relief || s->ahead) ? ADDRESS(read_clock) : 0;
}

/* --- synths --- */

/* Resets the record, with a bass to begin with, 0: none; keeps the parameters. */
static void make_new(lb_synth *s, const lb_bass *b) {
    LB_SYNTH *r = &s->record;
    double parameters[LB_PLAYED_PARAMETERS];
    memcpy(parameters, r->parameters, sizeof parameters);
    s->kernels->fill_synth(ADDRESS(r), ADDRESS(s->rings), MESSAGES, r->rate, -1, r->gain_target,
                           ADDRESS(s->kernels->process));
    memcpy(r->parameters, parameters, sizeof parameters);
    s->busy = 0;
    r->clock_id = TIME;
    r->work_clock_id = WORK; /* other programs' load must not change the sound */
    r->ceiling = INFINITY; /* hosts accept levels beyond full scale, and may turn them down */
    r->next_bass = b ? address_of(b) : 0;
    s->ahead = b && b->building.ahead;
    set_clock(s);
}

lb_synth *lb_new_synth(double rate, const lb_kernels *kernels) {
    lb_synth *s = calloc(1, sizeof *s);
    if (!s) return 0;
    s->kernels = kernels;
    s->record.rate = rate;
    s->record.gain_target = 1.0;
    s->rings = new_lines(kernels->ring_bytes(MESSAGES));
    if (!s->rings) {
        free(s);
        return 0;
    }
    make_new(s, 0);
    return s;
}

/* Frees a synth's basses except one. */
static void free_others(lb_synth *s, const lb_bass *but) {
    const LB_SYNTH *r = &s->record;
    const int64_t all[] = {r->bass, r->next_bass, r->old_bass, r->faded_bass};
    for (int k = 0; k < 4; k++)
        if (bass_at(all[k]) != but) lb_free_bass(bass_at(all[k]));
}

void lb_put_on(lb_synth *s, lb_bass *b) {
    free_others(s, b);
    make_new(s, b);
}

void lb_reset_synth(lb_synth *s) {
    lb_bass *b = bass_at(s->record.next_bass ? s->record.next_bass : s->record.bass);
    free_others(s, b);
    if (b) b->kernels->fill_bass(ADDRESS(&b->building));
    make_new(s, b);
}

void lb_free_synth(lb_synth *s) {
    if (!s) return;
    lb_set_helpers(s, 0);
    free_others(s, 0);
    free_lines(s->rings);
    free(s);
}

int lb_changing(const lb_synth *s) { return s->record.next_bass || s->record.faded_bass; }

void lb_change_bass(lb_synth *s, lb_bass *b) {
    s->record.next_bass = address_of(b);
    s->ahead = b->building.ahead != 0;
    set_clock(s);
}

lb_bass *lb_take_next(lb_synth *s) {
    lb_bass *b = bass_at(s->record.next_bass);
    s->record.next_bass = 0;
    return b;
}

lb_bass *lb_take_faded(lb_synth *s) {
    lb_bass *b = bass_at(s->record.faded_bass);
    s->record.faded_bass = 0;
    return b;
}

void lb_send(lb_synth *s, int64_t offset, const uint8_t *bytes, size_t count) {
    if (count < 1 || count > 3 || bytes[0] < 0x80 || bytes[0] >= 0xF0) return;
    s->kernels->push_message(s->record.midi_ring[LB_RINGS - 1], MESSAGES, s->record.frame + offset, bytes[0],
                             count > 1 ? bytes[1] : 0, count > 2 ? bytes[2] : 0);
}

void lb_send_everywhere(lb_synth *s, int64_t offset, int controller, int value) {
    for (int channel = 0; channel < LB_CHANNELS; channel++)
        lb_send(s, offset, (const uint8_t[]){(uint8_t)(0xB0 | channel), (uint8_t)controller, (uint8_t)value}, 3);
}

static void push(lb_synth *s, int64_t offset, int kind, int number, double value) {
    s->kernels->push_event(s->record.midi_ring[LB_RINGS - 1], MESSAGES, s->record.frame + offset, kind, number, value);
}

/* Sends an event that is no note, if `number`, without its channel, is below `end`. The kernels take LB_MAX_MESSAGES
   per chunk: with more of these events, notes after them would be late and finally lost. */
static int control(lb_synth *s, int64_t offset, int kind, int number, int end, double value) {
    const int64_t frame = s->record.frame + offset;
    if (number < 0 || (number & LB_NUMBER) >= end) return 1;
    if (s->busy < frame) s->busy = frame;
    if (s->busy - frame >= (int64_t)AT_ONCE * EACH) return 0;
    s->busy += EACH;
    push(s, offset, kind, number, value);
    return 1;
}

int lb_set(lb_synth *s, int64_t offset, int parameter, double value) {
    if (parameter < 0 || parameter >= LB_PARAMETERS) return 1;
    const lb_parameter *p = &lb_parameters[parameter];
    return p->kind < 0 || control(s, offset, p->kind, p->number, p->number + 1, value);
}

/* Encodes a channel's key for events. */
static int of_channel(int channel, int key) { return key < 0 ? key : key | (channel + 1) << LB_VALUE_BIT; }

int lb_bend_note(lb_synth *s, int64_t offset, int channel, int key, double semitones) {
    return control(s, offset, LB_KIND_NOTE_BEND, of_channel(channel, key), 128, semitones);
}

int lb_vibrate_note(lb_synth *s, int64_t offset, int channel, int key, double amount) {
    return control(s, offset, LB_KIND_NOTE_VIBRATO, of_channel(channel, key), 128, amount);
}

void lb_cut_note(lb_synth *s, int64_t offset, int channel, int key) {
    if (key >= 0 && key < 128) push(s, offset, LB_KIND_NOTE_CUT, of_channel(channel, key), 0);
}

void lb_choose_string(lb_synth *s, int64_t offset, int key, int string) {
    if (key >= 0 && key < 128) push(s, offset, LB_KIND_NOTE_STRING, key, string);
}

void lb_place_note(lb_synth *s, int64_t offset, int key, double position) {
    if (key >= 0 && key < 128) push(s, offset, LB_KIND_NOTE_PLACE, key, position);
}

void lb_play(lb_synth *s, float *out, int64_t n) {
    if (n <= 0) return;
    s->kernels->process(ADDRESS(&s->record), ADDRESS(out), n);
}

void lb_play_strings(lb_synth *s, float *const *outs, int64_t n) {
    for (int64_t done = 0, m; done < n; done += m) {
        m = n - done < LB_CHUNK ? n - done : LB_CHUNK;
        for (int i = 0; i < LB_STRINGS; i++) s->record.apart[i] = outs[i] ? ADDRESS(outs[i] + done) : 0;
        lb_play(s, s->mix, m);
    }
    memset(s->record.apart, 0, sizeof s->record.apart);
}

/* --- strings side by side --- */

void lb_share(lb_synth *s, void (*call)(int64_t, int64_t), void *owner) {
    s->pool = ADDRESS(call);
    s->record.team.owner = ADDRESS(owner);
    set_clock(s);
}

void lb_help(lb_synth *s) { s->kernels->help_now(ADDRESS(&s->record)); }

#ifdef _WIN32
int lb_set_helpers(lb_synth *s, int count) {
    return !count;
}
#else
struct lb_helper {
    struct lb_helper *next;
    lb_synth *synth;
    pthread_t thread;
};

static void *help(void *helper) {
    lb_synth *s = ((struct lb_helper *)helper)->synth;
    s->kernels->help_out(ADDRESS(&s->record), ADDRESS(usleep));
    return 0;
}

/* Starts one thread; returns 0 if the system refuses it real-time priority. */
static int start_helper(lb_synth *s) {
    const struct sched_param priority = {.sched_priority = LB_PRIORITY};
    struct lb_helper *h = calloc(1, sizeof *h);
    pthread_attr_t how;
    if (!h) return 0;
    h->synth = s;
    h->next = s->helpers;
    pthread_attr_init(&how);
    pthread_attr_setinheritsched(&how, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&how, SCHED_FIFO);
    const int good = !pthread_attr_setschedparam(&how, &priority) && !pthread_create(&h->thread, &how, help, h);
    pthread_attr_destroy(&how);
    if (good) s->helpers = h;
    else free(h);
    return good;
}

int lb_set_helpers(lb_synth *s, int count) {
    int64_t *stop = &s->record.team.stop;
    int good = 1;
    const long left = sysconf(_SC_NPROCESSORS_ONLN) - 1;
    enter();
    __atomic_store_n(stop, 1, __ATOMIC_RELEASE);
    for (struct lb_helper *h; (h = s->helpers); free(h)) {
        pthread_join(h->thread, 0);
        s->helpers = h->next;
    }
    __atomic_store_n(stop, 0, __ATOMIC_RELEASE);
    for (int k = 0; k < count && k < left && good; k++) good = start_helper(s);
    leave();
    if (!good) lb_set_helpers(s, 0);
    return good;
}
#endif

int lb_is_still(const lb_synth *s) {
    const LB_SYNTH *r = &s->record;
    const int settled = fabs(r->gain - r->gain_target) <= 1e-13 * r->gain_target; /* as close as rounding allows */
    return settled && s->kernels->is_still(ADDRESS(r)) != 0;
}

int lb_overload(const lb_synth *s) {
    const int64_t n = s->record.overload;
    return n < 0 ? 0 : n > LB_STRINGS ? LB_STRINGS : (int)n;
}

void lb_offline(lb_synth *s, int on) {
    if (s->offline == !!on) return;
    s->offline = !!on;
    if (on) s->kernels->return_to_clock(ADDRESS(&s->record));
    set_clock(s);
}

void lb_relieve(lb_synth *s, int on) {
    if (s->relief == !!on) return;
    s->relief = !!on;
    if (!on) s->kernels->return_to_clock(ADDRESS(&s->record));
    set_clock(s);
}

/* --- the shelf --- */

enum { NAME = 64, PATH = LB_PATH };
typedef struct details { /* what an instrument file says; they live as long as the shelf */
    struct details *next;
    uint64_t sum; /* checksum of the file */
    file kept;    /* its bytes, if a session kept them; no words: it is on disk */
    LB_INSTRUMENT instrument;
    lb_own own;
    uint8_t switches[LB_KEY_COUNT]; /* for each key: 1 + its index in lb_switches; 0: a note */
} details;
typedef struct {
    char name[NAME], title[2 * NAME + 4], path[PATH];
    int quality; /* a value of LB_QUALITY */
    details *own, *now; /* of the file on disk, and of the bass that plays; 0: it cannot be read */
} place;
struct lb_shelf {
    char folder[PATH];
    int count, listed; /* listed: those that came with the plugin */
    details *all;
    place places[LB_MAX_BASSES];
};

int lb_shelf_count(const lb_shelf *s) { return __atomic_load_n(&s->count, __ATOMIC_ACQUIRE); }

/* The details of the bass that plays; 0 beyond the last one. */
static const details *details_of(const lb_shelf *s, int k) {
    return k < lb_shelf_count(s) ? __atomic_load_n(&s->places[k].now, __ATOMIC_ACQUIRE) : 0;
}

const char *lb_shelf_folder(const lb_shelf *s) { return s->folder; }
const char *lb_shelf_name(const lb_shelf *s, int k) { return s->places[k].name; }
const char *lb_shelf_title(const lb_shelf *s, int k) { return s->places[k].title; }
void lb_close_shelf(lb_shelf *s) {
    for (details *d = s ? s->all : 0, *next; d; d = next) {
        next = d->next;
        free_lines(d->kept.words);
        free(d);
    }
    free(s);
}
lb_source lb_shelf_source(const lb_shelf *s, int k) {
    const details *d = details_of(s, k);
    return (lb_source){s->places[k].path, d ? d->kept.words : 0, d ? (size_t)d->kept.bytes : 0};
}
const LB_INSTRUMENT *lb_shelf_instrument(const lb_shelf *s, int k) {
    const details *d = details_of(s, k);
    return d ? &d->instrument : 0;
}
int lb_shelf_group(const lb_shelf *s, int k) {
    const char *name = s->places[k].name;
    if (k >= s->listed) return LB_MINE;
    return !strncmp(name, "paper-", 6) || !strcmp(name, "one-contact") ? LB_LABORATORY : LB_SHIPPED;
}
int lb_shelf_quality(const lb_shelf *s, int k) { return k < s->count ? s->places[k].quality : 0; }
const lb_switch *lb_shelf_switch(const lb_shelf *s, int k, int key) {
    const details *d = details_of(s, k);
    const int found = d ? d->switches[key] : 0;
    return found ? &lb_switches[found - 1] : 0;
}

int lb_shelf_find(const lb_shelf *s, const char *name) {
    for (int k = 0; k < s->count; k++)
        if (!strcmp(s->places[k].name, name)) return k;
    return -1;
}

int lb_shelf_program(const lb_shelf *s, int64_t program) {
    for (size_t k = 0; k < sizeof lb_programs / sizeof *lb_programs; k++)
        if (lb_programs[k].number == program) return lb_shelf_find(s, lb_programs[k].preset);
    return -1;
}

/* Measures the crowns under the lowest string, and from them action, nut and relief, as the kernels do (note.py). */
static void measure_neck(const double *numbers, const LB_BENCH_STRING *s, lb_own *own) {
    const double *rows = numbers + s->frets;
    const int64_t count = s->frets_count;
    if (count < 3 || count > LB_PLACES) return;
    own->crowns = (int)count;
    for (ptrdiff_t k = 0; k < count; k++) {
        own->at[k] = 1e3 * rows[2 * k];
        own->height[k] = 1e3 * rows[2 * k + 1];
    }
    const double middle = (own->at[0] + own->at[count - 1]) / 2;
    int k = 1;
    while (k < count - 1 && own->at[k] < middle) k++;
    const double part = (middle - own->at[k - 1]) / (own->at[k] - own->at[k - 1]);
    const double low = own->height[k - 1] + part * (own->height[k] - own->height[k - 1]);
    own->action = -own->height[count < 12 ? count - 1 : 11];
    own->nut_height = -own->height[0];
    own->relief = (own->height[0] + own->height[count - 1]) / 2 - low;
}

/* Measures the lowest resonance that bends the neck. */
static void measure_resonance(const double *numbers, const LB_BENCH_STRING *s, lb_own *own) {
    int64_t k = 0;
    while (k < s->bending_count && numbers[s->bending + k] == 0) k++;
    if (k >= s->bending_count || k >= s->resonances_count) return;
    own->resonance = numbers[s->resonances + 3 * k];
    own->mass = numbers[s->resonances + 3 * k + 2];
}

/* The last fret's place, or the end of a board beyond it, m from the nut (change.py). */
static double end_of_neck(const double *numbers, const LB_BENCH_STRING *s) {
    double end = 0;
    if (s->frets_count > 0) end = numbers[s->frets + 2 * (s->frets_count - 1)];
    return s->surface_count > 0 ? fmax(end, numbers[s->surface + 2 * (s->surface_count - 1)]) : end;
}

static void measure(const LB_CHANGE *change, lb_own *own) {
    const LB_BENCH *b = &change->kept.bench;
    const LB_BENCH_STRING *low = &b->string[0];
    const double *numbers = (const double *)(intptr_t)change->first[0];
    for (size_t k = 0; k < offsetof(lb_own, crowns) / sizeof(double); k++) ((double *)own)[k] = NAN;
    own->foam = low->extra_damping;
    double room = INFINITY;
    for (int64_t k = 0; k < b->strings; k++) room = fmin(room, b->string[k].length - end_of_neck(numbers, &b->string[k]));
    for (int k = 0; k < 2 && k < b->pickups; k++) {
        own->place[k] = 1e3 * b->position[k];
        own->nearest[k] = fmin(own->place[k], 500 * b->aperture[k]);
        own->farthest[k] = fmax(own->place[k], 1e3 * room - 500 * b->aperture[k]);
    }
    own->cable = 1e12 * b->capacitance;
    own->finger_width = 1e3 * b->rounding;
    own->pluck_angle = b->pluck_angle * 180 / 3.14159265358979;
    own->thickest = low->diameter / 25.4e-3;
    own->thinnest = b->string[b->strings - 1].diameter / 25.4e-3;
    own->a4 = b->a4;
    own->tension = low->tension / 9.80665;
    own->length = 1e3 * low->length;
    own->open = low->open_note;
    measure_neck(numbers, low, own);
    measure_resonance(numbers, low, own);
}

const lb_own *lb_shelf_own(const lb_shelf *s, int k) {
    static const lb_own unknown;
    const details *d = details_of(s, k);
    return d ? &d->own : &unknown;
}

static void find_switches(details *d) {
    const LB_KEY_MAP *map = &d->instrument.key_map;
    for (int key = 0; key < LB_KEY_COUNT; key++)
        for (int k = 0; k < LB_SWITCHES; k++)
            if (lb_switches[k].action == map->action[key] && (lb_switches[k].value < 0 || lb_switches[k].value == map->value[key]))
                d->switches[key] = (uint8_t)(k + 1);
}

/* Reads the details of a source, and the bass's title; 0 after writing one line into `error`. */
static details *new_details(lb_shelf *s, const lb_source *source, char title[NAME], char *error, size_t room) {
    file f = {0, 0};
    LB_CHANGE change;
    if (!read_source(&f, source, &change, lb_best_kernels(), error, room)) return 0;
    details *d = calloc(1, sizeof *d);
    if (d) {
        d->sum = checksum(&f);
        d->instrument = change.kept.instrument;
        measure(&change, &d->own);
        find_switches(d);
        if (memchr(change.kept.name, 0, NAME)) memcpy(title, change.kept.name, NAME);
        if (source->bytes) d->kept = f;
        d->next = s->all;
        s->all = d;
    } else snprintf(error, room, "%s: no memory for it", source->path);
    if (!d || !source->bytes) free_lines(f.words);
    return d;
}

/* The checksum of the image that plays a source; 0: it cannot be played. */
static uint64_t image_sum(const lb_source *source, const lb_kernels *kernels) {
    char error[PATH];
    file image;
    uint64_t of;
    const uint64_t sum = make_image(&image, source, 0, &of, kernels, error, sizeof error, 0) ? checksum(&image) : 0;
    free_lines(image.words);
    return sum;
}

void *lb_source_bytes(const lb_source *source, size_t *count) {
    char error[PATH];
    file f = {0, 0};
    if (!source->bytes && !read_bytes(&f, source->path, error, sizeof error)) return 0;
    *count = source->bytes ? source->size : (size_t)f.bytes;
    void *made = malloc(*count + 1);
    if (made) memcpy(made, source->bytes ? source->bytes : f.words, *count);
    free_lines(f.words);
    return made;
}

static void play(place *p, const details *d) { __atomic_store_n(&p->now, (details *)(intptr_t)d, __ATOMIC_RELEASE); }

int lb_keep_bass(lb_shelf *s, const char *name, const void *bytes, size_t count, char *error, size_t room) {
    const lb_kernels *kernels = lb_best_kernels();
    const lb_source source = {name, bytes, count};
    const uint64_t sum = image_sum(&source, kernels);
    char title[NAME] = "";
    uint64_t own;
    snprintf(error, room, "%s: the bass that the session kept cannot be played", name);
    if (!sum || count < 8) return -1;
    int k = lb_shelf_find(s, name);
    const lb_source on_disk = {k < 0 ? "" : s->places[k].path, 0, 0};
    if (k >= 0 && s->places[k].own && image_sum(&on_disk, kernels) == sum) {
        play(&s->places[k], s->places[k].own);
        return k;
    }
    memcpy(&own, (const char *)bytes + count - 8, 8);
    enter();
    details *d = s->all;
    while (d && !(d->kept.words && d->sum == own)) d = d->next;
    if (!d) d = new_details(s, &source, title, error, room);
    leave();
    if (!d) return -1;
    if (k < 0 && s->count < LB_MAX_BASSES && strlen(name) < NAME) {
        place *p = &s->places[s->count];
        strcpy(p->name, name);
        snprintf(p->title, sizeof p->title, "%s", *title ? title : name);
        snprintf(p->path, PATH, "%s", name);
        play(p, d);
        k = s->count;
        __atomic_store_n(&s->count, k + 1, __ATOMIC_RELEASE);
    } else if (k >= 0) play(&s->places[k], d);
    return k;
}

int lb_is_kept(const lb_shelf *s, int k) { return s->places[k].own && details_of(s, k) != s->places[k].own; }

void lb_update_bass(lb_shelf *s, int k) {
    if (s->places[k].own) play(&s->places[k], s->places[k].own);
}

const void *lb_present_bass(const lb_shelf *s, int k) { return details_of(s, k); }

void lb_put_bass(lb_shelf *s, int k, const void *present) { play(&s->places[k], present); }

uint64_t lb_kept_sum(const lb_shelf *s, int k) {
    const details *d = details_of(s, k);
    return d && d != s->places[k].own ? d->sum : 0;
}

/* Adds the file with this name, unless it is already there or does not fit. */
static void add(lb_shelf *s, const char *folder, const char *name) {
    char title[NAME] = "", error[PATH];
    const size_t length = strlen(name);
    if (s->count < 0 || s->count >= LB_MAX_BASSES || !length || length >= NAME || lb_shelf_find(s, name) >= 0) return;
    place *p = &s->places[s->count];
    if (snprintf(p->path, PATH, "%s/%s" ENDING, folder, name) >= PATH) return;
    strcpy(p->name, name);
    p->own = p->now = new_details(s, &(lb_source){p->path, 0, 0}, title, error, sizeof error); /* reported when it is loaded */
    strcpy(p->title, *title ? title : name);
    s->count++;
}

/* Adds the files in a folder's list, one per line; the initial quality may follow a name. */
static void add_listed(lb_shelf *s, const char *folder) {
    char line[PATH];
    FILE *in = snprintf(line, sizeof line, "%s/instruments.txt", folder) < PATH ? lb_open_file(line, "rb") : 0;
    while (in && fgets(line, sizeof line, in)) {
        const int before = s->count;
        line[strcspn(line, "\r\n")] = 0;
        char *quality = strchr(line, ' ');
        if (quality) *quality++ = 0;
        add(s, folder, line);
        if (quality && before >= 0 && before < LB_MAX_BASSES && s->count > before)
            s->places[before].quality = !strcmp(quality, lb_parameters[LB_QUALITY].points[LB_STUDIO]);
    }
    if (in) fclose(in);
}

static int by_name(const void *a, const void *b) { return strcmp(((const place *)a)->name, ((const place *)b)->name); }

static void add_own(void *shelf, const char *folder, const char *name) { add(shelf, folder, name); }

/* Makes titles unique: all but the first of a title get their name after it, in brackets. bundle.py does the same. */
static void tell_apart(lb_shelf *s) {
    for (int k = s->count - 1; k > 0; k--) { /* backwards: earlier titles are still the files' */
        place *p = &s->places[k];
        int other = 0;
        while (other < k && strcmp(s->places[other].title, p->title)) other++;
        if (other == k) continue;
        strcat(p->title, " (");
        strcat(p->title, p->name);
        strcat(p->title, ")");
    }
}

lb_shelf *lb_open_shelf(const char *folder) {
    char users[PATH];
    lb_shelf *s = calloc(1, sizeof *s);
    if (!s) return 0;
    snprintf(s->folder, PATH, "%s", folder);
    add_listed(s, folder);
    s->listed = s->count;
    if (lb_users_folder(users)) lb_each_file(users, ENDING, add_own, s);
    qsort(s->places + s->listed, (size_t)(s->count - s->listed), sizeof *s->places, by_name);
    tell_apart(s);
    return s;
}
