/* What the LV2 plugin and its window, which may be in another process, know of each other. */
#ifndef LB_LV2_PORTS_H
#define LB_LV2_PORTS_H
#include "instance.h"
#include "lv2_abi.h"

#define URI "urn:livebass:bass"
/* Ports: MIDI, the outputs, the parameters in the order of their numbers, freewheeling; overload and looks, outputs. */
enum { MIDI, FIRST_OUT, FREEWHEELING = LB_PARAMETERS, CONTROLS };
/* Atoms. LOOK_ATOM: an LB_LOOK, to the window; to the plugin WATCH_ATOM: a window is open, for another WATCHED seconds, and
   TOUCH_ATOM: an lb_touch. */
#define LOOK_ATOM URI "#look"
#define WATCH_ATOM URI "#watch"
#define TOUCH_ATOM URI "#touch"
enum { WATCHED = 3 /* s */ };
#endif
