/* Saving an environment of the batch engine and putting it into others: envs_save, envs_fork.
 *
 * On another soft ground, own_ground, a robot takes its prints along. An element at the depth u
 * that has been at a bears the share s of what it would bear at a. It keeps s, so that on ground
 * that gives back r of a
 *
 *     a = u + (1 - s) max(r a, ELEMENT_ELASTIC),   a <= FORK_PRINT u
 *
 * and the robot is moved up or down until the feet bear at rest what they bore in the block. Where
 * they bear that already nothing moves: the same ground is as if it were copied. A robot without
 * load is not moved; its elements bear nothing. */
#ifndef ENVS_BATCH_FORK_H
#define ENVS_BATCH_FORK_H

#include "env/batch_step.h"
#include "ground/batch/contact.h"
#include "ground/law/rest.h"

#define FORK_HALVINGS 20
#define FORK_PRINT REAL(20)    /* [-] of an element's depth: the deepest u_max that it is given */
#define FORK_DEEPEST REAL(0.5) /* [m] by which a robot may be moved, either way */
#define FORK_SAME REAL(1e-3)   /* [-] of the load: grounds are the same */
#define FORK_LEAST REAL(1)     /* [N] of load */

/* That of an environment. */
MILD_HD char *env_block(const EnvsFork *fork, long robot) {
    return fork->block + (size_t)((robot - fork->first) / fork->group) * fork->stride;
}

/* Row r of an environment to (save: bool) or from its block, by lane of lanes. Rows of whole words
 * begin at one, on either side. */
MILD_HD void env_move_row(const EnvsFork *fork, int r, long robot, int save, int lane, int lanes) {
    const size_t bytes = fork->row[r].bytes;
    const int there = fork->row[r].at != NULL;
    char *own = there ? fork->row[r].at + (size_t)robot * bytes : NULL;
    char *block = env_block(fork, robot) + fork->row[r].place;
    char *to = save ? block : own;
    const char *from = save ? own : block;
    const size_t words = bytes % sizeof(float) ? 0 : bytes / sizeof(float);
    for (size_t i = (size_t)lane; to && i < words; i += (size_t)lanes) {
        ((uint32_t *)(void *)to)[i] = from ? ((const uint32_t *)(const void *)from)[i] : 0;
    }
    for (size_t i = (size_t)lane; words == 0 && i < bytes; i += (size_t)lanes) {
        to[i] = from[i];
    }
}

MILD_HD void env_move_rows(const EnvsFork *fork, long robot, int save, int lane, int lanes) {
    for (int r = 0; r < fork->count; r++) {
        env_move_row(fork, r, robot, save, lane, lanes);
    }
}

/* What a fork leaves to the environment. */
typedef struct {
    TaskShape shape;
    uint32_t held;
    uint64_t seed;
    uint32_t index, tick, tick_first;
    Real tally[TALLY_KEPT];
    /* with own_ground */
    int ground[MILD_MATERIALS_MAX];
    int rigid;
    Real rigid_friction, rigid_time;
} EnvKept;

MILD_HD EnvKept env_keep(const EnvsArrays *all, long robot) {
    const TaskEnv *env = env_at(all, robot);
    EnvKept kept;
    kept.shape = env->shape;
    kept.held = env->held;
    kept.seed = env->seed;
    kept.index = env->index;
    kept.tick = env->tick;
    kept.tick_first = env->tick_first;
    for (int i = 0; i < TALLY_KEPT; i++) {
        kept.tally[i] = env_robot_at(all, robot)->tally[i];
    }
    for (int label = 0; label < MILD_MATERIALS_MAX; label++) {
        kept.ground[label] = env->ground[label];
    }
    kept.rigid = env->variation.rigid;
    kept.rigid_friction = env->variation.rigid_friction;
    kept.rigid_time = env->variation.rigid_time;
    return kept;
}

/* An index within `count`, whatever a block that was never saved holds. */
MILD_HD int env_within(int index, int count) {
    return (int)((uint32_t)index % (uint32_t)count);
}

/* ---- what the ground bears ---- */

/* Memory of a robot's feet, a number of an element `next` after the one before. */
typedef struct {
    Real *numbers;
    Real *worn; /* NULL: no material wears */
    int next;
} EnvPrints;

MILD_HD EnvPrints env_prints(const EnvsFork *fork, long robot) {
    const BatchShape *shape = &fork->shape;
    const int all = shape->groups * shape->stride;
    const EnvPrints prints = {fork->ground.memory + robot * contact_memory_numbers(all, shape->map),
                              fork->ground.worn ? fork->ground.worn + robot * all : NULL, all};
    return prints;
}

/* What element e of foot f stands on. */
MILD_HD const ContactMaterial *env_stands_on(const EnvsArrays *all, const EnvsFork *fork,
                                             long robot, int f, int e) {
    const EnvPrints prints = env_prints(fork, robot);
    const Real *label = prints.numbers + (CONTACT_MEMORY + 3) * prints.next;
    const int own = fork->shape.map ? (int)label[f * fork->shape.stride + e] : 0;
    const int labels = all->task->labels;
    const int material = all->material[robot * labels + env_within(own, labels)];
    return (const ContactMaterial *)(const void *)fork->ground.materials +
           env_within(material, fork->shape.materials) * fork->shape.feet + f;
}

/* In the block: the load at rest [N], then s of each element [-], as prints. */
MILD_HD Real *env_rest(const EnvsFork *fork, long robot) {
    return (Real *)(void *)(env_block(fork, robot) + fork->rest);
}

/* [N] What element e of foot f bears at rest. */
MILD_HD Real env_element_bears(const EnvsArrays *all, const EnvsFork *fork, long robot, int f,
                               int e, Real depth, Real depth_max) {
    const EnvPrints prints = env_prints(fork, robot);
    const int stride = fork->shape.stride, at = f * stride + e;
    const Real *place = fork->ground.elements + f * CONTACT_PLACES * stride + e;
    const ContactMaterial *on = env_stands_on(all, fork, robot, f, e);
    const Law law = on->projects > 0 ? law_of_heap(on->law, place[CONTACT_BEGIN * stride],
                                                   place[CONTACT_WIDTH * stride])
                                     : on->law;
    const ElementRest rest = element_rest(&law, on->recovery, LAW_ANY, depth, depth_max,
                                          prints.worn != NULL, prints.worn ? prints.worn[at] : 0);
    return depth > 0 ? rest_force(&rest) : 0;
}

/* [m] a above, at most FORK_PRINT times the depth. */
MILD_HD Real env_deepest(Real recovery, Real share, Real depth) {
    const Real left = real_max(1 - (1 - share) * recovery, 1 / FORK_PRINT);
    return real_max(depth / left, depth + (1 - share) * ELEMENT_ELASTIC);
}

/* [N] What all bear at rest; by a tile. */
MILD_HD Real env_bears(const EnvsArrays *all, const EnvsFork *fork, long robot) {
    const EnvPrints prints = env_prints(fork, robot);
    Real sum = 0;
    for (int f = 0; f < fork->shape.feet; f++) {
        for (int e = tile_lane(); e < fork->shape.elements[f]; e += TILE) {
            const Real *number = prints.numbers + f * fork->shape.stride + e;
            if (number[0] > 0) {
                sum += env_element_bears(all, fork, robot, f, e, number[prints.next], number[0]);
            }
        }
    }
    return tile_sum(sum);
}

/* The same of elements that lie `deeper` [m] and keep s. */
MILD_HD Real env_bears_deeper(const EnvsArrays *all, const EnvsFork *fork, long robot,
                              Real deeper) {
    const EnvPrints prints = env_prints(fork, robot);
    Real sum = 0;
    for (int f = 0; f < fork->shape.feet; f++) {
        for (int e = tile_lane(); e < fork->shape.elements[f]; e += TILE) {
            const int at = f * fork->shape.stride + e;
            const Real depth = prints.numbers[prints.next + at] + deeper;
            if (prints.numbers[at] > 0) {
                const Real recovery = env_stands_on(all, fork, robot, f, e)->recovery;
                const Real share = env_rest(fork, robot)[1 + at];
                sum += env_element_bears(all, fork, robot, f, e, depth,
                                         env_deepest(recovery, share, depth));
            }
        }
    }
    return tile_sum(sum);
}

/* Before an environment is saved, by a tile. */
MILD_HD void env_weigh(const EnvsArrays *all, const EnvsFork *fork, long robot) {
    const EnvPrints prints = env_prints(fork, robot);
    Real *rest = env_rest(fork, robot);
    Real load = 0;
    for (int f = 0; f < fork->shape.feet; f++) {
        for (int e = tile_lane(); e < fork->shape.elements[f]; e += TILE) {
            const int at = f * fork->shape.stride + e;
            const Real a = prints.numbers[at], u = prints.numbers[prints.next + at];
            const Real bore = a > 0 ? env_element_bears(all, fork, robot, f, e, u, a) : 0;
            const Real whole = a > 0 ? env_element_bears(all, fork, robot, f, e, a, a) : 0;
            rest[1 + at] = real_over(bore, whole + ELEMENT_TINY);
            load += bore;
        }
    }
    load = tile_sum(load);
    if (tile_lane() == 0) {
        rest[0] = load;
    }
}

/* Moves the elements `deeper` [m]; those that come out forget. By a tile. */
MILD_HD void env_shift_prints(const EnvsArrays *all, const EnvsFork *fork, long robot,
                              Real deeper) {
    const EnvPrints prints = env_prints(fork, robot);
    for (int f = 0; f < fork->shape.feet; f++) {
        for (int e = tile_lane(); e < fork->shape.elements[f]; e += TILE) {
            const int at = f * fork->shape.stride + e;
            Real *number = prints.numbers + at;
            const Real depth = number[prints.next] + deeper;
            const Real recovery = env_stands_on(all, fork, robot, f, e)->recovery;
            const int loaded = number[0] > 0;
            if (loaded && depth > 0) {
                number[0] = env_deepest(recovery, env_rest(fork, robot)[1 + at], depth);
                number[prints.next] = depth;
            }
            for (int n = 0; loaded && !(depth > 0) && n < CONTACT_MEMORY; n++) {
                number[n * prints.next] = 0;
            }
            if (prints.worn && loaded && !(depth > 0)) {
                prints.worn[at] = 0;
            }
        }
    }
}

/* [m] By how much deeper the feet bear what they bore, by a tile. */
MILD_HD Real env_deeper(const EnvsArrays *all, const EnvsFork *fork, long robot) {
    const Real load = env_rest(fork, robot)[0];
    Real low = -FORK_DEEPEST, high = FORK_DEEPEST;
    for (int i = 0; i < FORK_HALVINGS; i++) {
        const Real middle = (low + high) / 2;
        const int less = env_bears_deeper(all, fork, robot, middle) <= load;
        low = less ? middle : low;
        high = less ? high : middle;
    }
    return low;
}

/* ---- back ---- */

/* Sets a robot down whose ground has no prints, or had none: rigid, or at the start of an episode.
 * Its lowest sole below the surface becomes as deep as one that stands; one in the air is
 * lowered by that depth. The ground forgets the feet. By a tile. */
MILD_HD void env_set_down(const EnvsArrays *all, const EnvsFork *fork, long robot) {
    TaskEnv *env = env_at(all, robot);
    const RobotReading *reading = env_reading(env_robot_at(all, robot));
    const EnvPrints prints = env_prints(fork, robot);
    const int numbers = contact_memory_numbers(prints.next, fork->shape.map);
    const int ground = env->ground[env_first_label(all, robot)];
    Real lowest = 0;
    for (int f = 0; f < env->shape.feet; f++) {
        lowest = real_min(lowest, reading->foot[f].sole_height);
    }
    if (tile_lane() == 0) {
        env->robot.qpos[2] -= lowest;
        env->robot.qpos[2] -= env->variation.rigid ? 0 : (Real)all->task->ground[ground].depth;
    }
    tile_clear(prints.numbers, (size_t)numbers * sizeof *prints.numbers);
    if (prints.worn) {
        tile_clear(prints.worn, (size_t)prints.next * sizeof *prints.worn);
    }
}

/* What stays the environment's own, by one thread. */
MILD_HD void env_restore(const EnvsArrays *all, const EnvsFork *fork, long robot,
                         const EnvKept *kept) {
    TaskEnv *env = env_at(all, robot);
    EnvRobot *own = env_robot_at(all, robot);
    env->shape = kept->shape;
    env->held = kept->held;
    env->oldest %= kept->held;
    env->seed = kept->seed;
    env->index = kept->index;
    env->tick = kept->tick;
    env->tick_first = kept->tick_first;
    for (int i = 0; i < TALLY_KEPT; i++) {
        own->tally[i] = kept->tally[i];
    }
    own->label = env_within(own->label, all->task->labels);
    for (int label = 0; !fork->own_ground && label < all->task->labels; label++) {
        int *material = &all->material[robot * all->task->labels + label];
        *material = env_within(*material, all->task->grounds);
        env->ground[label] = env_within(env->ground[label], all->task->grounds);
    }
    if (fork->own_ground) {
        for (int label = 0; label < MILD_MATERIALS_MAX; label++) {
            env->ground[label] = kept->ground[label];
        }
        env->variation.rigid = kept->rigid;
        env->variation.rigid_friction = kept->rigid_friction;
        env->variation.rigid_time = kept->rigid_time;
    }
}

/* After the rows, by a tile. */
MILD_HD void env_take_back(const EnvsArrays *all, const EnvsFork *fork, long robot,
                           const EnvKept *kept) {
    TaskEnv *env = env_at(all, robot);
    const int was_rigid = env->variation.rigid != 0;
    tile_sync();
    if (tile_lane() == 0) {
        env_restore(all, fork, robot, kept);
    }
    tile_sync();
    if (!fork->own_ground) {
        return;
    }
    if (was_rigid || kept->rigid || all->reset[robot]) {
        env_set_down(all, fork, robot);
        return;
    }
    const Real load = env_rest(fork, robot)[0];
    if (!(REAL_ABS(env_bears(all, fork, robot) - load) > FORK_SAME * load)) {
        return;
    }
    const Real deeper = load > FORK_LEAST ? env_deeper(all, fork, robot) : 0;
    env_shift_prints(all, fork, robot, deeper);
    if (tile_lane() == 0) {
        env->robot.qpos[2] -= deeper;
    }
}

#endif
