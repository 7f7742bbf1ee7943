/* A sound as text: a preset that plugins, the page and livebass open, or a page's link. [any thread] */
#ifndef LB_TEXT_H
#define LB_TEXT_H
#include "files.h"
#include "instance.h"

/* Reads a text; returns its fault, to follow a name: "is empty"; 0: none. */
const char *lb_parse_text(const char *text, lb_kept *);
/* Writes a bass, by name, and the values of a side as a preset; returns the number of bytes. */
size_t lb_write_text(const char *bass, const double values[LB_PARAMETERS], char text[LB_MOST_TEXT]);
/* Prints into a text of `room` bytes, from its byte `end` on; returns its new end. */
__attribute__((format(printf, 4, 5))) size_t lb_append(char *text, size_t room, size_t end, const char *form, ...);
#endif
