/* The part of VST 3's binary interface that vst3.c uses: function order, layouts, identifiers.

   An interface is a pointer to a table of functions, which begins with the three of `vst3_unknown`; each takes the
   address of that pointer. Structs have C's layout on 64-bit systems. */
#ifndef LB_VST3_ABI_H
#define LB_VST3_ABI_H
#include <stdint.h>

typedef int32_t vst3_result;
typedef uint8_t vst3_id[16];
typedef int16_t vst3_text[128]; /* UTF-16 */

#define VST3_BYTES(x) (x) >> 24 & 255, (x) >> 16 & 255, (x) >> 8 & 255, (x) & 255
#ifdef _WIN32 /* COM's identifiers */
#define VST3_ID(a, b, c, d) \
    {(a) & 255, (a) >> 8 & 255, (a) >> 16 & 255, (a) >> 24 & 255, (b) >> 16 & 255, (b) >> 24 & 255, (b) & 255, \
     (b) >> 8 & 255, VST3_BYTES(c), VST3_BYTES(d)}
enum {
    VST3_OK = 0,
    VST3_NO = 1,
    VST3_NO_INTERFACE = (int32_t)0x80004002,
    VST3_INVALID = (int32_t)0x80070057,
    VST3_MISSING = (int32_t)0x80004001,
};
#else
#define VST3_ID(a, b, c, d) {VST3_BYTES(a), VST3_BYTES(b), VST3_BYTES(c), VST3_BYTES(d)}
enum { VST3_NO_INTERFACE = -1, VST3_OK = 0, VST3_NO = 1, VST3_INVALID = 2, VST3_MISSING = 3 };
#endif

#define VST3_UNKNOWN VST3_ID(0u, 0u, 0xC0000000u, 0x46u)
#define VST3_BASE VST3_ID(0x22888DDBu, 0x156E45AEu, 0x8358B348u, 0x08190625u)
#define VST3_COMPONENT VST3_ID(0xE831FF31u, 0xF2D54301u, 0x928EBBEEu, 0x25697802u)
#define VST3_PROCESSOR VST3_ID(0x42043F99u, 0xB7DA453Cu, 0xA569E79Du, 0x9AAEC33Du)
#define VST3_CONTROLLER VST3_ID(0xDCD7BBE3u, 0x7742448Du, 0xA874AACCu, 0x979C759Eu)
#define VST3_MIDI_MAPPING VST3_ID(0xDF0FF9F7u, 0x49B74669u, 0xB63AB732u, 0x7ADBF5E5u)
#define VST3_UNITS VST3_ID(0x3D4BD6B5u, 0x913A4FD2u, 0xA886E768u, 0xA5EB92C1u)
#define VST3_EXPRESSIONS VST3_ID(0xB7F8F859u, 0x41234872u, 0x91169581u, 0x4F3721A3u)
#define VST3_SWITCHES VST3_ID(0x1F2F76D3u, 0xBFFB4B96u, 0xB99527A5u, 0x5EBCCEF4u)
#define VST3_CONTEXT VST3_ID(0x2A654303u, 0xEF764E3Du, 0x95B5FE83u, 0x730EF6D0u)
#define VST3_PHYSICAL VST3_ID(0xB03078FFu, 0x94D24AC8u, 0x90CCD303u, 0xD4133324u)
#define VST3_HANDLER VST3_ID(0x93A0BEA3u, 0x0BD045DBu, 0x8E890B0Cu, 0xC1E46AC6u)
#define VST3_VIEW VST3_ID(0x5BC32507u, 0xD06049EAu, 0xA6151B52u, 0x2B755B29u)
#define VST3_VIEW_SCALE VST3_ID(0x65ED9690u, 0x8AC44525u, 0x8AADEF7Au, 0x72EA703Fu)
#define VST3_TIMER VST3_ID(0x10BDD94Fu, 0x41424774u, 0x821FAD8Fu, 0xECA72CA9u)
#define VST3_RUN_LOOP VST3_ID(0x18C35366u, 0x97764F1Au, 0x9C5B8385u, 0x7A871389u)
#define VST3_FACTORY VST3_ID(0x7A4D811Cu, 0x52114A1Fu, 0xAED9D2EEu, 0x0B43BF9Fu)
#define VST3_FACTORY_2 VST3_ID(0x0007B650u, 0xF24B4C0Bu, 0xA464EDB9u, 0xF00B2ABBu)

typedef struct {
    vst3_result (*query)(void *, const vst3_id, void **);
    uint32_t (*take)(void *), (*drop)(void *);
} vst3_unknown;

/* --- from hosts: the address of a pointer to these --- */

typedef struct {
    vst3_unknown unknown;
    vst3_result (*read)(void *, void *, int32_t, int32_t *);
    vst3_result (*write)(void *, void *, int32_t, int32_t *);
} vst3_stream; /* and more */

typedef struct {
    vst3_unknown unknown;
    uint32_t (*id)(void *);
    int32_t (*count)(void *);
    vst3_result (*point)(void *, int32_t index, int32_t *offset, double *value);
    vst3_result (*add)(void *, int32_t offset, double value, int32_t *index);
} vst3_queue;

typedef struct {
    vst3_unknown unknown;
    int32_t (*count)(void *);
    vst3_queue **(*queue)(void *, int32_t index);
    vst3_queue **(*add)(void *, const uint32_t *id, int32_t *index);
} vst3_changes;

enum { VST3_VALUES_CHANGED = 1 << 2, VST3_SWITCHES_CHANGED = 1 << 10 }; /* flags of restart */
typedef struct { /* of the controls: receives changes by hand */
    vst3_unknown unknown;
    vst3_result (*begin)(void *, uint32_t id);
    vst3_result (*perform)(void *, uint32_t id, double value);
    vst3_result (*end)(void *, uint32_t id);
    vst3_result (*restart)(void *, int32_t flags);
} vst3_handler;

typedef struct { /* of the host's thread for windows, on Linux */
    vst3_unknown unknown;
    vst3_result (*register_handler)(void *, void *handler, int file);
    vst3_result (*drop_handler)(void *, void *handler);
    vst3_result (*register_timer)(void *, void *timer, uint64_t ms);
    vst3_result (*drop_timer)(void *, void *timer);
} vst3_run_loop;

typedef struct {
    vst3_unknown unknown;
    void (*on_timer)(void *);
} vst3_timer;

typedef struct {
    int32_t left, top, right, bottom;
} vst3_box;

typedef struct {
    vst3_unknown unknown;
    vst3_result (*supported)(void *, const char *type);
    vst3_result (*attached)(void *, void *parent, const char *type);
    vst3_result (*removed)(void *);
    vst3_result (*wheel)(void *, float);
    vst3_result (*key_down)(void *, int16_t, int16_t, int16_t);
    vst3_result (*key_up)(void *, int16_t, int16_t, int16_t);
    vst3_result (*size)(void *, vst3_box *);
    vst3_result (*on_size)(void *, const vst3_box *);
    vst3_result (*focus)(void *, uint8_t);
    vst3_result (*set_frame)(void *, void *frame);
    vst3_result (*can_resize)(void *);
    vst3_result (*check_size)(void *, vst3_box *);
} vst3_view;

typedef struct { /* of the host, around a view */
    vst3_unknown unknown;
    vst3_result (*resize)(void *, void *view, vst3_box *);
} vst3_frame;

typedef struct {
    vst3_unknown unknown;
    vst3_result (*set_scale)(void *, float);
} vst3_view_scale;

enum { VST3_NOTE_ON = 0, VST3_NOTE_OFF = 1, VST3_NOTE_PRESSURE = 3, VST3_NOTE_EXPRESSION = 4 };
/* Note expressions, 0 to 1; for the tuning, -120 to 120 semitones */
enum { VST3_TUNING = 2, VST3_VIBRATO = 3, VST3_BRIGHTNESS = 5 };
typedef struct {
    int32_t bus, offset;
    double quarters;
    uint16_t flags, type;
    union {
        struct {
            int16_t channel, key;
            float tuning, velocity; /* cents; 0 to 1 */
            int32_t length, id;
        } on;
        struct {
            int16_t channel, key;
            float velocity;
            int32_t id;
            float tuning;
        } off;
        struct {
            int16_t channel, key;
            float pressure;
            int32_t id;
        } pressure;
        struct {
            uint32_t type;
            int32_t id;
            double value;
        } expression;
        struct {
            uint32_t size, type;
            const uint8_t *bytes;
        } data;
    };
} vst3_event;

typedef struct {
    vst3_unknown unknown;
    int32_t (*count)(void *);
    vst3_result (*get)(void *, int32_t index, vst3_event *);
} vst3_events; /* and more */

/* --- structs --- */

enum { VST3_AUDIO = 0, VST3_EVENTS = 1 };  /* media */
enum { VST3_INPUT = 0, VST3_OUTPUT = 1 };  /* directions */
enum { VST3_MAIN = 0, VST3_AUX = 1 };      /* types of buses */
enum { VST3_DEFAULT_ACTIVE = 1 };          /* flags of buses */
enum { VST3_SAMPLE_32 = 0 };
enum { VST3_OFFLINE = 2 };                 /* modes of processing */
#define VST3_SPEAKER_MONO ((uint64_t)1 << 19)
#define VST3_SPEAKERS_STEREO ((uint64_t)3)

typedef struct {
    int32_t channels;
    uint64_t silence;
    float **data;
} vst3_buffers;

typedef struct {
    int32_t mode, sample_size, frames, input_count, output_count;
    vst3_buffers *inputs, *outputs;
    vst3_changes **changes, **output_changes;
    vst3_events **events, **output_events;
    void *context;
} vst3_process_data;

typedef struct {
    int32_t mode, sample_size, max_frames;
    double rate;
} vst3_setup;

typedef struct {
    int32_t media, direction, channels;
    vst3_text name;
    int32_t type;
    uint32_t flags;
} vst3_bus;

enum {
    VST3_CAN_AUTOMATE = 1,
    VST3_IS_READ_ONLY = 1 << 1,
    VST3_IS_LIST = 1 << 3,
    VST3_IS_HIDDEN = 1 << 4,
    VST3_IS_PROGRAM_CHANGE = 1 << 15,
};
typedef struct {
    uint32_t id;
    vst3_text title, short_title, unit_name;
    int32_t steps;
    double default_value; /* 0 to 1 */
    int32_t unit, flags;
} vst3_parameter;

enum { VST3_ROOT_UNIT = 0, VST3_NO_UNIT = -1 };
typedef struct {
    int32_t id, parent;
    vst3_text name;
    int32_t programs;
} vst3_unit;

typedef struct {
    int32_t id;
    vst3_text name;
    int32_t count;
} vst3_programs;

enum { VST3_IS_BIPOLAR = 1 };
typedef struct {
    uint32_t type;
    vst3_text title, short_title, unit_name;
    int32_t unit;
    double default_value, minimum, maximum;
    int32_t steps;
    uint32_t parameter;
    int32_t flags;
} vst3_expression;

enum { VST3_BEFORE_NOTES = 0 }; /* key switches: pressed before a note, or as it begins */
typedef struct {
    uint32_t type;
    vst3_text title, short_title;
    int32_t minimum, maximum, remapped, unit, flags; /* keys, -1: none */
} vst3_switch;

/* Motions on a keyboard, and their note expressions. */
enum { VST3_MOVED_X = 0, VST3_MOVED_Y = 1, VST3_PRESSED = 2 };
typedef struct {
    uint32_t physical, expression;
} vst3_physical;
typedef struct {
    uint32_t count;
    vst3_physical *map;
} vst3_physicals;

/* Controller numbers beyond MIDI's, for the mapping. */
enum { VST3_PRESSURE = 128, VST3_BEND = 129, VST3_CONTROLLERS = 130 };

/* --- the plugin's tables of functions --- */

typedef struct {
    vst3_unknown unknown;
    vst3_result (*initialize)(void *, void *context);
    vst3_result (*terminate)(void *);
    vst3_result (*controller_class)(void *, vst3_id);
    vst3_result (*set_io_mode)(void *, int32_t);
    int32_t (*bus_count)(void *, int32_t media, int32_t direction);
    vst3_result (*bus_info)(void *, int32_t media, int32_t direction, int32_t index, vst3_bus *);
    vst3_result (*routing)(void *, void *, void *);
    vst3_result (*activate_bus)(void *, int32_t media, int32_t direction, int32_t index, uint8_t on);
    vst3_result (*set_active)(void *, uint8_t on);
    vst3_result (*set_state)(void *, vst3_stream **);
    vst3_result (*get_state)(void *, vst3_stream **);
} vst3_component;

typedef struct {
    vst3_unknown unknown;
    vst3_result (*set_arrangements)(void *, uint64_t *inputs, int32_t, uint64_t *outputs, int32_t);
    vst3_result (*arrangement)(void *, int32_t direction, int32_t index, uint64_t *);
    vst3_result (*can_sample_size)(void *, int32_t);
    uint32_t (*latency)(void *);
    vst3_result (*setup)(void *, vst3_setup *);
    vst3_result (*set_processing)(void *, uint8_t on);
    vst3_result (*process)(void *, vst3_process_data *);
    uint32_t (*tail)(void *);
} vst3_processor;

typedef struct {
    vst3_unknown unknown;
    vst3_result (*initialize)(void *, void *context);
    vst3_result (*terminate)(void *);
    vst3_result (*set_component_state)(void *, vst3_stream **);
    vst3_result (*set_state)(void *, vst3_stream **);
    vst3_result (*get_state)(void *, vst3_stream **);
    int32_t (*count)(void *);
    vst3_result (*info)(void *, int32_t index, vst3_parameter *);
    vst3_result (*to_text)(void *, uint32_t id, double, vst3_text);
    vst3_result (*from_text)(void *, uint32_t id, int16_t *, double *);
    double (*to_plain)(void *, uint32_t id, double);
    double (*to_normal)(void *, uint32_t id, double);
    double (*value)(void *, uint32_t id);
    vst3_result (*set_value)(void *, uint32_t id, double);
    vst3_result (*set_handler)(void *, void *);
    void *(*create_view)(void *, const char *);
} vst3_controller;

typedef struct {
    vst3_unknown unknown;
    vst3_result (*parameter)(void *, int32_t bus, int16_t channel, int16_t controller, uint32_t *id);
} vst3_midi_mapping;

typedef struct {
    vst3_unknown unknown;
    int32_t (*count)(void *);
    vst3_result (*info)(void *, int32_t index, vst3_unit *);
    int32_t (*list_count)(void *);
    vst3_result (*list_info)(void *, int32_t index, vst3_programs *);
    vst3_result (*program_name)(void *, int32_t list, int32_t program, vst3_text);
    vst3_result (*program_info)(void *, int32_t list, int32_t program, const char *, vst3_text);
    vst3_result (*has_pitch_names)(void *, int32_t list, int32_t program);
    vst3_result (*pitch_name)(void *, int32_t list, int32_t program, int16_t key, vst3_text);
    int32_t (*selected)(void *);
    vst3_result (*select)(void *, int32_t unit);
    vst3_result (*of_bus)(void *, int32_t media, int32_t direction, int32_t bus, int32_t channel, int32_t *unit);
    vst3_result (*set_program_data)(void *, int32_t list, int32_t program, vst3_stream **);
} vst3_units;

typedef struct {
    vst3_unknown unknown;
    int32_t (*count)(void *, int32_t bus, int16_t channel);
    vst3_result (*info)(void *, int32_t bus, int16_t channel, int32_t index, vst3_expression *);
    vst3_result (*to_text)(void *, int32_t bus, int16_t channel, uint32_t type, double, vst3_text);
    vst3_result (*from_text)(void *, int32_t bus, int16_t channel, uint32_t type, const int16_t *, double *);
} vst3_expressions;

typedef struct {
    vst3_unknown unknown;
    uint32_t (*requirements)(void *);
} vst3_context;

typedef struct {
    vst3_unknown unknown;
    vst3_result (*mapping)(void *, int32_t bus, int16_t channel, vst3_physicals *);
} vst3_physical_mapping;

typedef struct {
    vst3_unknown unknown;
    int32_t (*count)(void *, int32_t bus, int16_t channel);
    vst3_result (*info)(void *, int32_t bus, int16_t channel, int32_t index, vst3_switch *);
} vst3_switches;

/* --- the factory of a binary --- */

enum { VST3_UNICODE = 16, VST3_MANY = 0x7FFFFFFF };
typedef struct {
    char vendor[64], url[256], email[128];
    int32_t flags;
} vst3_factory_info;

typedef struct {
    vst3_id id;
    int32_t cardinality;
    char category[32], name[64];
} vst3_class;

typedef struct {
    vst3_id id;
    int32_t cardinality;
    char category[32], name[64];
    uint32_t flags;
    char sub_categories[128], vendor[64], release[64], sdk[64];
} vst3_class_2;

typedef struct {
    vst3_unknown unknown;
    vst3_result (*info)(void *, vst3_factory_info *);
    int32_t (*count)(void *);
    vst3_result (*class_info)(void *, int32_t index, vst3_class *);
    vst3_result (*create)(void *, const vst3_id class_id, const vst3_id interface_id, void **);
    vst3_result (*class_info_2)(void *, int32_t index, vst3_class_2 *);
} vst3_factory;
#endif
