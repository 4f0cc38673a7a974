/* The device of a build without CUDA. Nothing opens one, so the rest is never called. */
#define MILD_REAL_FLOAT
#include "crowd/text.h"

static const char *const none = "this build is without CUDA";

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

const char *crowd_device_physics(const CrowdArrays *all, const CrowdStep *call,
                                 const MildBatch *batch, void *stream) {
    (void)all;
    (void)call;
    (void)batch;
    (void)stream;
    return none;
}

const char *crowd_device_tally(const CrowdArrays *all, void *stream) {
    (void)all;
    (void)stream;
    return none;
}

const char *crowd_device_fits(const EngineTree *tree, const MildBatch *batch) {
    (void)tree;
    (void)batch;
    return none;
}
