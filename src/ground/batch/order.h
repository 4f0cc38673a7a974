/* In which order a step of two feet on level ground takes the robots of a batch on a GPU. In CUDA
 * C++, after device/cuda.h. */
#ifndef MILD_GROUND_BATCH_ORDER_H
#define MILD_GROUND_BATCH_ORDER_H

enum { ORDER_ROBOTS = 256 }; /* of a chunk, at most */

/* A chunk has robots that lie next to each other, as many as the next chunk has or one more. Place
 * p of a chunk is at [p * chunks + chunk] of the list: the robot's number times 4 and its feet that
 * may touch the ground, bit f for foot f. Those with both come first; the others, an even number,
 * are pairs, two by two from the last place on. */
struct BatchOrder {
    int32_t *list; /* [robots] */
    int32_t *left; /* [*count] of the list, that were to be a pair and are none, in any order */
    int32_t *count;
    int chunks;
};

static __device__ __forceinline__ BatchOrder batch_order_of(const BatchShape *shape,
                                                            const BatchArrays *arrays) {
    int32_t *list = arrays->order;
    static_assert(3 <= BATCH_ORDER, "of one robot");
    return {list, list + shape->robots, list + 2 * (long)shape->robots,
            (shape->robots + ORDER_ROBOTS - 1) / ORDER_ROBOTS};
}

/* Bool: both feet may touch the ground. */
static __device__ __forceinline__ int is_both(int turn) {
    return turn % 4 == 3;
}

#endif
