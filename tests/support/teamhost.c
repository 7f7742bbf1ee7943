/* Strings side by side, for sanitizers: teamhost FILE.lbass OTHER.lbass BLOCKS SEED HELPERS RESTS

   Plays random notes of two basses in blocks of random sizes, changing from one to the other, beside HELPERS threads
   that come and go. Each of them rests at random up to RESTS us before it plays a string, if it is not 0, so that
   strings are left to all, and taken late. Prints how many strings the helpers played, and a checksum of the sound,
   which must not depend on them. */
#include "instance/core.h"
#include "chance.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { RATE = 48000, MAXIMUM = 2048, THREADS = 7 };

static unsigned rests;
static lb_kernels kernels, slow;

/* lb_play_string by way of a random rest. */
static void play_late(int64_t bass, int64_t string, int64_t end) {
    static _Thread_local uint32_t own;
    own = own * 1664525u + 1013904223u + (uint32_t)(intptr_t)&own;
    if (own >> 30) usleep((own >> 8) % rests);
    kernels.play_string(bass, string, end);
}

static void *help(void *synth) {
    kernels.help_out((int64_t)(intptr_t)synth, (int64_t)(intptr_t)usleep);
    return 0;
}

int main(int count, char **words) {
    char why[200];
    if (count < 7) return 2;
    seed = (uint32_t)atoi(words[4]);
    rests = (unsigned)atoi(words[6]);
    const int blocks = atoi(words[3]), helpers = atoi(words[5]);
    kernels = slow = *lb_best_kernels();
    if (rests) slow.play_string = play_late;
    lb_synth *s = lb_new_synth(RATE, &slow);
    lb_bass *bass = lb_load_bass(&(lb_source){words[1], 0, 0}, LB_LIVE, RATE, 1, 0, 0, 0, &slow, why, sizeof why);
    if (!s || !bass) return 3;
    lb_put_on(s, bass);
    pthread_t threads[THREADS];
    static float sound[MAXIMUM];
    int there = 0;
    uint64_t sum = 1469598103934665603u;
    for (int k = 0; k < blocks; k++) {
        const uint32_t frames = 1 + random_below(random_below(8) ? 128 : MAXIMUM);
        if (k % 50 == 0) {
            for (__atomic_store_n(&s->record.team.stop, 1, __ATOMIC_RELEASE); there > 0; there--)
                pthread_join(threads[there - 1], 0);
            __atomic_store_n(&s->record.team.stop, 0, __ATOMIC_RELEASE);
            if (s->record.team.helpers) return 4;
        }
        if (k % 50 == 10)
            for (; there < helpers && there < THREADS; there++)
                if (pthread_create(&threads[there], 0, help, s)) return 5;
        for (uint32_t n = random_below(5), frame = 0; n; n--) {
            const uint8_t key = (uint8_t)(28 + random_below(36)), force = (uint8_t)(1 + random_below(127));
            frame += random_below(frames - frame);
            lb_send(s, frame, (const uint8_t[]){random_below(3) ? 0x90 : 0x80, key, force}, 3);
        }
        if (k % 37 == 36 && !lb_changing(s)) {
            const char *next = words[1 + random_below(2)];
            lb_change_bass(s, lb_load_bass(&(lb_source){next, 0, 0}, LB_LIVE, RATE, 1, 0, 0, 0, &slow, why, sizeof why));
        }
        if (k % 91 == 90) lb_reset_synth(s);
        lb_play(s, sound, frames);
        lb_free_bass(lb_take_faded(s));
        for (uint32_t j = 0; j < frames; j++) {
            uint32_t bits;
            __builtin_memcpy(&bits, &sound[j], sizeof bits);
            sum = (sum ^ bits) * 1099511628211u;
        }
    }
    for (__atomic_store_n(&s->record.team.stop, 1, __ATOMIC_RELEASE); there > 0; there--)
        pthread_join(threads[there - 1], 0);
    printf("%lld %016llx\n", (long long)s->record.team.helped, (unsigned long long)sum);
    lb_free_synth(s);
    return 0;
}
