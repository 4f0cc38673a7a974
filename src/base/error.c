#include "mild/error.h"

#include <stdarg.h>
#include <stdio.h>

MildStatus mild_fail(MildError *error, MildStatus status, const char *format, ...) {
    if (error) {
        error->status = status;
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(error->text, sizeof error->text, format, arguments);
        va_end(arguments);
    }
    return status;
}
