/* A host of CLAP plugins on Windows, for tests of the window: winhost FILE.clap [SCALE]

   Opens the plugin's window in one of its own, which stands in the corner of the screen and has the size that the
   plugin asks for; without SCALE the plugin takes that of the system. Plays by the clock until its input ends. Lines of
   input: "size W H" resizes, "again" closes the window and opens it anew. Lines of output: "open W H" and "closed",
   "begin K", "value K V" and "end K" as the plugin tells of its parameters, "loud" and "still" when its sound becomes
   so. */
#define WIN32_LEAN_AND_MEAN
#include <windows.h>

#include "abi/clap.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RATE = 48000, FRAMES = 480, LINE = 64, COMMAND = WM_APP };
#define LOUD 1e-3

static const clap_plugin *plugin;
static const clap_gui *gui;
static HWND frame;
static double scale;
static volatile LONG requested;

static void say(const clap_host *h, int32_t severity, const char *line) {
    fprintf(stderr, "%s\n", line);
}

static const void *extension(const clap_host *h, const char *id) {
    static const clap_host_log log = {say};
    return strcmp(id, CLAP_LOG) ? 0 : &log;
}

static void nothing(const clap_host *h) {}

static void ask(const clap_host *h) {
    InterlockedExchange(&requested, 1);
}

static uint32_t no_events(const clap_in_events *l) {
    return 0;
}

static bool reported(const clap_out_events *l, const clap_event *e) {
    const clap_param_value *v = (const clap_param_value *)e;
    const unsigned id = ((const clap_param_gesture *)e)->id;
    if (e->type == CLAP_GESTURE_BEGIN) printf("begin %u\n", id);
    else if (e->type == CLAP_GESTURE_END) printf("end %u\n", id);
    else if (e->type == CLAP_PARAM_VALUE) printf("value %u %.6f\n", (unsigned)v->id, v->value);
    return true;
}

/* --- the window --- */

static void place(uint32_t width, uint32_t height) {
    SetWindowPos(frame, 0, 0, 0, (int)width, (int)height, SWP_NOZORDER);
}

static int open_window(void) {
    const clap_window parent = {"win32", (uintptr_t)frame};
    uint32_t width, height;
    if (gui->is_api_supported(plugin, "x11", false) || !gui->create(plugin, parent.api, false)) return 0;
    if (scale > 0 && !gui->set_scale(plugin, scale)) return 0;
    if (!gui->get_size(plugin, &width, &height)) return 0;
    place(width, height);
    if (!gui->set_parent(plugin, &parent) || !gui->show(plugin)) return 0;
    printf("open %u %u\n", width, height);
    return 1;
}

static void obey(char *line) {
    unsigned width, height;
    if (sscanf(line, "size %u %u", &width, &height) == 2 && gui->set_size(plugin, width, height)) {
        place(width, height);
        printf("open %u %u\n", width, height);
    }
    if (!strncmp(line, "again", 5)) {
        gui->destroy(plugin);
        printf("closed\n");
        open_window();
    }
    free(line);
}

/* Passes lines of input on to the thread that has the window; the end of them ends it. */
static DWORD WINAPI listen(void *to) {
    const DWORD thread = (DWORD)(uintptr_t)to;
    char line[LINE];
    while (fgets(line, sizeof line, stdin)) PostThreadMessageW(thread, COMMAND, 0, (LPARAM)_strdup(line));
    PostThreadMessageW(thread, WM_QUIT, 0, 0);
    return 0;
}

/* Plays one block, and tells when sound begins and ends. */
static void play(int64_t time) {
    static int loud;
    static float sound[FRAMES];
    float *channel = sound;
    clap_audio_buffer out = {&channel, 0, 1, 0, 0};
    const clap_in_events events = {0, no_events, 0};
    const clap_out_events taken = {0, reported};
    const clap_process block = {time, FRAMES, 0, 0, &out, 0, 1, &events, &taken};
    double peak = 0;
    plugin->process(plugin, &block);
    for (int k = 0; k < FRAMES; k++) peak = fmax(peak, fabs(sound[k]));
    if ((peak > LOUD) != loud) printf((loud = peak > LOUD) ? "loud\n" : "still\n");
    if (InterlockedExchange(&requested, 0)) plugin->on_main_thread(plugin);
}

int main(int count, char **words) {
    if (count < 2) return 2;
    setvbuf(stdout, 0, _IONBF, 0);
    SetProcessDPIAware();
    HMODULE library = LoadLibraryA(words[1]);
    const clap_plugin_entry *entry = library ? (void *)(intptr_t)GetProcAddress(library, "clap_entry") : 0;
    if (!entry || !entry->init(words[1])) return 3;
    scale = count > 2 ? atof(words[2]) : 0;
    const clap_plugin_factory *factory = entry->get_factory(CLAP_PLUGIN_FACTORY);
    const clap_host host = {CLAP_VERSION, 0, "winhost", "", "", "1", extension, nothing, nothing, ask};
    plugin = factory->create(factory, &host, factory->descriptor(factory, 0)->id);
    if (!plugin || !plugin->init(plugin) || !plugin->activate(plugin, RATE, 1, FRAMES)) return 4;
    plugin->start_processing(plugin);
    gui = plugin->get_extension(plugin, CLAP_GUI);
    frame = CreateWindowExW(0, L"STATIC", L"winhost", WS_POPUP | WS_VISIBLE, 0, 0, 10, 10, 0, 0, 0, 0);
    if (!frame || !open_window()) return 5;
    CloseHandle(CreateThread(0, 0, listen, (void *)(uintptr_t)GetCurrentThreadId(), 0, 0));
    MSG message = {0};
    for (int64_t time = 0; message.message != WM_QUIT; time += FRAMES) {
        while (message.message != WM_QUIT && PeekMessageW(&message, 0, 0, 0, PM_REMOVE)) {
            if (message.message == COMMAND) obey((char *)message.lParam);
            DispatchMessageW(&message);
        }
        play(time);
        Sleep(1000 * FRAMES / RATE);
    }
    gui->destroy(plugin);
    plugin->stop_processing(plugin);
    plugin->deactivate(plugin);
    plugin->destroy(plugin);
    entry->deinit();
    DestroyWindow(frame);
    printf("ended\n");
    return 0;
}
