#include <math.h>
#include <stdio.h>
#include <string.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/grounds.h"
#include "app/report.h"
#include "app/robots.h"
#include "base/paths.h"
#include "base/text.h"
#include "identify/press.h"
#include "robot/robot.h"

/* NaN: the option was not given. */
typedef struct {
    const char *robot, *ground, *model, *plate, *csv, *figure;
    CliNumbers depth, force; /* the turns */
    double speed, tilt_deg, drag, drag_speed, drop, impact, mass, seconds, step;
    int cycles;
} PressOptions;

/* The sole to press with. `robot` owns it when it is the robot's. */
typedef struct {
    const char *robot_name; /* of --robot, or NULL */
    Robot *robot;
    MildSole *plate, *concentric;
    const MildSole *raster, *sole; /* sole: what the model presses with */
    char name[64];
} Tool;

static void tool_close(Tool *tool) {
    mild_sole_destroy(tool->plate);
    mild_sole_destroy(tool->concentric);
    robot_destroy(tool->robot);
}

static MildStatus tool_open_robot(Tool *tool, MildError *error) {
    if (!tool->robot) {
        tool->robot = robots_open(tool->robot_name, "sa01", error);
    }
    return tool->robot ? MILD_OK : error->status;
}

static MildStatus tool_open_sole(Tool *tool, MildError *error) {
    MildStatus status = tool_open_robot(tool, error);
    if (status != MILD_OK) {
        return status;
    }
    tool->sole = tool->raster = robot_rasters(tool->robot)[0];
    snprintf(tool->name, sizeof tool->name, "the robot's %.40s sole",
             robot_foot_name(tool->robot, 0));
    return MILD_OK;
}

static MildStatus tool_open(Tool *tool, const char *text, MildError *error) {
    if (strcmp(text, "sole") == 0) {
        return tool_open_sole(tool, error);
    }
    char length_text[32], *comma;
    double length, width = 0;
    snprintf(length_text, sizeof length_text, "%s", text);
    comma = strchr(length_text, ',');
    if (comma) {
        *comma = '\0';
    }
    if (strlen(text) >= sizeof length_text || !text_double(length_text, &length) ||
        (comma && !text_double(comma + 1, &width))) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--plate: '%.40s' is neither LENGTH,WIDTH nor DIAMETER in metres, nor "
                         "`sole`",
                         text);
    }
    width = comma ? width : length;
    if (!(length >= 0.0195 && length <= 1 && width >= 0.0195 && width <= 1)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "--plate: %g x %g m is outside 0.0195 .. 1 m (one element to a metre)",
                         length, width);
    }
    tool->plate =
        comma ? press_plate_create(length, width, error) : press_disc_create(length, error);
    tool->sole = tool->raster = tool->plate;
    snprintf(tool->name, sizeof tool->name,
             comma ? "a plate of %g x %g m" : "a round plate of %g m", length, width);
    return tool->plate ? MILD_OK : MILD_ERROR_ARGUMENT;
}

static double sole_area(const MildSole *sole) {
    return mild_sole_elements(sole) * mild_sole_pitch(sole) * mild_sole_pitch(sole);
}

/* Sets the material of the model and the sole that the model presses with. The material is matched
 * on this tool, under the pressure of half the robot's weight on its own sole. */
static MildStatus tool_set_model(Tool *tool, int model, const CliArgs *args, MildMaterial *material,
                                 TerrainDef *terrain, MildError *error) {
    GroundsDef finish = {
        .model = model, .sole = tool->raster, .load = 1, .args = args, .terrain = terrain};
    MildStatus status = model == TASK_MODEL_OWN ? MILD_OK : tool_open_robot(tool, error);
    if (status == MILD_OK && tool->robot) {
        finish.load = robot_foot_load(tool->robot) * sole_area(tool->raster) /
                      sole_area(robot_rasters(tool->robot)[0]);
    }
    if (status == MILD_OK) {
        status = grounds_finish(&finish, material, error);
    }
    if (status == MILD_OK && mild_model_is_concentric(task_model_soles(model))) {
        tool->sole = tool->concentric = mild_sole_concentric(tool->raster, error);
        if (!tool->concentric) {
            status = error->status;
        }
    }
    return status;
}

/* Eight columns; four more where the motion is not straight down and up. */
static MildStatus csv_write(const PressResult *result, int more, const char *path,
                            MildError *error) {
    Sheet csv = {0};
    MildStatus status = sheet_open(&csv, error);
    if (status != MILD_OK) {
        return status;
    }
    fprintf(csv.file, "time_s,depth_m,force_n,moment_x_nm,moment_y_nm,zmp_x_m,zmp_y_m,area_m2%s\n",
            more ? ",force_x_n,force_y_n,x_m,tilt_rad" : "");
    for (int i = 0; i < result->count; i++) {
        const PressRow *row = &result->rows[i];
        fprintf(csv.file, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g", row->time, row->depth,
                row->force, row->moment_x, row->moment_y, row->zmp_x, row->zmp_y, result->area);
        if (more) {
            fprintf(csv.file, ",%.9g,%.9g,%.9g,%.9g", row->force_x, row->force_y, row->x,
                    row->tilt);
        }
        fputc('\n', csv.file);
    }
    return sheet_close(&csv, path, MILD_OK, error);
}

/* Draws the picture from the file of --csv, or otherwise from FILE.csv beside FILE.png. */
static MildStatus figure_save(const PressOptions *options, const Tool *tool, const char *model,
                              const PressResult *result, int more, MildError *error) {
    char data[PATH_SIZE], title[256];
    const char *figure = options->figure;
    snprintf(title, sizeof title, "%s (%s) under %s", options->ground, model, tool->name);
    if (options->csv && strcmp(options->csv, "-") != 0) {
        return figure_draw("press", options->csv, figure, title, error);
    }
    MildStatus status = path_beside(figure, ".csv", data, error);
    if (status == MILD_OK) {
        status = csv_write(result, more, data, error);
    }
    return status == MILD_OK ? figure_draw("press", data, figure, title, error) : status;
}

/* ---- the printed result ---- */

enum { TABLE_LINES = 10 };

static int is_dropped(const PressOptions *options) {
    return isfinite(options->drop) || isfinite(options->impact);
}

/* First row of a way, and the row after its last. */
static void way_find(const PressResult *result, int way, int *first, int *end) {
    for (*first = 0; *first < result->count && result->rows[*first].way < way; ++*first) {
        continue;
    }
    for (*end = *first; *end < result->count && result->rows[*end].way == way; ++*end) {
        continue;
    }
}

/* Row of a way with the nearest depth. */
static const PressRow *way_at(const PressResult *result, int way, double depth) {
    int first, end;
    way_find(result, way, &first, &end);
    const PressRow *best = &result->rows[first];
    for (int i = first; i < end; i++) {
        if (fabs(result->rows[i].depth - depth) < fabs(best->depth - depth)) {
            best = &result->rows[i];
        }
    }
    return best;
}

/* Eleven depths with the forces on the first way down and on the last way up. */
static void table_depths(const PressResult *result) {
    int first, end, last = result->rows[result->count - 1].way;
    way_find(result, 0, &first, &end);
    printf("%10s  %12s  %12s\n", "depth [mm]", "down [N]", "up [N]");
    for (int line = 0; line <= TABLE_LINES; line++) {
        const PressRow *row = &result->rows[first + line * (end - 1 - first) / TABLE_LINES];
        printf("%10.2f  %12.3f  %12.3f\n", 1e3 * row->depth, row->force,
               way_at(result, last, row->depth)->force);
    }
}

static void table_turns(const PressResult *result) {
    int pairs = result->ways / 2;
    printf("%6s  %14s  %14s  %14s  %14s\n", "", "down to [mm]", "force [N]", "up to [mm]",
           "force [N]");
    for (int pair = 0; pair < pairs; pair++) {
        int first, down, up;
        if (pair >= TABLE_LINES && pair < pairs - TABLE_LINES) {
            continue;
        }
        way_find(result, 2 * pair, &first, &down);
        way_find(result, 2 * pair + 1, &first, &up);
        const PressRow *low = &result->rows[down - 1], *high = &result->rows[up - 1];
        printf("%6d  %14.3f  %14.3f  %14.3f  %14.3f\n", pair + 1, 1e3 * low->depth, low->force,
               1e3 * high->depth, high->force);
    }
}

static void table_drag(const PressResult *result) {
    int first, end;
    way_find(result, 1, &first, &end);
    printf("%10s  %16s  %14s\n", "moved [mm]", "forward [N]", "up [N]");
    for (int line = 0; line <= TABLE_LINES; line++) {
        const PressRow *row = &result->rows[first + line * (end - 1 - first) / TABLE_LINES];
        printf("%10.2f  %16.3f  %14.3f\n", 1e3 * row->x, row->force_x, row->force);
    }
}

/* Rows from the first contact to twice the time of the first stop. */
static void table_drop(const PressResult *result) {
    int touch = 0, last;
    while (touch < result->count - 1 && result->rows[touch].contacts == 0) {
        touch++;
    }
    double until = 2 * result->stop_time - result->rows[touch].time;
    for (last = touch; last < result->count - 1 && result->rows[last].time < until; last++) {
        continue;
    }
    printf("%10s  %12s  %12s  %12s\n", "time [ms]", "depth [mm]", "force [N]", "tilt [deg]");
    for (int line = 0; line <= TABLE_LINES; line++) {
        const PressRow *row = &result->rows[touch + line * (last - touch) / TABLE_LINES];
        printf("%10.2f  %12.3f  %12.3f  %12.2f\n", 1e3 * row->time, 1e3 * row->depth, row->force,
               row->tilt * 180 / acos(-1.0));
    }
}

static void table_print(const PressOptions *options, const PressResult *result) {
    if (is_dropped(options)) {
        table_drop(result);
    } else if (isfinite(options->drag)) {
        table_depths(result);
        printf("\n");
        table_drag(result);
    } else if (result->ways > 2) {
        table_turns(result);
    } else {
        table_depths(result);
    }
    printf("\n");
}

static void drop_summary(const PressOptions *options, const PressResult *result, FILE *file) {
    fprintf(file, ", %g kg dropped from %g mm at %g m/s", options->mass,
            isfinite(options->drop) ? 1e3 * options->drop : 0,
            isfinite(options->impact) ? options->impact : 0);
    if (options->tilt_deg != 0) {
        fprintf(file, ", tilted %g deg", options->tilt_deg);
    }
    fprintf(file, "\n");
    if (result->stop_time > 0) {
        fprintf(file, "first stop %.3f mm deep after %.2f ms, ", 1e3 * result->stop_depth,
                1e3 * result->stop_time);
    } else {
        fprintf(file, "no stop within %g s, ", options->seconds);
    }
    fprintf(file, "peak %.1f N; at the end %.3f mm deep, %.3g m/s\n", result->peak_force,
            1e3 * result->rows[result->count - 1].depth, result->rest_speed);
}

static void summary_print(const PressOptions *options, const Tool *tool, const char *model,
                          const PressResult *result, FILE *file) {
    fprintf(file, "%s (%s) under %s: %d element%s, %.4f m^2", options->ground, model, tool->name,
            result->elements, result->elements == 1 ? "" : "s", result->area);
    if (is_dropped(options)) {
        drop_summary(options, result, file);
        return;
    }
    double deepest = 0;
    for (int i = 0; i < result->count; i++) {
        deepest = fmax(deepest, result->rows[i].depth);
    }
    fprintf(file, ", to %.1f mm at %g m/s", 1e3 * deepest, options->speed);
    if (options->tilt_deg != 0) {
        fprintf(file, ", tilted %g deg", options->tilt_deg);
    }
    if (isfinite(options->drag)) {
        fprintf(file, ", dragged %g mm at %g m/s", 1e3 * options->drag, options->drag_speed);
    }
    fprintf(file,
            "\npeak %.1f N (%.2f kPa), work in %.3f J, work returned %.3f J, imprint %.1f mm\n",
            result->peak_force, 1e-3 * result->peak_force / result->area, result->work_in,
            result->work_out, 1e3 * fmax(result->print_depth, 0));
    if (isfinite(options->drag)) {
        fprintf(file, "work of the drag %.3f J\n", result->work_drag);
    }
}

/* ---- the command ---- */

static const char summary[] =
    "Moves a plate or the robot's sole through a ground and records the force. It goes down at "
    "constant speed and comes up again. It can also make several turns or cycles, or move "
    "forward at constant depth (--drag). With --drop or --impact it is a free body that falls. "
    "Depth, moments and zero moment point refer to the centre of the plate, or to the point of "
    "the sole below the ankle. The ground forgets an imprint once the plate has left it, unless "
    "--terrain.memory=true is given.";

static const char examples[] =
    "  mild press --ground sand_loose\n"
    "  mild press --ground foam45 --plate sole --depth 0.02 --tilt 5 --csv foam.csv\n"
    "  mild press --ground grass --depth 0.01,0.002,0.03 --figure reload.png\n"
    "  mild press --ground sand_dense --force 300,50 --cycles 5\n"
    "  mild press --ground grass --depth 0.02 --drag 0.1 --drag-speed 0.05 --figure drag.png\n"
    "  mild press --ground sand_loose --drop 0.05 --mass 20 --tilt 5 --figure drop.png\n";

static int options_parse(const CliOption *table, int count, int argc, char **argv, CliArgs *args) {
    const CliCommand command = {
        .name = "press",
        .usage = "--ground NAME [options]",
        .summary = summary,
        .options = table,
        .option_count = count,
        .overrides = "any key of sections [ground] and [terrain], e.g. --ground.k_pen=500 "
                     "--terrain.kind=waves; `mild info grounds` lists the first",
        .examples = examples,
        .picture = "figure",
        .numbers = ".csv",
    };
    return cli_parse(&command, argc, argv, args);
}

static int options_read(int argc, char **argv, PressOptions *options, CliArgs *args) {
    char grounds[300], ground_help[320], model_help[320];
    snprintf(ground_help, sizeof ground_help, "one of %s", grounds_names(grounds, sizeof grounds));
    const CliOption table[] = {
        {"ground", CLI_TEXT, &options->ground, 0, 0, "NAME", ground_help},
        {"model", CLI_TEXT, &options->model, 0, 0, "NAME",
         grounds_model_help(model_help, sizeof model_help)},
        {"plate", CLI_TEXT, &options->plate, 0, 0, "L,W|D|sole",
         "[m] length and width of a plate, D, the diameter of a round one, or `sole` for the "
         "robot's sole (default 0.2,0.1)"},
        {"robot", CLI_TEXT, &options->robot, 0, 0, "NAME|DIR",
         ROBOTS_HELP "; its sole, and the weight that models are matched under (default sa01)"},
        {"tilt", CLI_NUMBER, &options->tilt_deg, -45, 45, "DEG",
         "[deg] tilt, positive when the front edge is lower (default 0)"},
        {"depth", CLI_NUMBERS, &options->depth, 0, 1, "D[,BACK,...]",
         "[m] depths at which it turns: down to the first (default 0.03), up to the second, and "
         "so on; at the end it leaves the ground"},
        {"force", CLI_NUMBERS, &options->force, 0, 1e6, "F[,BACK,...]",
         "[N] as --depth, but it turns where the ground pushes with these forces"},
        {"speed", CLI_NUMBER, &options->speed, 1e-5, 10, "V",
         "[m/s] speed down and up (default 0.01)"},
        {"cycles", CLI_INT, &options->cycles, 1, 1000, "N",
         "how often to repeat all turns (default 1)"},
        {"drag", CLI_NUMBER, &options->drag, 1e-4, 10, "X",
         "[m] after the way down, move this far forward, along the plate's length, at constant "
         "depth"},
        {"drag-speed", CLI_NUMBER, &options->drag_speed, 1e-5, 10, "V",
         "[m/s] speed of --drag (default: that of --speed)"},
        {"drop", CLI_NUMBER, &options->drop, 0, 10, "H",
         "[m] drop it from this height above the ground"},
        {"impact", CLI_NUMBER, &options->impact, 0, 20, "V",
         "[m/s] drop it with this downward speed"},
        {"mass", CLI_NUMBER, &options->mass, 1e-3, 1e4, "M",
         "[kg] mass of the dropped body, spread evenly over the plate (default 20)"},
        {"seconds", CLI_NUMBER, &options->seconds, 1e-3, 100, "T",
         "[s] how long to record a drop (default 1)"},
        {"step", CLI_NUMBER, &options->step, 1e-7, 1, "DT",
         "[s] time between rows (default: a thousandth of the way down; with --force the time for "
         "0.02 mm; 0.0001 for a drop)"},
        {"csv", CLI_OUTPUT, &options->csv, 0, 0, "FILE",
         "write the rows to FILE, or - for standard output. Columns: time_s, depth_m, force_n, "
         "moment_x_nm, moment_y_nm, zmp_x_m, zmp_y_m; with --drag, --drop or --impact also "
         "force_x_n, force_y_n, x_m, tilt_rad"},
        {"figure", CLI_OUTPUT, &options->figure, 0, 0, "FILE.png",
         "draw the press; without --csv its numbers go to FILE.csv beside it"},
    };
    return options_parse(table, sizeof table / sizeof *table, argc, argv, args);
}

/* Turns must alternate between down and up. */
static MildStatus turns_check(const char *name, const CliNumbers *turns, MildError *error) {
    const double *at = turns->value;
    if (turns->count > 0 && !(at[0] > 0)) {
        return mild_fail(error, MILD_ERROR_RANGE, "--%s: the first turn must be above 0", name);
    }
    for (int i = 1; i < turns->count; i++) {
        if (i % 2 ? at[i] < at[i - 1] : at[i] > at[i - 1]) {
            continue;
        }
        return mild_fail(error, MILD_ERROR_RANGE,
                         "--%s: %g after %g is not %s; turns alternate between down and up", name,
                         at[i], at[i - 1], i % 2 ? "up" : "down");
    }
    return MILD_OK;
}

/* Refuses options that contradict each other. */
static MildStatus options_check(const PressOptions *o, MildError *error) {
    const CliNumbers *turns = o->force.count ? &o->force : &o->depth;
    if (is_dropped(o) && (turns->count || isfinite(o->speed) || o->cycles || isfinite(o->drag))) {
        return mild_fail(
            error, MILD_ERROR_ARGUMENT,
            "--%s: the path of a dropped body cannot be prescribed; leave out --depth, "
            "--force, --speed, --cycles and --drag",
            isfinite(o->drop) ? "drop" : "impact");
    }
    if (!is_dropped(o) && (isfinite(o->mass) || isfinite(o->seconds))) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--%s: applies only to a dropped body; add --drop H or --impact V",
                         isfinite(o->mass) ? "mass" : "seconds");
    }
    if (o->depth.count && o->force.count) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--force: cannot be used with --depth; leave out one of them");
    }
    if (isfinite(o->drag) && (o->cycles > 1 || turns->count > 1)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--drag: works with one turn; leave out --cycles and further turns");
    }
    if (isfinite(o->drag_speed) && !isfinite(o->drag)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--drag-speed: the distance is missing; add --drag X");
    }
    return turns_check(o->force.count ? "force" : "depth", turns, error);
}

static double or_else(double value, double otherwise) {
    return isfinite(value) ? value : otherwise;
}

/* Fills in the defaults of options that were not given. */
static PressDef options_def(PressOptions *o) {
    o->speed = or_else(o->speed, 0.01);
    o->mass = or_else(o->mass, 20);
    o->seconds = or_else(o->seconds, 1);
    o->drag_speed = or_else(o->drag_speed, o->speed);
    const CliNumbers *turns = o->force.count ? &o->force : &o->depth;
    PressDef def = {.tilt = o->tilt_deg * acos(-1.0) / 180,
                    .step = or_else(o->step, 0),
                    .speed = o->speed,
                    .turns = turns->count ? turns->count : 1,
                    .turn = {0.03},
                    .by_force = o->force.count > 0,
                    .cycles = o->cycles,
                    .drag = or_else(o->drag, 0),
                    .drag_speed = o->drag_speed,
                    .mass = is_dropped(o) ? o->mass : 0,
                    .height = or_else(o->drop, 0),
                    .impact = or_else(o->impact, 0),
                    .seconds = o->seconds};
    for (int i = 0; i < turns->count; i++) {
        def.turn[i] = turns->value[i];
    }
    return def;
}

static MildStatus press_report(const PressOptions *options, const Tool *tool, const PressDef *def,
                               MildError *error) {
    PressResult result;
    const char *model = mild_model_names[def->material.model];
    int more = is_dropped(options) || isfinite(options->drag);
    MildStatus status = press_run(def, tool->sole, &result, error);
    if (status == MILD_OK && options->csv) {
        status = csv_write(&result, more, options->csv, error);
    }
    if (status == MILD_OK && options->figure) {
        status = figure_save(options, tool, model, &result, more, error);
    }
    if (status == MILD_OK) {
        if (!options->csv) {
            table_print(options, &result);
        }
        summary_print(options, tool, model, &result,
                      options->csv && strcmp(options->csv, "-") == 0 ? stderr : stdout);
    }
    press_result_close(&result);
    return status;
}

int cmd_press(int argc, char **argv) {
    PressOptions options = {.plate = "0.2,0.1",
                            .speed = NAN,
                            .drag = NAN,
                            .drag_speed = NAN,
                            .drop = NAN,
                            .impact = NAN,
                            .mass = NAN,
                            .seconds = NAN,
                            .step = NAN};
    CliArgs args;
    const int parsed = options_read(argc, argv, &options, &args);
    if (parsed != CLI_RUN) {
        return parsed;
    }
    if (!options.ground) {
        return cli_fail_text("press", "--ground NAME is missing (mild info grounds lists all)");
    }
    MildError error;
    int model;
    Tool tool = {.robot_name = options.robot};
    MildStatus status = options_check(&options, &error);
    if (status != MILD_OK) {
        return cli_fail("press", &error);
    }
    PressDef def = options_def(&options);
    TerrainDef terrain = terrain_def_default();
    MildMap *map = NULL;
    status = grounds_find(options.ground, &def.material, NULL, &error);
    if (status == MILD_OK) {
        status = grounds_model(options.model, &args, &model, &error);
    }
    if (status == MILD_OK) {
        status = options.robot ? tool_open_robot(&tool, &error) : MILD_OK;
    }
    if (status == MILD_OK) {
        status = tool_open(&tool, options.plate, &error);
    }
    if (status == MILD_OK) {
        status = tool_set_model(&tool, model, &args, &def.material, &terrain, &error);
    }
    if (status == MILD_OK) {
        status = terrain_make(&terrain, 1, &map, &error);
    }
    def.map = map;
    def.imprint_tiles = terrain_imprint_tiles(&terrain);
    if (status == MILD_OK) {
        status = press_report(&options, &tool, &def, &error);
    }
    tool_close(&tool);
    mild_map_destroy(map);
    return status == MILD_OK ? 0 : cli_fail("press", &error);
}
