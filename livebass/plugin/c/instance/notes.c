/* A host's notes: one table by channel and key, with the host's port and id of each. [audio thread]

   A channel has one note of a key, as the bass has: a second one strikes the string again and replaces the first, whose
   note-off, choke and expressions then mean nothing. */
#include "instance/instance.h"
#include "instance/retuning.h"

#include <math.h>
#include <string.h>

enum { UNKNOWN, LET_GO, HELD };                       /* states of a note */
enum { ANY = -1, NONE = -2 }; /* ids of notes begun without one: any id means it; none, as it replaced a note with an id */
enum { NOTE_OFF = 0x80, NOTE_ON = 0x90, MODE = 0xB0, PROGRAM = 0xC0, PRESSURE = 0xD0 }; /* MIDI, of the first channel */
enum { ALL_SOUND_OFF = 120, ALL_NOTES_OFF = 123 };    /* first of the controllers that end sounds, and notes */

static int is_channel(int channel) { return channel >= 0 && channel < LB_CHANNELS; }

static void send(lb_instance *i, int64_t offset, int status, int first, int second) {
    lb_send(i->synth, offset, (const uint8_t[]){(uint8_t)status, (uint8_t)first, (uint8_t)second}, 3);
}

void lb_forget_notes(lb_instance *i) {
    memset(i->audio.notes, 0, sizeof i->audio.notes);
    for (int n = 0; n < LB_NOTES; n++) i->audio.notes[n].id = ANY;
    i->audio.unsent = 0;
}

/* --- expressions --- */

/* Sends an expression of note n; in a flood the synth gets it in the next block. */
static void express(lb_instance *i, int64_t offset, int n, int what, double amount) {
    lb_note *note = &i->audio.notes[n];
    const int bends = what == LB_EXPRESS_BEND;
    const int reported = bends ? lb_bend_note(i->synth, offset, n / LB_KEYS, n % LB_KEYS, amount + note->retuning)
                               : lb_vibrate_note(i->synth, offset, n / LB_KEYS, n % LB_KEYS, amount);
    note->amounts[what] = amount;
    note->unsent[what] = !reported;
    i->audio.unsent |= !reported;
}

/* Tunes note n as the master wants it. */
static void retune(lb_instance *i, int64_t offset, int n) {
    lb_note *note = &i->audio.notes[n];
    const double wanted = lb_retuning(n / LB_KEYS, n % LB_KEYS);
    if (note->state != HELD || wanted == note->retuning) return;
    note->retuning = wanted;
    i->audio.retuned = 1;
    express(i, offset, n, LB_EXPRESS_BEND, note->amounts[LB_EXPRESS_BEND]);
}

void lb_tell_notes(lb_instance *i) {
    const int tuned = lb_has_master();
    for (int n = 0; n < LB_NOTES && (tuned || i->audio.retuned); n++) retune(i, 0, n);
    i->audio.retuned = tuned;
    if (!i->audio.unsent) return;
    i->audio.unsent = 0;
    for (int what = 0; what < LB_EXPRESSIONS; what++)
        for (int n = 0; n < LB_NOTES; n++)
            if (i->audio.notes[n].unsent[what]) express(i, 0, n, what, i->audio.notes[n].amounts[what]);
}

int lb_is_left_out(const lb_instance *i, int channel, int key) {
    return lb_leaves_out(channel, key) && !lb_shelf_switch(i->shelf, (int)lb_value(i, LB_BASS), key);
}

/* --- naming notes --- */

int lb_is_named(lb_named named, lb_named note) {
    return (named.port < 0 || note.port < 0 || named.port == note.port) &&
           (named.channel < 0 || named.channel == note.channel) && (named.key < 0 || named.key == note.key) &&
           (named.id < 0 || named.id == note.id || (note.id == ANY && named.key >= 0));
}

/* Writes the named notes into `found` and returns their number: those held, or, if a key or an id is given and none is
   held, the released ones. */
static int find(const lb_instance *i, lb_named named, int16_t found[LB_NOTES]) {
    const int low = named.key < 0 ? 0 : named.key, high = named.key < 0 ? LB_KEYS : named.key + 1;
    const int last_state = named.key < 0 && named.id < 0 ? HELD : LET_GO;
    int count = 0;
    for (int state = HELD; !count && high <= LB_KEYS && state >= last_state; state--)
        for (int channel = 0; channel < LB_CHANNELS; channel++)
            for (int key = low; key < high; key++) {
                const lb_note *note = &i->audio.notes[channel * LB_KEYS + key];
                const lb_named its = {note->port, channel, key, note->id};
                if (note->state == state && lb_is_named(named, its)) found[count++] = (int16_t)(channel * LB_KEYS + key);
            }
    return count;
}

/* --- notes begin and end --- */

/* Replaces the note of its channel and key. A released note loses its id to a new one. */
static void begin(lb_instance *i, lb_named note) {
    lb_note *all = i->audio.notes, *at = &all[note.channel * LB_KEYS + note.key];
    for (int n = 0; n < LB_NOTES && note.id >= 0; n++)
        if (all[n].state != HELD && all[n].id == note.id) all[n].id = ANY;
    if (note.id < 0) note.id = at->state == HELD && at->id != ANY ? NONE : ANY;
    *at = (lb_note){.id = note.id, .port = (int16_t)note.port, .state = HELD};
}

static void let_go(lb_instance *i, int n) {
    if (i->audio.notes[n].state == HELD) i->audio.notes[n].state = LET_GO;
}

void lb_start_note(lb_instance *i, int64_t offset, lb_named note, double velocity) {
    LB_ALONE(i->audio.owner);
    if (!is_channel(note.channel)) note.channel = 0;
    if (note.key < 0 || note.key >= LB_KEYS || lb_is_left_out(i, note.channel, note.key)) return;
    begin(i, note);
    const int seven = (int)fmin(fmax(rint(127 * velocity), 1), 127); /* 0 would end it: in hosts it is the softest note */
    send(i, offset, NOTE_ON | note.channel, note.key, seven);
    retune(i, offset, note.channel * LB_KEYS + note.key);
}

/* Releases a held note. A second note-off would end another channel's note of the key. */
static void release(lb_instance *i, int64_t offset, int n, double velocity) {
    if (i->audio.notes[n].state != HELD) return;
    let_go(i, n);
    send(i, offset, NOTE_OFF | n / LB_KEYS, n % LB_KEYS, (int)lrint(fmin(fmax(velocity, 0), 1) * 127));
}

/* Sends a channel mode message to a channel, or to all channels. */
static void end_all(lb_instance *i, int64_t offset, int channel, int mode) {
    for (int n = 0; n < LB_NOTES; n++)
        if (!is_channel(channel) || n / LB_KEYS == channel) let_go(i, n);
    if (is_channel(channel)) send(i, offset, MODE | channel, mode, 0);
    else lb_send_everywhere(i->synth, offset, mode, 0);
}

void lb_stop_note(lb_instance *i, int64_t offset, lb_named named, double velocity) {
    LB_ALONE(i->audio.owner);
    int16_t found[LB_NOTES];
    if (named.key < 0 && named.id < 0) end_all(i, offset, named.channel, ALL_NOTES_OFF);
    else
        for (int k = 0, count = find(i, named, found); k < count; k++) release(i, offset, found[k], velocity);
}

void lb_choke_note(lb_instance *i, int64_t offset, lb_named named) {
    LB_ALONE(i->audio.owner);
    int16_t found[LB_NOTES];
    if (named.key < 0 && named.id < 0) {
        end_all(i, offset, named.channel, ALL_SOUND_OFF);
        return;
    }
    for (int k = 0, count = find(i, named, found); k < count; k++) {
        release(i, offset, found[k], 0.5); /* it may be a switch key */
        lb_cut_note(i->synth, offset, found[k] / LB_KEYS, found[k] % LB_KEYS);
    }
}

void lb_express(lb_instance *i, int64_t offset, lb_named named, int what, double amount) {
    LB_ALONE(i->audio.owner);
    int16_t found[LB_NOTES];
    for (int k = 0, count = find(i, named, found); k < count; k++) express(i, offset, found[k], what, amount);
}

void lb_express_place(lb_instance *i, int64_t offset, lb_named named, double brightness) {
    LB_ALONE(i->audio.owner);
    int16_t found[LB_NOTES];
    const int count = find(i, named, found);
    for (int k = 0; k < count; k++) lb_place_note(i->synth, offset, found[k] % LB_KEYS, 1 - 2 * brightness);
    named.id = -1; /* another note of the key keeps its place */
    if (!count && named.key >= 0 && !find(i, named, found)) lb_place_note(i->synth, offset, named.key, 1 - 2 * brightness);
}

void lb_take_midi(lb_instance *i, int64_t offset, const uint8_t *bytes, size_t count) {
    LB_ALONE(i->audio.owner);
    const int kind = count ? bytes[0] & 0xF0 : 0, short_one = kind == PROGRAM || kind == PRESSURE;
    if (count < (short_one ? 2 : 3) || bytes[1] > 127 || (!short_one && bytes[2] > 127)) return; /* cut short, or none */
    if (lb_take_learned(i, offset, bytes, count)) return;
    const int channel = bytes[0] & 0x0F, first = bytes[1], starts = kind == NOTE_ON && bytes[2];
    if (starts && lb_is_left_out(i, channel, first)) return;
    if (starts) begin(i, (lb_named){-1, channel, first, -1});
    else if (kind == NOTE_ON || kind == NOTE_OFF) let_go(i, channel * LB_KEYS + first);
    for (int key = 0; kind == MODE && (first == ALL_SOUND_OFF || first >= ALL_NOTES_OFF) && key < LB_KEYS; key++)
        let_go(i, channel * LB_KEYS + key);
    lb_send(i->synth, offset, bytes, count);
    if (starts) retune(i, offset, channel * LB_KEYS + first);
}
