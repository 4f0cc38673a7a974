/* The batch ground as a foreign function of XLA, so that JAX calls it inside jit (mild.jax). */
#include "ground.h"

#include <cstring>
#include <map>
#include <memory>
#include <mutex>

#include "xla_abi.h"

using namespace xla_abi;

/* A batch that XLA may step. Its own lock holds it against being freed while it is stepped, so that
 * others are stepped at the same time. */
struct Known {
    std::mutex stepped;
    Batch *batch; /* NULL: freed */
};

static std::mutex lock; /* of the map */
static std::map<int64_t, std::shared_ptr<Known>> batches;

int64_t xla_number(Batch &batch) {
    static int64_t last = 0;
    const std::lock_guard<std::mutex> held(lock);
    if (batch.number == 0) {
        batch.number = ++last;
        batches[batch.number] = std::make_shared<Known>();
        batches[batch.number]->batch = &batch;
    }
    return batch.number;
}

static std::shared_ptr<Known> find(int64_t number) {
    const std::lock_guard<std::mutex> held(lock);
    const auto found = batches.find(number);
    return found == batches.end() ? nullptr : found->second;
}

void xla_forget(Batch &batch) {
    const std::shared_ptr<Known> known = find(batch.number);
    if (known) {
        const std::lock_guard<std::mutex> waited(known->stepped);
        known->batch = nullptr;
    }
    const std::lock_guard<std::mutex> held(lock);
    batches.erase(batch.number);
}

static void *fail(const Frame *frame, const std::string &text) {
    const std::string line = "mild: " + text;
    ErrorArgs args = {sizeof args, nullptr, line.c_str(), INVALID_ARGUMENT};
    return frame->api->make_error(&args);
}

/* A scalar among the attributes; NULL where there is none of this type. */
static const void *attribute(const Frame *frame, const char *name, int type) {
    const Attributes &a = frame->attributes;
    for (int64_t i = 0; i < a.count; i++) {
        const Scalar *scalar = (const Scalar *)a.values[i];
        if (a.names[i]->length == std::strlen(name) &&
            std::memcmp(a.names[i]->text, name, a.names[i]->length) == 0) {
            return scalar->type == type ? scalar->value : nullptr;
        }
    }
    return nullptr;
}

/* What a buffer must be; dims end with 0. */
struct Expected {
    const char *name;
    int type;
    int64_t dims[4];
};

/* Bool: the buffers are those; otherwise the name of the first that is not in *wrong. */
static bool fits(const List &list, const std::vector<Expected> &wanted, std::string *wrong) {
    if (list.count != (int64_t)wanted.size()) {
        *wrong = "the number of arrays";
        return false;
    }
    for (size_t i = 0; i < wanted.size(); i++) {
        const Buffer *buffer = (const Buffer *)list.items[i];
        bool same = buffer->type == wanted[i].type;
        int64_t rank = 0;
        for (; rank < 4 && wanted[i].dims[rank] > 0; rank++) {
            same = same && rank < buffer->rank && buffer->dims[rank] == wanted[i].dims[rank];
        }
        if (!same || buffer->rank != rank) {
            *wrong = wanted[i].name;
            return false;
        }
    }
    return true;
}

static void *data(const List &list, int64_t i) {
    return ((const Buffer *)list.items[i])->data;
}

/* A step on a batch that nobody else is in. */
static void *step(const Frame *frame, Batch &batch, bool advance, bool begins, MildStream stream) {
    const int64_t n = batch.robots, feet = batch.feet, labels = batch.labels;
    const List &in = frame->arguments, &out = frame->results;
    std::string wrong;
    if (!fits(in,
              {{"position", F32, {n, feet, 3}},
               {"rotation", F32, {n, feet, 3, 3}},
               {"velocity", F32, {n, feet, 6}},
               {"inverse_inertia", F32, {n, 6 * feet, 6 * feet}},
               {"free_velocity", F32, {n, feet, 6}},
               {"material", S32, {n, labels}},
               {"height", F32, {n}},
               {"map_origin", F32, {n, 2}},
               {"begin", PRED, {n}}},
              &wrong) ||
        !fits(out,
              {{"wrench", F32, {n, feet, 6}},
               {"new_velocity", F32, {n, feet, 6}},
               {"foot", F32, {n, feet, 6}}},
              &wrong)) {
        return fail(frame, wrong + " is not what this batch takes");
    }
    const int32_t *material = (const int32_t *)data(in, 5);
    for (int64_t i = 0; batch.device < 0 && i < n * labels; i++) {
        if (material[i] < 0 || material[i] >= batch.materials) {
            return fail(frame, "material: " + std::to_string(material[i]) + " is outside 0 .. " +
                                   std::to_string(batch.materials - 1));
        }
    }
    MildBatchInput input = {};
    input.position = (const float *)data(in, 0);
    input.rotation = (const float *)data(in, 1);
    input.velocity = (const float *)data(in, 2);
    input.inverse_inertia = (const float *)data(in, 3);
    input.free_velocity = (const float *)data(in, 4);
    input.material = material;
    input.height = (const float *)data(in, 6);
    input.map_origin = (const float *)data(in, 7);
    MildBatchOutput output = {};
    output.wrench = (float *)data(out, 0);
    output.velocity = (float *)data(out, 1);
    output.foot = (MildBatchFoot *)data(out, 2);
    MildError error = {};
    MildStatus status = MILD_OK;
    if (begins) {
        status = mild_batch_reset(batch.batch, (const uint8_t *)data(in, 8), stream, &error);
    }
    if (status == MILD_OK) {
        status = mild_batch_step(batch.batch, &input, &output, advance, stream, &error);
    }
    return status == MILD_OK ? nullptr : fail(frame, error.text);
}

/* The batch is held against being freed until its work is in the stream. */
static void *call(const Frame *frame, bool on_device) {
    const int64_t *number = (const int64_t *)attribute(frame, "batch", S64);
    const bool *advance = (const bool *)attribute(frame, "advance", PRED);
    const bool *begins = (const bool *)attribute(frame, "begins", PRED);
    StreamArgs stream = {sizeof stream, nullptr, frame->context, nullptr};
    if (on_device) {
        void *error = frame->api->get_stream(&stream);
        if (error) {
            return error;
        }
    }
    const std::shared_ptr<Known> known = number ? find(*number) : nullptr;
    if (!known || !advance || !begins) {
        return fail(frame, "the batch is closed");
    }
    const std::lock_guard<std::mutex> held(known->stepped);
    if (!known->batch) {
        return fail(frame, "the batch is closed");
    }
    Batch &batch = *known->batch;
    if ((batch.device >= 0) != on_device) {
        return fail(frame, on_device ? "the batch is on the CPU; make it with device=\"cuda\""
                                     : "the batch is on a device; make it with device=\"cpu\"");
    }
    if (batch.busy.exchange(true)) {
        return fail(frame, "another thread is inside of the batch");
    }
    void *error = batch.batch ? step(frame, batch, *advance, *begins, (MildStream)stream.stream)
                              : fail(frame, "the batch is closed");
    batch.busy = false;
    return error;
}

/* XLA asks once for the version. */
static bool is_question(const Frame *frame) {
    Extension *extension = frame->extension;
    if (!extension || extension->type != EXTENSION_METADATA) {
        return false;
    }
    Metadata *metadata = ((MetadataExtension *)(void *)extension)->metadata;
    metadata->version.major = MAJOR;
    metadata->version.minor = MINOR;
    metadata->traits = 0;
    return true;
}

static void *step_on_cpu(Frame *frame) {
    return is_question(frame) || frame->stage != STAGE_EXECUTE ? nullptr : call(frame, false);
}

static void *step_on_device(Frame *frame) {
    return is_question(frame) || frame->stage != STAGE_EXECUTE ? nullptr : call(frame, true);
}

void bind_xla(nb::module_ &module) {
    module.def(
        "_xla_steps",
        [] {
            return nb::make_tuple(nb::capsule((void *)step_on_cpu),
                                  nb::capsule((void *)step_on_device));
        },
        "Handlers of XLA for the CPU and for CUDA (mild.jax).");
    module.def(
        "_xla_number", [](Batch &batch) { return xla_number(batch); },
        "The number of a Batch for these (mild.jax).");
}
