/* Impulse responses of cabinets and rooms, and the instance's. */
#include "instance/response.h"
#include "system/lock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC "LBIMPULS"
#define ENDING ".wav"
#define LEAD 1e-3 /* of the loudest sample of all channels: the first channel as loud is played */
enum { LONGEST_FILE = 60 /* s */, MAX_FILE = 64 << 20 /* bytes */, MAX_LOUD = 100 /* of full scale */ };
enum { WHOLE = 1, REAL = 3, EXTENSIBLE = 0xFFFE }; /* a WAV file's kinds of samples */

/* --- as kept --- */

static size_t kept_size(int64_t count) { return sizeof(lb_response_head) + ((size_t)count * 4 + 7) / 8 * 8 + 8; }

static uint64_t checksum(const lb_kernels *kernels, const void *bytes, size_t count) {
    return kernels->checksum((int64_t)(intptr_t)bytes, (int64_t)(count / 8));
}

static const float *samples_of(const lb_response *r) { return (const float *)(r->kept + 1); }

/* Makes the samples to play: without silence before and behind, as loud as without a response. */
static int fill_played(lb_response *r, const lb_kernels *kernels) {
    const int64_t count = r->kept->count;
    r->played = malloc((size_t)count * sizeof *r->played);
    if (!r->played) return 0;
    for (int64_t k = 0; k < count; k++) r->played[k] = samples_of(r)[k];
    r->count = kernels->cut_response((int64_t)(intptr_t)r->played, count, r->kept->rate, 1);
    return r->count > 0;
}

static lb_response *new_response(size_t size) {
    lb_response *r = calloc(1, sizeof *r + size);
    if (r) r->users = 1;
    if (r) r->size = size;
    return r;
}

lb_response *lb_name_response(const char *name) {
    lb_response *r = new_response(sizeof(lb_response_head));
    if (r) snprintf(r->kept->name, sizeof r->kept->name, "%s", name);
    return r;
}

void lb_free_response(lb_response *r) {
    if (!r || __atomic_sub_fetch(&r->users, 1, __ATOMIC_ACQ_REL)) return;
    free(r->played);
    free(r);
}

/* True for a character that a name may have: it becomes a file's, and stands in the text of a sound. */
static int is_plain(char c) { return (unsigned char)c >= ' ' && c != 127 && !strchr("/\\:\"", c); }

static int is_name(const char *name) {
    while (is_plain(*name)) name++;
    return !*name;
}

static int is_good(const lb_response_head *h, size_t size) {
    if (size < sizeof *h || memcmp(h->magic, MAGIC, sizeof h->magic)) return 0;
    if (!(h->rate >= LB_MIN_RATE && h->rate <= LB_MAX_RATE)) return 0;
    if (h->count < 1 || (double)h->count > LB_LONGEST * h->rate || size != kept_size(h->count)) return 0;
    if (!memchr(h->name, 0, sizeof h->name) || !is_name(h->name)) return 0;
    const float *samples = (const float *)(h + 1);
    for (int64_t k = 0; k < h->count; k++)
        if (!(fabsf(samples[k]) <= MAX_LOUD)) return 0;
    return 1;
}

const char *lb_parse_response(const void *bytes, size_t count, const lb_kernels *kernels, lb_response **to) {
    *to = 0;
    if (count > LB_KEPT_RESPONSE) return "is damaged";
    lb_response *r = new_response(count);
    if (!r) return "has no memory";
    memcpy(r->kept, bytes, count);
    if (is_good(r->kept, count)) {
        memcpy(&r->sum, (const char *)r->kept + count - sizeof r->sum, sizeof r->sum);
        if (r->sum == checksum(kernels, r->kept, count - sizeof r->sum) && fill_played(r, kernels)) {
            *to = r;
            return 0;
        }
    }
    lb_free_response(r);
    return "is damaged";
}

/* --- WAV files --- */

typedef struct {
    const uint8_t *data;
    int64_t frames;
    int kind, channels, bytes; /* bytes: of a sample */
    double rate;
} wave;

static uint32_t word(const uint8_t *at, int bytes) {
    uint32_t value = 0;
    for (int k = bytes - 1; k >= 0; k--) value = value << 8 | at[k];
    return value;
}

static double sample_at(const wave *w, int64_t frame, int channel) {
    const uint8_t *at = w->data + (frame * w->channels + channel) * w->bytes;
    if (w->kind == REAL && w->bytes == 8) {
        double value;
        memcpy(&value, at, sizeof value);
        return value;
    }
    const uint32_t bits = word(at, w->bytes);
    if (w->kind == REAL) {
        float value;
        memcpy(&value, &bits, sizeof value);
        return value;
    }
    if (w->bytes == 1) return ((double)bits - 128) / 128;
    return (int32_t)(bits << (32 - 8 * w->bytes)) / 2147483648.0;
}

/* Finds format and samples in a file's bytes; returns 0 if they are not those of a WAV file that is known here. */
static int parse_wave(const uint8_t *bytes, size_t size, wave *w) {
    if (size < 12 || memcmp(bytes, "RIFF", 4) || memcmp(bytes + 8, "WAVE", 4)) return 0;
    for (size_t at = 12; at + 8 <= size;) {
        const size_t room = size - at - 8, length = word(bytes + at + 4, 4), count = length < room ? length : room;
        const uint8_t *part = bytes + at + 8;
        if (!memcmp(bytes + at, "fmt ", 4) && count >= 16) {
            w->kind = (int)word(part, 2);
            if (w->kind == EXTENSIBLE && count >= 26) w->kind = (int)word(part + 24, 2);
            w->channels = (int)word(part + 2, 2);
            w->rate = word(part + 4, 4);
            w->bytes = (int)word(part + 14, 2) / 8;
        } else if (!memcmp(bytes + at, "data", 4)) {
            const int known = w->kind == WHOLE ? w->bytes >= 1 && w->bytes <= 4 : w->kind == REAL && (w->bytes == 4 || w->bytes == 8);
            if (!known || w->channels < 1) return 0;
            w->data = part;
            w->frames = (int64_t)count / ((int64_t)w->channels * w->bytes);
            return w->frames > 0;
        }
        at += 8 + count + (count & 1);
    }
    return 0;
}

/* The first channel that is not silent beside the loudest; writes its loudest sample. */
static int channel_of(const wave *w, double *loudest) {
    double all = 0;
    for (int64_t k = 0; k < w->frames; k++)
        for (int c = 0; c < w->channels; c++) all = fmax(all, fabs(sample_at(w, k, c)));
    for (int c = 0; c < w->channels; c++) {
        *loudest = 0;
        for (int64_t k = 0; k < w->frames; k++) *loudest = fmax(*loudest, fabs(sample_at(w, k, c)));
        if (*loudest >= LEAD * all) return c;
    }
    return 0;
}

/* Makes a response of a channel's samples; returns the fault. */
static const char *make(const wave *w, const char *name, const lb_kernels *kernels, lb_response **to) {
    double loudest = 0, *samples = malloc((size_t)w->frames * sizeof *samples);
    const int channel = channel_of(w, &loudest);
    const char *why = !samples ? "has no memory" : !(loudest <= MAX_LOUD) ? "is too loud" : 0;
    lb_response *r = 0;
    if (!why) {
        for (int64_t k = 0; k < w->frames; k++) samples[k] = sample_at(w, k, channel);
        const int64_t count = kernels->cut_response((int64_t)(intptr_t)samples, w->frames, w->rate, 0);
        if (count < 1) why = "is silent";
        else if ((double)count > LB_LONGEST * w->rate) why = "lasts longer than 1 s";
        else if (!(r = new_response(kept_size(count)))) why = "has no memory";
        else {
            memcpy(r->kept->magic, MAGIC, sizeof r->kept->magic);
            r->kept->rate = w->rate;
            r->kept->count = count;
            snprintf(r->kept->name, sizeof r->kept->name, "%s", name);
            for (char *c = r->kept->name; *c; c++) *c = is_plain(*c) ? *c : '_';
            float *kept = (float *)(r->kept + 1);
            for (int64_t k = 0; k < count; k++) kept[k] = (float)samples[k];
            const uint64_t sum = checksum(kernels, r->kept, r->size - sizeof sum);
            memcpy((char *)r->kept + r->size - sizeof sum, &sum, sizeof sum);
            why = lb_parse_response(r->kept, r->size, kernels, to);
        }
    }
    lb_free_response(r);
    free(samples);
    return why;
}

const char *lb_read_response(const char *path, const lb_kernels *kernels, lb_response **to) {
    char name[LB_STATE_NAME];
    FILE *in = lb_open_file(path, "rb");
    uint8_t *bytes = in ? malloc(MAX_FILE + 1) : 0;
    const size_t size = bytes ? fread(bytes, 1, MAX_FILE + 1, in) : 0;
    wave w = {0};
    *to = 0;
    if (in) fclose(in);
    const char *why = !size ? "cannot be read" : !parse_wave(bytes, size, &w) ? "is not a WAV file" : 0;
    if (!why && !(w.rate >= LB_MIN_RATE && w.rate <= LB_MAX_RATE)) why = "must have a rate from 8 to 192 kHz";
    if (!why && (size > MAX_FILE || (double)w.frames > LONGEST_FILE * w.rate)) why = "lasts longer than 1 s";
    snprintf(name, sizeof name, "%s", lb_file_name(path));
    char *dot = strrchr(name, '.');
    if (dot) *dot = 0;
    if (!why) why = make(&w, name, kernels, to);
    if (!why) snprintf((*to)->path, LB_PATH, "%s", path);
    free(bytes);
    return why;
}

static int folder_of(char folder[LB_PATH]) {
    char users[LB_PATH];
    return lb_users_folder(users) && snprintf(folder, LB_PATH, "%s/" LB_RESPONSES, users) < LB_PATH;
}

int lb_response_path(const char *name, char path[LB_PATH]) {
    char folder[LB_PATH];
    return folder_of(folder) && snprintf(path, LB_PATH, "%s/%s" ENDING, folder, name) < LB_PATH;
}

typedef struct {
    char (*names)[LB_FILE_NAME];
    int count;
} list;

static void add_name(void *to, const char *folder, const char *name) {
    list *l = to;
    (void)folder;
    if (l->count < LB_MAX_RESPONSES) strcpy(l->names[l->count++], name);
}

static int by_name(const void *a, const void *b) { return strcmp(a, b); }

int lb_list_responses(char names[LB_MAX_RESPONSES][LB_FILE_NAME]) {
    char folder[LB_PATH];
    list l = {names, 0};
    if (folder_of(folder)) lb_each_file(folder, ENDING, add_name, &l);
    qsort(names, (size_t)l.count, sizeof *names, by_name);
    return l.count;
}

int lb_write_response(const lb_response *r, const lb_kernels *kernels, char name[LB_FILE_NAME]) {
    static const uint8_t form[44] = {'R', 'I', 'F', 'F', 0, 0, 0, 0, 'W', 'A', 'V', 'E', 'f', 'm', 't', ' ', 16, 0, 0, 0,
                                     REAL, 0, 1, 0, [36] = 'd', 'a', 't', 'a'};
    char folder[LB_PATH], path[LB_PATH];
    lb_response *there;
    snprintf(name, LB_FILE_NAME, "%s", r->kept->name);
    if (!folder_of(folder) || !lb_response_path(name, path)) return 0;
    const char *why = lb_read_response(path, kernels, &there);
    const int same = !why && (there->sum == r->sum || !r->kept->count);
    lb_free_response(there);
    if (same || !r->kept->count) return same;
    const uint32_t data = (uint32_t)r->kept->count * 4, rate = (uint32_t)r->kept->rate, whole = data + 36;
    uint8_t *bytes = malloc(data + sizeof form);
    if (!bytes) return 0;
    const uint32_t numbers[] = {rate, 4 * rate, 4 | 32 << 16};
    memcpy(bytes, form, sizeof form);
    memcpy(bytes + 4, &whole, 4);
    memcpy(bytes + 24, numbers, sizeof numbers);
    memcpy(bytes + 40, &data, 4);
    memcpy(bytes + sizeof form, samples_of(r), data);
    enter(); /* one at a time per process */
    const int good = lb_write_numbered(folder, r->kept->name, ENDING, bytes, data + sizeof form, 0, name);
    leave();
    free(bytes);
    return good;
}

/* --- the instance's --- */

void lb_hold_response(lb_response *r) {
    if (r) __atomic_add_fetch(&r->users, 1, __ATOMIC_RELAXED);
}

lb_response *lb_use_response(lb_instance *i) {
    enter();
    lb_response *r = i->response;
    lb_hold_response(r);
    leave();
    return r;
}

int lb_same_response(const lb_response *a, const lb_response *b) {
    return a == b || (a && b && a->sum == b->sum && !strcmp(a->kept->name, b->kept->name));
}

void lb_set_response(lb_instance *i, lb_response *r) {
    enter();
    lb_response *old = i->response;
    i->response = r;
    __atomic_store_n(&i->response_sum, r ? r->sum : 0, __ATOMIC_RELEASE);
    __atomic_add_fetch(&i->responses, 1, __ATOMIC_RELEASE);
    leave();
    lb_free_response(old);
}

void lb_response_title(lb_instance *i, char *text, size_t room) {
    lb_response *r = lb_use_response(i);
    snprintf(text, room, "%s", r ? r->kept->name : "none");
    lb_free_response(r);
}
