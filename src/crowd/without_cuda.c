/* The device of a build without CUDA. Nothing opens one, so the rest is never called. */
#define MILD_REAL_FLOAT
#include "crowd/text.h"

static const char *const none = "this build is without CUDA";

const char *crowd_device_create(const CrowdArrays *all, void *stream) {
    (void)all;
    (void)stream;
    return none;
}

const char *crowd_device_begin(const CrowdArrays *all, void *stream) {
    (void)all;
    (void)stream;
    return none;
}

const char *crowd_device_first(const CrowdArrays *all, const CrowdStep *call, void *stream) {
    (void)all;
    (void)call;
    (void)stream;
    return none;
}

const char *crowd_device_part(const CrowdArrays *all, const CrowdStep *call, int k, void *stream) {
    (void)all;
    (void)call;
    (void)k;
    (void)stream;
    return none;
}

const char *crowd_device_end(const CrowdArrays *all, const CrowdStep *call, void *stream) {
    (void)all;
    (void)call;
    (void)stream;
    return none;
}

const char *crowd_device_keep(const CrowdArrays *all, int back, void *stream) {
    (void)all;
    (void)back;
    (void)stream;
    return none;
}

const char *crowd_device_tell(const CrowdArrays *all, void *stream) {
    (void)all;
    (void)stream;
    return none;
}

const char *crowd_device_tally(const CrowdArrays *all, void *stream) {
    (void)all;
    (void)stream;
    return none;
}

CrowdBytes crowd_device_bytes(const TaskDef *def, const TaskShape *shape) {
    (void)def;
    (void)shape;
    return (CrowdBytes){0, 0};
}

const char *crowd_device_fits(const EngineTree *tree) {
    (void)tree;
    return none;
}
