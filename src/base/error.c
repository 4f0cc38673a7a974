#include "mild/error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/text.h"

MildStatus mild_fail(MildError *error, MildStatus status, const char *format, ...) {
    if (error) {
        error->status = status;
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(error->text, sizeof error->text, format, arguments);
        va_end(arguments);
        const size_t size = strlen(error->text);
        const size_t torn = text_plain(error->text, size, "");
        error->text[size - torn] = '\0'; /* of a character that was cut in the middle */
    }
    return status;
}
