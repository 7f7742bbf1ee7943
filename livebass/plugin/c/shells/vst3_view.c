/* The VST3 plugin's view: a window inside a host window. On Linux each window has its own thread, and the host's run
   loop collects its changes as often as pictures come. */
#include "shells/vst3_view.h"
#include "abi/vst3.h"

#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define PLATFORM "HWND"
#elif defined(__APPLE__)
#define PLATFORM "NSView"
#else
#define PLATFORM "X11EmbedWindowID"
#endif

enum { VIEW, SCALE, TIMER, INTERFACES };
typedef struct {
    const void *interfaces[INTERFACES]; /* first: hosts know their addresses */
    int32_t users;
    lb_view_owner of;
    lb_editor *editor;
    vst3_frame **frame; /* the host's, and its run loop: 0: it has none */
    vst3_run_loop **loop;
    int width, height;
    double scale;
} view;

static view *at(void *self, int which) { return (view *)((char *)self - (size_t)which * sizeof(void *)); }

static vst3_result query(view *v, const vst3_id id, void **out) {
    static const vst3_id ids[] = {VST3_VIEW, VST3_VIEW_SCALE, VST3_TIMER}, unknown = VST3_UNKNOWN;
    for (int k = 0; k < INTERFACES; k++) {
        if (memcmp(id, ids[k], sizeof(vst3_id)) && (k || memcmp(id, unknown, sizeof unknown))) continue;
        __atomic_add_fetch(&v->users, 1, __ATOMIC_ACQ_REL);
        *out = &v->interfaces[k];
        return VST3_OK;
    }
    *out = 0;
    return VST3_NO_INTERFACE;
}

static void stop_timer(view *v) {
    if (!v->loop) return;
    *v->of.timed = 0;
    (*v->loop)->drop_timer(v->loop, &v->interfaces[TIMER]);
    (*v->loop)->unknown.drop(v->loop);
    v->loop = 0;
}

static void shut(view *v) {
    if (v->editor) *v->of.attached = 0;
    lb_close_editor(v->editor);
    v->editor = 0;
    v->of.tell(v->of.owner); /* the end of a hold */
    stop_timer(v);
}

static uint32_t drop(view *v) {
    const int32_t users = __atomic_sub_fetch(&v->users, 1, __ATOMIC_ACQ_REL);
    if (!users) {
        shut(v);
        v->of.drop(v->of.owner);
        free(v);
    }
    return (uint32_t)users;
}

#define UNKNOWN(NAME, INTERFACE) \
    static vst3_result NAME##_query(void *self, const vst3_id id, void **out) { \
        return query(at(self, INTERFACE), id, out); \
    } \
    static uint32_t NAME##_take(void *self) { \
        return (uint32_t)__atomic_add_fetch(&at(self, INTERFACE)->users, 1, __ATOMIC_ACQ_REL); \
    } \
    static uint32_t NAME##_drop(void *self) { return drop(at(self, INTERFACE)); }
UNKNOWN(view, VIEW)
UNKNOWN(scale, SCALE)
UNKNOWN(timer, TIMER)

static vst3_result supported(void *self, const char *type) { return strcmp(type, PLATFORM) ? VST3_NO : VST3_OK; }

/* Registers on_timer with the host's run loop, if its frame has one. */
static void start_timer(view *v) {
    static const vst3_id run_loop = VST3_RUN_LOOP;
    void *loop = 0;
    if (!v->frame || (*v->frame)->unknown.query(v->frame, run_loop, &loop) != VST3_OK || !loop) return;
    v->loop = loop;
    *v->of.timed = (*v->loop)->register_timer(v->loop, &v->interfaces[TIMER], 1000 / LB_PICTURES) == VST3_OK;
}

static vst3_result attached(void *self, void *parent, const char *type) {
    view *v = at(self, VIEW);
    if (*v->of.attached || supported(self, type) != VST3_OK) return VST3_NO;
    start_timer(v);
    v->editor = lb_edit_instance(v->of.instance, (uintptr_t)parent, v->width, v->height, v->scale);
    if (v->editor) {
        *v->of.attached = 1;
        return VST3_OK;
    }
    stop_timer(v);
    return VST3_NO;
}

static vst3_result removed(void *self) {
    shut(at(self, VIEW));
    return VST3_OK;
}

static vst3_result wheel(void *self, float way) { /* the window handles it itself */
    return VST3_NO;
}

static vst3_result key(void *self, int16_t letter, int16_t code, int16_t modifiers) { /* keys are the host's */
    return VST3_NO;
}

static vst3_result size(void *self, vst3_box *box) {
    const view *v = at(self, VIEW);
    *box = (vst3_box){0, 0, v->width, v->height};
    return VST3_OK;
}

static vst3_result check_size(void *self, vst3_box *box) {
    int width = box->right - box->left, height = box->bottom - box->top;
    lb_allowed_size(at(self, VIEW)->scale, &width, &height);
    box->right = box->left + width;
    box->bottom = box->top + height;
    return VST3_OK;
}

static vst3_result on_size(void *self, const vst3_box *box) {
    view *v = at(self, VIEW);
    vst3_box allowed = *box;
    check_size(self, &allowed);
    v->width = allowed.right - allowed.left;
    v->height = allowed.bottom - allowed.top;
    if (v->editor) lb_resize_editor(v->editor, v->width, v->height, v->scale);
    return VST3_OK;
}

static vst3_result focus(void *self, uint8_t on) { return VST3_OK; }

static vst3_result set_frame(void *self, void *frame) {
    at(self, VIEW)->frame = frame;
    return VST3_OK;
}

static vst3_result can_resize(void *self) { return VST3_OK; }

/* Sets the screen's scale, and the size for it; macOS has neither. */
static vst3_result set_scale(void *self, float scale) {
    view *v = at(self, SCALE);
    if (!(scale >= 0.5f && scale <= 4) || !strcmp(PLATFORM, "NSView")) return VST3_NO;
    v->width = (int)((float)v->width * scale / v->scale);
    v->height = (int)((float)v->height * scale / v->scale);
    v->scale = scale;
    if (v->editor) lb_resize_editor(v->editor, v->width, v->height, v->scale);
    vst3_box box = {0, 0, v->width, v->height};
    if (v->editor && v->frame) (*v->frame)->resize(v->frame, &v->interfaces[VIEW], &box);
    return VST3_OK;
}

static void on_timer(void *self) {
    const view *v = at(self, TIMER);
    v->of.tell(v->of.owner);
}

void *lb_new_vst3_view(const lb_view_owner *of) {
    static const vst3_view view_table = {
        {view_query, view_take, view_drop}, supported, attached, removed, wheel, key, key, size, on_size, focus,
        set_frame, can_resize, check_size,
    };
    static const vst3_view_scale scale_table = {{scale_query, scale_take, scale_drop}, set_scale};
    static const vst3_timer timer_table = {{timer_query, timer_take, timer_drop}, on_timer};
    view *v = calloc(1, sizeof *v);
    if (!v) return 0;
    v->interfaces[VIEW] = &view_table;
    v->interfaces[SCALE] = &scale_table;
    v->interfaces[TIMER] = &timer_table;
    v->users = 1;
    v->of = *of;
    v->scale = lb_system_scale();
    lb_default_size(v->scale, &v->width, &v->height);
    of->take(of->owner);
    return &v->interfaces[VIEW];
}
