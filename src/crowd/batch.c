#define MILD_REAL_FLOAT
#include "crowd/backend.h"

#include <stdlib.h>
#include <string.h>

#include "crowd/text.h"
#include "device/device.h"
#include "engine/read.h"

_Static_assert(CROWD_MODEL_NUMBERS == ENGINE_NUMBERS, "what engine_model_read fills");

/* Shares of the robots. One NVIDIA H200: three make 5 % more steps with 16 384 robots, 7 % with
 * 4096 and 2 % with 65 536; four are no faster. The CPU steps them in turn, so that its tests see
 * them. */
enum { SHARES = 3 };

typedef struct {
    Envs base;
    CrowdArrays arrays; /* their memory is the device's */
    MildBatch *ground;
    DeviceFork *fork; /* streams of all shares but the first, on a GPU; else NULL */
    int shares;       /* of the robots */
    TaskShape shape;
    size_t labels;               /* of the map, 1 without */
    const CrowdKernels *kernels; /* NULL: on the host */
    void *block;                 /* where the arrays are, but for task and model */
    CrowdGround *drawn;          /* of the device: the grounds of CrowdTask */
    void *trials;                /* where those of trials are */
    Pool *pool;                  /* of the host */
    int device;
    size_t robot; /* [B] of CrowdRobot */
    size_t bytes; /* of the device, without the ground */
} Crowd;

static Crowd *own(Envs *envs) {
    return (Crowd *)(void *)envs;
}

static const Crowd *own_const(const Envs *envs) {
    return (const Crowd *)(const void *)envs;
}

static MildStatus checked(const char *why, MildError *error) {
    return why ? mild_fail(error, MILD_ERROR_IO, "GPU: robots: %s", why) : MILD_OK;
}

/* ---- creation ---- */

static MildStatus check_def(const EnvsDef *def, MildError *error) {
    const TaskDef *task = def->task;
    MildStatus status = task_def_check_robot(task, def->robot, error);
    const int patches = task->randomize.patch_share > 0 && !def->striped &&
                        !(task->map && mild_map_label_count(task->map) > 1);
    const char *missing = patches             ? "randomize.patch_share above 0"
                          : task->print_tiles ? "terrain.memory"
                          : !task->newton     ? "task.newton = 0"
                          : task->motors      ? "task.actuator"
                          : def->trial && task->map && mild_map_label_count(task->map) > 1
                              ? "terrain.patches"
                              : NULL;
    return status == MILD_OK && missing
               ? mild_fail(error, MILD_ERROR_ARGUMENT,
                           "%s is not there on a device yet; train.robots = mujoco has it", missing)
               : status;
}

static MildStatus open_ground(Crowd *crowd, const EnvsDef *def, const TaskGrounds *grounds,
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
    crowd->ground = mild_batch_create(&batch, error);
    MildStatus status =
        crowd->ground ? mild_batch_set_materials(crowd->ground, materials, grounds->count, error)
                      : MILD_ERROR_ARGUMENT;
    free(materials);
    if (status == MILD_OK && def->task->map) {
        status = mild_batch_set_map(crowd->ground, def->task->map, error);
    }
    return status;
}

/* Memory of the device, counted. */
static void *take(Crowd *crowd, size_t bytes, MildError *error) {
    crowd->bytes += bytes;
    return device_alloc(crowd->device, bytes, error);
}

static int labels_of(const TaskDef *task) {
    return task->map ? mild_map_label_count(task->map) : 1;
}

static MildStatus take_arrays(Crowd *crowd, const TaskDef *task, MildError *error) {
    const TaskShape *shape = &crowd->shape;
    CrowdArrays *all = &crowd->arrays;
    CrowdContact *contact = &all->contact;
    const CrowdBytes of =
        crowd->kernels ? crowd->kernels->bytes(task, shape) : crowd_host_bytes(task, shape);
    const size_t envs = (size_t)all->envs;
    const size_t feet = (size_t)shape->feet, rows = envs * feet;
    all->stride = of.stride;
    crowd->robot = of.robot;
    const struct {
        void *at; /* pointer to the array's pointer */
        size_t bytes;
    } arrays[] = {{&all->env, envs * all->stride},
                  {&all->robot, envs * crowd->robot},
                  {&all->material, envs * crowd->labels * sizeof *all->material},
                  {&all->map_origin, 2 * envs * sizeof *all->map_origin},
                  {&all->fresh, envs},
                  {&all->rigid, envs},
                  {&all->order, envs * sizeof *all->order},
                  {&all->tally, TALLY_NUMBERS * sizeof *all->tally},
                  {&contact->position, 3 * rows * sizeof(float)},
                  {&contact->rotation, 9 * rows * sizeof(float)},
                  {&contact->velocity, 6 * rows * sizeof(float)},
                  {&contact->inverse_inertia, 36 * rows * feet * sizeof(float)},
                  {&contact->free_velocity, 6 * rows * sizeof(float)},
                  {&contact->height, envs * sizeof(float)},
                  {&contact->foot, rows * sizeof *contact->foot}};
    size_t bytes = 0;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        bytes += (arrays[i].bytes + 255) / 256 * 256;
    }
    crowd->block = take(crowd, bytes, error);
    char *at = crowd->block;
    for (size_t i = 0; at && i < sizeof arrays / sizeof *arrays; i++) {
        memcpy(arrays[i].at, &at, sizeof at);
        at += (arrays[i].bytes + 255) / 256 * 256;
    }
    return crowd->block ? MILD_OK : MILD_ERROR_MEMORY;
}

/* Trials and their commands. */
static MildStatus copy_trials(Crowd *crowd, const EnvsDef *def, MildError *error) {
    CrowdArrays *all = &crowd->arrays;
    const size_t envs = (size_t)def->count, commands = 3 * envs * sizeof *all->command;
    crowd->trials = take(crowd, commands + envs * sizeof *all->trial, error);
    if (!crowd->trials) {
        return MILD_ERROR_MEMORY;
    }
    EnvsTrial *trial = (void *)((char *)crowd->trials + commands);
    all->command = crowd->trials;
    all->trial = trial;
    return device_copy(crowd->device, trial, def->trial, envs * sizeof *trial, error);
}

/* What is drawn of the grounds. */
static MildStatus copy_grounds(Crowd *crowd, const EnvsDef *def, const TaskGrounds *grounds,
                               MildError *error) {
    const size_t bytes = (size_t)grounds->count * sizeof *crowd->drawn;
    CrowdGround *made = malloc(bytes);
    if (!made) {
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for %d grounds", grounds->count);
    }
    for (int i = 0; i < grounds->count; i++) {
        made[i].depth = grounds->ground[i].depth;
        task_ground_numbers(def->robot, &grounds->ground[i].material, made[i].numbers);
    }
    crowd->drawn = take(crowd, bytes, error);
    MildStatus status = crowd->drawn ? device_copy(crowd->device, crowd->drawn, made, bytes, error)
                                     : MILD_ERROR_MEMORY;
    free(made);
    return status;
}

static MildStatus copy_task(Crowd *crowd, const EnvsDef *def, const TaskGrounds *grounds,
                            MildError *error) {
    CrowdTask task = {.task = *def->task,
                      .ground = crowd->drawn,
                      .grounds = grounds->count,
                      .map = crowd->ground->arrays.map,
                      .has_map = def->task->map != NULL,
                      .labels = labels_of(def->task),
                      .striped = def->striped,
                      .shape = task_shape(def->robot),
                      .seed = def->seed,
                      .first = def->first};
    if (task.has_map) {
        mild_map_extent(def->task->map, &task.map_extent[0], &task.map_extent[1]);
        task.uneven = !mild_map_is_level(def->task->map);
    }
    robot_fill_table(def->robot, &task.robot);
    MildStatus status = task_gains(def->task, def->robot, task.gains.kp, task.gains.kd, error);
    CrowdTask *at = status == MILD_OK ? take(crowd, sizeof *at, error) : NULL;
    crowd->arrays.task = at;
    return at ? device_copy(crowd->device, at, &task, sizeof task, error) : MILD_ERROR_MEMORY;
}

/* The first that fit; NULL if none do. */
static const CrowdKernels *kernels_for(const EngineTree *tree) {
    const CrowdKernels *const *at = crowd_kernels;
    while (*at && !(*at)->fits(tree)) {
        at++;
    }
    return *at;
}

static MildStatus choose_kernels(Crowd *crowd, const Robot *robot, const EngineTree *tree,
                                 MildError *error) {
    if (crowd->device == MILD_BATCH_HOST) {
        return MILD_OK;
    }
    crowd->kernels = kernels_for(tree);
    return crowd->kernels ? checked(crowd->kernels->open(), error)
                          : mild_fail(error, MILD_ERROR_ARGUMENT,
                                      "%s: this build has no kernels for a robot of its size; "
                                      "train.robots = mujoco steps it",
                                      robot_name(robot));
}

/* The robot as the engine knows it, and what steps it. */
static MildStatus copy_model(Crowd *crowd, const EnvsDef *def, MildError *error) {
    EngineModel *model = calloc(1, sizeof *model);
    double *number = calloc(ENGINE_NUMBERS, sizeof *number);
    EngineTree tree = {0};
    MildStatus status = MILD_ERROR_MEMORY;
    if (!model || !number) {
        mild_fail(error, status, "no memory for the model of the robot");
    } else {
        status = engine_model_read(def->robot, def->task->physics_dt, &tree, number, error);
    }
    status = status == MILD_OK ? choose_kernels(crowd, def->robot, &tree, error) : status;
    EngineModel *at = status == MILD_OK ? take(crowd, sizeof *at, error) : NULL;
    crowd->arrays.model = at;
    if (at) {
        crowd_model_fill(&tree, number, model);
        status = device_copy(crowd->device, at, model, sizeof *model, error);
    } else if (status == MILD_OK) {
        status = MILD_ERROR_MEMORY;
    }
    free(model);
    free(number);
    return status;
}

static void create_piece(void *context, int piece, int thread) {
    (void)thread;
    crowd_host_create(context, piece);
}

static MildStatus create_envs(Crowd *crowd, MildError *error) {
    CrowdArrays *all = &crowd->arrays;
    if (crowd->device != MILD_BATCH_HOST) {
        MildStatus status = checked(crowd->kernels->create(all, NULL), error);
        return status == MILD_OK ? device_wait(crowd->device, error) : status;
    }
    pool_run(crowd->pool, all->envs, create_piece, all);
    return MILD_OK;
}

static MildStatus open_shares(Crowd *crowd, MildError *error) {
    crowd->shares = crowd->arrays.envs >= SHARES ? SHARES : 1;
    if (crowd->device == MILD_BATCH_HOST || crowd->shares == 1) {
        return MILD_OK;
    }
    crowd->fork = device_fork_create(crowd->device, crowd->shares - 1, error);
    return crowd->fork ? MILD_OK : error->status;
}

static MildStatus open_crowd(Crowd *crowd, const EnvsDef *def, const TaskGrounds *grounds,
                             MildError *error) {
    crowd->shape = task_shape(def->robot);
    crowd->device = def->device;
    crowd->pool = def->pool;
    crowd->labels = (size_t)labels_of(def->task);
    crowd->arrays.envs = def->count;
    MildStatus status = open_ground(crowd, def, grounds, error);
    status = status == MILD_OK ? open_shares(crowd, error) : status;
    status = status == MILD_OK ? copy_model(crowd, def, error) : status;
    status = status == MILD_OK ? take_arrays(crowd, def->task, error) : status;
    status = status == MILD_OK ? copy_grounds(crowd, def, grounds, error) : status;
    status = status == MILD_OK && def->trial ? copy_trials(crowd, def, error) : status;
    status = status == MILD_OK ? copy_task(crowd, def, grounds, error) : status;
    return status == MILD_OK ? create_envs(crowd, error) : status;
}

static void destroy(Envs *envs) {
    Crowd *crowd = own(envs);
    const CrowdArrays *all = &crowd->arrays;
    device_free(crowd->device, crowd->drawn);
    device_free(crowd->device, crowd->block);
    device_free(crowd->device, crowd->trials);
    device_free(crowd->device, (void *)all->task);
    device_free(crowd->device, (void *)all->model);
    mild_batch_destroy(crowd->ground);
    device_fork_destroy(crowd->fork);
    free(crowd);
}

static EnvsMemory memory(const Envs *envs) {
    const Crowd *crowd = own_const(envs);
    const size_t task = crowd->arrays.stride, engine = crowd->robot;
    return (EnvsMemory){.task = task,
                        .engine = engine,
                        .ground = mild_batch_robot_bytes(crowd->ground),
                        .rest = crowd->bytes / (size_t)crowd->arrays.envs - task - engine};
}

/* ---- shares ---- */

/* A part of the robots, which a GPU steps in a stream of its own: while the last robots of one
 * share's kernel leave places free, the next kernel of another takes them. */
typedef struct {
    CrowdArrays arrays;
    EnvsStep step;
    MildBatch ground;
    void *stream;
} Share;

static float *row_from(float *rows, size_t first, int width) {
    return rows ? rows + first * (size_t)width : NULL;
}

static uint8_t *flag_from(uint8_t *flags, size_t first) {
    return flags ? flags + first : NULL;
}

static EnvsView view_from(const EnvsView *view, const TaskShape *shape, size_t first) {
    return (EnvsView){.history = row_from(view->history, first, shape->history),
                      .critic = row_from(view->critic, first, shape->critic),
                      .estimate = row_from(view->estimate, first, shape->estimates),
                      .frame = row_from(view->frame, first, shape->observation)};
}

static EnvsStep step_from(const EnvsStep *step, const TaskShape *shape, size_t first) {
    return (EnvsStep){.action = step->action ? step->action + first * (size_t)shape->actions : NULL,
                      .reward = row_from(step->reward, first, 1),
                      .done = flag_from(step->done, first),
                      .timeout = flag_from(step->timeout, first),
                      .valid = flag_from(step->valid, first),
                      .next = view_from(&step->next, shape, first)};
}

static CrowdContact contact_from(const CrowdContact *c, size_t first, size_t feet) {
    const size_t row = first * feet;
    return (CrowdContact){.position = c->position + 3 * row,
                          .rotation = c->rotation + 9 * row,
                          .velocity = c->velocity + 6 * row,
                          .inverse_inertia = c->inverse_inertia + 36 * row * feet,
                          .free_velocity = c->free_velocity + 6 * row,
                          .height = c->height + first,
                          .foot = c->foot + row};
}

/* `count` robots from `first` on. */
static CrowdArrays arrays_from(const Crowd *crowd, size_t first, int count) {
    CrowdArrays all = crowd->arrays;
    all.envs = count;
    all.env += first * all.stride;
    all.robot = (char *)all.robot + first * crowd->robot;
    all.material += first * crowd->labels;
    all.map_origin += 2 * first;
    all.fresh += first;
    all.rigid += first;
    all.order += first;
    all.contact = contact_from(&all.contact, first, (size_t)crowd->shape.feet);
    all.trial = all.trial ? all.trial + first : NULL;
    all.command = all.command ? all.command + 3 * first : NULL;
    all.sample = all.sample ? all.sample + first * (size_t)crowd->base.physics_steps : NULL;
    return all;
}

static Share share_of(const Crowd *crowd, const EnvsStep *step, int i, void *stream) {
    const long envs = crowd->arrays.envs;
    const long first = envs * i / crowd->shares, end = envs * (i + 1) / crowd->shares;
    const int count = (int)(end - first);
    return (Share){.arrays = arrays_from(crowd, (size_t)first, count),
                   .step = step_from(step, &crowd->shape, (size_t)first),
                   .ground = batch_share(crowd->ground, (int)first, count),
                   .stream =
                       i > 0 && crowd->fork ? device_fork_stream(crowd->fork, i - 1) : stream};
}

/* ---- steps on the CPU ---- */

/* One call, for the threads of the host. */
typedef struct {
    const CrowdArrays *arrays;
    const EnvsStep *step;
    int part;
} Call;

static void begin_piece(void *context, int piece, int thread) {
    (void)thread;
    crowd_host_begin(((const Call *)context)->arrays, piece);
}

static void part_piece(void *context, int piece, int thread) {
    const Call *call = context;
    (void)thread;
    crowd_host_part(call->arrays, call->step, call->part, piece);
}

static void tell_piece(void *context, int piece, int thread) {
    (void)thread;
    crowd_host_tell(((const Call *)context)->arrays, piece);
}

static void end_piece(void *context, int piece, int thread) {
    const Call *call = context;
    (void)thread;
    crowd_host_end(call->arrays, call->step, piece);
}

static void first_piece(void *context, int piece, int thread) {
    const Call *call = context;
    (void)thread;
    crowd_host_first(call->arrays, call->step, piece);
}

/* ---- steps ---- */

/* One step of the ground under the robots of a share. */
static MildStatus step_ground(Share *share, MildError *error) {
    const CrowdArrays *all = &share->arrays;
    const CrowdContact *c = &all->contact;
    const MildBatchInput input = {.position = c->position,
                                  .rotation = c->rotation,
                                  .velocity = c->velocity,
                                  .inverse_inertia = c->inverse_inertia,
                                  .free_velocity = c->free_velocity,
                                  .material = all->material,
                                  .map_origin = all->map_origin,
                                  .height = c->height};
    const MildBatchOutput output = {
        .wrench = c->velocity, .velocity = c->free_velocity, .foot = c->foot};
    return mild_batch_step(&share->ground, &input, &output, 1, share->stream, error);
}

/* The physics steps of a policy step: parts with the ground between them. Then the task. */
static MildStatus step_share(const Crowd *crowd, Share *share, MildError *error) {
    const CrowdArrays *all = &share->arrays;
    Call call = {&share->arrays, &share->step, 0};
    MildStatus status = MILD_OK;
    for (call.part = 0; status == MILD_OK && call.part <= crowd->base.physics_steps; call.part++) {
        status = call.part > 0 ? step_ground(share, error) : MILD_OK;
        if (status == MILD_OK && crowd->kernels) {
            status =
                checked(crowd->kernels->part(all, &share->step, call.part, share->stream), error);
        } else if (status == MILD_OK) {
            pool_run(crowd->pool, all->envs, part_piece, &call);
        }
    }
    if (status == MILD_OK && crowd->kernels) {
        return checked(crowd->kernels->end(all, &share->step, share->stream), error);
    }
    if (status == MILD_OK) {
        pool_run(crowd->pool, all->envs, end_piece, &call);
    }
    return status;
}

/* The first episodes. */
static MildStatus begin_share(const Crowd *crowd, Share *share, MildError *error) {
    Call call = {&share->arrays, &share->step, 0};
    if (crowd->kernels) {
        return checked(crowd->kernels->begin(&share->arrays, share->stream), error);
    }
    pool_run(crowd->pool, share->arrays.envs, begin_piece, &call);
    return MILD_OK;
}

/* New episodes forget their ground, and all are seen. */
static MildStatus see_share(const Crowd *crowd, Share *share, MildError *error) {
    const CrowdArrays *all = &share->arrays;
    Call call = {&share->arrays, &share->step, 0};
    MildStatus status = mild_batch_reset(&share->ground, all->fresh, share->stream, error);
    if (status == MILD_OK && crowd->kernels) {
        return checked(crowd->kernels->first(all, &share->step, share->stream), error);
    }
    if (status == MILD_OK) {
        pool_run(crowd->pool, all->envs, first_piece, &call);
    }
    return status;
}

static MildStatus each_share(const Crowd *crowd, const EnvsStep *step, void *stream,
                             MildStatus (*work)(const Crowd *, Share *, MildError *),
                             MildError *error) {
    MildStatus status = crowd->fork ? device_fork(crowd->fork, stream, error) : MILD_OK;
    for (int i = 0; status == MILD_OK && i < crowd->shares; i++) {
        Share share = share_of(crowd, step, i, stream);
        status = work(crowd, &share, error);
        status = status == MILD_OK ? see_share(crowd, &share, error) : status;
    }
    return status == MILD_OK && crowd->fork ? device_join(crowd->fork, stream, error) : status;
}

static MildStatus reset(Envs *envs, const EnvsView *first, void *stream, MildError *error) {
    const EnvsStep none = {.next = *first};
    return each_share(own(envs), &none, stream, begin_share, error);
}

static MildStatus step(Envs *envs, const EnvsStep *step, void *stream, MildError *error) {
    return step->last.history || step->terms
               ? mild_fail(error, MILD_ERROR_ARGUMENT,
                           "the batch engine does not keep the end of an episode; train.robots = "
                           "mujoco does")
               : each_share(own(envs), step, stream, step_share, error);
}

static MildStatus wait(Envs *envs, MildError *error) {
    const Crowd *crowd = own(envs);
    return crowd->device == MILD_BATCH_HOST ? MILD_OK : device_wait(crowd->device, error);
}

static MildStatus sums(Envs *envs, EnvsStats *sums, void *stream, MildError *error) {
    const Crowd *crowd = own(envs);
    const CrowdArrays *all = &crowd->arrays;
    double sum[TALLY_NUMBERS];
    if (crowd->device != MILD_BATCH_HOST) {
        MildStatus status = checked(crowd->kernels->tally(all, stream), error);
        status = status == MILD_OK ? device_wait(crowd->device, error) : status;
        if (status != MILD_OK) {
            return status;
        }
    } else {
        crowd_host_tally(all);
    }
    MildStatus status = device_copy(crowd->device, sum, all->tally, sizeof sum, error);
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

/* Between the environments and `all->kept`. */
static MildStatus move_kept(const Crowd *crowd, const CrowdArrays *all, int back,
                            MildError *error) {
    if (crowd->device == MILD_BATCH_HOST) {
        crowd_host_keep(all, back);
        return MILD_OK;
    }
    MildStatus status = device_wait(crowd->device, error);
    status = status == MILD_OK ? checked(crowd->kernels->keep(all, back, NULL), error) : status;
    return status == MILD_OK ? device_wait(crowd->device, error) : status;
}

static MildStatus save_progress(Envs *envs, TaskProgress *kept, MildError *error) {
    const Crowd *crowd = own(envs);
    const size_t bytes = (size_t)crowd->arrays.envs * sizeof *kept;
    CrowdArrays all = crowd->arrays;
    all.kept = device_alloc(crowd->device, bytes, error);
    MildStatus status = all.kept ? move_kept(crowd, &all, 0, error) : MILD_ERROR_MEMORY;
    status = status == MILD_OK ? device_copy(crowd->device, kept, all.kept, bytes, error) : status;
    device_free(crowd->device, all.kept);
    return status;
}

static MildStatus load_progress(Envs *envs, const TaskProgress *kept, MildError *error) {
    const Crowd *crowd = own(envs);
    const size_t bytes = (size_t)crowd->arrays.envs * sizeof *kept;
    CrowdArrays all = crowd->arrays;
    all.kept = device_alloc(crowd->device, bytes, error);
    MildStatus status =
        all.kept ? device_copy(crowd->device, all.kept, kept, bytes, error) : MILD_ERROR_MEMORY;
    status = status == MILD_OK ? move_kept(crowd, &all, 1, error) : status;
    device_free(crowd->device, all.kept);
    return status;
}

static MildStatus set_commands(Envs *envs, const double *command, MildError *error) {
    const Crowd *crowd = own(envs);
    const CrowdArrays *all = &crowd->arrays;
    Call call = {all, NULL, 0};
    MildStatus status = device_copy(crowd->device, all->command, command,
                                    3 * (size_t)all->envs * sizeof *command, error);
    if (status == MILD_OK && crowd->device != MILD_BATCH_HOST) {
        return checked(crowd->kernels->tell(all, NULL), error);
    }
    if (status == MILD_OK) {
        pool_run(crowd->pool, all->envs, tell_piece, &call);
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
                                    .set_samples = set_samples};

Envs *envs_create_batch(const EnvsDef *def, MildError *error) {
    if (check_def(def, error) != MILD_OK) {
        return NULL;
    }
    TaskGrounds *drawn = def->chosen ? NULL
                                     : task_grounds_create(def->task, def->robot, def->grounds,
                                                           def->seed, def->pool, error);
    const TaskGrounds *grounds = def->chosen ? def->chosen : drawn;
    Crowd *crowd = grounds ? calloc(1, sizeof *crowd) : NULL;
    if (grounds && !crowd) {
        mild_fail(error, MILD_ERROR_MEMORY, "environments: out of memory");
    }
    if (crowd) {
        crowd->base.backend = &backend;
    }
    if (crowd && open_crowd(crowd, def, grounds, error) != MILD_OK) {
        destroy(&crowd->base);
        crowd = NULL;
    }
    task_grounds_destroy(drawn);
    return crowd ? &crowd->base : NULL;
}

/* ---- tests ---- */

int envs_are_slow(const Robot *robot) {
    double *number = calloc(ENGINE_NUMBERS, sizeof *number);
    EngineTree tree;
    MildError unused;
    const int read =
        number && engine_model_read(robot, TASK_PERIOD, &tree, number, &unused) == MILD_OK;
    const CrowdKernels *kernels = read ? kernels_for(&tree) : NULL;
    free(number);
    return kernels && !kernels->fixed;
}

void *envs_batch_env(const Envs *envs, int i) {
    const Crowd *crowd = own_const(envs);
    return crowd->arrays.env + (size_t)i * crowd->arrays.stride;
}
