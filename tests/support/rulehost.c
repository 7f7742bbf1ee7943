/* Breaks a thread rule: rulehost FOLDER CASE. The plugin's C, built with LB_CHECK_THREADS, says so and aborts. */
#include "instance/instance.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

static lb_instance instance;

static void complain(void *owner, const char *line) {}
static void ask(void *owner) {}

static void *reset(void *nothing) {
    lb_reset_instance(&instance);
    return nothing;
}

int main(int count, char **words) {
    lb_instance *i = &instance;
    pthread_t thread;
    i->complain = complain;
    i->ask = ask;
    if (count != 3 || !lb_open_instance(i, words[1]) || !lb_activate_instance(i, 48000)) return 2;
    lb_set_offline(i, !strcmp(words[2], "offline"));
    lb_begin_block(i);
    if (!strcmp(words[2], "lock")) {
        size_t size;
        free(lb_new_state(i, &size));
    }
    if (!strcmp(words[2], "load") || !strcmp(words[2], "offline")) lb_serve(i);
    if (!strcmp(words[2], "two threads")) {
        LB_ALONE(i->audio.owner);
        pthread_create(&thread, 0, reset, 0);
        pthread_join(thread, 0);
    }
    lb_play_block(i, 0, (float *[LB_STRINGS]){0}, 64);
    lb_close_instance(i);
    return 0;
}
