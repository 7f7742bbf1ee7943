/* Reads MIDI files by the kernels. */
#include "instance/score.h"
#include "instance/names.h"
#include "instance/text.h"
#include "system/thread.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ADDRESS(x) ((int64_t)(intptr_t)(x))
#define AT(kind, address) ((const kind *)(intptr_t)(address))
#define NO_MEMORY "there is no memory for it"
enum { MAX_SAID = 3 /* parts */, PART_TEXT = 400 };

/* Memory that lasts as long as the score, as zeros; 0: there is none. */
static int64_t memory(lb_score *s, int64_t bytes) {
    LB_MAY_WAIT();
    void *made = calloc(1, (size_t)bytes + 8);
    s->memory[s->blocks++] = made;
    return ADDRESS(made);
}

void lb_free_score(lb_score *s) {
    LB_MAY_WAIT();
    while (s->blocks) free(s->memory[--s->blocks]);
}

/* --- sentences --- */

/* Writes a sentence of the table with its numbers, or with words in their place. */
static size_t add_sentence(char *line, size_t room, size_t end, const char *form, const int64_t *numbers,
                           const char *words) {
    for (; *form; form++) {
        if (*form != '{') {
            end = lb_append(line, room, end, "%c", *form);
            continue;
        }
        const char *close = strchr(form, '}');
        const long long number = words ? 0 : numbers[form[1] - '0'];
        if (words) end = lb_append(line, room, end, "%s", words);
        else end = lb_append(line, room, end, form[2] == '}' ? "%lld" : form[3] == '+' ? "%+lld" : "%02llX", number);
        form = close;
    }
    return end;
}

/* The sentence of a code, for one or several. */
static const char *sentence(int64_t code, int several) {
    const lb_sentence *s = lb_sentences;
    while (s < lb_sentences + LB_SENTENCES && s->code != code) s++;
    return s == lb_sentences + LB_SENTENCES ? "" : several && s->several ? s->several : s->one;
}

/* --- names --- */

typedef struct { /* a track's, or one of its channels' */
    lb_name title, instrument;
} called;

/* True for the name of a track, its instrument or its channel. */
static int is_name(const LB_TEXT *t) { return t->kind == LB_META_TRACK_NAME || t->kind == LB_META_INSTRUMENT; }

static void read_text(const lb_score *s, const LB_TEXT *t, lb_name *to) {
    lb_read_name(to, AT(uint8_t, s->smf.data) + t->at, (size_t)t->size);
}

/* Reads the names of a track, channel -1, or the last one, as the title, of its channel; they may be empty. */
static void read_called(const lb_score *s, int64_t track, int64_t channel, called *to) {
    const LB_TEXT *texts = AT(LB_TEXT, s->smf.rows[LB_TEXTS]);
    to->title.count = to->instrument.count = 0;
    for (int64_t k = 0; k < s->smf.count[LB_TEXTS]; k++) {
        const LB_TEXT *t = &texts[k];
        if (t->track == track && t->channel == channel && is_name(t))
            read_text(s, t, channel < 0 && t->kind == LB_META_INSTRUMENT ? &to->instrument : &to->title);
    }
}

static const lb_name *name_of(const called *c) { return c->title.count ? &c->title : &c->instrument; }

static int is_bass(const lb_name *n) { return lb_name_has(n, lb_bass_words) && !lb_name_has(n, lb_other_words); }

static int says(const lb_name *n) {
    return LB_IS_BASS * is_bass(n) | LB_IS_OTHER * lb_name_has(n, lb_other_words) |
           LB_IS_DRUMS * lb_name_has(n, lb_drum_words);
}

/* Fills the kernels' table of names from the texts, which are in the order of tracks; returns 0 for a chart of a
   game. */
static int fill_names(const lb_score *s, uint8_t *table) {
    const LB_TEXT *t = AT(LB_TEXT, s->smf.rows[LB_TEXTS]), *end = t + s->smf.count[LB_TEXTS];
    int games = 0;
    for (int64_t track = 0; track < s->smf.file.tracks; track++, table += LB_NAMES) {
        called c = {0};
        for (; t < end && t->track == track; t++) {
            lb_name name;
            if (!is_name(t)) continue;
            read_text(s, t, &name);
            if (t->channel >= 0) table[t->channel] = (uint8_t)(name.count ? says(&name) | LB_NAMED : 0);
            else *(t->kind == LB_META_INSTRUMENT ? &c.instrument : &c.title) = name;
        }
        table[LB_TRACK_NAME] = (uint8_t)(says(name_of(&c)) | LB_BASS_INSTRUMENT * is_bass(&c.instrument));
        games += lb_name_is(name_of(&c), lb_game_track);
    }
    return games < LB_MIN_GAME;
}

/* True if a text at the beginning marks a take of livebass. */
static int is_take(const lb_score *s) {
    for (int64_t k = 0; k < s->smf.count[LB_TEXTS]; k++) {
        const LB_TEXT *t = &AT(LB_TEXT, s->smf.rows[LB_TEXTS])[k];
        char text[LB_NAME_BYTES];
        lb_name name;
        if (t->kind != LB_META_TEXT) continue;
        read_text(s, t, &name);
        lb_write_name(&name, text);
        if (!strcmp(text, LB_TAKE)) return 1;
    }
    return 0;
}

/* --- reading --- */

/* Finds the file's rows, and what its names say; returns 0 after writing the fault. */
static int read_rows(lb_score *s, char *why, size_t room) {
    const int64_t error = s->kernels->measure_smf(ADDRESS(&s->smf));
    if (error) {
        add_sentence(why, room, 0, sentence(-error, 0), s->smf.file.numbers, 0);
        return 0;
    }
    s->smf.memory = memory(s, s->smf.room);
    if (s->smf.memory) s->kernels->fill_smf(ADDRESS(&s->smf));
    const int64_t names = s->smf.memory ? memory(s, s->smf.file.tracks * LB_NAMES) : 0;
    if (!names) {
        lb_append(why, room, 0, NO_MEMORY);
        return 0;
    }
    if (!fill_names(s, (uint8_t *)(intptr_t)names)) {
        lb_append(why, room, 0, LB_GAME_REFUSAL);
        return 0;
    }
    s->score.names = names;
    return 1;
}

/* Finds lines, parts and notes, and chooses; returns 0 after writing the fault. */
static int choose(lb_score *s, char *why, size_t room) {
    LB_SCORE *score = &s->score;
    if (!(score->memory = memory(s, s->kernels->measure_lines(ADDRESS(score))))) {
        lb_append(why, room, 0, NO_MEMORY);
        return 0;
    }
    const int64_t error = s->kernels->read_lines(ADDRESS(score));
    if (error) {
        const long tenths = lrint((double)score->last / (double)score->rate / 360);
        if (error != LB_TOO_LONG) lb_append(why, room, 0, LB_TOO_MUCH);
        else lb_append(why, room, 0, "lasts %ld.%ld hours, more than %d", tenths / 10, tenths % 10, LB_MAX_HOURS);
        return 0;
    }
    if (!(score->more = memory(s, score->more_bytes))) {
        lb_append(why, room, 0, NO_MEMORY);
        return 0;
    }
    s->kernels->read_parts_of(ADDRESS(score));
    if (s->kernels->choose_notes(ADDRESS(score), LB_AUTO, 0) > 0) return 1;
    lb_append(why, room, 0, score->parts_count ? "no bass notes: " LB_NO_BASS : "has no notes");
    return 0;
}

int lb_read_score(lb_score *s, const uint8_t *bytes, size_t count, int rate, const lb_kernels *kernels, char *why,
                  size_t room) {
    memset(s, 0, sizeof *s);
    s->kernels = kernels;
    s->smf.data = ADDRESS(bytes);
    s->smf.size = (int64_t)count;
    if (!read_rows(s, why, room)) return 0;
    s->score.file = ADDRESS(&s->smf.file);
    s->score.messages = s->smf.rows[LB_MESSAGES];
    s->score.tempos = s->smf.rows[LB_TEMPOS];
    s->score.exclusives = s->smf.rows[LB_EXCLUSIVES];
    s->score.data = s->smf.data;
    s->score.rate = rate;
    s->score.take = is_take(s);
    return choose(s, why, room);
}

int lb_fit_score(lb_score *s, const lb_keys *keys) {
    if (s->score.take) return 1;
    LB_FITTING *f = (LB_FITTING *)(intptr_t)memory(s, sizeof *f);
    const int64_t room = f ? memory(s, (int64_t)LB_FITTING_WORDS * 8 * s->score.notes) : 0;
    if (!room) return 0;
    const LB_PLAYED *played = AT(LB_PLAYED, s->score.played);
    f->rows = s->score.played;
    f->count = s->score.played_count;
    f->end = played[f->count - 1].frame;
    f->rate = s->score.rate;
    f->lowest = keys->lowest;
    f->highest = keys->highest;
    f->switches = ADDRESS(keys->switches);
    f->memory = room;
    s->score.played_count = s->kernels->leave_switches(ADDRESS(f));
    s->left_out = f->left_out;
    s->raised = s->kernels->raise_notes(ADDRESS(f));
    return 1;
}

/* --- describing --- */

static LB_LISTED listed(const lb_score *s, int64_t number) {
    LB_LISTED part = {0};
    s->kernels->describe_part(ADDRESS(&s->score), number, 0, ADDRESS(&part));
    return part;
}

/* Reads the name of a part: its channel's, if the file names channels, or its track's; and its track's instrument. */
static lb_name read_part_name(const lb_score *s, const LB_LISTED *part, lb_name *instrument) {
    called of_channel, of_track;
    read_called(s, part->track, part->channel, &of_channel);
    read_called(s, part->track, -1, &of_track);
    *instrument = of_track.instrument;
    return of_channel.title.count ? of_channel.title : *name_of(&of_track);
}

static void write_part_name(const lb_score *s, const LB_LISTED *part, char text[LB_NAME_BYTES]) {
    lb_name instrument;
    const lb_name name = read_part_name(s, part, &instrument);
    lb_write_name(&name, text);
}

/* Adds a comma and a number of things. */
static size_t add_count(char *line, size_t room, size_t end, int64_t count, const char *one, const char *several) {
    return lb_append(line, room, end, ", %lld %s", (long long)count, count == 1 ? one : several);
}

void lb_describe_part(const lb_score *s, int64_t number, char *text, size_t room) {
    const LB_LISTED part = listed(s, number);
    char name[LB_NAME_BYTES];
    size_t end = 0;
    write_part_name(s, &part, name);
    if (part.port > 0) end = lb_append(text, room, end, "port %d ", (int)part.port + 1);
    end = lb_append(text, room, end, "channel %d", (int)part.channel + 1);
    if (*name) end = lb_append(text, room, end, " \"%s\"", name);
    end = lb_append(text, room, end, part.drums ? " (drums" : part.programs ? " (program" : " (no program");
    for (int64_t k = 0; !part.drums && k < part.programs; k++)
        end = lb_append(text, room, end, " %d", part.program[k] + 1);
    end = add_count(text, room, end, part.notes, "note, ", "notes, ");
    end = lb_append(text, room, end, "%s", lb_note_names[part.lowest]);
    if (part.highest != part.lowest) end = lb_append(text, room, end, " to %s", lb_note_names[part.highest]);
    lb_append(text, room, end, ")");
}

/* Adds the chosen parts, and how many are left out. */
static size_t add_parts(const lb_score *s, char *line, size_t room, size_t end) {
    int chosen = 0, others = 0;
    for (int64_t k = 0; k < s->score.parts_count; k++) {
        const LB_LISTED part = listed(s, k);
        char name[LB_NAME_BYTES];
        others += !part.chosen;
        if (!part.chosen || ++chosen > MAX_SAID) continue;
        write_part_name(s, &part, name);
        end = lb_append(line, room, end, chosen == 1 ? "plays track %d" : ", track %d", (int)part.track + 1);
        if (*name) end = lb_append(line, room, end, " called %s", name);
        else end = lb_append(line, room, end, " (channel %d)", (int)part.channel + 1);
        end = add_count(line, room, end, part.chosen, "note", "notes");
    }
    if (chosen > MAX_SAID) end = lb_append(line, room, end, " and %d more", chosen - MAX_SAID);
    if (others) end = lb_append(line, room, end, "; left out %d other part%s", others, others == 1 ? "" : "s");
    return end;
}

/* Adds the names of the parts that are called bass: the first of them, each once. */
static size_t add_called(const lb_score *s, const LB_REMARK *remarks, char *line, size_t room, size_t end) {
    char names[PART_TEXT] = "";
    int count = 0;
    for (int64_t k = 0; k < s->score.remarks_count && strlen(names) < sizeof names - LB_NAME_BYTES - 4; k++) {
        char name[LB_NAME_BYTES + 2], text[LB_NAME_BYTES];
        lb_name instrument;
        if (remarks[k].code != LB_REMARK_CALLED) continue;
        const LB_LISTED part = listed(s, remarks[k].numbers[0]);
        const lb_name own = read_part_name(s, &part, &instrument);
        lb_write_name(!is_bass(&own) && is_bass(&instrument) ? &instrument : &own, text);
        lb_append(name, sizeof name, 0, "\"%s\"", text);
        if (strstr(names, name)) continue;
        lb_append(names, sizeof names, strlen(names), count++ ? ", %s" : "%s", name);
    }
    return add_sentence(line, room, end, sentence(LB_REMARK_CALLED, count > 1), 0, names);
}

/* Adds a remark about the choice or the file. */
static size_t add_remark(const lb_score *s, const LB_REMARK *r, char *line, size_t room, size_t end) {
    char part[PART_TEXT];
    int64_t numbers[6];
    const int shown = r->code == LB_REMARK_ONLY_PART || r->code == LB_REMARK_LOWEST_PART;
    if (shown) lb_describe_part(s, r->numbers[0], part, sizeof part);
    for (int k = 0; k < 6; k++) numbers[k] = r->numbers[k] + (r->code == LB_REMARK_DOUBLES);
    return add_sentence(line, room, end, sentence(r->code, r->numbers[0] > 1), numbers, shown ? part : 0);
}

void lb_describe_score(const lb_score *s, char *line, size_t room) {
    const LB_REMARK *of_file = AT(LB_REMARK, s->smf.rows[LB_REMARKS]), *of_choice = AT(LB_REMARK, s->score.remarks);
    int named = 0;
    size_t end = 0;
    if (!s->score.take) end = add_parts(s, line, room, end);
    else end = add_count(line, room, lb_append(line, room, end, "plays a take of livebass"), s->score.notes, "note", "notes");
    if (s->left_out)
        end = add_count(line, room, end, s->left_out, "key switch of another instrument left out",
                        "key switches of another instrument left out");
    if (s->raised) end = add_count(line, room, end, s->raised, "low note moved up by octaves", "low notes moved up by octaves");
    for (int64_t k = 0; k < s->smf.count[LB_REMARKS]; k++)
        end = add_remark(s, &of_file[k], line, room, lb_append(line, room, end, "; "));
    for (int64_t k = 0; k < s->score.remarks_count; k++) {
        if (of_choice[k].code == LB_REMARK_CALLED && named++) continue;
        end = lb_append(line, room, end, "; ");
        if (of_choice[k].code == LB_REMARK_CALLED) end = add_called(s, of_choice, line, room, end);
        else end = add_remark(s, &of_choice[k], line, room, end);
    }
}
