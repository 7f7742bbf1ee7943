/* The page as the plugin's editor, in a web view of the host's: what the page and a plugin say to each other.

   The page lies beside the instruments, as one file. It asks what is to be seen whenever it draws, and is answered: so
   nothing is sent to a view that is hidden or closed, and no timer is needed. */
#ifndef LB_PAGE_H
#define LB_PAGE_H
#include "editor.h"

/* What the page says: one of these and its numbers, all float64, little-endian. */
enum {
    LB_PAGE_SEE,  /* 1: has just been opened: answered by LB_PAGE_BASSES before; always by LB_PAGE_SEEN */
    LB_PAGE_MOVE, /* parameter, value, phase: LB_BEGIN, LB_MOVE or LB_END */
    LB_PAGE_NOTE, /* 1: on, 0: off; string or -1: any; key; velocity, 0 to 1 */
    LB_PAGE_UNDO,
    LB_PAGE_SWAP, /* goes to the other side, A or B */
};
/* What it is told: one of these, int64, and what follows. */
enum {
    LB_PAGE_BASSES, /* UTF-8: name, tab, title, a line each, in the order of the parameter LB_BASS */
    LB_PAGE_SEEN, /* side, int64; rate (Hz, 0: it has not played) and values of all parameters, float64; and, once it has
                     played, the part of an LB_LOOK that holds its strings */
};

/* Writes the file: address of the page in `folder`, where plugins have their instruments, (room) bytes, which may be 0;
   returns its length with the 0 behind it, or 0 if there is no page. */
size_t lb_page_address(const char *folder, char *to, size_t room);
/* What is held on the page, so that it can be let go when the page is closed: the view may go away without a word. */
typedef struct {
    uint8_t keys[LB_KEYS];         /* that sound */
    uint8_t moved[LB_PARAMETERS];  /* 1: its move has begun */
} lb_page;

void lb_open_page(lb_instance *, lb_page *); /* has looks taken. [main thread] */
void lb_close_page(lb_instance *, lb_page *); /* [main thread] */

/* Does what the page says; answers by `send`, with `to`. Returns 0, and does nothing, if that is not understood. [main
   thread] */
int lb_hear_page(lb_instance *, lb_page *, const void *bytes, size_t size,
                 void (*send)(void *to, const void *, size_t), void *to);
#endif
