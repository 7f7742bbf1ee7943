/* Windows on macOS: a view of our own class, made by the Objective-C runtime; the first window opens the runtime and
   AppKit. A timer on the main thread requests pictures. Sizes are in points; on a finer screen a picture has two pixels
   per point. */
#ifdef __APPLE__
#include "window/window.h"

#include <dlfcn.h>
#include <math.h>
#include <objc/message.h>
#include <objc/runtime.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct {
    double x, y;
} place;
typedef struct {
    double width, height;
} extent;
typedef struct {
    place origin;
    extent size;
} box;

enum { BITMAP = 2 << 12 | 6 }; /* 32 bits little-endian, first byte skipped: 0xFFRRGGBB */
enum { SHIFT = 1 << 17, CONTROL = 1 << 18, OPTION = 1 << 19 };
enum { TRACKING = 1 | 2 | 0x80 | 0x200 }; /* enters and leaves, moves; always; the visible part */

struct lb_window {
    id view, timer;
    lb_picture *picture;
    uint32_t *pixels;
    int width, height; /* points */
    int across, down;  /* pixels */
    double scale;      /* the host's, besides the screen's */
    int typing;        /* it has taken the keyboard */
};

/* Functions of the runtime and CoreGraphics: library, name there, name here, result, arguments. */
#define FUNCTIONS(F) \
    F(runtime, "objc_msgSend", send, id, (id, SEL)) \
    F(runtime, "objc_getClass", class_named, Class, (const char *)) \
    F(runtime, "sel_registerName", selector, SEL, (const char *)) \
    F(runtime, "objc_allocateClassPair", new_class, Class, (Class, const char *, size_t)) \
    F(runtime, "objc_registerClassPair", register_class, void, (Class)) \
    F(runtime, "objc_disposeClassPair", dispose_class, void, (Class)) \
    F(runtime, "class_addMethod", add_method, BOOL, (Class, SEL, IMP, const char *)) \
    F(runtime, "class_addIvar", add_variable, BOOL, (Class, const char *, size_t, uint8_t, const char *)) \
    F(runtime, "object_setInstanceVariable", set_variable, Ivar, (id, const char *, void *)) \
    F(runtime, "object_getInstanceVariable", get_variable, Ivar, (id, const char *, void **)) \
    F(graphics, "CGColorSpaceCreateDeviceRGB", color_space, void *, (void)) \
    F(graphics, "CGColorSpaceRelease", release_color_space, void, (void *)) \
    F(graphics, "CGDataProviderCreateWithData", new_provider, void *, (void *, const void *, size_t, void *)) \
    F(graphics, "CGDataProviderRelease", release_provider, void, (void *)) \
    F(graphics, "CGImageCreate", new_image, void *, (size_t, size_t, size_t, size_t, size_t, void *, uint32_t, void *, const double *, bool, int)) \
    F(graphics, "CGImageRelease", release_image, void, (void *)) \
    F(graphics, "CGContextDrawImage", draw_image, void, (void *, box, void *)) \
    F(graphics, "CGContextTranslateCTM", translate, void, (void *, double, double)) \
    F(graphics, "CGContextScaleCTM", stretch, void, (void *, double, double))
#define MEMBER(from, name, to, result, arguments) result(*to) arguments;
static struct {
    void *ready;
    FUNCTIONS(MEMBER)
} c;
static Class view_class;
static int windows;

static int find_cocoa(void) {
    if (c.ready) return 1;
    void *runtime = dlopen("/usr/lib/libobjc.A.dylib", RTLD_NOW | RTLD_LOCAL);
    void *kit = dlopen("/System/Library/Frameworks/AppKit.framework/AppKit", RTLD_NOW | RTLD_LOCAL);
    void *graphics = dlopen("/System/Library/Frameworks/CoreGraphics.framework/CoreGraphics", RTLD_NOW | RTLD_LOCAL);
    if (!runtime || !kit || !graphics) return 0;
#define FIND(from, name, to, result, arguments) \
    if (!(*(void **)&c.to = dlsym(from, name))) return 0;
    FUNCTIONS(FIND)
    c.ready = runtime;
    return 1;
}

/* --- messages, by argument and result types --- */

static id kind(const char *name) { return (id)c.class_named(name); }
static id get(id to, const char *what) { return c.send(to, c.selector(what)); }
static void tell(id to, const char *what, id about) {
    ((void (*)(id, SEL, id))(void *)c.send)(to, c.selector(what), about);
}
static id ask(id to, const char *what, id about) {
    return ((id(*)(id, SEL, id))(void *)c.send)(to, c.selector(what), about);
}
static double number(id to, const char *what) { return ((double (*)(id, SEL))(void *)c.send)(to, c.selector(what)); }
static unsigned long word(id to, const char *what) {
    return ((unsigned long (*)(id, SEL))(void *)c.send)(to, c.selector(what));
}
static place where(id event, id view) {
    const place of_window = ((place(*)(id, SEL))(void *)c.send)(event, c.selector("locationInWindow"));
    return ((place(*)(id, SEL, place, id))(void *)c.send)(view, c.selector("convertPoint:fromView:"), of_window, (id)0);
}

static lb_window *of(id view) {
    void *w = 0;
    c.get_variable(view, "livebass", &w);
    return w;
}

/* --- the view's methods --- */

/* Pixels per point on the view's screen. */
static double density(const lb_window *w) {
    id window = get(w->view, "window");
    const double found = window ? number(window, "backingScaleFactor") : 1;
    return found >= 1 && found <= 4 ? found : 1;
}

static void next_picture(lb_window *w) {
    const double fine = density(w);
    const int across = (int)lrint(w->width * fine), down = (int)lrint(w->height * fine);
    int dirty[4];
    struct timespec now;
    if (across != w->across || down != w->down) {
        uint32_t *pixels = calloc((size_t)across * (size_t)down, sizeof *pixels);
        if (!pixels) return;
        free(w->pixels);
        w->pixels = pixels;
        w->across = across;
        w->down = down;
    }
    clock_gettime(CLOCK_MONOTONIC, &now);
    const double seconds = (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
    lb_draw(w->picture, w->pixels, across, down, w->scale * fine, lb_is_dark(), seconds, dirty);
    if (!dirty[2] || !dirty[3]) return;
    const box all = {{dirty[0] / fine, dirty[1] / fine}, {dirty[2] / fine, dirty[3] / fine}};
    ((void (*)(id, SEL, box))(void *)c.send)(w->view, c.selector("setNeedsDisplayInRect:"), all);
}

static void on_timer(id view, SEL name, id timer) {
    if (of(view)) next_picture(of(view));
}

static void on_draw(id view, SEL name, box part) {
    const lb_window *w = of(view);
    if (!w || !w->pixels) return;
    id context = get(kind("NSGraphicsContext"), "currentContext");
    void *to = (void *)get(context, "CGContext"), *colors = c.color_space();
    const size_t bytes = 4 * (size_t)w->across;
    void *data = c.new_provider(0, w->pixels, bytes * (size_t)w->down, 0);
    void *image = c.new_image((size_t)w->across, (size_t)w->down, 8, 32, bytes, colors, BITMAP, data, 0, false,
                              0);
    c.translate(to, 0, w->height); /* y goes down in the view, up in images */
    c.stretch(to, 1, -1);
    c.draw_image(to, (box){{0, 0}, {w->width, w->height}}, image);
    c.release_image(image);
    c.release_provider(data);
    c.release_color_space(colors);
}

static id new_text(const char *text) {
    return ((id(*)(id, SEL, const char *))(void *)c.send)(kind("NSString"), c.selector("stringWithUTF8String:"), text);
}

/* The text that an object's method `what` returns for a name; 0: none. */
static const char *text_of(id from, const char *what, const char *name) {
    id found = ask(from, what, new_text(name));
    return found ? ((const char *(*)(id, SEL))(void *)c.send)(found, c.selector("UTF8String")) : 0;
}

/* Takes the keyboard while something is typed, and gives it back to the window. */
static void follow_focus(lb_window *w) {
    const int wanted = lb_wants_keys(w->picture);
    if (wanted == w->typing) return;
    w->typing = wanted;
    tell(get(w->view, "window"), "makeFirstResponder:", wanted ? w->view : (id)0);
}

static int modifiers_of(id event) {
    const unsigned long flags = word(event, "modifierFlags");
    return (flags & SHIFT ? LB_SHIFT : 0) | (flags & CONTROL ? LB_CONTROL : 0) | (flags & OPTION ? LB_ALT : 0);
}

/* The number of a key for lb_key, from the text that it types; 0: none. */
static int key_of(id event) {
    static const int special[][2] = {{0x7F, LB_KEY_BACK}, {0x19, LB_KEY_TAB}, {0xF700, LB_KEY_UP}, {0xF701, LB_KEY_DOWN},
                                     {0xF702, LB_KEY_LEFT}, {0xF703, LB_KEY_RIGHT}, {0xF728, LB_KEY_DELETE}};
    id typed = get(event, "characters");
    if (!typed || !word(typed, "length")) return 0;
    const int key = ((unsigned short (*)(id, SEL, unsigned long))(void *)c.send)(typed, c.selector("characterAtIndex:"), 0);
    for (size_t k = 0; k < sizeof special / sizeof *special; k++)
        if (key == special[k][0]) return special[k][1];
    return key;
}

static void on_key(id view, SEL name, id event) {
    lb_window *w = of(view);
    const int key = w ? key_of(event) : 0, used = key && lb_key(w->picture, key, modifiers_of(event));
    if (w) follow_focus(w);
    if (!used) tell(get(view, "nextResponder"), "keyDown:", event);
}

static void point(id view, id event, int what, int more) {
    lb_window *w = of(view);
    if (!w) return;
    const place at = where(event, view);
    const int modifiers = modifiers_of(event) | more;
    static const char *const cursors[] = {"arrowCursor", "pointingHandCursor", "resizeLeftRightCursor"};
    const double fine = density(w);
    const int shape = lb_point(w->picture, what, at.x * fine, at.y * fine, modifiers);
    follow_focus(w);
    if (lb_wants_text(w->picture))
        lb_paste(w->picture, text_of(get(kind("NSPasteboard"), "generalPasteboard"), "stringForType:",
                                     "public.utf8-plain-text"));
    get(get(kind("NSCursor"), cursors[shape >= 0 && shape < 3 ? shape : 0]), "set");
}

static void on_press(id view, SEL name, id event) {
    point(view, event, word(event, "clickCount") == 2 ? LB_POINT_DOUBLE : LB_POINT_PRESS, 0);
}
static void on_release(id view, SEL name, id event) {
    point(view, event, LB_POINT_RELEASE, 0);
}
static void on_right(id view, SEL name, id event) {
    point(view, event, LB_POINT_PRESS, LB_RIGHT);
}
static void on_right_release(id view, SEL name, id event) {
    point(view, event, LB_POINT_RELEASE, LB_RIGHT);
}
static void on_move(id view, SEL name, id event) {
    point(view, event, LB_POINT_MOVE, 0);
}
static void on_leave(id view, SEL name, id event) {
    point(view, event, LB_POINT_LEAVE, 0);
}
static void on_wheel(id view, SEL name, id event) {
    const double way = number(event, "deltaY");
    if (way != 0) point(view, event, way > 0 ? LB_POINT_UP : LB_POINT_DOWN, 0);
}
static BOOL yes(id view, SEL name) { return 1; }
static BOOL yes_to(id view, SEL name, id event) { return yes(view, name); }

/* A drag over the view may copy its files (NSDragOperationCopy). */
static unsigned long on_drag(id view, SEL name, id drag) { return 1; }

/* Takes the first of the dropped files. */
static BOOL on_drop(id view, SEL name, id drag) {
    lb_window *w = of(view);
    id url = ask(kind("NSURL"), "URLFromPasteboard:", get(drag, "draggingPasteboard"));
    id path = url ? get(get(url, "filePathURL"), "path") : (id)0;
    if (!w || !path) return 0;
    lb_drop(w->picture, ((const char *(*)(id, SEL))(void *)c.send)(path, c.selector("UTF8String")));
    return 1;
}

/* Makes a class with a name that no other version of the plugin in this process uses. */
static int make_class(void) {
    static const struct {
        const char *name;
        IMP does;
        const char *types;
    } all[] = {
        {"drawRect:", (IMP)on_draw, "v@:{CGRect={CGPoint=dd}{CGSize=dd}}"},
        {"onTimer:", (IMP)on_timer, "v@:@"},
        {"mouseDown:", (IMP)on_press, "v@:@"},
        {"mouseUp:", (IMP)on_release, "v@:@"},
        {"rightMouseDown:", (IMP)on_right, "v@:@"},
        {"rightMouseUp:", (IMP)on_right_release, "v@:@"},
        {"mouseDragged:", (IMP)on_move, "v@:@"},
        {"rightMouseDragged:", (IMP)on_move, "v@:@"},
        {"mouseMoved:", (IMP)on_move, "v@:@"},
        {"mouseExited:", (IMP)on_leave, "v@:@"},
        {"scrollWheel:", (IMP)on_wheel, "v@:@"},
        {"keyDown:", (IMP)on_key, "v@:@"},
        {"draggingEntered:", (IMP)on_drag, "Q@:@"},
        {"performDragOperation:", (IMP)on_drop, "c@:@"},
        {"acceptsFirstResponder", (IMP)yes, "c@:"},
        {"isFlipped", (IMP)yes, "c@:"},
        {"isOpaque", (IMP)yes, "c@:"},
        {"acceptsFirstMouse:", (IMP)yes_to, "c@:@"},
    };
    char name[64] = "LivebassView";
    for (uintptr_t at = (uintptr_t)&c, k = 12; at && k < sizeof name - 1; at >>= 4, k++) name[k] = "0123456789ABCDEF"[at & 15];
    view_class = c.new_class(c.class_named("NSView"), name, 0);
    if (!view_class) return 0;
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        c.add_method(view_class, c.selector(all[k].name), all[k].does, all[k].types);
    c.add_variable(view_class, "livebass", sizeof(void *), 3, "^v");
    c.register_class(view_class);
    return 1;
}

lb_window *lb_open_window(lb_picture *picture, uintptr_t parent, int width, int height, double scale) {
    if (!parent || !find_cocoa() || (!windows && !make_class())) return 0;
    lb_window *w = calloc(1, sizeof *w);
    if (!w) return 0;
    w->picture = picture;
    w->width = width;
    w->height = height;
    w->scale = scale;
    windows++;
    const box frame = {{0, 0}, {width, height}};
    w->view = ((id(*)(id, SEL, box))(void *)c.send)(get((id)view_class, "alloc"), c.selector("initWithFrame:"), frame);
    c.set_variable(w->view, "livebass", w);
    id area = get(kind("NSTrackingArea"), "alloc");
    area = ((id(*)(id, SEL, box, unsigned long, id, id))(void *)c.send)(
        area, c.selector("initWithRect:options:owner:userInfo:"), frame, TRACKING, w->view, (id)0);
    tell(w->view, "addTrackingArea:", area);
    get(area, "release");
    tell((id)parent, "addSubview:", w->view);
    tell(w->view, "registerForDraggedTypes:",
         ask(kind("NSArray"), "arrayWithObject:", new_text("public.file-url")));
    next_picture(w);
    w->timer = ((id(*)(id, SEL, double, id, SEL, id, BOOL))(void *)c.send)(
        kind("NSTimer"), c.selector("scheduledTimerWithTimeInterval:target:selector:userInfo:repeats:"),
        1.0 / LB_PICTURES, w->view, c.selector("onTimer:"), (id)0, 1);
    return w;
}

void lb_close_window(lb_window *w) {
    if (!w) return;
    get(w->timer, "invalidate"); /* releases the view */
    c.set_variable(w->view, "livebass", 0);
    get(w->view, "removeFromSuperview");
    get(w->view, "release");
    if (!--windows) c.dispose_class(view_class);
    free(w->pixels);
    free(w);
}

void lb_resize_window(lb_window *w, int width, int height, double scale) {
    w->width = width;
    w->height = height;
    w->scale = scale;
    ((void (*)(id, SEL, extent))(void *)c.send)(w->view, c.selector("setFrameSize:"), (extent){width, height});
    next_picture(w);
}

uintptr_t lb_window_handle(const lb_window *w) { return (uintptr_t)w->view; }

double lb_system_scale(void) { return 1; }

int lb_is_dark(void) {
    const char *theme = getenv("LIVEBASS_THEME");
    if (theme) return strcmp(theme, "light");
    if (!find_cocoa()) return 1;
    id defaults = get(kind("NSUserDefaults"), "standardUserDefaults");
    const char *name = text_of(defaults, "stringForKey:", "AppleInterfaceStyle");
    return name && !strcmp(name, "Dark");
}
#endif
