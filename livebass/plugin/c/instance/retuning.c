/* The library of MTS-ESP, on Windows and elsewhere. It stays loaded: other plugins may use it, too. */
#include "instance/retuning.h"
#include "system/lock.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#ifndef _WIN32
#include <dlfcn.h>
#endif

enum { CHANNELS = 16, KEYS = 128 };
static struct {
    int requested; /* for the library */
    void (*join)(void), (*leave)(void);
    bool (*has_master)(void), (*is_left_out)(char key, char channel), (*has_own)(char channel);
    const double *hertz, *of_channel[CHANNELS]; /* of each key */
} master;

typedef void (*function)(void);

#ifdef _WIN32
static void *open_library(void) {
    wchar_t path[MAX_PATH];
    const wchar_t *place = _wgetenv(L"LIVEBASS_MTS") ? L"%LIVEBASS_MTS%" : L"%CommonProgramFiles%\\MTS-ESP\\LIBMTS.dll";
    const DWORD length = ExpandEnvironmentStringsW(place, path, MAX_PATH);
    return length && length <= MAX_PATH ? (void *)LoadLibraryW(path) : 0;
}
static function find(void *library, const char *name) { return (function)(void *)GetProcAddress(library, name); }
#else
static void *open_library(void) {
#ifdef __APPLE__
    const char *path = "/Library/Application Support/MTS-ESP/libMTS.dylib", *other = getenv("LIVEBASS_MTS");
#else
    const char *path = "/usr/local/lib/libMTS.so", *other = getenv("LIVEBASS_MTS");
#endif
    return dlopen(other ? other : path, RTLD_NOW); // NOLINT(clang-analyzer-optin.taint.GenericTaint): as LD_PRELOAD
}
static function find(void *library, const char *name) {
    function found;
    *(void **)&found = dlsym(library, name);
    return found;
}
#endif

static void load(void) {
    void *library = open_library();
    if (!library) return;
    const double *(*all)(void) = (const double *(*)(void))find(library, "MTS_GetTuningTable");
    const double *(*one)(char) = (const double *(*)(char))find(library, "MTS_GetMultiChannelTuningTable");
    master.join = find(library, "MTS_RegisterClient");
    master.leave = find(library, "MTS_DeregisterClient");
    master.is_left_out = (bool (*)(char, char))find(library, "MTS_ShouldFilterNote");
    master.has_own = (bool (*)(char))find(library, "MTS_UseMultiChannelTuning");
    for (char c = 0; one && c < CHANNELS; c++) master.of_channel[(int)c] = one(c);
    master.hertz = all ? all() : 0;
    bool (*has_master)(void) = (bool (*)(void))find(library, "MTS_HasMaster");
    if (master.hertz && master.join && master.leave) __atomic_store_n(&master.has_master, has_master, __ATOMIC_RELEASE);
}

void lb_join_master(void) {
    enter();
    if (!master.requested) load();
    master.requested = 1;
    if (master.has_master) master.join();
    leave();
}

void lb_leave_master(void) {
    enter();
    if (master.has_master) master.leave();
    leave();
}

int lb_has_master(void) {
    bool (*has_master)(void) = __atomic_load_n(&master.has_master, __ATOMIC_ACQUIRE);
    return has_master && has_master();
}

double lb_retuning(int channel, int key) {
    if (!lb_has_master() || key < 0 || key >= KEYS || channel < 0 || channel >= CHANNELS) return 0;
    const double *own = master.has_own && master.has_own((char)channel) ? master.of_channel[channel] : 0;
    const double hertz = (own ? own : master.hertz)[key];
    return hertz > 0 && isfinite(hertz) ? 12 * log2(hertz / 440) - (key - 69) : 0;
}

int lb_leaves_out(int channel, int key) {
    return lb_has_master() && master.is_left_out && master.is_left_out((char)key, (char)channel);
}
