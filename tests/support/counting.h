/* Counts the calls of malloc and its kin while `inside` is 1 on their thread. */
#include <stddef.h>

_Atomic int allocations;
static _Thread_local int inside;
extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);
extern void __libc_free(void *);
void *malloc(size_t n) { allocations += inside; return __libc_malloc(n); }
void *calloc(size_t n, size_t m) { allocations += inside; return __libc_calloc(n, m); }
void *realloc(void *p, size_t n) { allocations += inside; return __libc_realloc(p, n); }
void free(void *p) { allocations += inside; __libc_free(p); }
