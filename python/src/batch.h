/* mild.Batch, as its methods (batch.cpp) and XLA's calls (xla.cpp) see it. */
#ifndef MILD_PYTHON_BATCH_H
#define MILD_PYTHON_BATCH_H

#include "ground.h"

#include "mild/batch.h"

struct Batch {
    MildBatch *batch = nullptr;
    int robots = 0;
    int feet = 0;
    int device = ON_CPU;
    int materials = 1;
    int labels = 1;
    bool has_map = false;
    std::vector<int> elements; /* of each sole */
    std::atomic<bool> busy{false};
    int64_t number = 0; /* of XLA's calls; 0: none yet */

    Batch() = default;
    Batch(const Batch &) = delete;
    ~Batch();
};

/* The number by which XLA's calls find the batch, until it is freed. */
int64_t xla_number(Batch &batch);
void xla_forget(Batch &batch);

#endif
