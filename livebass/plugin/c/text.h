/* A sound as text: a preset that plugins, the page and livebass open, or a page's link. [any thread] */
#ifndef LB_TEXT_H
#define LB_TEXT_H
#include "files.h"
#include "instance.h"

/* Decodes an address's escapes, in place; `plus`: a + stands for a space. */
void lb_decode(char *text, int plus);
/* Reads a text; returns its fault, to follow a name: "is empty"; 0: none. */
const char *lb_parse_text(const char *text, lb_kept *);
/* Writes a bass, by name, the values of a side, and the file of a response, "": none, as a preset; returns the number of
   bytes. */
size_t lb_write_text(const char *bass, const double values[LB_PARAMETERS], const char *response,
                     char text[LB_MOST_TEXT]);
/* Prints into a text of `room` bytes, from its byte `end` on; returns its new end. */
__attribute__((format(printf, 4, 5))) size_t lb_append(char *text, size_t room, size_t end, const char *form, ...);
#endif
