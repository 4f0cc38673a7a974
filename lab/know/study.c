#include <math.h>
#include <string.h>

#include "know/know.h"

static double draw_log(Random *r, double low, double high) {
    return low * exp(random_unit(r) * log(high / low));
}

static void draw_wide(Random *r, MildMaterial *m) {
#define PRIOR_DRAW(name, unit, low, high) m->name = draw_log(r, low, high);
    PRIOR_LIST(PRIOR_DRAW)
#undef PRIOR_DRAW
}

static void draw_paper(Random *r, MildMaterial *m) {
    m->k_pen = draw_log(r, 150, 1400);
    m->sigma_cone = draw_log(r, 8e4, 2.4e5);
    m->slip_length = draw_log(r, PRIOR_NO_SLIP, 1); /* none */
}

PriorGround prior_ground(const MildMaterial *material, const MildSole *sole, double load) {
    return (PriorGround){.sinkage = mild_sole_sinkage(sole, material, load),
                         .k_pen = material->k_pen,
                         .sigma_cone = material->sigma_cone,
                         .mu = material->mu,
                         .slip_length = material->slip_length > 0 ? material->slip_length : 1,
                         .preset = -1};
}

static int is_of_paper(const char *preset) {
    return strcmp(preset, "foam45") == 0 || strcmp(preset, "grass") == 0 ||
           strcmp(preset, "sand_loose") == 0;
}

PriorGround prior_draw(Prior prior, Random *r, const MildSole *sole, double load,
                       MildMaterial *material) {
    PriorGround ground;
    int preset;
    do {
        do {
            preset = (int)random_index(r, (uint32_t)mild_material_preset_count());
        } while (prior == PRIOR_PAPER && !is_of_paper(mild_material_preset_name(preset)));
        *material = mild_material_default();
        mild_material_preset(mild_material_preset_name(preset), material);
        mild_model_match(MILD_MODEL_MILD, material, sole, load, material, NULL);
        if (prior == PRIOR_PAPER) {
            draw_paper(r, material);
        } else if (prior == PRIOR_WIDE) {
            draw_wide(r, material);
        }
        ground = prior_ground(material, sole, load);
        ground.preset = preset;
    } while (!(ground.sinkage <= PRIOR_SINKAGE));
    if (material->slip_length >= PRIOR_NO_SLIP) {
        material->slip_length = 0;
    }
    return ground;
}

#define RANDOM_USE_WALK 0x4b4e4f57u
#define RANDOM_USE_BATCH 0x4b4e4f42u
#define FAR 1e4 /* [m] */

/* ---- what is drawn ---- */

static void draw_command(Random *r, double command[3]) {
    const double way = random_unit(r), side = random_unit(r), turn = random_unit(r);
    command[0] = way < 0.8 ? random_uniform(r, 0.2, 1.2) : random_uniform(r, -1, -0.2);
    command[1] = side < 0.8 ? 0 : random_uniform(r, -0.3, 0.3);
    command[2] = turn < 0.8 ? 0 : random_uniform(r, -0.6, 0.6);
}

/* Any command, or several; straight ones for a study at given speeds and over a border. */
static void draw_commands(const StudyDef *def, int straight, Random *r, WalkRoute *walk) {
    const double share = random_unit(r);
    walk->commands = straight || share < 0.6 ? 1 : 2 + (int)random_index(r, WALK_COMMANDS - 1);
    for (int i = 0; i < walk->commands; i++) {
        draw_command(r, walk->command[i]);
    }
    if (def->speed[0] != 0 || def->speed[1] != 0) {
        walk->command[0][0] = random_uniform(r, def->speed[0], def->speed[1]);
    }
    if (straight) {
        walk->command[0][1] = walk->command[0][2] = 0;
    }
}

/* Matched to the model; drawn again where there is no match. */
static PriorGround draw_ground(const StudyDef *def, Random *r, MildMaterial *material) {
    const MildSole *sole = robot_rasters(def->robot)[0];
    const double load = robot_foot_load(def->robot);
    MildMaterial rival;
    PriorGround ground;
    do {
        ground = prior_draw(def->prior, r, sole, load, material);
        if (def->preset) {
            *material = *def->preset;
            ground = prior_ground(material, sole, load);
        }
    } while (robot_match_model(def->robot, def->model, material, &rival, NULL) != MILD_OK);
    *material = rival;
    return ground;
}

/* The second ground begins where the robot will be in the middle third of the walk. */
static void draw_border(const StudyDef *def, Random *r, StudyWalk *walk) {
    MildTerrain *terrain = &walk->walk.terrain;
    const double speed = walk->walk.command[0][0];
    const double at = speed * random_uniform(r, 0.35, 0.65) * def->seconds;
    const MildPatch patch = {speed > 0 ? at : -FAR, speed > 0 ? FAR : at, -FAR, FAR, 1};
    do {
        walk->ground[1] = draw_ground(def, r, &terrain->materials[1]);
    } while (def->prior == PRIOR_PRESETS && !def->preset &&
             walk->ground[1].preset == walk->ground[0].preset);
    terrain->material_count = walk->grounds = 2;
    mild_terrain_add_patch(terrain, &patch, NULL);
}

static void draw_walk(const StudyDef *def, uint32_t number, StudyWalk *walk) {
    Random r = random_at(def->seed ^ RANDOM_USE_WALK, number, 0);
    const int changes = random_unit(&r) < def->change_share;
    const int straight = changes || def->speed[0] != 0 || def->speed[1] != 0;
    MildMaterial material;
    memset(walk, 0, sizeof *walk);
    walk->ground[0] = draw_ground(def, &r, &material);
    walk->grounds = 1;
    walk->walk.terrain = mild_terrain_uniform(&material);
    walk->walk.rigid = def->rigid;
    walk->seconds = def->seconds;
    draw_commands(def, straight, &r, &walk->walk);
    if (changes) {
        draw_border(def, &r, walk);
    }
    for (int g = 0; g < walk->grounds; g++) {
        MildMaterial *under = &walk->walk.terrain.materials[g];
        under->grip = under->slip_length > 0 ? def->grip : under->grip;
    }
    if (def->slick[1] > 0) {
        const int last = walk->grounds - 1;
        const double mu = def->slick[0] * pow(def->slick[1] / def->slick[0], random_unit(&r));
        walk->walk.terrain.materials[last].mu = walk->ground[last].mu = mu;
    }
}

static TaskDef draw_task(const StudyDef *def, uint32_t batch, StudyWalk *walk, int count) {
    Random r = random_at(def->seed ^ RANDOM_USE_BATCH, batch, 0);
    const int drawn = random_unit(&r) < def->robots;
    const double noise = random_unit(&r) < def->quiet ? random_unit(&r) : 1;
    TaskDef task = drawn ? *def->drawn : *def->nominal;
    task.noise_q *= noise;
    task.noise_qd *= noise;
    task.noise_omega *= noise;
    task.noise_gravity *= noise;
    for (int i = 0; i < count; i++) {
        walk[i].drawn = drawn;
        walk[i].noise = noise;
    }
    return task;
}

/* ---- the run ---- */

typedef struct {
    const StudyWatcher *watcher;
    int first;
} Numbered;

static void count_on(void *context, const WalkStep *step) {
    const Numbered *numbered = context;
    WalkStep same = *step;
    same.walk += numbered->first;
    numbered->watcher->stepped(numbered->watcher->context, &same);
}

static WalkCare care_on(void *context, int walk) {
    const Numbered *numbered = context;
    return numbered->watcher->care(numbered->watcher->context, walk + numbered->first);
}

MildStatus study_run(const StudyDef *def, StudyWalk *walk, int count, const StudyWatcher *watcher,
                     MildError *error) {
    MildStatus status = MILD_OK;
    robot_set_model(def->robot, def->model);
    for (int first = 0; first < count && status == MILD_OK; first += STUDY_BATCH) {
        const int batch = count - first < STUDY_BATCH ? count - first : STUDY_BATCH;
        WalkRoute walks[STUDY_BATCH];
        int lasted[STUDY_BATCH];
        Numbered numbered = {watcher, first};
        for (int i = 0; i < batch; i++) {
            draw_walk(def, (uint32_t)(first + i), &walk[first + i]);
            walks[i] = walk[first + i].walk;
        }
        const TaskDef task = draw_task(def, (uint32_t)first, walk + first, batch);
        const WalksDef run = {.task = &task,
                              .robot = def->robot,
                              .pool = def->pool,
                              .controller = def->controller,
                              .walk = walks,
                              .count = batch,
                              .seconds = def->seconds,
                              .seed = def->seed,
                              .first = (uint32_t)first,
                              .stepped = count_on,
                              .context = &numbered,
                              .care = watcher->care ? care_on : NULL};
        status = walks_run(&run, lasted, error);
        for (int i = 0; i < batch && status == MILD_OK; i++) {
            walk[first + i].lasted = lasted[i];
        }
    }
    return status;
}
