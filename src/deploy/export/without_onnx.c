/* In the place of onnx.c where protobuf-c or ONNX's schema is not installed. */
#include "deploy/export/export.h"

MildStatus export_onnx(const Export *export, const char *path, MildError *error) {
    (void)export;
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "%s: this program was built without ONNX; install libprotobuf-c-dev, "
                     "protobuf-c-compiler and libonnx-dev, and build it anew",
                     path);
}
