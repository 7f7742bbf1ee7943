/* Learns and forgets controllers as a window of the plugin does: learnhost FOLDER, which holds instruments. Prints nothing
   and returns 0, or the line of the first promise that is not kept. */
#include "instance/instance.h"

#include <stdlib.h>

#define CHECK(x) \
    if (!(x)) return __LINE__ % 256

static void complain(void *owner, const char *line) {
}

static void ask(void *owner) {}

static void turn(lb_instance *i, int controller, int value) {
    static float out[64];
    float *const outs[LB_STRINGS] = {out};
    lb_begin_block(i);
    lb_take_midi(i, 0, (const uint8_t[]){0xB3, (uint8_t)controller, (uint8_t)value}, 3);
    lb_play_block(i, 0, outs, 64);
}

int main(int count, char **words) {
    static lb_instance one, other;
    size_t size;
    lb_instance *i = &one;
    CHECK(count == 2);
    one.complain = other.complain = complain;
    one.ask = other.ask = ask;
    CHECK(lb_open_instance(i, words[1]) && lb_activate_instance(i, 48000));
    CHECK(lb_learning(i) == -1 && !lb_learn(i, LB_BASS) && !lb_learn(i, LB_PARAMETERS) && lb_learning(i) == -1);
    CHECK(lb_learn(i, LB_TONE) && lb_learning(i) == LB_TONE);
    turn(i, 6, 1); /* data of an RPN is no knob's */
    CHECK(lb_learning(i) == LB_TONE && lb_next_moved(i) == -1);
    turn(i, 20, 127);
    CHECK(lb_learning(i) == -1 && lb_learned_by(i, 20) == LB_TONE && lb_value(i, LB_TONE) == 1);
    CHECK(lb_next_moved(i) == LB_TONE && lb_next_moved(i) == -1);
    turn(i, 20, 64);
    CHECK(lb_value(i, LB_TONE) == 0); /* the middle is as the bass has it */
    turn(i, 20, 0);
    CHECK(lb_value(i, LB_TONE) == -1);
    CHECK(lb_learn(i, LB_TONE));
    turn(i, 21, 127); /* in place of the one before */
    turn(i, 20, 0);
    CHECK(lb_learned_by(i, 20) == -1 && lb_learned_by(i, 21) == LB_TONE && lb_value(i, LB_TONE) == 1);
    CHECK(lb_learn(i, LB_DRIVE) && !lb_learn(i, -1));
    turn(i, 22, 127); /* it was stopped */
    CHECK(lb_learned_by(i, 22) == -1 && lb_value(i, LB_DRIVE) == 0);
    CHECK(lb_learn(i, LB_DRIVE));
    turn(i, 21, 127); /* of two parameters the last one has the controller */
    CHECK(lb_learned_by(i, 21) == LB_DRIVE && lb_value(i, LB_DRIVE) == 1);
    char *state = lb_new_state(i, &size);
    CHECK(lb_open_instance(&other, words[1]) && lb_load_state(&other, state, size));
    CHECK(lb_learned_by(&other, 21) == LB_DRIVE && lb_learned_by(&other, 20) == -1);
    CHECK(!lb_load_state(&other, state, size - 8));
    free(state);
    CHECK(lb_learn(i, LB_GAIN));
    turn(i, 23, 127);
    CHECK(lb_value(i, LB_GAIN) == 0);
    CHECK(lb_learn(i, LB_TECHNIQUE));
    turn(i, 24, 64); /* the fifth of eight */
    CHECK(lb_value(i, LB_TECHNIQUE) == 4);
    lb_forget(i, LB_GAIN);
    lb_forget(i, LB_TECHNIQUE);
    lb_forget(i, LB_DRIVE);
    CHECK(lb_learned_by(i, 21) == -1);
    lb_close_instance(i);
    lb_close_instance(&other);
    return 0;
}
