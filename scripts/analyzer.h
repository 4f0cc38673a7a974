/* Read before every file by clang-tidy (scripts/check.sh): its analyzer looks at one file at a
 * time, and so cannot see that mild_fail returns the status it is given, which is never MILD_OK. */
#include "mild/error.h"
#define mild_fail(error, status, ...) (mild_fail(error, status, __VA_ARGS__), (status))
