/* Windows on X11. Compiling and linking need nothing from X11: the first window opens libX11, and the necessary types
   are below. Each window has its own connection, and its own thread, which alone uses it. */
#if !defined(_WIN32) && !defined(__APPLE__)
#include "window/window.h"

#include <dlfcn.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* --- of X11 (X.h, Xlib.h) --- */

typedef unsigned long xid;
typedef struct display display;
typedef struct visual visual;
typedef struct gc *gc;
typedef struct {
    int width, height, xoffset, format;
    char *data;
    int byte_order, bitmap_unit, bitmap_bit_order, bitmap_pad, depth, bytes_per_line, bits_per_pixel;
    unsigned long red_mask, green_mask, blue_mask;
    char *obdata;
    void *functions[6];
} ximage;
typedef struct {
    xid background_pixmap;
    unsigned long background_pixel;
    xid border_pixmap;
    unsigned long border_pixel;
    int bit_gravity, win_gravity, backing_store;
    unsigned long backing_planes, backing_pixel;
    int save_under;
    long event_mask, do_not_propagate_mask;
    int override_redirect;
    xid colormap, cursor;
} xattributes;
typedef struct { /* how every event begins */
    int type;
    unsigned long serial;
    int send_event;
    display *display;
} xhead;
typedef struct { /* of a button, the pointer, and its leaving; of a key, with its number in place of a button's */
    xhead head;
    xid window, root, subwindow;
    unsigned long time;
    int x, y, x_root, y_root;
    unsigned state, button;
    int same_screen;
} xpointer;
typedef struct {
    xhead head;
    xid window;
    int x, y, width, height, count;
} xexpose;
typedef struct { /* of a window's size */
    xhead head;
    xid event, window;
    int x, y, width, height;
} xconfigure;
typedef struct {
    xhead head;
    xid requestor, selection, target, property;
    unsigned long time;
} xselection;
typedef struct {
    xhead head;
    xid window;
    int mode, detail;
} xfocus;
typedef struct { /* a message between windows */
    xhead head;
    xid window, kind;
    int format;
    long data[5];
} xmessage;
typedef union {
    int type;
    xpointer pointer;
    xexpose expose;
    xconfigure configure;
    xselection selection;
    xfocus focus;
    xmessage message;
    long room[24];
} xevent;
typedef int (*handler)(display *, void *event, void *wire);

enum { KEY = 2, PRESS = 4, RELEASE = 5, MOTION = 6, LEAVE = 8, FOCUSED = 9, UNFOCUSED = 10, EXPOSE = 12, DESTROYED = 17, CONFIGURED = 22, SELECTION = 31, MESSAGE = 33 };
enum { INPUT_OUTPUT = 1, Z_PIXMAP = 2, LSB_FIRST = 0, REPLACE = 0 };
enum { BACK_PIXEL = 1 << 1, BORDER_PIXEL = 1 << 3, EVENTS = 1 << 11, COLORMAP = 1 << 13 };
/* Press, release, leave, motion, exposure, structure, focus; and keys, only while the window has the focus: else they
   would be taken from the host while the pointer is over the window. */
enum { WANTED = 1 << 2 | 1 << 3 | 1 << 5 | 1 << 6 | 1 << 15 | 1 << 17 | 1 << 21, KEYS = 1 << 0 };
enum { BY_POINTER = 5 }; /* a focus that the window has only because the pointer is over it */
enum { TO_PARENT = 2 };
enum { ATOM = 4 }; /* the type of a property */
enum { HAND = 60, ACROSS = 108, SHIFT = 1, CONTROL = 4, MOD1 = 8 };

static struct {
    void *library;
    display *(*OpenDisplay)(const char *);
    int (*CloseDisplay)(display *);
    int (*DefaultScreen)(display *);
    visual *(*DefaultVisual)(display *, int);
    int (*DefaultDepth)(display *, int);
    xid (*DefaultColormap)(display *, int);
    xid (*RootWindow)(display *, int);
    char *(*GetDefault)(display *, const char *, const char *);
    xid (*CreateWindow)(display *, xid, int, int, unsigned, unsigned, unsigned, int, unsigned, visual *, unsigned long,
                        xattributes *);
    int (*DestroyWindow)(display *, xid);
    int (*MapWindow)(display *, xid);
    int (*ResizeWindow)(display *, xid, unsigned, unsigned);
    int (*StoreName)(display *, xid, const char *);
    xid (*InternAtom)(display *, const char *, int);
    int (*ChangeProperty)(display *, xid, xid, xid, int, int, const unsigned char *, int);
    gc (*CreateGC)(display *, xid, unsigned long, void *);
    int (*FreeGC)(display *, gc);
    int (*InitImage)(ximage *);
    int (*PutImage)(display *, xid, gc, ximage *, int, int, int, int, unsigned, unsigned);
    int (*Pending)(display *);
    int (*NextEvent)(display *, xevent *);
    int (*Flush)(display *);
    int (*Sync)(display *, int);
    unsigned long (*NextRequest)(display *);
    int (*ConnectionNumber)(display *);
    xid (*CreateFontCursor)(display *, unsigned);
    int (*DefineCursor)(display *, xid, xid);
    int (*UndefineCursor)(display *, xid);
    handler (*ESetWireToError)(display *, int, handler);
    int (*GetGeometry)(display *, xid, xid *, int *, int *, unsigned *, unsigned *, unsigned *, unsigned *);
    int (*ConvertSelection)(display *, xid, xid, xid, xid, unsigned long);
    int (*GetWindowProperty)(display *, xid, xid, long, long, int, xid, xid *, int *, unsigned long *, unsigned long *,
                             unsigned char **);
    int (*Free)(void *);
    int (*SelectInput)(display *, xid, long);
    int (*SetInputFocus)(display *, xid, int, unsigned long);
    int (*GetInputFocus)(display *, xid *, int *);
    int (*LookupString)(xpointer *, char *, int, unsigned long *, void *);
    int (*SendEvent)(display *, xid, int, long, xevent *);
} x;

/* Hosts provide the functions that open libraries. No library is linked for them; without them there is no window. */
extern void *dlopen(const char *, int) __attribute__((weak));
extern void *dlsym(void *, const char *) __attribute__((weak));

/* Finds the functions of libX11, which stays open; returns 0 if there is none. */
static int find_x(void) {
    static const char names[] = /* each after an X; text, not pointers, which take 32 bytes of the binary each */
        "OpenDisplay\0CloseDisplay\0DefaultScreen\0DefaultVisual\0DefaultDepth\0DefaultColormap\0RootWindow\0"
        "GetDefault\0CreateWindow\0DestroyWindow\0MapWindow\0ResizeWindow\0StoreName\0InternAtom\0"
        "ChangeProperty\0CreateGC\0FreeGC\0InitImage\0PutImage\0Pending\0NextEvent\0Flush\0Sync\0NextRequest\0"
        "ConnectionNumber\0CreateFontCursor\0DefineCursor\0UndefineCursor\0ESetWireToError\0GetGeometry\0"
        "ConvertSelection\0GetWindowProperty\0Free\0SelectInput\0SetInputFocus\0GetInputFocus\0LookupString\0"
        "SendEvent\0";
    enum { COUNT = sizeof x / sizeof(void *) - 1 };
    void *found[COUNT];
    if (x.library) return 1;
    void *library = dlopen && dlsym ? dlopen("libX11.so.6", RTLD_NOW | RTLD_LOCAL) : 0;
    int count = 0;
    if (!library) return 0;
    for (const char *at = names; count < COUNT && at < names + sizeof names - 1; at += strlen(at) + 1) {
        char name[32];
        snprintf(name, sizeof name, "X%s", at);
        if (!(found[count++] = dlsym(library, name))) return 0;
    }
    if (count < COUNT) return 0;
    memcpy(&x.OpenDisplay, found, sizeof found);
    x.library = library;
    return 1;
}

/* --- windows --- */

/* Atoms of files that are dragged and dropped, XDND version 5 (freedesktop.org). */
enum { AWARE, ENTER, POSITION, STATUS, DROP, FINISHED, DRAGGED, COPY, FILES, DRAG_ATOMS };

struct lb_window {
    lb_picture *picture;
    display *display;
    xid window, parent, before, cursors[3]; /* before: it had the focus until this window took it, 0: none was taken */
    gc context;
    ximage image;
    uint32_t *pixels;
    int shown, pointer, exposed, x, y; /* the size of `pixels`, as one word; the pointer's shape; its last press, */
    unsigned long pressed, resized;    /* and the time of that, ms; the request that resized the window last */
    xid drag[DRAG_ATOMS], source; /* source: the window that drags files over this one ... */
    int files;                    /* ... and whether it has files */
    pthread_t thread;
    int stop;
    uint64_t wanted; /* size and scale, packed: set by the main thread */
};

/* Catches errors on our connections, such as from a window that the host has destroyed: a host's handler may not know
   them, and would exit. The process's handler stays: it may be another library's. */
static int no_error(display *d, void *event, void *wire) { return 0; }

static void keep_errors(lb_window *w) {
    for (int k = 1; k < 256; k++) x.ESetWireToError(w->display, k, no_error);
}

/* True if this window exists: an invalid parent has none. */
static int exists(display *d, xid window) {
    xid root;
    int at[2];
    unsigned size[4];
    return x.GetGeometry(d, window, &root, &at[0], &at[1], &size[0], &size[1], &size[2], &size[3]);
}

static uint64_t packed(int width, int height, double scale) {
    return (uint64_t)(uint16_t)width << 32 | (uint64_t)(uint16_t)height << 16 | (uint16_t)lrint(scale * 256);
}

/* A monotonic clock, ms. */
static int64_t now_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

/* Allocates pixels for a size; returns 0 without memory. */
static int make_room(lb_window *w, int width, int height) {
    uint32_t *pixels = calloc((size_t)width * (size_t)height, sizeof *pixels);
    if (!pixels) return 0;
    free(w->pixels);
    w->pixels = pixels;
    w->image = (ximage){.width = width, .height = height, .format = Z_PIXMAP, .data = (char *)pixels,
                        .byte_order = LSB_FIRST, .bitmap_unit = 32, .bitmap_bit_order = LSB_FIRST, .bitmap_pad = 32,
                        .depth = w->image.depth, .bytes_per_line = 4 * width, .bits_per_pixel = 32,
                        .red_mask = 0xFF0000, .green_mask = 0xFF00, .blue_mask = 0xFF};
    w->shown = 0;
    return x.InitImage(&w->image);
}

static int modifiers_of(const xpointer *e) {
    return (e->state & SHIFT ? LB_SHIFT : 0) | (e->state & CONTROL ? LB_CONTROL : 0) | (e->state & MOD1 ? LB_ALT : 0);
}

static void point(lb_window *w, const xpointer *e, int kind, int more) {
    const int shape = lb_point(w->picture, kind, e->x, e->y, modifiers_of(e) | more);
    if (shape == w->pointer || shape < 0 || shape > 2) return;
    w->pointer = shape;
    if (w->cursors[shape]) x.DefineCursor(w->display, w->window, w->cursors[shape]);
    else x.UndefineCursor(w->display, w->window);
}

static void press(lb_window *w, const xpointer *e) {
    if (e->button == 4 || e->button == 5) point(w, e, e->button == 4 ? LB_POINT_UP : LB_POINT_DOWN, 0);
    else if (e->button == 3) point(w, e, LB_POINT_PRESS, LB_RIGHT);
    else if (e->button == 1) {
        const int near = abs(e->x - w->x) < 5 && abs(e->y - w->y) < 5, twice = near && e->time - w->pressed < 400;
        point(w, e, twice ? LB_POINT_DOUBLE : LB_POINT_PRESS, 0);
        w->pressed = twice ? 0 : e->time;
        w->x = e->x;
        w->y = e->y;
    }
}

/* The number of a key for lb_key; 0: none. */
static int key_of(xpointer *e) {
    static const int special[][2] = {{0xFF08, LB_KEY_BACK}, {0xFF09, LB_KEY_TAB}, {0xFE20, LB_KEY_TAB},
                                     {0xFF0D, LB_KEY_ENTER}, {0xFF8D, LB_KEY_ENTER}, {0xFF1B, LB_KEY_ESCAPE},
                                     {0xFFFF, LB_KEY_DELETE}, {0xFF51, LB_KEY_LEFT}, {0xFF52, LB_KEY_UP},
                                     {0xFF53, LB_KEY_RIGHT}, {0xFF54, LB_KEY_DOWN}};
    char text[8];
    unsigned long symbol = 0;
    const int count = x.LookupString(e, text, sizeof text, &symbol, 0);
    for (size_t k = 0; k < sizeof special / sizeof *special; k++)
        if (symbol == (unsigned long)special[k][0]) return special[k][1];
    if (symbol >> 24 == 1) return (int)(symbol & 0xFFFFFF);
    return count == 1 && (unsigned char)*text >= ' ' ? (unsigned char)*text : 0;
}

/* Passes a key on: to the picture or, if that does not use it, to the host. */
static void take_key(lb_window *w, xevent *e) {
    const int key = key_of(&e->pointer);
    if ((key && lb_key(w->picture, key, modifiers_of(&e->pointer))) || e->pointer.head.send_event || !w->parent) return;
    e->pointer.window = w->parent;
    x.SendEvent(w->display, w->parent, 1, KEYS, e);
}

/* Takes the keyboard while something is typed, and gives it back. */
static void follow_focus(lb_window *w) {
    const int wanted = lb_wants_keys(w->picture);
    int how;
    if (!w->window || wanted == (w->before != 0)) return;
    if (wanted) {
        x.GetInputFocus(w->display, &w->before, &how);
        x.SetInputFocus(w->display, w->window, TO_PARENT, 0);
        if (!w->before) w->before = w->parent;
    } else {
        x.SetInputFocus(w->display, w->before, TO_PARENT, 0);
        w->before = 0;
    }
    x.Flush(w->display);
}

/* Tells the source of a drag STATUS or FINISHED, and whether its files are taken. */
static void answer(lb_window *w, int what, int taken) {
    const long copy = taken ? (long)w->drag[COPY] : 0;
    xevent e = {.message = {.head = {.type = MESSAGE}, .window = w->source, .kind = w->drag[what], .format = 32,
                            .data = {(long)w->window, taken}}};
    e.message.data[what == STATUS ? 4 : 2] = copy;
    x.SendEvent(w->display, w->source, 0, 0, &e);
    x.Flush(w->display);
}

/* Takes the text that was asked for: dropped files, or the clipboard's. */
static void take_text(lb_window *w, const xselection *e) {
    unsigned char *text = 0; /* Xlib adds a final zero */
    xid type;
    int format;
    unsigned long count, left;
    if (e->property)
        x.GetWindowProperty(w->display, w->window, e->property, 0, LB_MAX_TEXT / 4, 1, 0, &type, &format, &count, &left,
                            &text);
    const char *good = text && format == 8 ? (const char *)text : 0;
    if (e->selection != w->drag[DRAGGED]) lb_paste(w->picture, good);
    else {
        if (good) lb_drop(w->picture, good);
        answer(w, FINISHED, good != 0);
    }
    if (text) x.Free(text);
}

/* Requests a text of another program, which arrives as an event. */
static void ask(lb_window *w, xid selection, xid type, unsigned long time) {
    x.ConvertSelection(w->display, selection, type, x.InternAtom(w->display, "LIVEBASS_TEXT", 0), w->window, time);
    x.Flush(w->display);
}

static void ask_for_text(lb_window *w, unsigned long time) {
    ask(w, x.InternAtom(w->display, "CLIPBOARD", 0), x.InternAtom(w->display, "UTF8_STRING", 0), time);
}

/* Follows a drag over the window, and takes its files when they are dropped. */
static void take_message(lb_window *w, const xmessage *e) {
    const xid *drag = w->drag, source = (xid)e->data[0];
    if (e->kind == drag[ENTER]) { /* its first three types, and whether it has more */
        w->source = source;
        w->files = (int)(e->data[1] & 1);
        for (int k = 2; k < 5; k++) w->files |= (xid)e->data[k] == drag[FILES];
    }
    if (source != w->source) return;
    if (e->kind == drag[POSITION]) answer(w, STATUS, w->files);
    if (e->kind == drag[DROP] && w->files) ask(w, drag[DRAGGED], drag[FILES], (unsigned long)e->data[2]);
    else if (e->kind == drag[DROP]) answer(w, FINISHED, 0);
}

/* Lets files be dropped on the window. */
static void accept_files(lb_window *w) {
    static const char names[] = "XdndAware\0XdndEnter\0XdndPosition\0XdndStatus\0XdndDrop\0XdndFinished\0"
                                "XdndSelection\0XdndActionCopy\0text/uri-list";
    const long version = 5;
    const char *name = names;
    for (int k = 0; k < DRAG_ATOMS; k++, name += strlen(name) + 1) w->drag[k] = x.InternAtom(w->display, name, 0);
    x.ChangeProperty(w->display, w->window, w->drag[AWARE], ATOM, 32, REPLACE, (const unsigned char *)&version, 1);
}

/* Takes the size that a host gave the window itself, as LV2 hosts do, since the last size of our own. */
static void take_size(lb_window *w, const xconfigure *e) {
    uint64_t wanted = __atomic_load_n(&w->wanted, __ATOMIC_ACQUIRE);
    if (e->window != w->window || e->head.serial < w->resized || e->width < 1 || e->height < 1) return;
    __atomic_compare_exchange_n(&w->wanted, &wanted, packed(e->width, e->height, (double)(wanted & 0xFFFF) / 256), 0,
                                __ATOMIC_ACQ_REL, __ATOMIC_RELAXED);
}

static void take_events(lb_window *w) {
    xevent e;
    while (x.Pending(w->display)) {
        x.NextEvent(w->display, &e);
        if (e.type == PRESS) {
            press(w, &e.pointer);
            if (lb_wants_text(w->picture)) ask_for_text(w, e.pointer.time);
        }
        else if (e.type == RELEASE && (e.pointer.button == 1 || e.pointer.button == 3))
            point(w, &e.pointer, LB_POINT_RELEASE, e.pointer.button == 3 ? LB_RIGHT : 0);
        else if (e.type == MOTION) point(w, &e.pointer, LB_POINT_MOVE, 0);
        else if (e.type == LEAVE && !(e.pointer.state & 0x700)) /* it may be dragged outside */
            point(w, &e.pointer, LB_POINT_LEAVE, 0);
        else if (e.type == KEY) take_key(w, &e);
        else if ((e.type == FOCUSED || e.type == UNFOCUSED) && e.focus.detail != BY_POINTER)
            x.SelectInput(w->display, w->window, WANTED | (e.type == FOCUSED ? KEYS : 0));
        else if (e.type == CONFIGURED) take_size(w, &e.configure);
        else if (e.type == SELECTION) take_text(w, &e.selection);
        else if (e.type == MESSAGE) take_message(w, &e.message);
        else if (e.type == EXPOSE) w->exposed = 1;
        else if (e.type == DESTROYED) w->window = 0; /* by the host */
    }
    follow_focus(w);
}

/* Shows an area; of a wide one whole rows: Xlib would copy parts of rows. */
static void show(lb_window *w, const int area[4]) {
    const int whole = area[2] > w->image.width / 2, left = whole ? 0 : area[0], wide = whole ? w->image.width : area[2];
    if (wide > 0 && area[3] > 0)
        x.PutImage(w->display, w->window, w->context, &w->image, left, area[1], left, area[1], (unsigned)wide,
                   (unsigned)area[3]);
}

static void draw(lb_window *w) {
    const uint64_t wanted = __atomic_load_n(&w->wanted, __ATOMIC_ACQUIRE);
    const int width = (int)(wanted >> 32), height = (int)(wanted >> 16 & 0xFFFF);
    int dirty[4] = {0, 0, 0, 0};
    if (width != w->image.width || height != w->image.height) {
        if (!make_room(w, width, height)) return;
        w->resized = x.NextRequest(w->display);
        x.ResizeWindow(w->display, w->window, (unsigned)width, (unsigned)height);
    }
    const double seconds = (double)now_ms() * 1e-3, scale = (double)(wanted & 0xFFFF) / 256;
    lb_draw(w->picture, w->pixels, width, height, scale, lb_is_dark(), seconds, dirty);
    if (w->exposed) show(w, (const int[4]){0, 0, width, height});
    for (int k = 0; !w->exposed && lb_drawn_area(w->picture, k, dirty); k++) show(w, dirty);
    w->exposed = 0;
    x.Flush(w->display);
}

static void *live(void *window) {
    lb_window *w = window;
    struct pollfd wait = {.fd = x.ConnectionNumber(w->display), .events = POLLIN};
    int64_t next = now_ms();
    while (!__atomic_load_n(&w->stop, __ATOMIC_ACQUIRE)) {
        take_events(w);
        const int64_t now = now_ms();
        if (now >= next) {
            if (w->window) draw(w);
            next = now + 1000 / LB_PICTURES;
        }
        const int left = (int)(next - now_ms());
        if (left > 0) poll(&wait, 1, left);
        if (wait.revents & (POLLERR | POLLHUP)) break; /* the server has gone */
    }
    return 0;
}

lb_window *lb_open_window(lb_picture *picture, uintptr_t parent, int width, int height, double scale) {
    if (!find_x()) return 0;
    lb_window *w = calloc(1, sizeof *w);
    if (!w) return 0;
    if (!(w->display = x.OpenDisplay(0))) {
        free(w);
        return 0;
    }
    const int screen = x.DefaultScreen(w->display), depth = x.DefaultDepth(w->display, screen);
    w->picture = picture;
    w->parent = (xid)parent;
    w->image.depth = depth;
    w->wanted = packed(width, height, scale);
    keep_errors(w);
    if ((depth == 24 || depth == 32) && make_room(w, width, height)) {
        const long embedded[2] = {0, 1}; /* _XEMBED_INFO: version, mapped */
        xattributes how = {.background_pixel = 0, .border_pixel = 0, .event_mask = WANTED,
                           .colormap = x.DefaultColormap(w->display, screen)};
        w->window = x.CreateWindow(w->display, parent ? (xid)parent : x.RootWindow(w->display, screen), 0, 0,
                                   (unsigned)width, (unsigned)height, 0, depth, INPUT_OUTPUT,
                                   x.DefaultVisual(w->display, screen), BACK_PIXEL | BORDER_PIXEL | EVENTS | COLORMAP,
                                   &how);
        const xid info = x.InternAtom(w->display, "_XEMBED_INFO", 0);
        x.ChangeProperty(w->display, w->window, info, info, 32, REPLACE, (const unsigned char *)embedded, 2);
        x.StoreName(w->display, w->window, "livebass");
        accept_files(w);
        w->context = x.CreateGC(w->display, w->window, 0, 0);
        w->cursors[LB_POINTER_HAND] = x.CreateFontCursor(w->display, HAND);
        w->cursors[LB_POINTER_ACROSS] = x.CreateFontCursor(w->display, ACROSS);
        x.MapWindow(w->display, w->window);
        draw(w); /* now: a host may show it before the thread runs */
        x.Sync(w->display, 0);
        if (exists(w->display, w->window) && !pthread_create(&w->thread, 0, live, w)) return w;
        x.FreeGC(w->display, w->context);
    }
    x.CloseDisplay(w->display);
    free(w->pixels);
    free(w);
    return 0;
}

void lb_close_window(lb_window *w) {
    if (!w) return;
    __atomic_store_n(&w->stop, 1, __ATOMIC_RELEASE);
    pthread_join(w->thread, 0);
    if (w->window) x.DestroyWindow(w->display, w->window);
    x.FreeGC(w->display, w->context);
    x.CloseDisplay(w->display);
    free(w->pixels);
    free(w);
}

void lb_resize_window(lb_window *w, int width, int height, double scale) {
    __atomic_store_n(&w->wanted, packed(width, height, scale), __ATOMIC_RELEASE);
}

uintptr_t lb_window_handle(const lb_window *w) { return (uintptr_t)w->window; }

double lb_system_scale(void) {
    display *d = find_x() ? x.OpenDisplay(0) : 0;
    const char *dpi = d ? x.GetDefault(d, "Xft", "dpi") : 0;
    const double scale = dpi ? strtod(dpi, 0) / 96 : 1;
    if (d) x.CloseDisplay(d);
    return scale >= 1 && scale <= 4 ? scale : 1;
}

int lb_is_dark(void) {
    const char *theme = getenv("LIVEBASS_THEME"); /* X11 has no theme */
    return !theme || strcmp(theme, "light");
}
#endif
