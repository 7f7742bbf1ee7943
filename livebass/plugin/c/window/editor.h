/* The plugin's window for the CLAP, VST3 and LV2 shells: a picture in a system window. */
#ifndef LB_EDITOR_H
#define LB_EDITOR_H
#include "window/window.h"

typedef struct lb_editor lb_editor;
/* Opens a window for an instance, which receives its changes; it watches the instance's look until it is closed. Returns
   0 without memory or a window. [main thread] */
lb_editor *lb_edit_instance(lb_instance *, uintptr_t parent, int width, int height, double scale);
lb_face lb_face_of(lb_instance *); /* its window's contents and callbacks */
void lb_close_editor(lb_editor *); /* may be 0 */
void lb_resize_editor(lb_editor *, int width, int height, double scale);
uintptr_t lb_editor_handle(const lb_editor *);
/* The size of a new window at a scale, with the user's zoom. */
void lb_default_size(double scale, int *width, int *height);
/* Clamps a size to the picture's limits at a scale. */
void lb_allowed_size(double scale, int *width, int *height);
#endif
