/* Functions that the compiler would take from its own library for Windows. */
#if defined _WIN32 && defined __x86_64__
#include <math.h>

/* A stack grows by a page when the page below it is touched. Functions with a frame of a page or more therefore call
   this with its size in rax: it touches every page of the new frame from above and keeps all registers. */
enum { PAGE = 4096, SAVED = 3 * 8 }; /* bytes: a page; below the frame: return address, rcx, rax */

__attribute__((naked)) void frame_is_touched(void) __asm__("___chkstk_ms");

__attribute__((naked)) void frame_is_touched(void) {
    __asm__(
        "pushq %%rcx\n\t"
        "pushq %%rax\n\t"
        "leaq %c1(%%rsp), %%rcx\n"
        "1:\n\t"
        "cmpq %0, %%rax\n\t"
        "jbe 2f\n\t"
        "subq %0, %%rcx\n\t"
        "subq %0, %%rax\n\t"
        "orl $0, (%%rcx)\n\t"
        "jmp 1b\n"
        "2:\n\t"
        "subq %%rax, %%rcx\n\t"
        "orl $0, (%%rcx)\n\t"
        "popq %%rax\n\t"
        "popq %%rcx\n\t"
        "retq"
        :
        : "i"(PAGE), "i"(SAVED));
}

/* The macros isnan and isfinite of MinGW's math.h call these. */
int lb_class(double) __asm__("__fpclassify");
int lb_class(double x) { return __builtin_fpclassify(FP_NAN, FP_INFINITE, FP_NORMAL, FP_SUBNORMAL, FP_ZERO, x); }
int lb_class_of_float(float) __asm__("__fpclassifyf");
int lb_class_of_float(float x) { return lb_class(x); }
int lb_is_nan(double) __asm__("__isnan");
int lb_is_nan(double x) { return x != x; }
#endif
