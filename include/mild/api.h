/* What all public headers share. MILD_API_BEGIN and MILD_API_END enclose the declarations of each:
 * they give them C linkage in C++ and make them visible outside libmild, which hides all other
 * symbols. Thread safety: this header contains no code. */
#ifndef MILD_API_H
#define MILD_API_H

#ifdef __cplusplus
/* Before the first declaration of a header, after its includes. */
#define MILD_API_BEGIN                                                                             \
    extern "C" {                                                                                   \
    _Pragma("GCC visibility push(default)")
#define MILD_API_END                                                                               \
    _Pragma("GCC visibility pop")                                                                  \
    }
#else
#define MILD_API_BEGIN _Pragma("GCC visibility push(default)")
#define MILD_API_END _Pragma("GCC visibility pop")
#endif

/* Behind a function: argument `text` is as for printf, whose arguments begin with `first`.
 * The compiler checks them. */
#define MILD_PRINTF(text, first) __attribute__((format(printf, text, first)))

/* Where a GPU does what it is asked for in order: a cudaStream_t, which is this type and needs no
 * cast, or NULL, the default stream. A CPU does not look at it. */
typedef struct CUstream_st *MildStream;

#endif
