#include "app/play.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "app/progress.h"
#include "base/clock.h"
#include "control/speed_hold.h"
#include "identify/belief/file.h"
#include "run/eval/eval.h"

static const double key_factor = 1.1; /* of friction or stiffness, a key */

Live live_begin(const MildTerrain *terrain, int presets) {
    Live live = {.terrain = *terrain, .presets = presets};
    memcpy(live.original, terrain->materials, sizeof live.original);
    return live;
}

/* Names of the fields that are the stiffness of a model; NULL ends them. */
static const char *const *stiffness_of(int model) {
    return mild_model_info((MildModel)model)->scaled;
}

static double *number_of(MildMaterial *material, const char *name) {
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, name, NULL);
    return (double *)(void *)((char *)material + field->offset);
}

/* Changes a material unless that leaves its range. */
static void scale(MildMaterial *material, double friction, double stiffness) {
    MildMaterial wanted = *material;
    const char *const *names = stiffness_of(material->model);
    wanted.mu *= friction;
    for (int i = 0; i < MILD_MODEL_SCALED && names[i]; i++) {
        *number_of(&wanted, names[i]) *= stiffness;
    }
    if (mild_material_check(&wanted, NULL) == MILD_OK) {
        *material = wanted;
    }
}

int live_take(Live *live, int material, const WindowInput *input) {
    MildTerrain *terrain = &live->terrain;
    if (input->friction != 0 || input->stiffness != 0) {
        scale(&terrain->materials[material], pow(key_factor, input->friction),
              pow(key_factor, input->stiffness));
    }
    if (input->ground < 1 || input->ground > live->presets) {
        return 0;
    }
    const int chosen = terrain->material_count - live->presets + input->ground - 1;
    terrain->materials[chosen] = live->original[chosen];
    terrain->patches[0] = (MildPatch){-INFINITY, INFINITY, -INFINITY, INFINITY, chosen};
    terrain->patch_count = 1;
    return 1;
}

void live_apply(const Live *live, MildTerrain *terrain) {
    memcpy(terrain->materials, live->terrain.materials, sizeof terrain->materials);
    memcpy(terrain->patches, live->terrain.patches, sizeof terrain->patches);
    terrain->patch_count = live->terrain.patch_count;
}

const char *live_describe(const Live *live, int material, char *text, size_t size) {
    MildMaterial now = live->terrain.materials[material];
    const char *name = stiffness_of(now.model)[0];
    snprintf(text, size, "friction %.2f (F V), %s %.4g (K M)", now.mu, name,
             *number_of(&now, name));
    return text;
}

#define START_TIME 1.0  /* [s] time for starting, not counted in speeds and pressures */
#define FALL_TIME 1.0   /* [s] how long the picture stays after a fall */
#define SPEED_TIME 0.5  /* [s] the shown speed is a running mean over about this long */
#define PACE_TIME 0.5   /* [s] over which the real-time factor is measured */
#define OWED_MAX 0.2    /* [s] delay behind real time that is caught up with at once */
#define WINDOW_TIME 1e6 /* [s] a window's walk has no end */
#define NEAR_SHARE 0.35 /* [-] of a video of many robots, before the camera moves away */
#define SKETCH_RATE 20  /* [1/s] pictures on a terminal */

/* [m/s, m/s, rad/s] Largest command of the keys, which is the range that the shipped policy was
 * trained on. */
static const double command_max[3] = {1.3, 0.3, 0.8};

/* How fast the walk passes: seconds of it per second of the clock, over the last PACE_TIME. */
typedef struct {
    double walked, clock; /* [s] at the start of the time that is measured now */
    double factor;        /* [-] of the time before */
} Pace;

/* State of the walk. This robot is stepped by task_env_step and not, as the others are, by an Envs:
 * pictures and pressures are read from its RobotSim, between the steps, too, and keys change the
 * terrain under it. An Envs steps many robots in one RobotSim and hands none out. */
typedef struct {
    Play *play;
    TaskDef task; /* the caller's task with an episode as long as the walk */
    TaskEnv *env;
    RobotSim *sim;
    double command[3]; /* [m/s, m/s, rad/s] given by the keys */
    SpeedHoldDef speed_hold;
    SpeedHold hold;
    int steer;    /* bool: keys were used; until then the heading is held */
    double speed; /* [m/s] shown */
    double end;   /* [s] */
    int ground;   /* material under the base */
    Live live;    /* the ground, which keys change in a window */
    Pace pace;
    int lost; /* bool: the simulation diverged, so the state must not be drawn */
} PlayWalk;

/* TaskCallback: every physics step. */
static void watch(void *context, const TaskEnv *env, const RobotSim *sim, const double *torque) {
    PlayWalk *walk = context;
    Play *play = walk->play;
    const double *qpos = robot_sim_qpos(sim);
    walk->ground = mild_terrain_material_at(task_env_terrain(env), qpos[0], qpos[1]);
    PlayLeg *leg = &play->leg[walk->ground];
    play->time += robot_sim_dt(sim);
    if (play->time < START_TIME || play->fell || play->changed) {
        return;
    }
    if (leg->steps++ == 0) {
        measure_start(&leg->measure, robot_sim_dt(sim));
        leg->start_x = qpos[0];
    }
    leg->end_x = qpos[0];
    measure_step(&leg->measure, env, sim, torque);
    if (play->pressure) {
        pressure_observe(play->pressure, sim, task_env_terrain(env));
    }
}

static void set_command(PlayWalk *walk) {
    const double jump = walk->play->jump;
    if (jump > 0 && walk->play->time < MEASURE_SETTLED) {
        eval_command(walk->env, 0, 0);
        return;
    }
    eval_command(walk->env, walk->command[0], walk->command[1]);
    if (walk->steer) {
        memcpy(walk->env->command, walk->command, sizeof walk->command);
    }
    walk->env->command[TASK_RISE] = jump;
}

static void start(PlayWalk *walk) {
    Play *play = walk->play;
    EnvsView none = {0};
    belief_reset(&play->knows);
    walk->hold = (SpeedHold){.cycles = {0}};
    set_command(walk);
    task_env_reset_on(walk->env, &walk->task, play->robot, walk->sim, &walk->live.terrain,
                      play->scene->rigid, &none);
    walk->speed = 0;
}

/* By the frame that the policy sees next. */
static void look_at_ground(PlayWalk *walk) {
    Play *play = walk->play;
    const float *frame = task_env_frame(walk->env);
    if (play->belief && belief_step(&play->knows, play->belief, frame) & BELIEF_ALARM &&
        play->knows.alarms <= PLAY_ALARMS) {
        play->alarm[play->knows.alarms - 1] = play->time;
    }
    if (play->log) {
        belief_log_print(play->log, play->time, frame);
    }
}

static void step(PlayWalk *walk) {
    Play *play = walk->play;
    float action[ROBOT_JOINTS_MAX];
    EnvsView none = {0};
    ControllerRow row = {play->controller, 0};
    TaskDrive drive = controller_drive(&row);
    TaskCallback callback = {watch, walk, play->controller->torque ? &drive : NULL};
    look_at_ground(walk);
    play->controller->act(play->controller->self, 1, &walk->env, action);
    TaskStep out =
        task_env_step(walk->env, &walk->task, play->robot, walk->sim, action, 0, &none, &callback);
    const double *rotation = robot_sim_base_rotation(walk->sim), *qvel = robot_sim_qvel(walk->sim);
    double forward = (rotation[0] * qvel[0] + rotation[3] * qvel[1]) /
                     fmax(hypot(rotation[0], rotation[3]), 1e-6);
    walk->speed += TASK_PERIOD / SPEED_TIME * (forward - walk->speed);
    set_command(walk);
    speed_hold(&walk->hold, &walk->speed_hold, task_env_frame(walk->env),
               controller_estimates(play->controller, 0), walk->env->command);
    if (play->others) {
        others_step(play->others);
    }
    if (play->view && out.valid) {
        view_observe(play->view, walk->sim);
    }
    if (play->sketch && out.valid) {
        sketch_observe(play->sketch, walk->sim);
    }
    if (!out.done || out.timeout) {
        return;
    }
    play->fell = 1;
    play->leg[walk->ground].fell = 1;
    /* Stop here: only soles touch the ground, and a falling robot would sink through it. */
    walk->end = play->time;
    walk->lost = !out.valid;
}

static MildStatus frame(PlayWalk *walk, MildError *error) {
    Play *play = walk->play;
    if (walk->lost) {
        return MILD_OK;
    }
    ViewInfo info = {.time = play->time, .speed = walk->speed, .fell = play->fell};
    char ground[96] = "rigid ground", note[700], knows[400] = "";
    memcpy(info.command, walk->env->command, sizeof info.command);
    if (play->others) {
        info.others = others_shown(play->others);
        info.away = fmin(fmax((play->time / walk->end - NEAR_SHARE) / (1 - NEAR_SHARE), 0), 1);
        snprintf(note, sizeof note, "%d of %d upright", !play->fell + others_upright(play->others),
                 1 + others_count(play->others));
        info.note = note;
    }
    if (play->window) {
        if (!play->scene->rigid) {
            live_describe(&walk->live, walk->ground, ground, sizeof ground);
        }
        if (play->belief && play->knows.footsteps > 0) {
            belief_lines(&play->knows, play->belief, knows, sizeof knows);
        }
        snprintf(note, sizeof note, "%s%s%s\n%.2f x real time (- =)", knows, ground,
                 play->presets ? ", other ground (1 2 3 ...)" : "", walk->pace.factor);
        info.note = note;
    }
    view_frame(play->view, walk->sim, &info);
    play->frames++;
    return play->video ? video_frame(play->video, view_pixels(play->view), error) : MILD_OK;
}

static void wait_until(double time) {
    double left = time - clock_seconds();
    if (left <= 0) {
        return;
    }
    struct timespec pause = {(time_t)left, (long)(1e9 * (left - floor(left)))};
    nanosleep(&pause, NULL);
}

/* On a terminal in the place of the one before; in a file one below the other. Written past the
 * stream, which lets no cursor move. */
static void print_sketch(PlayWalk *walk, int terminal) {
    Play *play = walk->play;
    if (play->frames++ > 0 && terminal) {
        dprintf(STDOUT_FILENO, "\033[%dA\r", sketch_rows(play->sketch) + 1);
    }
    printf("%5.1f s  x %5.2f m  %4.2f m/s %-12s\n%s", play->time, robot_sim_qpos(walk->sim)[0],
           walk->speed, play->fell ? "it fell" : "", sketch_draw(play->sketch, walk->sim));
    fflush(stdout);
}

/* In real time on a terminal; in a file a picture each second. */
static void run_printed(PlayWalk *walk) {
    Play *play = walk->play;
    const int terminal = isatty(STDOUT_FILENO);
    const double rate = terminal ? SKETCH_RATE : 1, begin = clock_seconds();
    while (play->time < walk->end && !interrupt_requested()) {
        if (play->time * rate >= play->frames) {
            wait_until(terminal ? begin + play->time : 0);
            print_sketch(walk, terminal);
        }
        step(walk);
    }
    if (!walk->lost) {
        print_sketch(walk, terminal);
    }
}

static MildStatus run_filmed(PlayWalk *walk, MildError *error) {
    Play *play = walk->play;
    Progress progress = progress_begin("playing");
    MildStatus status = MILD_OK;
    while (status == MILD_OK && play->time < walk->end && !interrupt_requested()) {
        if (play->view && play->time * play->rate >= play->frames) {
            status = frame(walk, error);
        }
        if (status == MILD_OK) {
            step(walk);
        }
        progress_show(&progress, play->time / walk->end, "%.1f s walked, x %.2f m, %.2f m/s",
                      play->time, robot_sim_qpos(walk->sim)[0], walk->speed);
    }
    for (int k = 0; play->video && play->fell && status == MILD_OK && k < FALL_TIME * play->rate;
         k++) {
        status = frame(walk, error);
    }
    progress_end(&progress, "%.1f s walked, x %.2f m%s", play->time, robot_sim_qpos(walk->sim)[0],
                 play->fell ? ", fell" : "");
    return status;
}

static MildStatus restart(PlayWalk *walk, MildError *error) {
    Play *play = walk->play;
    play->fell = walk->lost = 0;
    play->time = 0;
    start(walk);
    walk->pace = (Pace){0};
    return view_reset(play->view, &walk->live.terrain, error);
}

static void take_keys(PlayWalk *walk, const WindowInput *input) {
    if (input->halt) {
        memset(walk->command, 0, sizeof walk->command);
    }
    for (int c = 0; c < 3; c++) {
        if (c > 0 && input->command[c] != 0) {
            walk->steer = 1;
        }
        walk->command[c] =
            fmin(fmax(walk->command[c] + input->command[c], -command_max[c]), command_max[c]);
    }
}

/* The keys that change the ground. What was measured on it before does not go on. */
static MildStatus take_ground_keys(PlayWalk *walk, const WindowInput *input, MildError *error) {
    if (walk->play->scene->rigid || !(input->ground || input->friction || input->stiffness)) {
        return MILD_OK;
    }
    const int other = live_take(&walk->live, walk->ground, input);
    MildTerrain *terrain = &task_env_rest(walk->env)->terrain;
    const MildTerrain before = *terrain;
    live_apply(&walk->live, terrain);
    robot_sim_change_ground(walk->sim, &before, terrain, task_env_ground(walk->env));
    walk->play->changed = 1;
    return other ? view_reset(walk->play->view, &walk->live.terrain, error) : MILD_OK;
}

static void measure_pace(PlayWalk *walk, double now, int paused) {
    Pace *pace = &walk->pace;
    if (paused || pace->clock == 0) {
        *pace = (Pace){walk->play->time, now, paused ? 0 : pace->factor};
    } else if (now - pace->clock >= PACE_TIME) {
        const double factor = (walk->play->time - pace->walked) / (now - pace->clock);
        *pace = (Pace){walk->play->time, now, factor};
    }
}

static MildStatus run_window(PlayWalk *walk, MildError *error) {
    Play *play = walk->play;
    WindowInput input = {.time_scale = 1};
    double shown = clock_seconds(), fallen = 0,
           owed = 0; /* owed: [s] of the walk that real time is ahead */
    MildStatus status = MILD_OK;
    while (status == MILD_OK && !input.quit && !interrupt_requested()) {
        status = frame(walk, error);
        view_show(play->view, &input);
        take_keys(walk, &input);
        if (status == MILD_OK) {
            status = take_ground_keys(walk, &input, error);
        }
        if (input.reset || (play->fell && shown > fallen + FALL_TIME)) {
            status = restart(walk, error);
        }
        wait_until(shown + 1.0 / play->rate);
        double now = clock_seconds();
        owed = input.paused ? 0 : fmin(owed + (now - shown) * input.time_scale, OWED_MAX);
        for (; owed >= TASK_PERIOD && !play->fell; owed -= TASK_PERIOD) {
            step(walk);
        }
        shown = now;
        measure_pace(walk, now, input.paused);
        if (!play->fell) {
            fallen = now;
        }
    }
    return status;
}

MildStatus play_run(Play *play, MildError *error) {
    PlayWalk walk = {.play = play, .task = *play->task, .command = {play->speed, 0, 0}};
    walk.live = live_begin(&play->scene->terrain, play->presets);
    walk.end = play->seconds;
    walk.task.episode = play->window ? WINDOW_TIME : play->seconds + 1.0;
    walk.env = aligned_alloc(64, task_env_bytes(&walk.task, play->robot));
    walk.sim = robot_sim_create(play->robot, walk.task.physics_dt, error);
    MildStatus status = MILD_OK;
    if (!walk.sim) {
        status = error->status;
    }
    if (!walk.env) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    if (status == MILD_OK) {
        walk.speed_hold = speed_hold_def(&walk.task, play->robot, play->controller);
        task_env_init(walk.env, &walk.task, play->robot, play->seed, 0);
        start(&walk);
        if (play->sketch) {
            run_printed(&walk);
        } else {
            status = play->window ? run_window(&walk, error) : run_filmed(&walk, error);
        }
    }
    robot_sim_destroy(walk.sim);
    free(walk.env);
    return status;
}
