/* mild play: shows a policy walking a course, in a window or as a video; prints a table with a row
 * per ground, draws the sole pressure. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/context.h"
#include "app/others.h"
#include "app/play.h"
#include "app/progress.h"
#include "app/report.h"
#include "base/text.h"
#include "identify/belief/file.h"
#include "view/relief.h"

#define GRAVITY 9.81
#define AREA_MARGIN 2.0    /* [m] ground drawn beyond the walk */
#define AREA_ASIDE 0.2     /* [m] aside, for each metre of it: nobody holds the heading */
#define AREA_ASIDE_MAX 8.0 /* [m] */
#define WINDOW_AREA 12.0   /* [m] ground drawn around the start of a window's walk */
#define COURSE_EXTRA 3.0   /* [s] a course gets for starting and stopping */
#define COURSE_LEAST 12.0  /* [s] */
#define SQUARE_MARGIN 8.0  /* [m] ground drawn around a square of robots */
#define SQUARE_TILE 1.3    /* [m] edge of a tile of its picture, at most */
/* The camera goes from near the first robot to where all can be seen. */
#define SQUARE_NEAR 5.0     /* [m] from it */
#define SQUARE_LOW (-16.0)  /* [deg] */
#define SQUARE_AWAY 0.42    /* [-] farther by this share of the square's edge */
#define SQUARE_ASIDE 0.26   /* [-] and looking so much into it, along both edges */
#define SQUARE_HIGH (-33.0) /* [deg] */

typedef struct {
    Context context;
    const char *video, *pressure, *log; /* NULL: not given */
    CliNames grounds;
    double patch;
    int robots; /* of --envs; 1: no others */
    int width, height;
    int printed; /* bool: neither video nor window */
    Scene scene;
    const char *names[MILD_MATERIALS_MAX];
    BeliefNet *belief; /* NULL: the robot has none */
    Play play;
} Command;

/* ---- set-up ---- */

/* The course "a+b+c" of --ground a,b,c. */
static MildStatus make_scene(Command *c, MildError *error) {
    char name[sizeof c->scene.name] = "";
    for (int g = 0; g < c->grounds.count; g++) {
        MildMaterial unused;
        int rigid;
        MildStatus status = grounds_find(c->grounds.name[g], &unused, &rigid, error);
        if (status != MILD_OK) {
            return status;
        }
        if (rigid && c->grounds.count > 1) {
            return mild_fail(
                error, MILD_ERROR_ARGUMENT,
                "--ground: rigid is the engine's own contact and cannot be part of a course");
        }
        size_t used = strlen(name);
        if (used + strlen(c->grounds.name[g]) + 2 > sizeof name) {
            return mild_fail(error, MILD_ERROR_ARGUMENT, "--ground: the course is too long");
        }
        snprintf(name + used, sizeof name - used, "%s%s", g ? "+" : "", c->grounds.name[g]);
    }
    const MildStatus status = context_scene(&c->context, name, c->patch, &c->scene, error);
    for (int g = 0; status == MILD_OK && g < c->grounds.count; g++) {
        c->names[g] = c->grounds.name[g];
    }
    return status;
}

/* Appends the presets that the keys of a window choose from, as many as there is room for. */
static MildStatus add_presets(Command *c, MildError *error) {
    MildTerrain *terrain = &c->scene.terrain;
    MildStatus status = MILD_OK;
    for (int i = 0; i < mild_material_preset_count() && status == MILD_OK &&
                    terrain->material_count < MILD_MATERIALS_MAX && !c->scene.rigid;
         i++) {
        const int m = terrain->material_count;
        c->names[m] = mild_material_preset_name(i);
        mild_material_preset(c->names[m], &terrain->materials[m]);
        status = grounds_finish(&c->context.grounds, &terrain->materials[m], error);
        terrain->material_count++;
        c->play.presets++;
    }
    return status;
}

/* A smaller terminal gets a smaller picture, with a line above it and one below. */
static void fit_terminal(SketchDef *def) {
    struct winsize window;
    if (!isatty(STDOUT_FILENO) || ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) != 0) {
        return;
    }
    if (window.ws_col > 20 && window.ws_col <= def->columns) {
        def->columns = window.ws_col - 1;
    }
    if (window.ws_row > 6 && window.ws_row < def->rows + 2) {
        def->dots *= (window.ws_row - 2.0) / def->rows;
        def->rows = window.ws_row - 2;
    }
}

/* Without a display: the walk in characters. */
static MildStatus make_sketch(Command *c, MildError *error) {
    SketchDef def = sketch_def_default();
    fit_terminal(&def);
    Play *play = &c->play;
    const double reach = play->speed * play->seconds;
    def.rigid = c->scene.rigid;
    def.x_min = fmin(reach, 0) - AREA_MARGIN;
    def.x_max = fmax(reach, 0) + AREA_MARGIN;
    play->sketch = sketch_create(&def, play->robot, &c->scene.terrain, error);
    if (!play->sketch) {
        return error->status;
    }
    fprintf(stderr, "mild play: no window here (no display, or no GLFW), so the walk is printed; "
                    "--video walk.mp4 makes a video\n");
    return MILD_OK;
}

/* [m] Edge of the patches of the course. */
static double patch_of(const Command *c) {
    const TerrainDef *terrain = &c->context.terrain;
    return terrain->map.patches == MILD_PATTERN_NONE ? c->patch : terrain->map.patch_size;
}

/* From the corner at which the robot walks, with the others behind it. */
static void show_others(ViewDef *def, int others, double patch, double reach) {
    const double side = others_side(others), tiles = ceil(patch / SQUARE_TILE);
    def->others = others;
    def->cell = patch / tiles / RELIEF_TILE_CELLS; /* no tile on two patches */
    def->x_min = patch * floor((fmin(reach, 0) - side - SQUARE_MARGIN) / patch);
    def->x_max = patch * ceil((fmax(reach, 0) + SQUARE_MARGIN) / patch);
    def->y_min = patch * floor(-SQUARE_MARGIN / patch);
    def->y_max = patch * ceil((side + SQUARE_MARGIN) / patch);
    def->closeup = 0;
    def->force_arrow = 0;
    def->distance = SQUARE_NEAR;
    def->elevation = SQUARE_LOW;
    def->away_distance = SQUARE_NEAR + SQUARE_AWAY * side;
    def->away_elevation = SQUARE_HIGH;
    def->away_aside[0] = -SQUARE_ASIDE * side;
    def->away_aside[1] = SQUARE_ASIDE * side;
}

static MildStatus make_others(Command *c, MildError *error) {
    Play *play = &c->play;
    const OthersDef def = {.count = c->robots - 1,
                           .task = play->task,
                           .robot = play->robot,
                           .scene = play->scene,
                           .controller = play->controller,
                           .pool = c->context.pool,
                           .seconds = play->seconds,
                           .speed = play->speed,
                           .seed = play->seed};
    play->others = others_create(&def, error);
    return play->others ? MILD_OK : error->status;
}

static MildStatus make_view(Command *c, MildError *error) {
    ViewDef def = view_def_default();
    Play *play = &c->play;
    double reach = play->speed * play->seconds;
    def.width = c->width, def.height = c->height;
    def.rigid = c->scene.rigid;
    def.names = c->names;
    def.window = play->window;
    def.x_min = play->window ? -WINDOW_AREA : fmin(reach, 0) - AREA_MARGIN;
    def.x_max = play->window ? WINDOW_AREA : fmax(reach, 0) + AREA_MARGIN;
    const double aside = fmin(AREA_ASIDE * fabs(reach), AREA_ASIDE_MAX);
    def.y_min -= aside, def.y_max += aside;
    if (play->window) {
        def.y_min = -WINDOW_AREA, def.y_max = WINDOW_AREA;
    }
    if (c->robots > 1) {
        show_others(&def, c->robots - 1, patch_of(c), reach);
    }
    play->rate = def.rate;
    play->view = view_create(&def, play->robot, &c->scene.terrain, error);
    if (!play->view) {
        return error->status;
    }
    if (c->video) {
        play->video = video_open(c->video, def.width, def.height, def.rate, error);
        if (!play->video) {
            return error->status;
        }
    }
    return MILD_OK;
}

/* ---- results ---- */

/* A number of a leg's table: 1e3 sum/count, "-" of none. */
static const char *millimetres(const char *format, double sum, int count, char text[TEXT_CELL]) {
    return text_cell(format, count ? 1e3 * sum / count : NAN, text);
}

static void print_table(Command *c) {
    Play *play = &c->play;
    double weight = robot_total_mass(play->robot) * GRAVITY;
    printf("%-12s %9s %7s %9s %8s %10s %9s %5s\n", "ground", "distance", "time", "speed", "upright",
           "clearance", "deepest", "COT");
    for (int i = 0; i < c->grounds.count; i++) {
        PlayLeg *leg = &play->leg[i];
        Measure *m = &leg->measure;
        char clearance[TEXT_CELL], deepest[TEXT_CELL], cot[TEXT_CELL];
        if (leg->steps == 0) {
            printf("%-12s   not reached\n", c->names[i]);
            continue;
        }
        double distance = leg->end_x - leg->start_x, time = leg->steps * c->context.task.physics_dt;
        double steady = fabs(m->end[0] - m->start[0]);
        measure_finish(m); /* a robot that stands has stances too */
        printf("%-12s %7.2f m %5.1f s %5.2f m/s %8s %7s mm %6s mm %5s\n", c->names[i], distance,
               time, distance / time, leg->fell ? "fell" : "yes",
               millimetres("%.0f", m->apex_sum, m->swings, clearance),
               millimetres("%.1f", m->deepest_sum, m->stances, deepest),
               text_cell("%.2f", steady > 0.1 ? m->work / (weight * steady) : NAN, cot));
    }
}

/* Where the others are at the end, and how deep. */
static void print_others(const Command *c) {
    const Play *play = &c->play;
    printf("%-12s %9s %8s %9s\n", "others", "robots", "upright", "deepest");
    for (int i = 0; i < c->grounds.count; i++) {
        const OthersRow row = others_on(play->others, i);
        printf("%-12s %9d %8d %6.1f mm\n", c->names[i], row.robots, row.upright, 1e3 * row.sinkage);
    }
    printf("%d of %d robots upright\n", !play->fell + others_upright(play->others), c->robots);
}

/* What the robot's own sensors say of the ground at the end. */
static void print_knowledge(const Play *play) {
    char text[400];
    if (!play->belief || play->knows.footsteps == 0) {
        return;
    }
    belief_text(&play->knows, play->belief, text, sizeof text);
    printf("from its own sensors the robot says of the last %d footsteps, with 90 %% (at rest: a "
           "sole under half of its weight; deepest, above: an element in a step):\n    %s\n",
           play->knows.footsteps, text);
    for (int i = 0; i < play->knows.alarms && i < PLAY_ALARMS; i++) {
        printf("%s%.1f s%s", i ? ", " : "it felt another ground at ", play->alarm[i],
               i == play->knows.alarms - 1 || i == PLAY_ALARMS - 1 ? "\n" : "");
    }
}

/* Opens what looks at the ground, and the log. */
static MildStatus open_knowledge(Command *c, MildError *error) {
    Play *play = &c->play;
    const int jumps = c->context.task.jump[1] > 0; /* its frames are no walk's */
    MildStatus status =
        jumps ? MILD_OK : belief_open(robot_name(c->context.robot), &c->belief, error);
    play->belief = c->belief;
    if (status != MILD_OK || !c->log) {
        return status;
    }
    if (!c->belief) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--log: only sa01 has learned to know its ground (docs/identify.md)");
    }
    play->log = fopen(c->log, "w");
    if (!play->log) {
        return mild_fail(error, MILD_ERROR_IO, "%s: cannot write", c->log);
    }
    belief_log_print_header(play->log);
    return MILD_OK;
}

static MildStatus close_knowledge(Command *c, MildStatus status, MildError *error) {
    free(c->belief);
    c->belief = NULL;
    if (c->play.log && fclose(c->play.log) != 0 && status == MILD_OK) {
        return mild_fail(error, MILD_ERROR_IO, "%s: cannot write all of it", c->log);
    }
    return status;
}

/* Writes the CSV and draws the picture from it; for a name that ends in .csv only the CSV. */
static MildStatus save_pressure(const Command *c, MildError *error) {
    char data[PATH_SIZE], names[MILD_MATERIALS_MAX][96];
    const char *labels[MILD_MATERIALS_MAX];
    int any = 0;
    MildStatus status = path_beside(c->pressure, ".csv", data, error);
    if (status != MILD_OK) {
        return status;
    }
    for (int i = 0; i < c->grounds.count; i++) {
        int repeat = 1;
        for (int k = 0; k < i; k++) {
            repeat += strcmp(c->names[k], c->names[i]) == 0;
        }
        snprintf(names[i], sizeof names[i], repeat > 1 ? "%s (%d)" : "%s", c->names[i], repeat);
        labels[i] = names[i];
        any += pressure_stances(c->play.pressure, i);
    }
    if (any == 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%s: the robot took no step, so there is nothing to draw", c->pressure);
    }
    status = pressure_write(c->play.pressure, data, labels, error);
    if (status == MILD_OK && strcmp(data, c->pressure) != 0) {
        status = figure_draw("pressure", data, c->pressure, NULL, error);
    }
    return status;
}

/* ---- the command ---- */

static MildStatus finish_video(Command *c, MildStatus status, MildError *error) {
    MildError closing = {0};
    Play *play = &c->play;
    MildStatus closed = video_close(play->video, &closing);
    play->video = NULL;
    if (status == MILD_OK && closed != MILD_OK) {
        *error = closing;
        return closed;
    }
    return status;
}

static MildStatus walk(Command *c, MildError *error) {
    Play *play = &c->play;
    MildStatus status = play_run(play, error);
    if (play->video) {
        status = finish_video(c, status, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    print_table(c);
    print_knowledge(play);
    if (play->others) {
        print_others(c);
    }
    if (c->video) {
        printf("video %s: %d frames\n", c->video, play->frames);
    }
    if (!c->pressure) {
        return MILD_OK;
    }
    status = save_pressure(c, error);
    if (status == MILD_OK) {
        printf("sole pressure %s\n", c->pressure);
    }
    return status;
}

static MildStatus check_others(const Command *c, MildError *error) {
    if (!c->video) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "--envs: only for --video FILE.mp4");
    }
    return strcmp(c->context.controller, "learned") == 0
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_ARGUMENT,
                           "--envs: the others walk by --controller learned");
}

static MildStatus prepare(Command *c, MildError *error) {
    Play *play = &c->play;
    MildStatus status = MILD_OK;
    interrupt_install();
    if (c->robots > 1) {
        status = check_others(c, error);
        c->context.pool = status == MILD_OK ? pool_create(0) : NULL;
        if (status == MILD_OK && !c->context.pool) {
            status = mild_fail(error, MILD_ERROR_MEMORY, "--envs: no threads");
        }
    }
    if (c->pressure && c->scene.rigid) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--pressure: rigid ground has no elements, choose a soft one");
    }
    if (status == MILD_OK) {
        status = context_move(&c->context, c->robots, error);
    }
    if (status == MILD_OK && c->robots > 1) {
        status = make_others(c, error);
    }
    if (status == MILD_OK && c->pressure) {
        play->pressure = pressure_create(play->robot, c->scene.terrain.material_count,
                                         c->context.task.physics_dt, error);
        if (!play->pressure) {
            status = error->status;
        }
    }
    if (status == MILD_OK && (c->video || play->window)) {
        status = make_view(c, error);
    } else if (status == MILD_OK && c->printed) {
        status = make_sketch(c, error);
    }
    return status;
}

/* Speed and time that were not given. */
static MildStatus choose_walk(Command *c, MildError *error) {
    Play *play = &c->play;
    const int follows = controller_has(c->context.controller, CONTROLLER_FOLLOWS);
    if (isnan(play->speed)) {
        play->speed = follows ? 0.6 : 0;
    }
    if (play->seconds == 0) {
        double course = c->grounds.count * c->patch / fmax(fabs(play->speed), 0.1) + COURSE_EXTRA;
        play->seconds = follows ? fmax(course, COURSE_LEAST) : COURSE_LEAST;
    }
    MildStatus status = robots_check_command(c->context.controller, "speed", play->speed, error);
    return status == MILD_OK ? robots_check_jump(&c->context.task, play->jump, error) : status;
}

static MildStatus run_play(Command *c, const CliArgs *args, MildError *error) {
    Play *play = &c->play;
    Context *on = &c->context;
    MildStatus status = context_open(on, args, error);
    if (status == MILD_OK) {
        status = choose_walk(c, error);
    }
    play->task = &on->task, play->scene = &c->scene, play->robot = on->robot,
    play->controller = &on->mover;
    play->window = !c->video && !c->pressure && window_available();
    c->printed = !c->video && !c->pressure && !play->window;
    if (status == MILD_OK) {
        status = make_scene(c, error);
    }
    if (status == MILD_OK && play->window) {
        status = add_presets(c, error);
    }
    if (status == MILD_OK) {
        status = prepare(c, error);
    }
    if (status == MILD_OK) {
        status = open_knowledge(c, error);
    }
    if (status == MILD_OK) {
        status = walk(c, error);
    }
    status = close_knowledge(c, status, error);
    if (play->video) {
        finish_video(c, status, error);
    }
    view_destroy(play->view);
    sketch_destroy(play->sketch);
    pressure_destroy(play->pressure);
    others_destroy(play->others);
    context_close(on);
    return status;
}

static int parse_and_run(Command *c, CliArgs *args, int argc, char **argv) {
    const CliOption options[] = {
        context_policy(&c->context,
                       "policy to watch (default policies/mild.safetensors, or that of --robot)"),
        context_robot(&c->context),
        context_controller(&c->context),
        {"ground", CLI_NAMES, &c->grounds, 0, 0, "NAME[,NAME]",
         "ground, or several that are crossed in order (default sand_loose)"},
        context_model(&c->context),
        {"patch", CLI_NUMBER, &c->patch, 0.5, 100, "L",
         "[m] length of each ground of a course (default 2)"},
        {"video", CLI_OUTPUT, &c->video, 0, 0, "FILE.mp4",
         "write a video; without this and --pressure a window opens, and where there is none the "
         "walk is printed"},
        {"envs", CLI_INT, &c->robots, 1, 65536, "N",
         "so many robots in the video, in a square (default 1); the table and the pressure are the "
         "first one's"},
        {"pressure", CLI_OUTPUT, &c->pressure, 0, 0, "FILE.png",
         "draw the sole pressure on each ground; the numbers go to FILE.csv beside it"},
        {"log", CLI_OUTPUT, &c->log, 0, 0, "FILE.csv",
         "write the frames that the policy sees, for mild fit FILE.csv"},
        {"speed", CLI_NUMBER, &c->play.speed, -4, 4, "V",
         "[m/s] commanded forward speed (default 0.6; 0 for a controller that stands)"},
        {"jump", CLI_NUMBER, &c->play.jump, 0, 1, "H",
         "[m] commanded rise of jumps, one after the other from 1 s on; --speed is their mean "
         "speed (default 0)"},
        {"seconds", CLI_NUMBER, &c->play.seconds, 0, 3600, "T",
         "[s] length of the walk; 0: long enough for the course (default 0)"},
        {"seed", CLI_UINT64, &c->play.seed, 0, 0, "S",
         "seed of start and sensor noise (default 1)"},
        context_config(&c->context),
        {"width", CLI_INT, &c->width, 64, 7680, "N", "[pixels] width of the picture (default 960)"},
        {"height", CLI_INT, &c->height, 64, 4320, "N",
         "[pixels] height of the picture (default 540)"},
    };
    const CliCommand command = {
        .name = "play",
        .usage = "[--policy FILE] [--ground NAME[,NAME]] [--video FILE.mp4] [--pressure FILE.png] "
                 "[options]",
        .summary = "Shows a policy walking. Several grounds make a course, which it crosses in "
                   "order. Keys in the window: the arrows change speed and turn, Q and E step "
                   "sideways, S stops, space pauses, - and = change how fast time passes, R "
                   "restarts, Esc quits; the mouse turns the camera. 1 to 8 lay another ground "
                   "under the robot, in the order of mild info grounds; F and V change friction, "
                   "K and M stiffness, up and down by a tenth. At the end a table has a row for "
                   "each ground, until keys changed it.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .picture = "pressure",
        .numbers = ".csv",
        .overrides = "any key of sections [task], [ground] and [terrain], e.g. --ground.mu=0.4 "
                     "--terrain.kind=waves --terrain.memory=true",
        .examples = "  mild play --ground rubber,foam45,sand_loose --video walk.mp4 --pressure "
                    "pressure.png\n"
                    "  mild play --ground foam28 --speed 0.4\n"
                    "  mild play --ground sand_loose --terrain.kind=waves --terrain.memory=true "
                    "--video waves.mp4\n"
                    "  mild play --envs 4096 --ground "
                    "rubber,foam60,foam45,foam28,foam25,grass,sand_loose,sand_dense "
                    "--terrain.patches=checker --terrain.patch_size=3 --seconds 6 --video "
                    "patchwork.mp4\n",
    };
    const int parsed = cli_parse(&command, argc, argv, args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    MildError error = {0};
    int code = cli_refuse_dash("play", "video", c->video);
    code = code ? code : cli_refuse_dash("play", "pressure", c->pressure);
    code = code ? code : cli_refuse_dash("play", "log", c->log);
    if (code) {
        return code;
    }
    return run_play(c, args, &error) == MILD_OK ? 0 : cli_fail("play", &error);
}

int cmd_play(int argc, char **argv) {
    Command *c = calloc(1, sizeof *c);
    CliArgs *args = calloc(1, sizeof *args);
    int code = CLI_EXIT_BAD_INPUT;
    if (c && args) {
        c->context = context_default();
        c->context.controller = "learned";
        c->context.on_ground = 1;
        c->patch = 2;
        c->robots = 1;
        c->width = 960, c->height = 540;
        c->play.speed = NAN; /* not given */
        c->play.seed = 1;
        c->grounds.count = 1;
        strcpy(c->grounds.name[0], "sand_loose");
        code = parse_and_run(c, args, argc, argv);
    } else {
        cli_fail_text("play", "out of memory");
    }
    free(c);
    free(args);
    return code;
}
