/* What XLA hands to a foreign function, as its C interface lays it out: XLA_FFI, version 0.3, of
 * OpenXLA (xla/ffi/api/c_api.h, Apache-2.0), which promises to keep it. Only what a handler of
 * buffers needs; tests/python/check_jax.py compares it with the header of jaxlib. */
#ifndef MILD_PYTHON_XLA_ABI_H
#define MILD_PYTHON_XLA_ABI_H

#include <cstddef>
#include <cstdint>

namespace xla_abi {

enum { MAJOR = 0, MINOR = 3, EXTENSION_METADATA = 1, STAGE_EXECUTE = 3, INVALID_ARGUMENT = 3 };
enum Type { PRED = 1, S32 = 4, S64 = 5, F32 = 11 };

struct Extension {
    size_t size;
    int type;
    Extension *next;
};

struct Version {
    size_t size;
    Extension *extension;
    int major, minor;
};

struct Metadata {
    size_t size;
    Version version;
    uint32_t traits;
};

struct MetadataExtension {
    Extension base;
    Metadata *metadata;
};

struct ErrorArgs {
    size_t size;
    Extension *extension;
    const char *message;
    int code;
};

struct StreamArgs {
    size_t size;
    Extension *extension;
    void *context;
    void *stream;
};

struct Buffer {
    size_t size;
    Extension *extension;
    int type;
    void *data;
    int64_t rank;
    int64_t *dims;
};

struct Span {
    const char *text;
    size_t length;
};

struct Scalar {
    int type;
    void *value;
};

/* Arguments and results. */
struct List {
    size_t size;
    Extension *extension;
    int64_t count;
    int *types;
    void **items;
};

struct Attributes {
    size_t size;
    Extension *extension;
    int64_t count;
    int *types;
    Span **names; /* sorted */
    void **values;
};

struct Api {
    size_t size;
    Extension *extension;
    Version version;
    const void *internal;
    void *(*make_error)(ErrorArgs *args);
    void *error_text, *error_destroy, *handler_register;
    void *(*get_stream)(StreamArgs *args);
};

struct Frame {
    size_t size;
    Extension *extension;
    const Api *api;
    void *context;
    int stage;
    List arguments, results;
    Attributes attributes;
};

} // namespace xla_abi

#endif
