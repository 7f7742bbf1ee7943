/* An instance from beginning to end: its bass, its threads, and the blocks it plays. */
#include "instance/instance.h"
#include "system/lock.h"
#include "instance/response.h"
#include "instance/retuning.h"
#include "instance/song.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE = 1600 };

/* --- the bass --- */

/* Resets the audio thread's knowledge of the host's notes and of taps. */
static void begin_audio(lb_instance *i) {
    lb_forget_notes(i);
    memset(&i->audio.taps, 0, sizeof i->audio.taps);
    i->audio.programs = 0;
    lb_stop_song(i);
    i->audio.stroke = lb_value(i, LB_TECHNIQUE);
    lb_mark_all(&i->changed); /* a window may be moving values */
}

void lb_complain(void *owner, const char *line) {
    (void)owner;
    fprintf(stderr, "livebass: %s\n", line);
}

int lb_open_instance(lb_instance *i, const char *folder) {
    i->kernels = lb_best_kernels();
    i->shelf = lb_open_shelf(folder);
    for (int k = 0; i->shelf && k < LB_PARAMETERS; k++) i->values[k] = lb_default(i, k);
    lb_begin_sides(i);
    lb_join_master();
    i->joined = 1;
    if (i->shelf && lb_shelf_count(i->shelf)) return 1;
    lb_log(i, "%.1400s: there is no instrument here, nor in the user's directory", folder);
    lb_close_instance(i);
    return 0;
}

void lb_close_instance(lb_instance *i) {
    lb_deactivate_instance(i);
    if (i->shelf) lb_close_shelf(i->shelf);
    i->shelf = 0;
    if (i->joined) lb_leave_master();
    i->joined = 0;
    lb_set_response(i, 0);
    lb_close_song(i);
    lb_forget_kept(i);
    lb_forget_sounds(i);
    free(i->unknown);
    i->unknown = 0;
}

static int64_t seed_of(const lb_instance *i) {
    int64_t seed;
    __atomic_load(&i->seed, &seed, __ATOMIC_RELAXED);
    return seed;
}

/* The wanted bass and its settings as one word; its slider values as a checksum. */
static int64_t wish(const lb_instance *i) {
    uint64_t sum = 0;
    for (int k = 0; k < LB_BUILT; k++) {
        uint64_t bits;
        const double value = lb_value(i, lb_sliders[k]);
        memcpy(&bits, &value, sizeof bits);
        sum = (sum ^ (value == 0 ? 0 : bits)) * 0x9E3779B97F4A7C15u;
        sum ^= sum >> 29;
    }
    sum ^= lb_kept_sum(i->shelf, lb_bass_number(i, lb_value(i, LB_BASS)));
    const uint64_t plain = (uint64_t)seed_of(i) << 16 | (uint64_t)lb_value(i, LB_RUNNING_AHEAD) << 9 |
                           (uint64_t)lb_value(i, LB_QUALITY) << 8 | (uint64_t)lb_value(i, LB_BASS);
    return (int64_t)(plain ^ (sum ^ __atomic_load_n(&i->response_sum, __ATOMIC_ACQUIRE)) << 16);
}

static int wants_other(const lb_instance *i) { return wish(i) != __atomic_load_n(&i->loaded, __ATOMIC_ACQUIRE); }

/* Takes slider values, and tells the host of those that differ from its own. */
static void take_sliders(lb_instance *i, const double *built) {
    for (int k = 0; k < LB_BUILT; k++) {
        if (built[k] == lb_value(i, lb_sliders[k])) continue;
        lb_set_value(i, lb_sliders[k], built[k]);
        lb_mark(&i->unsent, lb_sliders[k]);
    }
    __atomic_store_n(&i->loaded, wish(i), __ATOMIC_RELEASE);
}

/* Keeps why sliders have stopped on their way from the last values to the `wanted` ones. */
static void keep_stop(lb_instance *i, const double *wanted, const lb_fault *fault) {
    int moved = 0, which = LB_PARAMETERS;
    for (int k = 0; k < LB_BUILT; k++)
        if (wanted[k] != i->built[k]) which = moved++ ? LB_PARAMETERS : lb_sliders[k];
    const uint64_t count = (__atomic_load_n(&i->stopped, __ATOMIC_RELAXED) >> 56) % 255 + 1;
    const uint64_t words[] = {count, (uint64_t)which, (uint64_t)fault->open, (uint64_t)fault->fret};
    uint64_t packed = (uint32_t)fmin(fmax(rint(1e3 * fault->height), 0), 1e6); /* um */
    for (int k = 0; k < 4; k++) packed |= (words[k] & 255) << (56 - 8 * k);
    __atomic_store_n(&i->stopped, packed, __ATOMIC_RELEASE);
}

lb_stop lb_last_stop(const lb_instance *i) {
    const uint64_t packed = __atomic_load_n(&i->stopped, __ATOMIC_ACQUIRE);
    const lb_fault fault = {(int)(packed >> 40 & 255), (int)(packed >> 32 & 255), 1e-3 * (double)(packed & 0xFFFFFFFFu)};
    return (lb_stop){(int)(packed >> 56), (int)(packed >> 48 & 255), fault};
}

/* Lets sliders stop on their way from the last values to those in `built`, writes these there and takes them; returns 0
   if the bass cannot even have the last ones. */
static int stop_sliders(lb_instance *i, const lb_source *source, int number, double built[LB_BUILT]) {
    lb_fault fault = {-1, 0, 0};
    double wanted[LB_BUILT];
    memcpy(wanted, built, sizeof wanted);
    if (number != i->built_of) memset(i->built, 0, sizeof i->built);
    if (!lb_fit_sliders(source, i->built, built, &fault, i->kernels)) return 0;
    keep_stop(i, wanted, &fault);
    take_sliders(i, built);
    return 1;
}

static void read_sliders(const lb_instance *i, double built[LB_BUILT]) {
    for (int k = 0; k < LB_BUILT; k++) built[k] = lb_value(i, lb_sliders[k]);
}

void lb_stop_sliders(lb_instance *i) {
    double built[LB_BUILT];
    lb_fault fault;
    const int number = (int)lb_value(i, LB_BASS);
    if (number >= lb_shelf_count(i->shelf)) return;
    const lb_source source = lb_shelf_source(i->shelf, number);
    read_sliders(i, built);
    if (!lb_fits(&source, built, &fault, i->kernels) && !stop_sliders(i, &source, number, built)) return;
    memcpy(i->built, built, sizeof i->built);
    i->built_of = number;
}

/* Loads the wanted bass with this response; the log reports failures. Sliders that it cannot have stop on their way from
   the last ones. If no bass plays and the wanted one cannot be built, loads it unchanged. */
static lb_bass *load_with(lb_instance *i, lb_response *r) {
    char why[LINE];
    double built[LB_BUILT];
    __atomic_store_n(&i->loaded, wish(i), __ATOMIC_RELEASE);
    const int number = (int)lb_value(i, LB_BASS), tier = (int)lb_value(i, LB_QUALITY) ? LB_STUDIO : LB_LIVE;
    if (number >= lb_shelf_count(i->shelf)) return 0; /* beyond the only bass */
    const lb_source source = lb_shelf_source(i->shelf, number);
    const int ahead = (int)lb_value(i, LB_RUNNING_AHEAD);
    read_sliders(i, built);
    lb_bass *b = lb_load_bass(&source, tier, i->rate, seed_of(i), ahead, built, r, i->kernels, why, sizeof why);
    if (!b) {
        i->complain(i->owner, why);
        if (stop_sliders(i, &source, number, built))
            b = lb_load_bass(&source, tier, i->rate, seed_of(i), ahead, built, r, i->kernels, why, sizeof why);
    }
    if (b) memcpy(i->built, built, sizeof i->built);
    if (b) i->built_of = number;
    return b || i->synth ? b : lb_load_bass(&source, tier, i->rate, seed_of(i), ahead, 0, r, i->kernels, why, sizeof why);
}

static lb_bass *load(lb_instance *i) {
    lb_response *r = lb_use_response(i);
    lb_bass *b = load_with(i, r);
    lb_free_response(r);
    return b;
}

/* How many of its own threads should play strings: none if the host has some, or renders. */
static int wanted_helpers(const lb_instance *i) {
    return i->pool || __atomic_load_n(&i->resting, __ATOMIC_RELAXED) || __atomic_load_n(&i->offline, __ATOMIC_RELAXED) ? 0 : (int)lb_value(i, LB_CORES) - 1;
}

static void see_to_helpers(lb_instance *i) {
    const int wanted = wanted_helpers(i);
    if (wanted == __atomic_load_n(&i->helpers, __ATOMIC_RELAXED)) return;
    __atomic_store_n(&i->helpers, wanted, __ATOMIC_RELAXED);
    if (!lb_set_helpers(i->synth, wanted)) i->complain(i->owner, LB_NO_HELPERS);
}

int lb_activate_instance(lb_instance *i, double rate) {
    LB_ALONE(i->audio.owner);
    lb_deactivate_instance(i);
    i->rate = rate;
    lb_bass *b = load(i);
    i->synth = b ? lb_new_synth(rate, i->kernels) : 0;
    if (i->synth) {
        lb_put_on(i->synth, b);
        if (i->pool) lb_share(i->synth, i->pool, i->owner);
        see_to_helpers(i);
        lb_begin_looks(&i->look, i->synth);
    } else lb_free_bass(b);
    begin_audio(i);
    lb_renew_song(i);
    return i->synth != 0;
}

void lb_deactivate_instance(lb_instance *i) {
    LB_ALONE(i->audio.owner);
    lb_free_synth(i->synth);
    lb_free_bass(i->ready);
    lb_free_bass(i->done);
    i->synth = 0;
    i->helpers = 0;
    i->ready = i->done = 0;
}

void lb_reset_instance(lb_instance *i) {
    LB_ALONE(i->audio.owner);
    __atomic_store_n(&i->resting, 0, __ATOMIC_RELAXED);
    lb_bass *b = __atomic_exchange_n(&i->ready, 0, __ATOMIC_ACQ_REL);
    if (!i->synth) return;
    if (b) lb_put_on(i->synth, b);
    else lb_reset_synth(i->synth);
    lb_begin_looks(&i->look, i->synth);
    begin_audio(i);
}

void lb_rest_instance(lb_instance *i) {
    LB_ALONE(i->audio.owner);
    enter();
    __atomic_store_n(&i->resting, 1, __ATOMIC_RELAXED);
    if (i->synth) see_to_helpers(i);
    leave();
}

void lb_serve(lb_instance *i) {
    enter(); /* the main thread may be here while the host renders offline in another */
    lb_free_bass(__atomic_exchange_n(&i->done, 0, __ATOMIC_ACQ_REL));
    lb_free_songs(i);
    if (i->synth && wants_other(i)) {
        lb_bass *b = load(i);
        if (b) lb_free_bass(__atomic_exchange_n(&i->ready, b, __ATOMIC_ACQ_REL));
    }
    if (i->synth) see_to_helpers(i);
    leave();
    lb_renew_song(i);
}

/* --- playing --- */

void lb_set_offline(lb_instance *i, int on) { __atomic_store_n(&i->offline, on, __ATOMIC_RELAXED); }

void lb_begin_block(lb_instance *i) {
    LB_ALONE(i->audio.owner);
    LB_REAL_TIME(!__atomic_load_n(&i->offline, __ATOMIC_RELAXED));
    lb_marks changed = lb_take_marks(&i->changed);
    for (int k; (k = lb_take_mark(&changed)) >= 0;)
        if (!lb_set(i->synth, 0, k, lb_value(i, k))) lb_mark(&i->changed, k);
    lb_tell_notes(i);
    lb_offline(i->synth, __atomic_load_n(&i->offline, __ATOMIC_RELAXED));
    lb_relieve(i->synth, lb_value(i, LB_RELIEF) > 0.5);
    lb_end_taps(i);
    for (lb_touch t; lb_take_touch(&i->touches, &t);) lb_play_touch(i, &t);
}

/* Requests another bass if one is wanted; passes on ready basses, and basses to free. */
static void change_bass(lb_instance *i) {
    lb_synth *s = i->synth;
    int busy = __atomic_load_n(&i->done, __ATOMIC_ACQUIRE) != 0;
    if (!busy) {
        lb_bass *faded = lb_take_faded(s);
        busy = faded != 0;
        __atomic_store_n(&i->done, faded, __ATOMIC_RELEASE);
    }
    if (__atomic_load_n(&i->offline, __ATOMIC_RELAXED)) {
        lb_serve(i); /* always: another thread may be loading the wanted bass */
        if (busy) lb_free_bass(lb_take_faded(s)); /* another has faded since */
    } else if (busy || lb_song_asks(i) || wants_other(i) ||
               wanted_helpers(i) != __atomic_load_n(&i->helpers, __ATOMIC_RELAXED))
        i->ask(i->owner);
    if (!__atomic_load_n(&i->ready, __ATOMIC_ACQUIRE) || __atomic_load_n(&i->done, __ATOMIC_ACQUIRE)) return;
    __atomic_store_n(&i->done, lb_take_next(s), __ATOMIC_RELEASE); /* it would be replaced before it began */
    lb_bass *b = lb_changing(s) ? 0 : __atomic_exchange_n(&i->ready, 0, __ATOMIC_ACQ_REL);
    if (b) lb_change_bass(s, b);
}

int lb_may_sleep(const lb_instance *i) {
    if (lb_is_marked(&i->changed) || __atomic_load_n(&i->ready, __ATOMIC_RELAXED)) return 0;
    if (__atomic_load_n(&i->done, __ATOMIC_RELAXED) || wants_other(i)) return 0;
    if (lb_waiting(&i->touches.ring) || i->audio.taps.count || lb_song_waits(i)) return 0;
    return lb_is_still(i->synth);
}

/* Chooses the bass of a program change, as `play` does; a program without a bass here changes nothing. */
static void answer_program(lb_instance *i) {
    const LB_SYNTH *r = &i->synth->record;
    if (r->program_count == i->audio.programs) return;
    i->audio.programs = r->program_count;
    const int bass = lb_shelf_program(i->shelf, r->program);
    if (bass >= 0) lb_set_value(i, LB_BASS, bass);
}

/* Takes the stroke that a key or a controller has chosen. */
static void follow_stroke(lb_instance *i) {
    const double stroke = i->synth->record.parameters[LB_TECHNIQUE], before = i->audio.stroke;
    i->audio.stroke = stroke;
    if (stroke == before || stroke == lb_value(i, LB_TECHNIQUE)) return;
    lb_set_value(i, LB_TECHNIQUE, stroke);
    lb_mark(&i->unsent, LB_TECHNIQUE);
}

/* Plays frames from `from` to below `end` of a block. */
static void play(lb_instance *i, int apart, float *const outs[LB_STRINGS], int64_t from, int64_t end) {
    float *at[LB_STRINGS];
    for (int k = 0; k < LB_STRINGS; k++) at[k] = outs[k] ? outs[k] + from : 0;
    change_bass(i);
    lb_play_song(i, end - from);
    if (at[0] && !apart) lb_play(i->synth, at[0], end - from);
    else lb_play_strings(i->synth, at, end - from);
}

void lb_play_block(lb_instance *i, int apart, float *const outs[LB_STRINGS], int64_t n) {
    LB_ALONE(i->audio.owner);
    int64_t done = 0;
    for (int k = 0; k < i->audio.turn_count; k++) {
        const lb_turn *t = &i->audio.turns[k];
        const int64_t at = t->offset < n ? t->offset : n;
        if (at > done) play(i, apart, outs, done, at);
        if (at > done) done = at;
        lb_set_value(i, t->parameter, t->value);
    }
    i->audio.turn_count = 0;
    play(i, apart, outs, done, n);
    answer_program(i);
    if (n > 0) follow_stroke(i); /* else the synth has taken no message yet */
    lb_take_look(&i->look, i->synth, outs[0] && !apart ? outs[0] : i->synth->mix, n < LB_CHUNK ? n : LB_CHUNK);
    LB_REAL_TIME(0);
}
