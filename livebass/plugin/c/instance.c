/* What CLAP and VST3 share between their interfaces and a synth: no interface of a host is known in here. */
#include "instance.h"
#include "lock.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE = 1600, ALL_SOUND_OFF = 120, ALL_NOTES_OFF = 123 };

/* --- values --- */

double lb_value(const lb_instance *i, int parameter) {
    double value;
    __atomic_load(&i->values[parameter], &value, __ATOMIC_RELAXED);
    return value;
}

static void keep(lb_instance *i, int parameter, double value) {
    if (parameter == LB_BASS && value != lb_value(i, LB_BASS)) {
        const double before = lb_shelf_quality(i->shelf, (int)lb_value(i, LB_BASS));
        __atomic_store_n(&i->missing, 0, __ATOMIC_RELAXED);
        if (lb_value(i, LB_QUALITY) == before) keep(i, LB_QUALITY, lb_shelf_quality(i->shelf, (int)value));
    }
    __atomic_store(&i->values[parameter], &value, __ATOMIC_RELAXED);
}

double lb_most(const lb_instance *i, int parameter) {
    if (parameter != LB_BASS) return lb_parameters[parameter].most;
    const int last = lb_shelf_count(i->shelf) - 1;
    return last > 0 ? last : 1; /* a host may divide by the range */
}

double lb_usual(const lb_instance *i, int parameter) {
    return parameter == LB_QUALITY ? lb_shelf_quality(i->shelf, 0) : lb_parameters[parameter].usual;
}

int lb_is_slider(int parameter) { return parameter >= LB_ACTION && parameter < LB_ACTION + LB_BUILT; }

double lb_allowed(const lb_instance *i, int parameter, double value) {
    const lb_parameter *p = &lb_parameters[parameter];
    if (!(value == value)) value = lb_usual(i, parameter);
    value = fmin(fmax(value, p->least), lb_most(i, parameter));
    if (lb_is_slider(parameter)) return lb_hundredths(value);
    return p->whole ? rint(value) : value;
}

void lb_set_value(lb_instance *i, int parameter, double value) {
    keep(i, parameter, lb_allowed(i, parameter, value));
    __atomic_fetch_or(&i->changed, 1ull << parameter, __ATOMIC_RELEASE);
}

/* Offline the bass is changed where the value is, within the block (lb_play_block); without places all so far at once. */
static void turn_at(lb_instance *i, int64_t offset, int parameter, double value) {
    for (int k = 0; i->turn_count == LB_TURNS && k < LB_TURNS; k++)
        lb_set_value(i, i->turns[k].parameter, i->turns[k].value);
    i->turn_count %= LB_TURNS;
    i->turns[i->turn_count++] = (lb_turn){offset, parameter, value};
}

void lb_set_value_at(lb_instance *i, int64_t offset, int parameter, double value) {
    value = lb_allowed(i, parameter, value);
    if (lb_is_slider(parameter) && __atomic_load_n(&i->offline, __ATOMIC_RELAXED)) {
        turn_at(i, offset, parameter, value);
        return;
    }
    keep(i, parameter, value);
    if (lb_parameters[parameter].kind < 0 || !lb_set(i->synth, offset, parameter, value))
        __atomic_fetch_or(&i->changed, 1ull << parameter, __ATOMIC_RELEASE);
}

/* Writes what a value that is relative comes to with this bass, in brackets; nothing where it says all itself. */
static void add_real_value(const lb_instance *i, int parameter, double value, char *text, size_t room) {
    const int bass = (int)lb_value(i, LB_BASS);
    const LB_PLAYER *p = bass < lb_shelf_count(i->shelf) ? lb_shelf_player(i->shelf, bass) : 0;
    if (!p) return;
    const double most = value < 0 ? p->pluck_farthest : p->pluck_nearest;
    if (parameter == LB_BEND_RANGE && value == 0) snprintf(text, room, " (the bass has %g)", p->bend_range);
    else if (parameter == LB_PLUCK_POSITION) {
        const double place = p->pluck_position + fabs(value) * (most - p->pluck_position);
        snprintf(text, room, " (%.0f %% of the string)", 100 * place);
    } else if (parameter == LB_HAND_DAMPING) snprintf(text, room, " (%.3g 1/s)", p->hand_damping * pow(10, value));
    else if (parameter == LB_UNEVENNESS) {
        const double all = fmin(fmax(p->unevenness + value, 0), LB_MOST_UNEVENNESS);
        snprintf(text, room, " (%.2f)", value == 0 ? p->unevenness : all);
    }
}

void lb_value_to_text(const lb_instance *i, int parameter, double value, char *text, size_t room) {
    const lb_parameter *p = &lb_parameters[parameter];
    value = lb_allowed(i, parameter, value);
    if (!p->whole) value = rint(100 * value) / 100 + 0.0; /* as its text is read back: that has the same text again */
    if (parameter == LB_BASS) {
        const int number = (int)value < lb_shelf_count(i->shelf) ? (int)value : 0;
        snprintf(text, room, "%s", lb_shelf_title(i->shelf, number));
    } else if (p->points) snprintf(text, room, "%s", p->points[(int)(value - p->least)]);
    else {
        snprintf(text, room, p->whole ? "%.0f%s%s" : "%.2f%s%s", value, *p->unit ? " " : "", p->unit);
        add_real_value(i, parameter, value, text + strlen(text), room - strlen(text));
    }
}

int lb_text_to_value(const lb_instance *i, int parameter, const char *text, double *value) {
    const lb_parameter *p = &lb_parameters[parameter];
    char other[256], *end;
    if (parameter == LB_BASS && lb_shelf_find(i->shelf, text) >= 0) {
        *value = lb_shelf_find(i->shelf, text);
        return 1;
    }
    if (parameter == LB_BASS || p->points) {
        for (double v = p->least; v <= lb_most(i, parameter); v++) {
            lb_value_to_text(i, parameter, v, other, sizeof other);
            if (strcmp(other, text)) continue;
            *value = v;
            return 1;
        }
    }
    const double read = strtod(text, &end);
    if (end == text) return 0;
    *value = lb_allowed(i, parameter, read);
    return 1;
}

/* --- the bass --- */

static void forget_notes(lb_instance *i) {
    memset(i->held, 0, sizeof i->held);
    memset(i->unbent, 0, sizeof i->unbent);
    memset(i->unvibrated, 0, sizeof i->unvibrated);
    memset(i->channels, 0, sizeof i->channels);
    i->untold = 0;
    for (int n = 0; n < LB_NOTES; n++) i->note_ids[n] = -1;
    memset(&i->taps, 0, sizeof i->taps);
}

int lb_open_instance(lb_instance *i, const char *folder) {
    char line[LINE];
    i->kernels = lb_best_kernels();
    forget_notes(i);
    i->shelf = lb_open_shelf(folder);
    for (int k = 0; i->shelf && k < LB_PARAMETERS; k++) i->values[k] = lb_usual(i, k);
    lb_begin_sides(i);
    if (i->shelf && lb_shelf_count(i->shelf)) return 1;
    snprintf(line, sizeof line, "%.1400s: there is no instrument here, nor in the user's directory", folder);
    i->complain(i->owner, line);
    lb_close_instance(i);
    return 0;
}

void lb_close_instance(lb_instance *i) {
    lb_deactivate_instance(i);
    if (i->shelf) lb_close_shelf(i->shelf);
    i->shelf = 0;
    lb_forget_sounds(i);
}

static int64_t seed_of(const lb_instance *i) {
    int64_t seed;
    __atomic_load(&i->seed, &seed, __ATOMIC_RELAXED);
    return seed;
}

/* Which bass is wanted, and how, as one word; how it is built as a checksum. */
static int64_t wish(const lb_instance *i) {
    uint64_t sum = 0;
    for (int k = 0; k < LB_BUILT; k++) {
        uint64_t bits;
        const double value = lb_value(i, LB_ACTION + k);
        memcpy(&bits, &value, sizeof bits);
        sum = (sum ^ (value == 0 ? 0 : bits)) * 0x9E3779B97F4A7C15u;
        sum ^= sum >> 29;
    }
    const uint64_t plain = (uint64_t)seed_of(i) << 16 | (uint64_t)lb_value(i, LB_RUNNING_AHEAD) << 9 |
                           (uint64_t)lb_value(i, LB_QUALITY) << 8 | (uint64_t)lb_value(i, LB_BASS);
    return (int64_t)(plain ^ sum << 16);
}

static int wants_other(const lb_instance *i) { return wish(i) != __atomic_load_n(&i->loaded, __ATOMIC_ACQUIRE); }

/* Loads the bass that is wanted; says why if it cannot. One that cannot be built so is taken as its file has it, if no
   other plays. */
static lb_bass *load(lb_instance *i) {
    char why[LINE];
    double built[LB_BUILT];
    __atomic_store_n(&i->loaded, wish(i), __ATOMIC_RELEASE);
    const int number = (int)lb_value(i, LB_BASS), tier = (int)lb_value(i, LB_QUALITY) ? LB_STUDIO : LB_LIVE;
    if (number >= lb_shelf_count(i->shelf)) return 0; /* beyond the only one */
    const char *path = lb_shelf_path(i->shelf, number);
    const int ahead = (int)lb_value(i, LB_RUNNING_AHEAD);
    for (int k = 0; k < LB_BUILT; k++) built[k] = lb_value(i, LB_ACTION + k);
    lb_bass *b = lb_load_bass(path, tier, i->rate, seed_of(i), ahead, built, i->kernels, why, sizeof why);
    if (b) return b;
    i->complain(i->owner, why);
    return i->synth ? 0 : lb_load_bass(path, tier, i->rate, seed_of(i), ahead, 0, i->kernels, why, sizeof why);
}

/* How many threads of its own shall play strings: none where the host has some, or renders. */
static int wanted_helpers(const lb_instance *i) {
    return i->pool || __atomic_load_n(&i->offline, __ATOMIC_RELAXED) ? 0 : (int)lb_value(i, LB_CORES) - 1;
}

static void see_to_helpers(lb_instance *i) {
    const int wanted = wanted_helpers(i);
    if (wanted == __atomic_load_n(&i->helpers, __ATOMIC_RELAXED)) return;
    __atomic_store_n(&i->helpers, wanted, __ATOMIC_RELAXED);
    if (!lb_set_helpers(i->synth, wanted)) i->complain(i->owner, LB_NO_HELPERS);
}

int lb_activate_instance(lb_instance *i, double rate) {
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
    forget_notes(i);
    i->programs = 0;
    __atomic_store_n(&i->changed, ~0ull, __ATOMIC_RELEASE); /* a window may be moving values */
    return i->synth != 0;
}

void lb_deactivate_instance(lb_instance *i) {
    lb_free_synth(i->synth);
    lb_free_bass(i->ready);
    lb_free_bass(i->done);
    i->synth = 0;
    i->helpers = 0;
    i->ready = i->done = 0;
}

void lb_reset_instance(lb_instance *i) {
    lb_bass *b = __atomic_exchange_n(&i->ready, 0, __ATOMIC_ACQ_REL);
    if (!i->synth) return;
    if (b) lb_put_on(i->synth, b);
    else lb_reset_synth(i->synth);
    lb_begin_looks(&i->look, i->synth);
    forget_notes(i);
    i->programs = 0;
    __atomic_store_n(&i->changed, ~0ull, __ATOMIC_RELEASE);
}

void lb_serve(lb_instance *i) {
    enter(); /* the main thread may be here while a host renders offline in another */
    lb_free_bass(__atomic_exchange_n(&i->done, 0, __ATOMIC_ACQ_REL));
    if (i->synth && wants_other(i)) {
        lb_bass *b = load(i);
        if (b) lb_free_bass(__atomic_exchange_n(&i->ready, b, __ATOMIC_ACQ_REL));
    }
    if (i->synth) see_to_helpers(i);
    leave();
}

/* --- by hand --- */

enum { SPARE = 32 }; /* moves that only ends may take */

void lb_put_move(lb_moves *m, int parameter, int phase, double value) {
    const uint32_t put = m->put, used = put - __atomic_load_n(&m->taken, __ATOMIC_ACQUIRE);
    if (used >= LB_MOVES || (phase != LB_END && used >= LB_MOVES - SPARE)) return;
    m->moves[put % LB_MOVES] = (lb_move){parameter, phase, value};
    __atomic_store_n(&m->put, put + 1, __ATOMIC_RELEASE);
}

int lb_take_move(lb_moves *m, lb_move *to) {
    const uint32_t taken = m->taken;
    if (taken == __atomic_load_n(&m->put, __ATOMIC_ACQUIRE)) return 0;
    *to = m->moves[taken % LB_MOVES];
    __atomic_store_n(&m->taken, taken + 1, __ATOMIC_RELEASE);
    return 1;
}

void lb_put_touch(lb_touches *t, int on, int string, int key, double velocity) {
    const uint32_t put = t->put;
    if (put - __atomic_load_n(&t->taken, __ATOMIC_ACQUIRE) >= LB_BY_HAND) return;
    const int seven = on ? (int)fmin(fmax(rint(127 * velocity), 1), 127) : 0;
    t->touches[put % LB_BY_HAND] = (lb_touch){(uint8_t)string, (uint8_t)key, (uint8_t)seven};
    __atomic_store_n(&t->put, put + 1, __ATOMIC_RELEASE);
}

int lb_take_touch(lb_touches *t, lb_touch *to) {
    const uint32_t taken = t->taken;
    if (taken == __atomic_load_n(&t->put, __ATOMIC_ACQUIRE)) return 0;
    *to = t->touches[taken % LB_BY_HAND];
    __atomic_store_n(&t->taken, taken + 1, __ATOMIC_RELEASE);
    return 1;
}

static void let_go(lb_synth *s, int key) { lb_send(s, 0, (const uint8_t[]){0x80, (uint8_t)key, 64}, 3); }

/* Ends the first `count` notes of those that wait. */
static void end_first(lb_synth *s, lb_taps *t, int count) {
    for (int k = 0; k < count; k++) let_go(s, t->keys[k]);
    t->count -= count;
    memmove(t->keys, t->keys + count, (size_t)t->count * sizeof *t->keys);
    memmove(t->due, t->due + count, (size_t)t->count * sizeof *t->due);
}

void lb_end_taps(lb_synth *s, lb_taps *t) {
    int count = 0;
    while (count < t->count && t->due[count] <= s->record.frame) count++;
    end_first(s, t, count);
}

/* They end in the order in which they were let go: notes that are bound end after the next one has begun. */
static void end_later(lb_synth *s, lb_taps *t, int key) {
    const int64_t due = t->began[key] + (int64_t)(LB_SHORTEST * s->record.rate);
    const int64_t before = t->count ? t->due[t->count - 1] : s->record.frame;
    if (due <= s->record.frame && !t->count) {
        let_go(s, key);
        return;
    }
    if (t->count == LB_BY_HAND) end_first(s, t, 1);
    t->keys[t->count] = (uint8_t)key;
    t->due[t->count++] = due > before ? due : before;
}

void lb_play_touch(lb_synth *s, lb_taps *taps, const lb_touch *t) {
    if (!t->velocity) {
        end_later(s, taps, t->key);
        return;
    }
    int last = taps->count; /* of those that wait, if the key begins anew */
    while (last && taps->keys[last - 1] != t->key) last--;
    end_first(s, taps, last);
    taps->began[t->key] = s->record.frame;
    if (t->string < LB_STRINGS) lb_choose_string(s, 0, t->key, t->string); /* else of the keyboard, or it switches */
    lb_send(s, 0, (const uint8_t[]){0x90, t->key, t->velocity}, 3);
}

void lb_move_value(lb_instance *i, int parameter, double value, int phase) {
    const double quality = lb_value(i, LB_QUALITY);
    if (phase == LB_MOVE) lb_set_value(i, parameter, value);
    lb_put_move(&i->moves, parameter, phase, lb_value(i, parameter));
    for (int p = LB_BEGIN; parameter == LB_BASS && lb_value(i, LB_QUALITY) != quality && p <= LB_END; p++)
        lb_put_move(&i->moves, LB_QUALITY, p, lb_value(i, LB_QUALITY)); /* it has followed: LV2 hears it from here alone */
    i->moved(i->owner);
}

/* --- playing --- */

void lb_set_offline(lb_instance *i, int on) { __atomic_store_n(&i->offline, on, __ATOMIC_RELAXED); }

/* Bends the string of note n, now or, in a flood, in the next block. */
static void bend(lb_instance *i, int64_t offset, int n, double semitones) {
    i->bends[n] = semitones;
    i->unbent[n] = !lb_bend_note(i->synth, offset, n / LB_KEYS, n % LB_KEYS, semitones);
    i->untold |= i->unbent[n];
}

/* The same for vibrato. */
static void vibrate(lb_instance *i, int64_t offset, int n, double amount) {
    i->vibratos[n] = amount;
    i->unvibrated[n] = !lb_vibrate_note(i->synth, offset, n / LB_KEYS, n % LB_KEYS, amount);
    i->untold |= i->unvibrated[n];
}

/* Tells the synth of what a flood has kept back. */
static void tell_notes(lb_instance *i) {
    if (!i->untold) return;
    i->untold = 0;
    for (int n = 0; n < LB_NOTES; n++)
        if (i->unbent[n]) bend(i, 0, n, i->bends[n]);
    for (int n = 0; n < LB_NOTES; n++)
        if (i->unvibrated[n]) vibrate(i, 0, n, i->vibratos[n]);
}

void lb_begin_block(lb_instance *i) {
    const uint64_t changed = __atomic_exchange_n(&i->changed, 0, __ATOMIC_ACQUIRE);
    for (int k = 0; k < LB_PARAMETERS; k++)
        if (changed >> k & 1 && !lb_set(i->synth, 0, k, lb_value(i, k)))
            __atomic_fetch_or(&i->changed, 1ull << k, __ATOMIC_RELEASE);
    tell_notes(i);
    lb_offline(i->synth, __atomic_load_n(&i->offline, __ATOMIC_RELAXED));
    lb_relieve(i->synth, lb_value(i, LB_RELIEF) > 0.5);
    lb_end_taps(i->synth, &i->taps);
    for (lb_touch t; lb_take_touch(&i->touches, &t);) lb_play_touch(i->synth, &i->taps, &t);
}

/* Has another bass loaded if one is wanted, hands over those that are ready and those that are done. */
static void change_bass(lb_instance *i) {
    lb_synth *s = i->synth;
    int busy = __atomic_load_n(&i->done, __ATOMIC_ACQUIRE) != 0;
    if (!busy) {
        lb_bass *faded = lb_take_faded(s);
        busy = faded != 0;
        __atomic_store_n(&i->done, faded, __ATOMIC_RELEASE);
    }
    if (busy || wants_other(i) || wanted_helpers(i) != __atomic_load_n(&i->helpers, __ATOMIC_RELAXED)) {
        if (__atomic_load_n(&i->offline, __ATOMIC_RELAXED)) {
            lb_serve(i);
            if (busy) lb_free_bass(lb_take_faded(s)); /* another one that has faded since */
        } else i->ask(i->owner);
    }
    if (!__atomic_load_n(&i->ready, __ATOMIC_ACQUIRE) || __atomic_load_n(&i->done, __ATOMIC_ACQUIRE)) return;
    __atomic_store_n(&i->done, lb_take_next(s), __ATOMIC_RELEASE); /* one that would be changed before it began */
    lb_bass *b = lb_changing(s) ? 0 : __atomic_exchange_n(&i->ready, 0, __ATOMIC_ACQ_REL);
    if (b) lb_change_bass(s, b);
}

static int is_channel(int channel) { return channel >= 0 && channel < LB_CHANNELS; }

/* True if a key on a channel is meant by `named`, which has the id of a note, or none but a channel. */
static int is_named(const lb_instance *i, int n, lb_named named) {
    if (named.key < 0 && named.id >= 0) return i->note_ids[n] == named.id;
    return i->held[n] && (!is_channel(named.channel) || n / LB_KEYS == named.channel);
}

/* Writes the notes that are meant into `found`; returns how many there are. A key that nobody holds is that of its
   channel, or of the one that played it last. */
static int find_notes(const lb_instance *i, lb_named named, int16_t found[LB_NOTES]) {
    int count = 0;
    if (named.key >= LB_KEYS) return 0;
    if (named.key < 0) {
        for (int n = 0; n < LB_NOTES; n++)
            if (is_named(i, n, named)) found[count++] = (int16_t)n;
        return count;
    }
    if (is_channel(named.channel) && i->held[named.channel * LB_KEYS + named.key]) {
        found[0] = (int16_t)(named.channel * LB_KEYS + named.key);
        return 1;
    }
    for (int channel = 0; channel < LB_CHANNELS; channel++)
        if (i->held[channel * LB_KEYS + named.key]) found[count++] = (int16_t)(channel * LB_KEYS + named.key);
    const int last = is_channel(named.channel) ? named.channel : i->channels[named.key];
    if (!count) found[count++] = (int16_t)(last * LB_KEYS + named.key);
    return count;
}

void lb_start_note(lb_instance *i, int64_t offset, int channel, int key, double velocity, int32_t id) {
    if (!is_channel(channel)) channel = 0;
    if (key < 0 || key >= LB_KEYS) return;
    const double scaled = fmin(fmax(rint(127 * velocity), 1), 127); /* 0 would release it */
    const int n = channel * LB_KEYS + key;
    for (int k = 0; k < LB_NOTES && id >= 0; k++)
        if (i->note_ids[k] == id) i->note_ids[k] = -1; /* of a note that is over */
    i->note_ids[n] = id;
    i->held[n] = 1;
    i->unbent[n] = i->unvibrated[n] = 0;
    i->channels[key] = (uint8_t)channel;
    lb_send(i->synth, offset, (const uint8_t[]){(uint8_t)(0x90 | channel), (uint8_t)key, (uint8_t)scaled}, 3);
}

/* Sends a channel mode message for all notes of a channel, or of all channels. */
static void end_all(lb_instance *i, int64_t offset, int channel, int mode) {
    for (int n = 0; n < LB_NOTES; n++)
        if (!is_channel(channel) || n / LB_KEYS == channel) i->held[n] = 0;
    const uint8_t message[] = {(uint8_t)(0xB0 | channel), (uint8_t)mode, 0};
    if (is_channel(channel)) lb_send(i->synth, offset, message, 3);
    else lb_send_everywhere(i->synth, offset, mode, 0);
}

static void release(lb_instance *i, int64_t offset, int n, double velocity) {
    const int seven = (int)lrint(fmin(fmax(velocity, 0), 1) * 127);
    const uint8_t message[] = {(uint8_t)(0x80 | n / LB_KEYS), (uint8_t)(n % LB_KEYS), (uint8_t)seven};
    i->held[n] = 0;
    lb_send(i->synth, offset, message, 3);
}

void lb_stop_note(lb_instance *i, int64_t offset, lb_named named, double velocity) {
    int16_t found[LB_NOTES];
    if (named.key < 0 && named.id < 0) {
        end_all(i, offset, named.channel, ALL_NOTES_OFF);
        return;
    }
    for (int k = 0, count = find_notes(i, named, found); k < count; k++) release(i, offset, found[k], velocity);
}

void lb_choke_note(lb_instance *i, int64_t offset, lb_named named) {
    int16_t found[LB_NOTES];
    if (named.key < 0 && named.id < 0) {
        end_all(i, offset, named.channel, ALL_SOUND_OFF);
        return;
    }
    for (int k = 0, count = find_notes(i, named, found); k < count; k++) {
        release(i, offset, found[k], 0.5); /* it may be a key that switches */
        lb_cut_note(i->synth, offset, found[k] / LB_KEYS, found[k] % LB_KEYS);
    }
}

void lb_express_bend(lb_instance *i, int64_t offset, lb_named named, double semitones) {
    int16_t found[LB_NOTES];
    for (int k = 0, count = find_notes(i, named, found); k < count; k++) bend(i, offset, found[k], semitones);
}

void lb_express_vibrato(lb_instance *i, int64_t offset, lb_named named, double amount) {
    int16_t found[LB_NOTES];
    for (int k = 0, count = find_notes(i, named, found); k < count; k++) vibrate(i, offset, found[k], amount);
}

void lb_express_place(lb_instance *i, int64_t offset, int key, int32_t id, double brightness) {
    for (int n = 0; n < LB_NOTES && key < 0 && id >= 0; n++)
        if (i->note_ids[n] == id) key = n % LB_KEYS;
    if (key < LB_KEYS) lb_place_note(i->synth, offset, key, 1 - 2 * brightness);
}

int lb_may_sleep(const lb_instance *i) {
    if (__atomic_load_n(&i->changed, __ATOMIC_RELAXED) || __atomic_load_n(&i->ready, __ATOMIC_RELAXED)) return 0;
    if (__atomic_load_n(&i->done, __ATOMIC_RELAXED) || wants_other(i)) return 0;
    if (__atomic_load_n(&i->touches.put, __ATOMIC_RELAXED) != i->touches.taken || i->taps.count) return 0;
    return lb_is_still(i->synth);
}

/* Chooses the bass of a program change that was played, as `play` does; one of none that is here changes nothing. */
static void answer_program(lb_instance *i) {
    const LB_SYNTH *r = &i->synth->record;
    if (r->program_count == i->programs) return;
    i->programs = r->program_count;
    const int bass = lb_shelf_program(i->shelf, r->program);
    if (bass >= 0) lb_set_value(i, LB_BASS, bass);
}

/* Plays frames from `from` to below `end` of a block. */
static void play(lb_instance *i, int apart, float *const outs[LB_STRINGS], int64_t from, int64_t end) {
    float *at[LB_STRINGS];
    for (int k = 0; k < LB_STRINGS; k++) at[k] = outs[k] ? outs[k] + from : 0;
    change_bass(i);
    if (at[0] && !apart) lb_play(i->synth, at[0], end - from);
    else lb_play_strings(i->synth, at, end - from);
}

void lb_play_block(lb_instance *i, int apart, float *const outs[LB_STRINGS], int64_t n) {
    int64_t done = 0;
    for (int k = 0; k < i->turn_count; k++) {
        const lb_turn *t = &i->turns[k];
        const int64_t at = t->offset < n ? t->offset : n;
        if (at > done) play(i, apart, outs, done, at);
        if (at > done) done = at;
        lb_set_value(i, t->parameter, t->value);
    }
    i->turn_count = 0;
    play(i, apart, outs, done, n);
    answer_program(i);
    lb_take_look(&i->look, i->synth, outs[0] && !apart ? outs[0] : i->synth->mix, n < LB_CHUNK ? n : LB_CHUNK);
}

int lb_switch_key(const lb_instance *i, uint32_t *index) {
    uint32_t found = 0;
    for (int key = 0; key < LB_KEY_COUNT; key++)
        if (lb_shelf_switch(i->shelf, (int)lb_value(i, LB_BASS), key) && found++ == *index) return key;
    *index = found;
    return -1;
}

const char *lb_switch_name(const lb_instance *i, int key) {
    return lb_shelf_switch(i->shelf, (int)lb_value(i, LB_BASS), key)->name;
}
