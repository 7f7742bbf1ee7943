/* Names of tracks in a MIDI file: what they say. The patterns are those of Python (tracknames.py), compiled by
   plugin/names.py. Unlike Python this reads names that are not UTF-8 as Latin-1, whatever their language, and neither
   composes letters nor widens narrow ones. [any thread] */
#ifndef LB_NAMES_H
#define LB_NAMES_H
#include <stddef.h>
#include <stdint.h>

enum { LB_NAME = 40, LB_NAME_BYTES = 4 * LB_NAME + 1 }; /* characters that are kept of a name, and their bytes */
typedef struct {
    int count;
    int32_t letters[LB_NAME];
} lb_name;

/* Reads a name: without spaces around it, others for what cannot be printed, and ... for what is too long. */
void lb_read_name(lb_name *, const uint8_t *bytes, size_t count);
/* Writes it in UTF-8. */
void lb_write_name(const lb_name *, char text[LB_NAME_BYTES]);
/* True if a program of kernels.h finds its words in a name, in small or large letters; if the whole name is its word. */
int lb_name_has(const lb_name *, const int32_t *program);
int lb_name_is(const lb_name *, const int32_t *program);
#endif
