/* A sound as text: a preset that plugins, the page and livebass open, or a page's link. [any thread] */
#ifndef LB_TEXT_H
#define LB_TEXT_H
#include "system/files.h"
#include "instance/instance.h"

enum { LB_NUMERAL = 40 }; /* bytes in a number as text */
int lb_read_number(const char *text, double *to); /* reads a whole text as a decimal number; 0: it is not one */
void lb_write_number(char to[LB_NUMERAL], double); /* with the fewest digits that identify it */
char *lb_trimmed(char *line);   /* cuts white space and unquoted `#` comments off; returns its beginning */
char *lb_unquoted(char *value); /* takes the quotes off; 0: it has none */
/* Decodes an address's escapes, in place; `plus`: a + stands for a space. */
void lb_decode(char *text, int plus);
/* Reads a text; returns its fault, to follow a name: "is empty"; 0: none. */
const char *lb_parse_text(const char *text, lb_kept *);
/* Writes a bass, by name, the values of a side, and the file of a response, "": none, as a preset; returns the number of
   bytes. */
size_t lb_write_text(const char *bass, const double values[LB_PARAMETERS], const char *response,
                     char text[LB_MAX_TEXT]);
/* Prints into a text of `room` bytes, from its byte `end` on; returns its new end. */
__attribute__((format(printf, 4, 5))) size_t lb_append(char *text, size_t room, size_t end, const char *form, ...);
#endif
