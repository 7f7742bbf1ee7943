/* Shared by the LV2 plugin and its window, which may be in another process. */
#ifndef LB_LV2_PORTS_H
#define LB_LV2_PORTS_H
#include "abi/lv2.h"
#include "instance/response.h"

#define URI "urn:livebass:bass"
/* Ports: MIDI, the outputs, the parameters by number, freewheeling; then two outputs, overload and looks. */
enum { MIDI, FIRST_OUT, FREEWHEELING = LB_PARAMETERS, CONTROLS };
/* Atoms. To the window, LOOK_ATOM: an LB_LOOK. To the plugin, WATCH_ATOM: a window is open for another WATCHED seconds,
   an int32 that is not 0 if it does not know the sides yet; and TOUCH_ATOM: an lb_touch. SIDES_ATOM: an lb_sides, kept
   in the plugin's state, to a window that asks for it and from one that changes it. RESPONSE_ATOM: from a window the
   path of a response's file, "": none, or EARLIER and the name of one that the plugin had before; to it the response's
   name; with its final zero. UPDATE_ATOM: an int32; from a window: play the present bass in place of one that the
   session kept; to it: 1 if such a one plays. */
/* SONG_ATOM: from a window an int32, what a hand does with the song (LB_ROLL ...), and a path, with its final zero; to
   it an lb_song_view. */
#define SONG_ATOM URI "#song"
#define LOOK_ATOM URI "#look"
#define WATCH_ATOM URI "#watch"
#define TOUCH_ATOM URI "#touch"
#define SIDES_ATOM URI "#sides"
#define RESPONSE_ATOM URI "#response"
#define UPDATE_ATOM URI "#update"
enum { WATCHED = 3 /* s */ };
enum { EARLIER = ':' }; /* no path and no name begins with it */
_Static_assert(sizeof(lb_sides) <= LB_PATH && LB_PATH <= sizeof(LB_LOOK), "a port for looks has room for it");
_Static_assert(sizeof(lb_song_view) <= sizeof(LB_LOOK), "a port for looks has room for it");
#endif
