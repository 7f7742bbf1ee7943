/* Impulse responses of cabinets and rooms, from sound files; sessions keep their samples. */
#ifndef LB_RESPONSE_H
#define LB_RESPONSE_H
#include "instance/instance.h"

enum { LB_MAX_RESPONSE = (int)(LB_LONGEST * LB_MAX_RATE) }; /* samples */
enum { LB_MAX_RESPONSES = 200 };
#define LB_RESPONSES "responses"                              /* their folder, within the user's */

typedef struct { /* as kept: little-endian; then float32 samples, zeros up to a whole word, the checksum of all before */
    char magic[8];
    double rate; /* Hz */
    int64_t count; /* samples */
    char name[LB_STATE_NAME];
} lb_response_head;
enum { LB_KEPT_RESPONSE = sizeof(lb_response_head) + sizeof(float) * LB_MAX_RESPONSE + 16 }; /* bytes, at most */

struct lb_response { /* it does not change; whoever keeps its address counts as a user */
    int users;
    uint64_t sum;
    size_t size;             /* bytes as kept */
    double *played;          /* the samples to play ... */
    int64_t count;           /* ... and their number */
    char path[LB_PATH];      /* the file that it came from; "": a session's state */
    lb_response_head kept[]; /* one, with all that follows it; without samples: a name for a window */
};

/* Make a response, with one user, from a WAV file and from what a session kept; they return the fault, to follow a name:
   "cannot be read"; 0: none. [not the audio thread] */
const char *lb_read_response(const char *path, const lb_kernels *, lb_response **);
const char *lb_parse_response(const void *kept, size_t count, const lb_kernels *, lb_response **);
/* One that has only a name, for windows. */
lb_response *lb_name_response(const char *name);
void lb_hold_response(lb_response *); /* counts one more user; may be 0 */
/* The instance's response, with one more user; 0: none. [not the audio thread but offline] */
lb_response *lb_use_response(lb_instance *);
int lb_same_response(const lb_response *, const lb_response *); /* they sound alike and have one name; each may be 0 */
/* Reads the names of the files in the user's folder of responses, without endings, in order; returns their number. */
int lb_list_responses(char names[LB_MAX_RESPONSES][LB_FILE_NAME]);
/* The path of one of them; returns 0 if there is no room for it. */
int lb_response_path(const char *name, char path[LB_PATH]);
/* Writes it into the user's folder, unless it is there; writes its file's name without ending. Returns 0 on failure. */
int lb_write_response(const lb_response *, const lb_kernels *, char name[LB_FILE_NAME]);
#endif
