/* A window of the system that shows a picture: a child of a window of the host's. One of window_x11.c, window_win32.c and
   window_cocoa.c is compiled to something. The system's library is looked for when the first window opens: where there
   is none, there is no window. */
#ifndef LB_WINDOW_H
#define LB_WINDOW_H
#include "picture.h"

enum { LB_PICTURES = 30 };      /* a second, at most */
enum { LB_MOST_SIZE = 8192 }; /* pixels, of a side */

/* Where the system's windows come from, as CLAP and LV2 call it. */
#if defined(_WIN32)
#define LB_WINDOWS "win32"
#elif defined(__APPLE__)
#define LB_WINDOWS "cocoa"
#else
#define LB_WINDOWS "x11"
#endif

typedef struct lb_window lb_window;
/* Opens a window in `parent`, width x height pixels (Cocoa: points), that shows a picture at a scale, and lets the
   pointer at it. The picture must live until it is closed. With X11 the window draws and points in a thread of its own,
   elsewhere in the thread that opens it. Returns 0 if there is none to be had. [main thread] */
lb_window *lb_open_window(lb_picture *, uintptr_t parent, int width, int height, double scale);
void lb_close_window(lb_window *); /* may be 0. [main thread] */
/* Makes it another size. [main thread] */
void lb_resize_window(lb_window *, int width, int height, double scale);
/* What the host calls a window of its own. [main thread] */
uintptr_t lb_window_handle(const lb_window *);
/* By which scale the system shows windows now; Cocoa: 1, it counts in points. [main thread] */
double lb_system_scale(void);
/* True if the system shows dark windows, or LIVEBASS_THEME says so: dark or light. [any thread] */
int lb_is_dark(void);
#endif
