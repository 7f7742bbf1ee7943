/* The plugin's window as the shells of CLAP, VST3 and LV2 hold it: a picture in a window of the system. */
#ifndef LB_EDITOR_H
#define LB_EDITOR_H
#include "window.h"

typedef struct lb_editor lb_editor;
/* Opens the window; the look of the face is watched until it is closed. Returns 0 if there is no memory or no window to
   be had. [main thread] */
lb_editor *lb_open_editor(const lb_face *, lb_look *, uintptr_t parent, int width, int height, double scale);
/* The same for an instance, which is told of what is done in it. */
lb_editor *lb_edit_instance(lb_instance *, uintptr_t parent, int width, int height, double scale);
lb_face lb_face_of(lb_instance *); /* what its window shows, and whom it calls */
void lb_close_editor(lb_editor *); /* may be 0 */
void lb_resize_editor(lb_editor *, int width, int height, double scale);
uintptr_t lb_editor_handle(const lb_editor *);
/* Holds a size within what the picture takes at a scale. */
void lb_allowed_size(double scale, int *width, int *height);
#endif
