/* The picture in the plugin's window: drawn into memory, without a toolkit; it knows no system and no host. Only the
   window's thread may call these functions. */
#ifndef LB_PICTURE_H
#define LB_PICTURE_H
#include "instance/instance.h"

enum { LB_WIDTH = 900, LB_HEIGHT = 460 };             /* a new window's size, at scale 1 ... */
enum { LB_MIN_WIDTH = 640, LB_MIN_HEIGHT = 320 }; /* ... and the smallest that shows everything */
enum { LB_POINT_MOVE, LB_POINT_PRESS, LB_POINT_RELEASE, LB_POINT_LEAVE, LB_POINT_DOUBLE, LB_POINT_UP, LB_POINT_DOWN };
/* Keys: letters by their Unicode number, and these. */
enum { LB_KEY_BACK = 8, LB_KEY_TAB = 9, LB_KEY_ENTER = 13, LB_KEY_ESCAPE = 27, LB_KEY_DELETE = 127,
       LB_KEY_LEFT = 0x110000, LB_KEY_UP, LB_KEY_RIGHT, LB_KEY_DOWN };
enum { LB_SHIFT = 1, LB_CONTROL = 2, LB_ALT = 4, LB_RIGHT = 8 }; /* modifiers; LB_RIGHT: the right button */
/* The shape of the pointer that lb_point returns. */
enum { LB_POINTER_DEFAULT, LB_POINTER_HAND, LB_POINTER_ACROSS /* may be dragged left and right */ };

/* A picture's contents and callbacks; `owner` is the instance. */
typedef struct {
    lb_instance *owner;
    const lb_look *look;
    double (*value)(const lb_instance *, int parameter);
    double (*maximum)(const lb_instance *, int parameter);
    /* `value` is also set in the phases LB_BEGIN and LB_END. */
    void (*set)(lb_instance *, int parameter, double value, int phase);
    void (*text)(const lb_instance *, int parameter, double value, char *, size_t);
    /* Reads a value; returns 0 if the text is not one. */
    int (*read)(const lb_instance *, int parameter, const char *text, double *value);
    /* A note by hand on a string, counted from 0: velocity 0 to 1. */
    void (*note)(lb_instance *, int on, int string, int key, double velocity);
    /* The present bass's own values, for the bench; 0: none. 0 instead of the function: this window has none. */
    const lb_own *(*own)(const lb_instance *);
    /* A key's switch, 0: none; for the names of the lamps. */
    const lb_switch *(*switched)(const lb_instance *, int key);
    /* Undoes the last change; goes to the other side, A or B; the present side, 1: B. */
    void (*undo)(lb_instance *), (*swap)(lb_instance *);
    int (*side)(const lb_instance *);
    int (*kept)(const lb_instance *);    /* the bass plays as a session kept it, and the present one differs */
    void (*update)(lb_instance *); /* plays the present one */
    void (*copy)(lb_instance *); /* copies the present side to the other */
    /* Lets the next MIDI controller move a parameter, or frees it from its controller; its controller: LB_NO_CONTROLLER
       for none, LB_WAITS while it waits. 0: this window cannot. */
    void (*learn)(lb_instance *, int parameter);
    int (*controller)(const lb_instance *, int parameter);
    /* Writes the name of the sound that plays, or the bass's, with a * if it has changed since. */
    void (*title)(const lb_instance *, char *text, size_t);
    int (*playing)(const lb_instance *);         /* the sound that plays, as listed; -1: none */
    int (*group)(const lb_instance *, int bass); /* LB_SHIPPED, LB_MINE, LB_LABORATORY */
    /* Sounds: reads their folders and returns their number; the name of one. 0: this window has none. */
    int (*list)(lb_instance *);
    const char *(*sound)(const lb_instance *, int sound);
    int (*is_own)(const lb_instance *, int sound); /* the user's, not the factory's; 0: all are */
    /* Saves the present values under `name`, empty: the bass's, and writes their name there; loads a sound; both return
       0 on failure. */
    int (*save)(lb_instance *, char *name, size_t);
    int (*load)(lb_instance *, int sound);
    void (*remove)(lb_instance *, int sound);
    /* The response's name; the files of the user's folder: reads it and returns their number; the name of one; chooses
       one, -1: none, and returns the fault, 0: none. 0: this window has none. */
    void (*response)(lb_instance *, char *text, size_t);
    int (*responses)(lb_instance *);
    const char *(*response_name)(lb_instance *, int file);
    const char *(*respond)(lb_instance *, int file);
    /* The enlargement of all windows: sets it, 1 for 100 %, unless `to` is 0, and returns it. 0: this window has none. */
    double (*zoom)(lb_instance *, double to);
    /* Loads a text, a page's link or a sound; returns its fault, 0: none. 0: this window has no clipboard. */
    const char *(*paste)(lb_instance *, const char *text);
    /* Takes a file dropped on the window, by its path or address, likewise. 0: this window takes none. */
    const char *(*drop)(lb_instance *, const char *text);
    /* The song, and what a hand does with it: LB_ROLL ... 0: this window has none. */
    void (*song)(lb_instance *, lb_song_view *);
    void (*steer)(lb_instance *, int what);
    /* Why sliders have stopped last, and its fault as a clause. 0: this window does not tell. */
    lb_stop (*stopped)(const lb_instance *);
    size_t (*fault)(const lb_fault *, char *text, size_t);
} lb_face;
enum { LB_NO_CONTROLLER = -1, LB_WAITS = -2 };

typedef struct lb_picture lb_picture;
/* Returns 0 if there is no memory. The face is copied. */
lb_picture *lb_new_picture(const lb_face *);
void lb_free_picture(lb_picture *); /* may be 0; ends what the pointer holds */
/* Draws into pixels 0xFFRRGGBB, width x height, row after row, which must still hold the last picture. `scale`: array
   pixels per design pixel, 1 to 4; `dark`: the theme; `seconds`: a clock. Draws only changes; `dirty` becomes their x,
   y, width and height, 0 0 0 0: none. The zoom enlarges it further, as far as it has room. Draws everything if size,
   scale, theme or array have changed. */
void lb_draw(lb_picture *, uint32_t *pixels, int width, int height, double scale, int dark, double seconds,
             int dirty[4]);
/* Returns the k-th of the areas, apart from each other, that the last picture has drawn: x, y, width, height, together
   `dirty` or smaller; 0 after the last. */
int lb_drawn_area(const lb_picture *, int k, int area[4]);
/* Handles a pointer event (LB_POINT_...) at x, y, in array pixels; returns the pointer's new shape. Release and leave
   end a hold. LB_POINT_DOUBLE replaces the second press. */
int lb_point(lb_picture *, int kind, double x, double y, int modifiers);
/* Handles a key; returns 0 if it is the host's. */
int lb_key(lb_picture *, int key, int modifiers);
/* True while something is typed: the window then takes the keyboard. */
int lb_wants_keys(const lb_picture *);
/* True, once, after a press that asks for the clipboard's text; pass that, or 0 if there is none, to lb_paste. */
int lb_wants_text(lb_picture *);
void lb_paste(lb_picture *, const char *text);
/* Takes a dropped file: a path, or a list of addresses in lines, of which the first counts. */
void lb_drop(lb_picture *, const char *text);
#endif
