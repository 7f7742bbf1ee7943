/* MTS-ESP: another plugin, the master, tunes the notes of all that follow it, through a library of the system. */
#ifndef LB_RETUNING_H
#define LB_RETUNING_H

/* An instance begins and ends to follow a master. The first one loads the library: /usr/local/lib/libMTS.so, on macOS
   /Library/Application Support/MTS-ESP/libMTS.dylib, on Windows MTS-ESP\\LIBMTS.dll in the folder of common files;
   LIVEBASS_MTS may name another. Without it nothing is tuned. [not the audio thread] */
void lb_join_master(void);
void lb_leave_master(void);
/* True while there is a master. [any thread] */
int lb_has_master(void);
/* Semitones that the master adds to a channel's key; 0 without one. [any thread] */
double lb_retuning(int channel, int key);
/* True if the master's scale leaves out a key. [any thread] */
int lb_leaves_out(int channel, int key);
#endif
