/* A library of MTS-ESP with a master that tests command. */
#include <stdbool.h>

double hertz[128], of_second[128];
int clients, has_master, left_out = -1, uses_second;

void MTS_RegisterClient(void) { clients++; }
void MTS_DeregisterClient(void) { clients--; }
bool MTS_HasMaster(void) { return has_master; }
bool MTS_ShouldFilterNote(char key, char channel) { return key == left_out; }
bool MTS_UseMultiChannelTuning(char channel) { return channel == 1 && uses_second; }
const double *MTS_GetTuningTable(void) { return hertz; }
const double *MTS_GetMultiChannelTuningTable(char channel) { return channel == 1 ? of_second : 0; }
