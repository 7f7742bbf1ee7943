/* The picture in the plugin's window: drawn into memory, without a toolkit; it knows no system and no host. Everything
   here is called by one thread, the window's. */
#ifndef LB_PICTURE_H
#define LB_PICTURE_H
#include "instance.h"

enum { LB_WIDTH = 900, LB_HEIGHT = 460 };             /* as a window opens, of scale 1 ... */
enum { LB_LEAST_WIDTH = 640, LB_LEAST_HEIGHT = 320 }; /* ... and the least that shows everything */
enum { LB_POINT_MOVE, LB_POINT_PRESS, LB_POINT_RELEASE, LB_POINT_LEAVE, LB_POINT_DOUBLE, LB_POINT_UP, LB_POINT_DOWN };
enum { LB_SHIFT = 1, LB_CONTROL = 2, LB_ALT = 4, LB_RIGHT = 8 }; /* modifiers; LB_RIGHT: the right button */
/* The shape of the pointer that lb_point returns. */
enum { LB_POINTER_USUAL, LB_POINTER_HAND, LB_POINTER_ACROSS /* may be dragged left and right */ };

/* What a picture shows and whom it calls. */
typedef struct {
    void *owner;
    const lb_look *look;
    double (*value)(void *owner, int parameter);
    double (*most)(void *owner, int parameter);
    /* The phases LB_BEGIN and LB_END have the value, too. */
    void (*set)(void *owner, int parameter, double value, int phase);
    void (*text)(void *owner, int parameter, double value, char *, size_t);
    /* A note of a string, counted from 0, by hand: velocity 0 to 1. */
    void (*note)(void *owner, int on, int string, int key, double velocity);
    /* What a key of the bass switches, 0: nothing; for the names of the lamps. */
    const lb_switch *(*switched)(void *owner, int key);
    /* Takes the last change back; goes to the other side, A or B; which one that is, 1: B. */
    void (*undo)(void *owner), (*swap)(void *owner);
    int (*side)(void *owner);
    /* Lets the next MIDI controller move a parameter, or frees it from the one that does; which one does: LB_NO_CONTROLLER, or
       LB_WAITS for it. 0: this window cannot. */
    void (*learn)(void *owner, int parameter);
    int (*controller)(void *owner, int parameter);
    /* The user's sounds: reads the folder and returns how many there are; the name of one. 0: this window has none. */
    int (*list)(void *owner);
    const char *(*sound)(void *owner, int sound);
    /* Keeps what is set, and says under which name; takes one over; both return 0 if that cannot be done. */
    int (*save)(void *owner, char *name, size_t);
    int (*load)(void *owner, int sound);
    void (*remove)(void *owner, int sound);
    /* Takes over a text, the link of a page or a sound; returns what is wrong with it, 0: nothing. 0: this window has no
       clipboard. */
    const char *(*paste)(void *owner, const char *text);
} lb_face;
enum { LB_NO_CONTROLLER = -1, LB_WAITS = -2 };

typedef struct lb_picture lb_picture;
/* Returns 0 if there is no memory. The face is copied. */
lb_picture *lb_new_picture(const lb_face *);
void lb_free_picture(lb_picture *); /* may be 0; ends what the pointer holds */
/* Draws into pixels 0xFFRRGGBB, width x height, row after row, which hold what was drawn there last. `scale`: pixels of
   the array a pixel of the design, 1 to 4; `dark`: the theme; `seconds`: a clock. Only what has changed is drawn, and
   `dirty` becomes its x, y, width and height, 0 0 0 0: nothing. All is drawn if size, scale, theme or array are others
   than before. */
void lb_draw(lb_picture *, uint32_t *pixels, int width, int height, double scale, int dark, double seconds,
             int dirty[4]);
/* The pointer does something (LB_POINT_...) at x, y, in pixels of the array; returns the shape it shall have. Release
   and leave end what it holds. LB_POINT_DOUBLE comes in place of the second press. */
int lb_point(lb_picture *, int kind, double x, double y, int modifiers);
/* True, once, after a press that asks for the text of the clipboard; what is in it, 0: no text, goes to lb_paste. */
int lb_wants_text(lb_picture *);
void lb_paste(lb_picture *, const char *text);
#endif
