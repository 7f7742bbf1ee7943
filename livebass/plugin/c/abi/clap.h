/* The part of CLAP 1.2's C interface that clap.c uses: layouts and numbers are the specification's. */
#ifndef LB_CLAP_ABI_H
#define LB_CLAP_ABI_H
#include <stdbool.h>
#include <stdint.h>

#define CLAP_PLUGIN_FACTORY "clap.plugin-factory"
#define CLAP_PRESET_FACTORY "clap.preset-discovery-factory/2"
#define CLAP_PRESET_FACTORY_DRAFT "clap.preset-discovery-factory/draft-2"
#define CLAP_AUDIO_PORTS "clap.audio-ports"
#define CLAP_NOTE_PORTS "clap.note-ports"
#define CLAP_NOTE_NAMES "clap.note-name"
#define CLAP_PARAMS "clap.params"
#define CLAP_STATE "clap.state"
#define CLAP_RENDER "clap.render"
#define CLAP_LATENCY "clap.latency"
#define CLAP_TAIL "clap.tail"
#define CLAP_LOG "clap.log"
#define CLAP_THREAD_POOL "clap.thread-pool"
#define CLAP_GUI "clap.gui"
#define CLAP_PRESET_LOAD "clap.preset-load/2"
#define CLAP_PRESET_LOAD_DRAFT "clap.preset-load.draft/2"
#define CLAP_REMOTE_CONTROLS "clap.remote-controls/2"
#define CLAP_REMOTE_CONTROLS_DRAFT "clap.remote-controls.draft/2"

typedef struct {
    uint32_t major, minor, revision;
} clap_version;
#define CLAP_VERSION {1, 2, 2}

typedef struct clap_host {
    clap_version version;
    void *data;
    const char *name, *vendor, *url, *release;
    const void *(*get_extension)(const struct clap_host *, const char *id);
    void (*request_restart)(const struct clap_host *);
    void (*request_process)(const struct clap_host *);
    void (*request_callback)(const struct clap_host *);
} clap_host;

/* --- events --- */

enum {
    CLAP_NOTE_ON = 0,
    CLAP_NOTE_OFF = 1,
    CLAP_NOTE_CHOKE = 2,
    CLAP_NOTE_EXPRESSION = 4,
    CLAP_PARAM_VALUE = 5,
    CLAP_GESTURE_BEGIN = 7,
    CLAP_GESTURE_END = 8,
    CLAP_MIDI = 10,
};
enum { CLAP_CORE_EVENTS = 0 };
enum { CLAP_TUNING = 2, CLAP_VIBRATO = 3, CLAP_BRIGHTNESS = 5, CLAP_PRESSURE = 6 }; /* semitones; 0 to 1 */

typedef struct {
    uint32_t size, time;
    uint16_t space, type;
    uint32_t flags;
} clap_event;

typedef struct {
    clap_event head;
    int32_t note_id;
    int16_t port, channel, key; /* -1: any */
    double velocity;
} clap_note;

typedef struct {
    clap_event head;
    int32_t expression, note_id;
    int16_t port, channel, key;
    double value;
} clap_note_expression;

typedef struct {
    clap_event head;
    uint32_t id;
    void *cookie;
    int32_t note_id;
    int16_t port, channel, key;
    double value;
} clap_param_value;

typedef struct {
    clap_event head;
    uint16_t port;
    uint8_t data[3];
} clap_midi;

typedef struct clap_in_events {
    void *data;
    uint32_t (*size)(const struct clap_in_events *);
    const clap_event *(*get)(const struct clap_in_events *, uint32_t);
} clap_in_events;

typedef struct clap_out_events {
    void *data;
    bool (*try_push)(const struct clap_out_events *, const clap_event *);
} clap_out_events;

/* --- sound --- */

typedef struct {
    float **data32;
    double **data64;
    uint32_t channels, latency;
    uint64_t constant_mask;
} clap_audio_buffer;

enum { CLAP_PROCESS_ERROR = 0, CLAP_PROCESS_CONTINUE = 1, CLAP_PROCESS_SLEEP = 4 };
typedef struct {
    int64_t steady_time;
    uint32_t frames;
    const void *transport;
    const clap_audio_buffer *inputs;
    clap_audio_buffer *outputs;
    uint32_t input_count, output_count;
    const clap_in_events *in_events;
    const clap_out_events *out_events;
} clap_process;

/* --- plugins --- */

typedef struct {
    clap_version version;
    const char *id, *name, *vendor, *url, *manual, *support, *release, *description;
    const char *const *features;
} clap_descriptor;

typedef struct clap_plugin {
    const clap_descriptor *descriptor;
    void *data;
    bool (*init)(const struct clap_plugin *);
    void (*destroy)(const struct clap_plugin *);
    bool (*activate)(const struct clap_plugin *, double rate, uint32_t min_frames, uint32_t max_frames);
    void (*deactivate)(const struct clap_plugin *);
    bool (*start_processing)(const struct clap_plugin *);
    void (*stop_processing)(const struct clap_plugin *);
    void (*reset)(const struct clap_plugin *);
    int32_t (*process)(const struct clap_plugin *, const clap_process *);
    const void *(*get_extension)(const struct clap_plugin *, const char *id);
    void (*on_main_thread)(const struct clap_plugin *);
} clap_plugin;

typedef struct clap_plugin_factory {
    uint32_t (*count)(const struct clap_plugin_factory *);
    const clap_descriptor *(*descriptor)(const struct clap_plugin_factory *, uint32_t);
    const clap_plugin *(*create)(const struct clap_plugin_factory *, const clap_host *, const char *id);
} clap_plugin_factory;

typedef struct {
    clap_version version;
    bool (*init)(const char *path);
    void (*deinit)(void);
    const void *(*get_factory)(const char *id);
} clap_plugin_entry;

/* --- extensions --- */

enum { CLAP_NAME = 256, CLAP_PATH = 1024 };

enum { CLAP_PORT_IS_MAIN = 1 };
#define CLAP_MONO "mono"
#define CLAP_NO_ID UINT32_MAX
typedef struct {
    uint32_t id;
    char name[CLAP_NAME];
    uint32_t flags, channels;
    const char *type;
    uint32_t in_place_pair;
} clap_audio_port;

typedef struct {
    uint32_t (*count)(const clap_plugin *, bool is_input);
    bool (*get)(const clap_plugin *, uint32_t index, bool is_input, clap_audio_port *);
} clap_audio_ports;

enum { CLAP_DIALECT_CLAP = 1, CLAP_DIALECT_MIDI = 2, CLAP_DIALECT_MPE = 4 };
typedef struct {
    uint32_t id, supported, preferred;
    char name[CLAP_NAME];
} clap_note_port;

typedef struct {
    uint32_t (*count)(const clap_plugin *, bool is_input);
    bool (*get)(const clap_plugin *, uint32_t index, bool is_input, clap_note_port *);
} clap_note_ports;

typedef struct {
    char name[CLAP_NAME];
    int16_t port, key, channel; /* -1: all */
} clap_note_name;

typedef struct {
    uint32_t (*count)(const clap_plugin *);
    bool (*get)(const clap_plugin *, uint32_t index, clap_note_name *);
} clap_note_names;
typedef struct {
    void (*changed)(const clap_host *);
} clap_host_note_names;

enum { CLAP_PARAM_STEPPED = 1, CLAP_PARAM_READONLY = 1 << 3, CLAP_PARAM_AUTOMATABLE = 1 << 5, CLAP_PARAM_ENUM = 1 << 16 };
typedef struct {
    uint32_t id, flags;
    void *cookie;
    char name[CLAP_NAME], module[CLAP_PATH];
    double minimum, maximum, default_value;
} clap_param_info;

typedef struct {
    uint32_t (*count)(const clap_plugin *);
    bool (*info)(const clap_plugin *, uint32_t index, clap_param_info *);
    bool (*value)(const clap_plugin *, uint32_t id, double *);
    bool (*to_text)(const clap_plugin *, uint32_t id, double, char *, uint32_t room);
    bool (*from_text)(const clap_plugin *, uint32_t id, const char *, double *);
    void (*flush)(const clap_plugin *, const clap_in_events *, const clap_out_events *);
} clap_params;

enum { CLAP_RESCAN_VALUES = 1 };
typedef struct {
    void (*rescan)(const clap_host *, uint32_t flags);
    void (*clear)(const clap_host *, uint32_t id, uint32_t flags);
    void (*request_flush)(const clap_host *);
} clap_host_params;

typedef struct clap_in_stream {
    void *data;
    int64_t (*read)(const struct clap_in_stream *, void *, uint64_t);
} clap_in_stream;

typedef struct clap_out_stream {
    void *data;
    int64_t (*write)(const struct clap_out_stream *, const void *, uint64_t);
} clap_out_stream;

typedef struct {
    bool (*save)(const clap_plugin *, const clap_out_stream *);
    bool (*load)(const clap_plugin *, const clap_in_stream *);
} clap_state;

enum { CLAP_OFFLINE = 1 };
typedef struct {
    bool (*needs_real_time)(const clap_plugin *);
    bool (*set)(const clap_plugin *, int32_t mode);
} clap_render;

/* --- the window --- */

typedef struct {
    const char *api;
    uintptr_t handle; /* an X11 window, an HWND, an NSView * */
} clap_window;

typedef struct {
    bool wider, taller, preserve_ratio;
    uint32_t ratio_width, ratio_height;
} clap_resize_hints;

typedef struct {
    bool (*is_api_supported)(const clap_plugin *, const char *api, bool floating);
    bool (*get_preferred_api)(const clap_plugin *, const char **api, bool *floating);
    bool (*create)(const clap_plugin *, const char *api, bool floating);
    void (*destroy)(const clap_plugin *);
    bool (*set_scale)(const clap_plugin *, double);
    bool (*get_size)(const clap_plugin *, uint32_t *width, uint32_t *height);
    bool (*can_resize)(const clap_plugin *);
    bool (*get_resize_hints)(const clap_plugin *, clap_resize_hints *);
    bool (*adjust_size)(const clap_plugin *, uint32_t *width, uint32_t *height);
    bool (*set_size)(const clap_plugin *, uint32_t width, uint32_t height);
    bool (*set_parent)(const clap_plugin *, const clap_window *);
    bool (*set_transient)(const clap_plugin *, const clap_window *);
    void (*suggest_title)(const clap_plugin *, const char *);
    bool (*show)(const clap_plugin *);
    bool (*hide)(const clap_plugin *);
} clap_gui;

typedef struct { /* a change by hand begins or ends */
    clap_event head;
    uint32_t id;
} clap_param_gesture;

typedef struct { /* latency, tail */
    uint32_t (*get)(const clap_plugin *);
} clap_frames;

enum { CLAP_LOG_ERROR = 3 };
typedef struct {
    void (*log)(const clap_host *, int32_t severity, const char *line);
} clap_host_log;

typedef struct {
    void (*exec)(const clap_plugin *, uint32_t task);
} clap_thread_pool;
typedef struct {
    bool (*request_exec)(const clap_host *, uint32_t tasks);
} clap_host_thread_pool;

enum { CLAP_CONTROLS = 8 }; /* per page */
typedef struct {
    char section[CLAP_NAME];
    uint32_t id;
    char name[CLAP_NAME];
    uint32_t parameters[CLAP_CONTROLS];
    bool of_preset;
} clap_remote_page;
typedef struct {
    uint32_t (*count)(const clap_plugin *);
    bool (*get)(const clap_plugin *, uint32_t index, clap_remote_page *);
} clap_remote_controls;

/* --- presets in the host's browser --- */

enum { CLAP_LOCATION_FILE = 0, CLAP_LOCATION_PLUGIN = 1, CLAP_FACTORY_CONTENT = 1, CLAP_USER_CONTENT = 2 };

typedef struct {
    bool (*from_location)(const clap_plugin *, uint32_t kind, const char *location, const char *key);
} clap_preset_load;

typedef struct {
    void (*on_error)(const clap_host *, uint32_t kind, const char *location, const char *key, int32_t error,
                     const char *line);
    void (*loaded)(const clap_host *, uint32_t kind, const char *location, const char *key);
} clap_host_preset_load;

typedef struct {
    const char *abi, *id;
} clap_universal_id;

typedef struct clap_preset_receiver {
    void *data;
    void (*on_error)(const struct clap_preset_receiver *, int32_t error, const char *line);
    bool (*begin_preset)(const struct clap_preset_receiver *, const char *name, const char *key);
    void (*add_plugin_id)(const struct clap_preset_receiver *, const clap_universal_id *);
    void (*set_soundpack_id)(const struct clap_preset_receiver *, const char *);
    void (*set_flags)(const struct clap_preset_receiver *, uint32_t);
    void (*add_creator)(const struct clap_preset_receiver *, const char *);
    void (*set_description)(const struct clap_preset_receiver *, const char *);
    void (*set_timestamps)(const struct clap_preset_receiver *, uint64_t, uint64_t);
    void (*add_feature)(const struct clap_preset_receiver *, const char *);
    void (*add_extra_info)(const struct clap_preset_receiver *, const char *, const char *);
} clap_preset_receiver;

typedef struct {
    uint32_t flags;
    const char *name;
    uint32_t kind;
    const char *location;
} clap_preset_location;

typedef struct {
    const char *name, *description, *ending; /* without its dot */
} clap_preset_filetype;

typedef struct clap_preset_indexer {
    clap_version version;
    const char *name, *vendor, *url, *release;
    void *data;
    bool (*declare_filetype)(const struct clap_preset_indexer *, const clap_preset_filetype *);
    bool (*declare_location)(const struct clap_preset_indexer *, const clap_preset_location *);
    bool (*declare_soundpack)(const struct clap_preset_indexer *, const void *);
    const void *(*get_extension)(const struct clap_preset_indexer *, const char *id);
} clap_preset_indexer;

typedef struct {
    clap_version version;
    const char *id, *name, *vendor;
} clap_provider_descriptor;

typedef struct clap_preset_provider {
    const clap_provider_descriptor *descriptor;
    void *data;
    bool (*init)(const struct clap_preset_provider *);
    void (*destroy)(const struct clap_preset_provider *);
    bool (*get_metadata)(const struct clap_preset_provider *, uint32_t kind, const char *location,
                         const clap_preset_receiver *);
    const void *(*get_extension)(const struct clap_preset_provider *, const char *id);
} clap_preset_provider;

typedef struct clap_preset_factory {
    uint32_t (*count)(const struct clap_preset_factory *);
    const clap_provider_descriptor *(*descriptor)(const struct clap_preset_factory *, uint32_t);
    const clap_preset_provider *(*create)(const struct clap_preset_factory *, const clap_preset_indexer *,
                                          const char *id);
} clap_preset_factory;
#endif
