/* The part of LV2's interface (lv2plug.in) that this plugin uses: names and layouts, in our words. */
#ifndef LB_LV2_ABI_H
#define LB_LV2_ABI_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    const char *uri;
    void *data;
} lv2_feature;

typedef struct lv2_plugin {
    const char *uri;
    void *(*instantiate)(const struct lv2_plugin *, double rate, const char *bundle, const lv2_feature *const *);
    void (*connect_port)(void *, uint32_t port, void *data);
    void (*activate)(void *);
    void (*run)(void *, uint32_t frames);
    void (*deactivate)(void *);
    void (*cleanup)(void *);
    const void *(*extension_data)(const char *uri);
} lv2_plugin;

/* urid:map */
#define LV2_MAP "http://lv2plug.in/ns/ext/urid#map"
typedef struct {
    void *handle;
    uint32_t (*map)(void *handle, const char *uri);
} lv2_map;

/* log:log */
#define LV2_LOG "http://lv2plug.in/ns/ext/log#log"
#define LV2_LOG_ERROR "http://lv2plug.in/ns/ext/log#Error"
typedef struct {
    void *handle;
    int (*print)(void *handle, uint32_t type, const char *format, ...);
} lv2_log;

/* midnam:interface and midnam:update, by Ardour: names of keys as a MIDI Name Document; `free` frees both texts */
#define LV2_MIDNAM "http://ardour.org/lv2/midnam#interface"
#define LV2_MIDNAM_UPDATE "http://ardour.org/lv2/midnam#update"
typedef struct {
    char *(*document)(void *);
    char *(*model)(void *);
    void (*free)(char *);
} lv2_midnam;
typedef struct {
    void *handle;
    void (*update)(void *handle);
} lv2_midnam_host;

/* atom:Sequence: a head, then events, each at a multiple of 8 bytes */
#define LV2_MIDI_EVENT "http://lv2plug.in/ns/ext/midi#MidiEvent"
#define LV2_STRING "http://lv2plug.in/ns/ext/atom#String"
#define LV2_CHUNK "http://lv2plug.in/ns/ext/atom#Chunk"
#define LV2_LONG "http://lv2plug.in/ns/ext/atom#Long"
#define LV2_FLOAT "http://lv2plug.in/ns/ext/atom#Float"
typedef struct {
    uint32_t size, type; /* of what follows */
} lv2_atom;
typedef struct {
    lv2_atom atom;
    uint32_t unit, pad;
} lv2_sequence;
typedef struct {
    int64_t frame;
    lv2_atom body;
} lv2_event;

#define LV2_SEQUENCE "http://lv2plug.in/ns/ext/atom#Sequence"
#define LV2_EVENT_TRANSFER "http://lv2plug.in/ns/ext/atom#eventTransfer"

/* ui: windows */
#define LV2_UI_PARENT "http://lv2plug.in/ns/extensions/ui#parent"
#define LV2_UI_RESIZE "http://lv2plug.in/ns/extensions/ui#resize"
#define LV2_UI_TOUCH "http://lv2plug.in/ns/extensions/ui#touch"
#define LV2_UI_IDLE "http://lv2plug.in/ns/extensions/ui#idleInterface"
typedef void (*lv2_ui_write)(void *controller, uint32_t port, uint32_t size, uint32_t format, const void *data);
typedef struct lv2_ui {
    const char *uri;
    void *(*instantiate)(const struct lv2_ui *, const char *plugin, const char *bundle, lv2_ui_write, void *controller,
                         void **widget, const lv2_feature *const *);
    void (*cleanup)(void *);
    void (*port_event)(void *, uint32_t port, uint32_t size, uint32_t format, const void *data);
    const void *(*extension_data)(const char *uri);
} lv2_ui;
typedef struct {
    int (*idle)(void *);
} lv2_ui_idle;
typedef struct {
    void *handle;
    int (*resize)(void *handle, int width, int height);
} lv2_ui_resize;
typedef struct {
    void *handle;
    void (*touch)(void *handle, uint32_t port, bool begins);
} lv2_ui_touch;

/* work:schedule and work:interface */
#define LV2_SCHEDULE "http://lv2plug.in/ns/ext/worker#schedule"
#define LV2_WORKER "http://lv2plug.in/ns/ext/worker#interface"
enum { LV2_SUCCESS = 0, LV2_UNKNOWN = 1 }; /* statuses of work and state */
typedef int (*lv2_respond)(void *handle, uint32_t size, const void *data);
typedef struct {
    void *handle;
    int (*schedule)(void *handle, uint32_t size, const void *data);
} lv2_schedule;
typedef struct {
    int (*work)(void *, lv2_respond, void *handle, uint32_t size, const void *data);
    int (*respond)(void *, uint32_t size, const void *data);
    int (*end)(void *);
} lv2_worker;

/* state:interface */
#define LV2_STATE "http://lv2plug.in/ns/ext/state#interface"
enum { LV2_PLAIN = 1 | 2, LV2_NO_PROPERTY = 5 }; /* flags: POD and portable; a status */
typedef int (*lv2_store)(void *handle, uint32_t key, const void *value, size_t size, uint32_t type, uint32_t flags);
typedef const void *(*lv2_retrieve)(void *handle, uint32_t key, size_t *size, uint32_t *type, uint32_t *flags);
typedef struct {
    int (*save)(void *, lv2_store, void *handle, uint32_t flags, const lv2_feature *const *);
    int (*restore)(void *, lv2_retrieve, void *handle, uint32_t flags, const lv2_feature *const *);
} lv2_state;
#endif
