/* Files and folders of the system. Paths and names are UTF-8. [not the audio thread] */
#ifndef LB_FILES_H
#define LB_FILES_H
#include <stddef.h>
#include <stdio.h>

enum { LB_PATH = 1200, LB_FILE_NAME = 160 }; /* bytes in paths, and in names without endings */

FILE *lb_open_file(const char *path, const char *how); /* as fopen: "rb" or "wb" */
int lb_remove_file(const char *path);                  /* 0: it stays */
const char *lb_file_name(const char *path); /* the part after its last / or \ */
/* The user's folder of instruments and sounds; returns 0 if there is none. */
int lb_users_folder(char folder[LB_PATH]);
/* Calls `take` for each file with this ending in a folder, with its name without the ending. */
void lb_each_file(const char *folder, const char *ending, void (*take)(void *to, const char *folder, const char *name),
                  void *to);
/* Writes a file into a folder, which is made if missing; on failure there is none. */
int lb_write_file(const char *folder, const char *name, const void *bytes, size_t count);
/* Writes a file whole, or not at all, into a folder, which is made if missing, under the first free name: `stem`
   followed by 1, 2 ..., or with `first` 0 `stem` itself if it is free; `name` becomes that name. Returns 0 on
   failure. */
int lb_write_numbered(const char *folder, const char *stem, const char *ending, const void *bytes, size_t count,
                      int first, char name[LB_FILE_NAME]);
#endif
