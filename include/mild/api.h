/* Around the declarations of every public header: C names for C++, and the only symbols that
 * libmild exports. Nothing here runs, so threads do not matter. */
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

#endif
