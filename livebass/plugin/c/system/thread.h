/* The thread rules as code. A build for tests defines LB_CHECK_THREADS and aborts with a line if a rule is broken.
   Releases compile all of this to nothing. */
#ifndef LB_THREAD_H
#define LB_THREAD_H
#ifdef LB_CHECK_THREADS
typedef struct { /* for data that only one thread at a time may use */
    const void *thread;
    int depth;
} lb_owner;
lb_owner *lb_enter_alone(lb_owner *, const char *function);
void lb_leave_alone(lb_owner **);
void lb_check_waiting(const char *function);
void lb_set_real_time(int on);
#define LB_OWNER(name) lb_owner name;
/* Until the function returns, no other thread may use data with this owner. */
#define LB_ALONE(owner) \
    __attribute__((cleanup(lb_leave_alone), unused)) lb_owner *alone_ = lb_enter_alone((lb_owner *)&(owner), __func__)
/* The function may wait for a lock, memory or a file: threads may call it within a block only offline. */
#define LB_MAY_WAIT() lb_check_waiting(__func__)
/* This thread begins, or ends, a block in real time. */
#define LB_REAL_TIME(on) lb_set_real_time(on)
#else
#define LB_OWNER(name)
#define LB_ALONE(owner) (void)0
#define LB_MAY_WAIT() (void)0
#define LB_REAL_TIME(on) (void)0
#endif
#endif
