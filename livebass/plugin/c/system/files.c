/* Files and folders, on Windows and elsewhere. */
#include "system/files.h"

#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#else
#include <dirent.h>
#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

enum { MAX_NUMBERS = 9999 };
enum { MOVED, TAKEN, REFUSED }; /* results of naming a file; TAKEN: another file has the name */

const char *lb_file_name(const char *path) {
    const char *name = path;
    for (const char *at = path; *at; at++)
        if (*at == '/' || *at == '\\') name = at + 1;
    return name;
}

#ifdef _WIN32
static int widen(const char *path, wchar_t wide[LB_PATH]) {
    return MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, LB_PATH) != 0;
}

FILE *lb_open_file(const char *path, const char *how) {
    wchar_t wide[LB_PATH];
    return widen(path, wide) ? _wfopen(wide, *how == 'w' ? L"wb" : L"rb") : 0;
}

int lb_remove_file(const char *path) {
    wchar_t wide[LB_PATH];
    return widen(path, wide) && DeleteFileW(wide);
}

int lb_users_folder(char folder[LB_PATH]) {
    wchar_t wide[LB_PATH];
    const DWORD length = GetEnvironmentVariableW(L"APPDATA", wide, LB_PATH);
    if (!length || length >= LB_PATH || !WideCharToMultiByte(CP_UTF8, 0, wide, -1, folder, LB_PATH - 10, 0, 0)) return 0;
    strcat(folder, "\\livebass");
    return 1;
}

static void make_folder(const char *path) {
    wchar_t wide[LB_PATH];
    if (widen(path, wide)) CreateDirectoryW(wide, 0);
}

static int is_written(FILE *f) { return !fflush(f); }

static int move(const char *from, const char *to) {
    wchar_t wide_from[LB_PATH], wide_to[LB_PATH];
    if (!widen(from, wide_from) || !widen(to, wide_to)) return REFUSED;
    if (MoveFileExW(wide_from, wide_to, MOVEFILE_WRITE_THROUGH)) return MOVED;
    const DWORD why = GetLastError();
    return why == ERROR_ALREADY_EXISTS || why == ERROR_FILE_EXISTS ? TAKEN : REFUSED;
}

static unsigned long process_number(void) { return GetCurrentProcessId(); }
#else
FILE *lb_open_file(const char *path, const char *how) { return fopen(path, how); }

int lb_remove_file(const char *path) { return !unlink(path); }

int lb_users_folder(char folder[LB_PATH]) {
    const char *home = getenv("HOME");
#ifdef __APPLE__
    const char *within = "/Library/Application Support/livebass";
#else
    const char *within = "/.local/share/livebass", *data = getenv("XDG_DATA_HOME");
    if (data && *data == '/') {
        home = data;
        within = "/livebass";
    }
#endif
    return home && *home && snprintf(folder, LB_PATH, "%s%s", home, within) < LB_PATH;
}

/* Makes a folder and any missing folders above it. */
static void make_folder(const char *path) {
    char part[LB_PATH];
    for (size_t k = 1; k < LB_PATH && path[k - 1]; k++) {
        if (path[k] && path[k] != '/') continue;
        memcpy(part, path, k);
        part[k] = 0;
        mkdir(part, 0777);
    }
}

static int is_written(FILE *f) { return !fflush(f) && !fsync(fileno(f)); }

/* Links first: rename would replace another's file. Not all disks have links. */
static int move(const char *from, const char *to) {
    struct stat there;
    if (!link(from, to)) {
        unlink(from);
        return MOVED;
    }
    if (errno == EEXIST || !stat(to, &there)) return TAKEN;
    return rename(from, to) ? REFUSED : MOVED;
}

static unsigned long process_number(void) { return (unsigned long)getpid(); }
#endif

/* Passes on a file's name without its ending, if it has this ending. */
static void take_entry(const char *folder, const char *ending, const char *entry,
                       void (*take)(void *, const char *, const char *), void *to) {
    char name[LB_FILE_NAME];
    const size_t length = strlen(entry), end = strlen(ending);
    if (length <= end || length - end >= sizeof name || strcmp(entry + length - end, ending)) return;
    memcpy(name, entry, length - end);
    name[length - end] = 0;
    take(to, folder, name);
}

void lb_each_file(const char *folder, const char *ending, void (*take)(void *to, const char *folder, const char *name),
                  void *to) {
#ifdef _WIN32
    char pattern[LB_PATH], entry[LB_PATH];
    wchar_t wide[LB_PATH];
    WIN32_FIND_DATAW found;
    if (snprintf(pattern, sizeof pattern, "%s\\*%s", folder, ending) >= LB_PATH || !widen(pattern, wide)) return;
    HANDLE search = FindFirstFileW(wide, &found);
    if (search == INVALID_HANDLE_VALUE) return;
    do
        if (WideCharToMultiByte(CP_UTF8, 0, found.cFileName, -1, entry, sizeof entry, 0, 0))
            take_entry(folder, ending, entry, take, to);
    while (FindNextFileW(search, &found));
    FindClose(search);
#else
    DIR *open = opendir(folder);
    for (const struct dirent *e; open && (e = readdir(open));) take_entry(folder, ending, e->d_name, take, to);
    if (open) closedir(open);
#endif
}

/* Writes a file; on failure returns 0 and leaves no file. */
static int write_file(const char *path, const void *bytes, size_t count) {
    FILE *out = lb_open_file(path, "wb");
    if (!out) return 0;
    const int written = fwrite(bytes, 1, count, out) == count && is_written(out);
    if (!fclose(out) && written) return 1;
    lb_remove_file(path);
    return 0;
}

int lb_write_file(const char *folder, const char *name, const void *bytes, size_t count) {
    char path[LB_PATH];
    make_folder(folder);
    return snprintf(path, LB_PATH, "%s/%s", folder, name) < LB_PATH && write_file(path, bytes, count);
}

int lb_write_numbered(const char *folder, const char *stem, const char *ending, const void *bytes, size_t count,
                      int first, char name[LB_FILE_NAME]) {
    char temporary[LB_PATH], path[LB_PATH];
    int how = TAKEN;
    make_folder(folder);
    if (snprintf(temporary, LB_PATH, "%s/%s.%lu.part", folder, stem, process_number()) >= LB_PATH) return 0;
    if (!write_file(temporary, bytes, count)) return 0;
    for (int number = first; how == TAKEN && number <= MAX_NUMBERS; number += number ? 1 : 2) { /* stem, stem 2 ... */
        if (snprintf(name, LB_FILE_NAME, number ? "%s %d" : "%s", stem, number) >= LB_FILE_NAME) break;
        if (snprintf(path, LB_PATH, "%s/%s%s", folder, name, ending) >= LB_PATH) break;
        how = move(temporary, path);
    }
    if (how != MOVED) lb_remove_file(temporary);
    return how == MOVED;
}
