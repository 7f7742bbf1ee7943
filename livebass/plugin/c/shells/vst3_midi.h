/* VST3 knows no MIDI controllers: each channel's are hidden parameters. Their ids must never change: sessions use
   them. */
#ifndef LB_VST3_MIDI_H
#define LB_VST3_MIDI_H
#include "kernels.h"
#include "abi/vst3.h"

enum { RPN_LOW = 100, RPN_HIGH = 101 }; /* controllers that select the data's parameter */
enum { LB_OWN = 3, LB_OTHER = VST3_PRESSURE - 1 }; /* wheel, pressure and place of a channel; its other controllers */
enum { LB_HIDDEN = VST3_CONTROLLERS + LB_CHANNELS * LB_OWN + (LB_CHANNELS - 1) * LB_OTHER };
/* The default of controllers that have no value of MIDI in a new plugin: they move what a parameter or the bass has set,
   as the plucking place, select something, or end notes. No value of MIDI is near it. */
#define LB_UNMOVED (0.5 / 127)
typedef struct {
    uint32_t id;
    int channel, controller; /* controller: MIDI's, or VST3_BEND, VST3_PRESSURE */
    double default_value;            /* 0 to 1: its value until it is moved, as in the synth */
} lb_hidden;

lb_hidden lb_hidden_at(int index); /* in the order of hosts' lists: 0 to LB_HIDDEN - 1 */
void lb_hidden_name(int index, char name[64]);
int lb_find_hidden(uint32_t id); /* a parameter's index; -1: it is none of these */
/* The parameter for a channel's controller; channel -1: another that hosts ask for. */
uint32_t lb_hidden_id(int channel, int controller);
#endif
