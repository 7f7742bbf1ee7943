/* A system window that shows a picture: a child of a host window. Each system compiles one of x11.c, win32.c
   and cocoa.c. The first window that opens looks for the system's library: without it there is no window. */
#ifndef LB_WINDOW_H
#define LB_WINDOW_H
#include "picture/picture.h"

enum { LB_PICTURES = 25 };      /* per second, at most */
enum { LB_MAX_SIZE = 8192 }; /* pixels per side */

/* The window system, as CLAP and LV2 call it. */
#if defined(_WIN32)
#define LB_WINDOWS "win32"
#elif defined(__APPLE__)
#define LB_WINDOWS "cocoa"
#else
#define LB_WINDOWS "x11"
#endif

typedef struct lb_window lb_window;
/* Opens a window in `parent`, width x height pixels (Cocoa: points), that shows a picture at a scale and passes pointer
   events, keys and dropped files to it. The picture must live until the window is closed. With X11 the window draws and handles events in its
   own thread, elsewhere in the thread that opens it. Returns 0 if no window can be opened. [main thread] */
lb_window *lb_open_window(lb_picture *, uintptr_t parent, int width, int height, double scale);
void lb_close_window(lb_window *); /* may be 0. [main thread] */
/* Changes its size. [main thread] */
void lb_resize_window(lb_window *, int width, int height, double scale);
/* The system's handle for a window. [main thread] */
uintptr_t lb_window_handle(const lb_window *);
/* The system's present window scale; Cocoa: 1, it counts in points. [main thread] */
double lb_system_scale(void);
/* True if the system shows dark windows, or LIVEBASS_THEME says so: dark or light. [any thread] */
int lb_is_dark(void);
#endif
