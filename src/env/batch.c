#define MILD_REAL_FLOAT
#include "env/batch_inside.h"

#include <stdlib.h>
#include <string.h>

#include "ground/law/law.h"
#include "robot/engine/read.h"

_Static_assert(ENVS_MODEL_NUMBERS == ENGINE_NUMBERS, "what engine_model_read fills");

/* Shares of the robots. One NVIDIA H200: three make 5 % more steps than one with 16 384 robots, 7 %
 * with 4096 and 2 % with 65 536. 16 384 walking robots make 12.1 M steps a second in three, 12.0 M
 * in four and 11.7 M in six (one H100). The CPU steps them in turn, so that its tests see them. */
enum { SLICES = 3 };

/* ---- creation ---- */

static MildStatus check_def(const EnvsDef *def, MildError *error) {
    const TaskDef *task = def->task;
    MildStatus status = task_def_check_robot(task, def->robot, error);
    const int patches = task->randomize.patch_share > 0 && !def->striped &&
                        !(task->map && mild_map_label_count(task->map) > 1);
    int course = 0; /* bool: a trial's */
    for (int i = 0; def->trial && i < def->terrains; i++) {
        course |= def->terrain[i].material_count > 1;
    }
    const char *missing = patches               ? "randomize.patch_share above 0"
                          : task->imprint_tiles ? "terrain.memory"
                          : task->solver        ? "task.solver other than newton"
                          : task->motors        ? "task.actuator"
                          : def->trial && task->map && mild_map_label_count(task->map) > 1
                              ? "terrain.patches"
                          : course ? "a course of several grounds"
                                   : NULL;
    return status == MILD_OK && missing
               ? mild_fail(error, MILD_ERROR_ARGUMENT,
                           "%s is not supported by the batch engine; set train.robots = mujoco",
                           missing)
               : status;
}

static MildStatus open_ground(Batch *b, const EnvsDef *def, const TaskGrounds *grounds,
                              MildError *error) {
    const MildBatchDef batch = {.robots = def->count,
                                .feet = robot_feet(def->robot),
                                .soles = robot_soles(def->robot),
                                .dt = def->task->physics_dt,
                                .tolerance = def->task->contact_tolerance,
                                .max_iterations = def->task->contact_iterations,
                                .device = def->device,
                                .points = robot_points(def->robot)};
    MildMaterial *materials = malloc((size_t)grounds->count * sizeof *materials);
    if (!materials) {
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for %d grounds", grounds->count);
    }
    for (int i = 0; i < grounds->count; i++) {
        materials[i] = grounds->ground[i].material;
    }
    b->ground = mild_batch_create(&batch, error);
    MildStatus status = MILD_ERROR_ARGUMENT;
    if (b->ground) {
        b->ground->shape.triangle = 1;
        status = mild_batch_set_materials(b->ground, materials, grounds->count, error);
    }
    if (status == MILD_OK && def->task->map) {
        status = mild_batch_set_map(b->ground, def->task->map, error);
    }
    const int bodies = robot_bodies(def->robot) - batch.feet;
    if (status == MILD_OK && bodies > 0) {
        status =
            batch_bodies_open(&b->bodies, b->ground, batch.soles, bodies, def->task->map, materials,
                              grounds->count, b->ground->arrays.worn != NULL, error);
    }
    free(materials);
    return status;
}

/* Memory of the device, counted. */
static void *take(Batch *b, size_t bytes, MildError *error) {
    b->bytes += bytes;
    return device_alloc(b->device, bytes, error);
}

static int labels_of(const TaskDef *task) {
    return task->map ? mild_map_label_count(task->map) : 1;
}

/* Of the lower triangle of A. */
static size_t inertia_numbers(size_t feet) {
    return 6 * feet * (6 * feet + 1) / 2;
}

void batch_list_rows(const Batch *b, EnvsArrays *all, BatchArrays *ground, Row rows[ROWS]) {
    const size_t feet = (size_t)b->shape.feet;
    const size_t shells = b->bodies.setup ? 1 : 0;
    EnvsContact *contact = &all->contact;
    const Row list[ROWS] = {
        {&all->env, all->stride, ROW_STATE},
        {&all->robot, b->robot, ROW_STATE},
        {&all->shells.robot, shells * b->shells, ROW_STATE},
        {&all->shells.near, shells * sizeof *all->shells.near, ROW_STATE},
        {&all->reset, sizeof *all->reset, ROW_STATE},
        {&contact->position, 3 * feet * sizeof(float), ROW_STATE},
        {&contact->rotation, 9 * feet * sizeof(float), ROW_STATE},
        {&contact->velocity, 6 * feet * sizeof(float), ROW_STATE},
        {&contact->inverse_inertia, inertia_numbers(feet) * sizeof(float), ROW_STATE},
        {&contact->free_velocity, 6 * feet * sizeof(float), ROW_STATE},
        {&contact->foot, feet * sizeof *contact->foot, ROW_STATE},
        {&contact->height, sizeof(float), ROW_GROUND},
        {&all->material, b->labels * sizeof *all->material, ROW_GROUND},
        {&all->map_origin, 2 * sizeof *all->map_origin, ROW_GROUND},
        {&all->rigid, sizeof *all->rigid, ROW_GROUND},
        {&all->shells.held, shells * sizeof *all->shells.held, ROW_GROUND},
        {&all->shells.list, shells * sizeof *all->shells.list, ROW_WORK},
        {&all->shells.waiting, 4 * shells * sizeof *all->shells.waiting, ROW_WORK},
        {&all->order, sizeof *all->order, ROW_WORK},
        {&all->shells.memory, shells * b->bodies.numbers * sizeof(float), ROW_GROUND},
        {&ground->worn, batch_worn_numbers(&b->ground->shape) * sizeof(float), ROW_PRINTS},
        {&ground->memory, batch_memory_numbers(&b->ground->shape) * sizeof(float), ROW_PRINTS}};
    memcpy(rows, list, sizeof list);
}

static size_t whole_lines(size_t bytes) {
    return (bytes + 255) / 256 * 256;
}

static MildStatus take_arrays(Batch *b, const TaskDef *task, MildError *error) {
    const TaskShape *shape = &b->shape;
    EnvsArrays *all = &b->arrays;
    BatchArrays ground;
    Row rows[ROWS];
    const EnvsBytes of = b->kernels ? b->kernels->bytes(task, shape) : envs_host_bytes(task, shape);
    const size_t envs = (size_t)all->envs, tally = TALLY_NUMBERS * sizeof *all->tally;
    all->stride = of.stride;
    b->robot = of.robot;
    b->shells = of.shells;
    batch_list_rows(b, all, &ground, rows);
    size_t bytes = whole_lines(tally);
    for (int i = 0; i < ROWS_TAKEN; i++) {
        bytes += whole_lines(envs * rows[i].bytes);
    }
    b->block = take(b, bytes, error);
    all->tally = b->block;
    char *at = b->block ? (char *)b->block + whole_lines(tally) : NULL;
    for (int i = 0; at && i < ROWS_TAKEN; i++) {
        memcpy(rows[i].at, &at, sizeof at);
        at += whole_lines(envs * rows[i].bytes);
    }
    all->shells.setup = b->bodies.setup;
    all->shells.curves = batch_bodies_curves(b->ground);
    all->shells.memory = b->bodies.memory;
    all->shells.numbers = b->bodies.numbers;
    return b->block ? MILD_OK : MILD_ERROR_MEMORY;
}

/* Trials and their commands. */
static MildStatus copy_trials(Batch *b, const EnvsDef *def, MildError *error) {
    EnvsArrays *all = &b->arrays;
    const size_t envs = (size_t)def->count;
    const size_t commands = TASK_COMMANDS * envs * sizeof *all->command;
    b->trials = take(b, commands + envs * sizeof *all->trial, error);
    if (!b->trials) {
        return MILD_ERROR_MEMORY;
    }
    EnvsTrial *trial = (void *)((char *)b->trials + commands);
    all->command = b->trials;
    all->trial = trial;
    return device_copy(b->device, trial, def->trial, envs * sizeof *trial, error);
}

/* What is drawn of the grounds. */
static MildStatus copy_grounds(Batch *b, const EnvsDef *def, const TaskGrounds *grounds,
                               MildError *error) {
    const size_t bytes = (size_t)grounds->count * sizeof *b->drawn;
    EnvsGround *made = malloc(bytes);
    if (!made) {
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for %d grounds", grounds->count);
    }
    for (int i = 0; i < grounds->count; i++) {
        made[i].depth = grounds->ground[i].depth;
        task_ground_numbers(def->robot, &grounds->ground[i].material, made[i].numbers);
    }
    b->drawn = take(b, bytes, error);
    MildStatus status =
        b->drawn ? device_copy(b->device, b->drawn, made, bytes, error) : MILD_ERROR_MEMORY;
    free(made);
    return status;
}

static MildStatus copy_task(Batch *b, const EnvsDef *def, const TaskGrounds *grounds,
                            MildError *error) {
    EnvsTask task = {.task = *def->task,
                     .ground = b->drawn,
                     .grounds = grounds->count,
                     .map = b->ground->arrays.map,
                     .has_map = def->task->map != NULL,
                     .labels = labels_of(def->task),
                     .striped = def->striped,
                     .shape = task_shape(def->task, def->robot),
                     .seed = def->seed,
                     .first = def->first};
    if (task.has_map) {
        mild_map_extent(def->task->map, &task.map_extent[0], &task.map_extent[1]);
        task.uneven = !mild_map_is_level(def->task->map);
    }
    task.robot = *robot_table(def->robot);
    MildStatus status = task_gains(def->task, def->robot, &task.gains, error);
    EnvsTask *at = status == MILD_OK ? take(b, sizeof *at, error) : NULL;
    b->arrays.task = at;
    return at ? device_copy(b->device, at, &task, sizeof task, error) : MILD_ERROR_MEMORY;
}

/* The first that fit; NULL if none do. */
static const EnvsKernels *kernels_for(const EngineTree *tree) {
    const EnvsKernels *const *at = envs_kernels;
    while (*at && !(*at)->fits(tree)) {
        at++;
    }
    return *at;
}

static MildStatus choose_kernels(Batch *b, const Robot *robot, const EngineTree *tree,
                                 MildError *error) {
    if (b->device == MILD_BATCH_HOST) {
        return MILD_OK;
    }
    b->kernels = kernels_for(tree);
    return b->kernels ? checked(b->kernels->open(b->device), error)
                      : mild_fail(error, MILD_ERROR_ARGUMENT,
                                  "%s: this build has no kernels for a robot of its size; "
                                  "train.robots = mujoco steps it",
                                  robot_name(robot));
}

/* The robot as the engine knows it, and what steps it. */
static MildStatus copy_model(Batch *b, const EnvsDef *def, MildError *error) {
    EngineModel *model = calloc(1, sizeof *model);
    double *number = calloc(ENGINE_NUMBERS, sizeof *number);
    EngineTree tree = {0};
    MildStatus status = MILD_ERROR_MEMORY;
    if (!model || !number) {
        mild_fail(error, status, "no memory for the model of the robot");
    } else {
        status = engine_model_read(def->robot, def->task->physics_dt, &tree, number, error);
    }
    status = status == MILD_OK ? choose_kernels(b, def->robot, &tree, error) : status;
    EngineModel *at = status == MILD_OK ? take(b, sizeof *at, error) : NULL;
    b->arrays.model = at;
    if (at) {
        envs_model_fill(&tree, number, model);
        status = device_copy(b->device, at, model, sizeof *model, error);
    } else if (status == MILD_OK) {
        status = MILD_ERROR_MEMORY;
    }
    free(model);
    free(number);
    return status;
}

static void create_piece(void *context, int piece, int thread) {
    (void)thread;
    envs_host_create(context, piece);
}

static MildStatus create_envs(Batch *b, MildError *error) {
    EnvsArrays *all = &b->arrays;
    if (b->device != MILD_BATCH_HOST) {
        MildStatus status = checked(b->kernels->create(all, NULL), error);
        return status == MILD_OK ? device_wait(b->device, error) : status;
    }
    pool_run(b->pool, all->envs, create_piece, all);
    return MILD_OK;
}

static MildStatus open_slices(Batch *b, MildError *error) {
    b->slices = b->arrays.envs >= SLICES ? SLICES : 1;
    if (b->device == MILD_BATCH_HOST || b->slices == 1) {
        return MILD_OK;
    }
    b->fork = device_fork_create(b->device, b->slices - 1, error);
    return b->fork ? MILD_OK : error->status;
}

static MildStatus open_batch(Batch *b, const EnvsDef *def, const TaskGrounds *grounds,
                             MildError *error) {
    b->shape = task_shape(def->task, def->robot);
    b->device = def->device;
    b->pool = def->pool;
    b->labels = (size_t)labels_of(def->task);
    b->arrays.envs = def->count;
    b->arrays.device = def->device;
    MildStatus status = open_ground(b, def, grounds, error);
    status = status == MILD_OK ? open_slices(b, error) : status;
    status = status == MILD_OK ? copy_model(b, def, error) : status;
    status = status == MILD_OK ? take_arrays(b, def->task, error) : status;
    status = status == MILD_OK ? copy_grounds(b, def, grounds, error) : status;
    status = status == MILD_OK && def->trial ? copy_trials(b, def, error) : status;
    status = status == MILD_OK ? copy_task(b, def, grounds, error) : status;
    return status == MILD_OK ? create_envs(b, error) : status;
}

static void destroy(Envs *envs) {
    Batch *b = own(envs);
    const EnvsArrays *all = &b->arrays;
    device_free(b->device, b->drawn);
    device_free(b->device, b->block);
    device_free(b->device, b->trials);
    device_free(b->device, (void *)all->task);
    device_free(b->device, (void *)all->model);
    batch_bodies_close(&b->bodies, b->device);
    mild_batch_destroy(b->ground);
    device_fork_destroy(b->fork);
    free(b);
}

static EnvsMemory memory(const Envs *envs) {
    const Batch *b = own_const(envs);
    const size_t task = b->arrays.stride, engine = b->robot;
    const size_t shells = b->bodies.numbers * sizeof *b->bodies.memory;
    const size_t all = b->bytes + b->bodies.bytes;
    return (EnvsMemory){.task = task,
                        .engine = engine,
                        .ground = mild_batch_robot_bytes(b->ground) + shells,
                        .rest = all / (size_t)b->arrays.envs - task - engine};
}

/* ---- slices ---- */

/* A part of the robots, which a GPU steps in a stream of its own: while the last robots of one
 * slice's kernel leave places free, the next kernel of another takes them. */
typedef struct {
    EnvsArrays arrays;
    EnvsStep step;
    MildBatch ground;
    MildStream stream;
} Slice;

static uint8_t *flag_from(uint8_t *flags, size_t first) {
    return flags ? flags + first : NULL;
}

static EnvsStep step_from(const EnvsStep *step, const TaskShape *shape, size_t first) {
    return (EnvsStep){.action = step->action ? step->action + first * (size_t)shape->actions : NULL,
                      .reward = task_row(step->reward, (long)first, 1),
                      .done = flag_from(step->done, first),
                      .timeout = flag_from(step->timeout, first),
                      .valid = flag_from(step->valid, first),
                      .cause = flag_from(step->cause, first),
                      .next = task_view_from(&step->next, shape, (long)first)};
}

/* `count` robots from `first` on. */
static EnvsArrays arrays_from(const Batch *b, size_t first, int count) {
    EnvsArrays all = b->arrays;
    BatchArrays ground = b->ground->arrays; /* batch_slice has its own */
    Row rows[ROWS];
    all.envs = count;
    batch_list_rows(b, &all, &ground, rows);
    for (int i = 0; i < ROWS; i++) {
        char *at;
        memcpy(&at, rows[i].at, sizeof at);
        if (at) {
            at += first * rows[i].bytes;
            memcpy(rows[i].at, &at, sizeof at);
        }
    }
    all.trial = all.trial ? all.trial + first : NULL;
    all.command = all.command ? all.command + TASK_COMMANDS * first : NULL;
    all.sample = all.sample ? all.sample + first * (size_t)b->base.physics_steps : NULL;
    return all;
}

static Slice slice_of(const Batch *b, const EnvsStep *step, int i, MildStream stream) {
    const long envs = b->arrays.envs;
    const long first = envs * i / b->slices, end = envs * (i + 1) / b->slices;
    const int count = (int)(end - first);
    Slice slice = {.arrays = arrays_from(b, (size_t)first, count),
                   .step = step_from(step, &b->shape, (size_t)first),
                   .ground = batch_slice(b->ground, (int)first, count),
                   .stream = i > 0 && b->fork ? device_fork_stream(b->fork, i - 1) : stream};
    if (slice.arrays.shells.setup) {
        slice.arrays.shells.shape = slice.ground.shape;
        slice.arrays.shells.ground = slice.ground.arrays;
        slice.ground.arrays.skip = slice.arrays.shells.near;
        slice.ground.arrays.beside = 1;
    }
    return slice;
}

/* ---- steps on the CPU ---- */

static void begin_piece(void *context, int piece, int thread) {
    (void)thread;
    envs_host_begin(((const Call *)context)->arrays, piece);
}

static void part_piece(void *context, int piece, int thread) {
    const Call *call = context;
    (void)thread;
    envs_host_part(call->arrays, call->step, call->part, piece);
}

static void command_piece(void *context, int piece, int thread) {
    (void)thread;
    envs_host_set_command(((const Call *)context)->arrays, piece);
}

static void shells_piece(void *context, int piece, int thread) {
    const Call *call = context;
    (void)thread;
    envs_host_shells(call->arrays, call->part, piece);
}

static void end_piece(void *context, int piece, int thread) {
    const Call *call = context;
    (void)thread;
    envs_host_end(call->arrays, call->step, piece);
}

static void first_piece(void *context, int piece, int thread) {
    const Call *call = context;
    (void)thread;
    envs_host_first(call->arrays, call->step, piece);
}

/* ---- steps ---- */

static MildBatchInput ground_input(const Slice *slice) {
    const EnvsArrays *all = &slice->arrays;
    const EnvsContact *c = &all->contact;
    return (MildBatchInput){.position = c->position,
                            .rotation = c->rotation,
                            .velocity = c->velocity,
                            .inverse_inertia = c->inverse_inertia,
                            .free_velocity = c->free_velocity,
                            .material = all->material,
                            .map_origin = all->map_origin,
                            .height = c->height};
}

/* One step of the ground under the robots of a slice. */
static MildStatus step_ground(Slice *slice, MildError *error) {
    const EnvsContact *c = &slice->arrays.contact;
    const MildBatchInput input = ground_input(slice);
    const MildBatchOutput output = {
        .wrench = c->velocity, .velocity = c->free_velocity, .foot = c->foot};
    return mild_batch_step(&slice->ground, &input, &output, 1, slice->stream, error);
}

/* The same under robots with shells near it, after part k. */
static MildStatus step_shells(const Batch *b, const Slice *slice, int k, MildError *error) {
    const EnvsArrays *all = &slice->arrays;
    Call call = {.arrays = all, .step = &slice->step, .part = k};
    if (!all->shells.setup) {
        return MILD_OK;
    }
    if (b->kernels) {
        return checked(b->kernels->shells(all, k, slice->stream), error);
    }
    pool_run(b->pool, all->envs, shells_piece, &call);
    return MILD_OK;
}

/* The physics steps of a policy step: parts with the ground between them. Then the task. */
static MildStatus step_slice(const Batch *b, Slice *slice, MildError *error) {
    const EnvsArrays *all = &slice->arrays;
    Call call = {.arrays = &slice->arrays, .step = &slice->step};
    MildStatus status = MILD_OK;
    for (call.part = 0; status == MILD_OK && call.part <= b->base.physics_steps; call.part++) {
        status = call.part > 0 ? step_shells(b, slice, call.part - 1, error) : MILD_OK;
        status = status == MILD_OK && call.part > 0 ? step_ground(slice, error) : status;
        if (status == MILD_OK && b->kernels) {
            status = checked(b->kernels->part(all, &slice->step, call.part, slice->stream), error);
        } else if (status == MILD_OK) {
            pool_run(b->pool, all->envs, part_piece, &call);
        }
    }
    if (status == MILD_OK && b->kernels) {
        return checked(b->kernels->end(all, &slice->step, slice->stream), error);
    }
    if (status == MILD_OK) {
        pool_run(b->pool, all->envs, end_piece, &call);
    }
    return status;
}

/* The first episodes. */
static MildStatus begin_slice(const Batch *b, Slice *slice, MildError *error) {
    Call call = {.arrays = &slice->arrays, .step = &slice->step};
    if (b->kernels) {
        return checked(b->kernels->begin(&slice->arrays, slice->stream), error);
    }
    pool_run(b->pool, slice->arrays.envs, begin_piece, &call);
    return MILD_OK;
}

/* New episodes forget their ground, and all are seen. */
static MildStatus see_slice(const Batch *b, Slice *slice, MildError *error) {
    const EnvsArrays *all = &slice->arrays;
    Call call = {.arrays = &slice->arrays, .step = &slice->step};
    MildStatus status = mild_batch_reset(&slice->ground, all->reset, slice->stream, error);
    if (status == MILD_OK && b->kernels) {
        return checked(b->kernels->first(all, &slice->step, slice->stream), error);
    }
    if (status == MILD_OK) {
        pool_run(b->pool, all->envs, first_piece, &call);
    }
    return status;
}

static MildStatus each_slice(const Batch *b, const EnvsStep *step, MildStream stream,
                             MildStatus (*work)(const Batch *, Slice *, MildError *),
                             MildError *error) {
    MildStatus status = b->fork ? device_fork(b->fork, stream, error) : MILD_OK;
    for (int i = 0; status == MILD_OK && i < b->slices; i++) {
        Slice slice = slice_of(b, step, i, stream);
        status = work(b, &slice, error);
        status = status == MILD_OK ? see_slice(b, &slice, error) : status;
    }
    return status == MILD_OK && b->fork ? device_join(b->fork, stream, error) : status;
}

static MildStatus reset(Envs *envs, const EnvsView *first, MildStream stream, MildError *error) {
    const EnvsStep none = {.next = *first};
    return each_slice(own(envs), &none, stream, begin_slice, error);
}

static MildStatus step(Envs *envs, const EnvsStep *step, MildStream stream, MildError *error) {
    return step->last.history || step->terms
               ? mild_fail(error, MILD_ERROR_ARGUMENT,
                           "the batch engine does not keep the end of an episode; train.robots = "
                           "mujoco does")
               : each_slice(own(envs), step, stream, step_slice, error);
}

static MildStatus wait(Envs *envs, MildError *error) {
    const Batch *b = own(envs);
    return b->device == MILD_BATCH_HOST ? MILD_OK : device_wait(b->device, error);
}

static MildStatus sums(Envs *envs, EnvsStats *sums, MildStream stream, MildError *error) {
    const Batch *b = own(envs);
    const EnvsArrays *all = &b->arrays;
    double sum[TALLY_NUMBERS];
    if (b->device != MILD_BATCH_HOST) {
        MildStatus status = checked(b->kernels->tally(all, stream), error);
        status = status == MILD_OK ? device_wait(b->device, error) : status;
        if (status != MILD_OK) {
            return status;
        }
    } else {
        envs_host_tally(all);
    }
    MildStatus status = device_copy(b->device, sum, all->tally, sizeof sum, error);
    if (status != MILD_OK) {
        return status;
    }
    *sums = (EnvsStats){.episodes = (int)sum[TALLY_EPISODES],
                        .falls = (int)sum[TALLY_FALLS],
                        .diverged = (int)sum[TALLY_DIVERGED],
                        .steps = sum[TALLY_STEPS],
                        .paid = sum[TALLY_PAID],
                        .length = sum[TALLY_LENGTH],
                        .reward = sum[TALLY_REWARD],
                        .speed_error = sum[TALLY_SPEED_ERROR],
                        .assist = sum[TALLY_ASSIST]};
    memcpy(sums->terms, sum + TALLY_TERMS, TASK_REWARD_COUNT * sizeof *sum);
    return MILD_OK;
}

/* Between the environments and `all->progress`. */
static MildStatus move_progress(const Batch *b, const EnvsArrays *all, int back, MildError *error) {
    if (b->device == MILD_BATCH_HOST) {
        envs_host_move_progress(all, back);
        return MILD_OK;
    }
    MildStatus status = device_wait(b->device, error);
    status =
        status == MILD_OK ? checked(b->kernels->move_progress(all, back, NULL), error) : status;
    return status == MILD_OK ? device_wait(b->device, error) : status;
}

static MildStatus save_progress(Envs *envs, TaskProgress *progress, MildError *error) {
    const Batch *b = own(envs);
    const size_t bytes = (size_t)b->arrays.envs * sizeof *progress;
    EnvsArrays all = b->arrays;
    all.progress = device_alloc(b->device, bytes, error);
    MildStatus status = all.progress ? move_progress(b, &all, 0, error) : MILD_ERROR_MEMORY;
    status =
        status == MILD_OK ? device_copy(b->device, progress, all.progress, bytes, error) : status;
    device_free(b->device, all.progress);
    return status;
}

static MildStatus load_progress(Envs *envs, const TaskProgress *progress, MildError *error) {
    const Batch *b = own(envs);
    const size_t bytes = (size_t)b->arrays.envs * sizeof *progress;
    EnvsArrays all = b->arrays;
    all.progress = device_alloc(b->device, bytes, error);
    MildStatus status = all.progress ? device_copy(b->device, all.progress, progress, bytes, error)
                                     : MILD_ERROR_MEMORY;
    status = status == MILD_OK ? move_progress(b, &all, 1, error) : status;
    device_free(b->device, all.progress);
    return status;
}

static MildStatus set_commands(Envs *envs, const double *command, MildError *error) {
    const Batch *b = own(envs);
    const EnvsArrays *all = &b->arrays;
    Call call = {.arrays = all};
    MildStatus status = device_copy(b->device, all->command, command,
                                    TASK_COMMANDS * (size_t)all->envs * sizeof *command, error);
    if (status == MILD_OK && b->device != MILD_BATCH_HOST) {
        return checked(b->kernels->set_command(all, NULL), error);
    }
    if (status == MILD_OK) {
        pool_run(b->pool, all->envs, command_piece, &call);
    }
    return status;
}

static void set_samples(Envs *envs, EnvsSample *sample) {
    own(envs)->arrays.sample = sample;
}

static const EnvsBackend backend = {.destroy = destroy,
                                    .reset = reset,
                                    .step = step,
                                    .wait = wait,
                                    .sums = sums,
                                    .save_progress = save_progress,
                                    .load_progress = load_progress,
                                    .memory = memory,
                                    .set_commands = set_commands,
                                    .set_samples = set_samples,
                                    .block_bytes = batch_block_bytes,
                                    .save = batch_save,
                                    .fork = batch_fork,
                                    .read = batch_read};

/* Those of trials, with the depth of a robot that stands on them. NULL: out of memory. */
static TaskGrounds *trial_grounds(const EnvsDef *def, MildError *error) {
    TaskGrounds *grounds = malloc(sizeof *grounds);
    TaskGround *ground = calloc((size_t)def->terrains, sizeof *ground);
    if (!grounds || !ground) {
        free(grounds);
        free(ground);
        mild_fail(error, MILD_ERROR_MEMORY, "no memory for %d grounds", def->terrains);
        return NULL;
    }
    for (int i = 0; i < def->terrains; i++) {
        ground[i].material = def->terrain[i].materials[0];
        ground[i].depth = task_standing_depth(def->robot, &ground[i].material);
    }
    *grounds = (TaskGrounds){def->terrains, ground};
    return grounds;
}

Envs *envs_create_batch(const EnvsDef *def, MildError *error) {
    if (check_def(def, error) != MILD_OK) {
        return NULL;
    }
    TaskGrounds *grounds = def->trial ? trial_grounds(def, error)
                                      : task_grounds_create(def->task, def->robot, def->grounds,
                                                            def->seed, def->pool, error);
    Batch *b = grounds ? calloc(1, sizeof *b) : NULL;
    if (grounds && !b) {
        mild_fail(error, MILD_ERROR_MEMORY, "environments: out of memory");
    }
    if (b) {
        b->base.backend = &backend;
    }
    if (b && open_batch(b, def, grounds, error) != MILD_OK) {
        destroy(&b->base);
        b = NULL;
    }
    task_grounds_destroy(grounds);
    return b ? &b->base : NULL;
}

int envs_are_slow(const Robot *robot) {
    double *number = calloc(ENGINE_NUMBERS, sizeof *number);
    EngineTree tree;
    MildError unused;
    const int read =
        number && engine_model_read(robot, TASK_PERIOD, &tree, number, &unused) == MILD_OK;
    const EnvsKernels *kernels = read ? kernels_for(&tree) : NULL;
    free(number);
    return kernels && !kernels->fixed;
}

const EnvsArrays *envs_batch_arrays(const Envs *envs) {
    return &own_const(envs)->arrays;
}
