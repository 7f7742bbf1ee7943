/* The page as the plugin's editor: messages in, messages out. */
#include "page.h"
#include "files.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FILE_NAME "livebass.html"
enum { WORDS = 5, NAMES = 1 << 16 };

size_t lb_page_address(const char *folder, char *to, size_t room) {
    static const char *const plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~/:";
    char path[4096 + sizeof FILE_NAME];
    if (snprintf(path, sizeof path, "%.4094s/" FILE_NAME, folder) >= (int)sizeof path) return 0;
    FILE *page = lb_open_file(path, "rb");
    if (!page) return 0;
    fclose(page);
    size_t n = 0;
    const char *const head = path[0] == '/' ? "file://" : "file:///"; /* drives of Windows have no slash before them */
    for (const char *c = head; *c; c++, n++)
        if (n < room) to[n] = *c;
    for (const char *c = path; *c; c++) {
#ifdef _WIN32
        char one[4] = {*c == '\\' ? '/' : *c, 0};
#else
        char one[4] = {*c, 0};
#endif
        if (!strchr(plain, one[0])) snprintf(one, sizeof one, "%%%02X", (unsigned char)*c);
        for (const char *d = one; *d; d++, n++)
            if (n < room) to[n] = *d;
    }
    if (room) to[n < room ? n : room - 1] = 0;
    return n + 1;
}

/* Sends the names of all basses. */
static void send_basses(const lb_instance *i, void (*send)(void *, const void *, size_t), void *to) {
    char *text = malloc(NAMES);
    if (!text) return;
    const int64_t kind = LB_PAGE_BASSES;
    memcpy(text, &kind, sizeof kind);
    size_t n = sizeof kind;
    for (int k = 0; k < lb_shelf_count(i->shelf); k++) {
        const int more = snprintf(text + n, NAMES - n, "%s\t%s\n", lb_shelf_name(i->shelf, k), lb_shelf_title(i->shelf, k));
        if (more < 0 || (size_t)more >= NAMES - n) break;
        n += (size_t)more;
    }
    send(to, text, n);
    free(text);
}

/* Sends what is to be seen. */
static void send_seen(const lb_instance *i, void (*send)(void *, const void *, size_t), void *to) {
    static const size_t values = LB_PARAMETERS * sizeof(double), head = 2 * sizeof(int64_t) + sizeof(double);
    char *message = malloc(head + values + sizeof(LB_LOOK));
    if (!message) return;
    const int64_t first[] = {LB_PAGE_SEEN, lb_side(i)};
    memcpy(message, first, sizeof first);
    memcpy(message + sizeof first, &i->rate, sizeof i->rate);
    for (int k = 0; k < LB_PARAMETERS; k++) {
        const double value = lb_value(i, k);
        memcpy(message + head + (size_t)k * sizeof value, &value, sizeof value);
    }
    LB_LOOK *look = (LB_LOOK *)(message + head + values);
    size_t size = head + values;
    if (lb_read_look(&i->look, 0, look))
        size += offsetof(LB_LOOK, string) + (size_t)look->strings * sizeof(LB_STRING_LOOK);
    send(to, message, size);
    free(message);
}

/* True if a number is whole, from `least` to below `end`. */
static int is_whole(double x, int least, int end) { return x >= least && x < end && x == rint(x); }

void lb_open_page(lb_instance *i, lb_page *p) {
    memset(p, 0, sizeof *p);
    lb_watch(&i->look, 1);
}

void lb_close_page(lb_instance *i, lb_page *p) {
    const lb_face face = lb_face_of(i);
    for (int k = 0; k < LB_KEYS; k++)
        if (p->keys[k]) face.note(i, 0, -1, k, 0);
    for (int k = 0; k < LB_PARAMETERS; k++)
        if (p->moved[k]) face.set(i, k, lb_value(i, k), LB_END);
    lb_watch(&i->look, 0);
}

int lb_hear_page(lb_instance *i, lb_page *p, const void *bytes, size_t size,
                 void (*send)(void *to, const void *, size_t), void *to) {
    static const size_t counts[] = {[LB_PAGE_SEE] = 2, [LB_PAGE_MOVE] = 4, [LB_PAGE_NOTE] = 5, [LB_PAGE_UNDO] = 1,
                                    [LB_PAGE_SWAP] = 1};
    double said[WORDS];
    if (size < sizeof *said || size > sizeof said) return 0;
    memcpy(said, bytes, size);
    if (!is_whole(said[0], 0, sizeof counts / sizeof *counts) || size != counts[(int)said[0]] * sizeof *said) return 0;
    const lb_face face = lb_face_of(i);
    switch ((int)said[0]) {
    case LB_PAGE_SEE:
        if (said[1] == 1) send_basses(i, send, to);
        send_seen(i, send, to);
        return 1;
    case LB_PAGE_MOVE:
        if (!is_whole(said[1], 0, LB_PARAMETERS) || !isfinite(said[2]) || !is_whole(said[3], LB_BEGIN, LB_END + 1)) return 0;
        if ((int)said[3] != LB_MOVE) p->moved[(int)said[1]] = (int)said[3] == LB_BEGIN;
        face.set(i, (int)said[1], said[2], (int)said[3]);
        return 1;
    case LB_PAGE_NOTE:
        if (!is_whole(said[2], -1, LB_STRINGS) || !is_whole(said[3], 0, LB_KEYS) || !(said[4] >= 0 && said[4] <= 1)) return 0;
        p->keys[(int)said[3]] = said[1] == 1;
        face.note(i, said[1] == 1, (int)said[2], (int)said[3], said[4]);
        return 1;
    case LB_PAGE_UNDO:
        face.undo(i);
        return 1;
    default:
        face.swap(i);
        return 1;
    }
}
