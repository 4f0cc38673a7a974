#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/grounds.h"
#include "app/paths.h"
#include "app/press.h"
#include "app/text.h"
#include "robot/robot.h"

typedef struct {
    const char *ground, *model, *plate, *csv;
    double depth, speed, tilt_deg;
} PressOptions;

/* The sole to press with, and the robot that owns it when it is the robot's. */
typedef struct {
    Robot *robot;
    MildSole *plate;
    const MildSole *sole;
    char name[64];
} Tool;

static void tool_close(Tool *tool) {
    if (tool->plate) mild_sole_destroy(tool->plate);
    if (tool->robot) robot_destroy(tool->robot);
}

static MildStatus tool_open_sole(Tool *tool, MildError *error) {
    char path[PATH_SIZE];
    tool->robot = robot_create(path_data("models/sa01/sa01.xml", path), error);
    if (!tool->robot) return MILD_ERROR_IO;
    tool->sole = robot_soles(tool->robot)[ROBOT_FOOT_LEFT];
    snprintf(tool->name, sizeof tool->name, "the robot's left sole");
    return MILD_OK;
}

static MildStatus tool_open(Tool *tool, const char *text, MildError *error) {
    *tool = (Tool){0};
    if (strcmp(text, "sole") == 0) return tool_open_sole(tool, error);
    char length_text[32], *comma;
    double length, width;
    snprintf(length_text, sizeof length_text, "%s", text);
    comma = strchr(length_text, ',');
    if (comma) *comma = '\0';
    if (!comma || strlen(text) >= sizeof length_text || !text_double(length_text, &length) ||
        !text_double(comma + 1, &width)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "--plate: '%.40s' is neither LENGTH,WIDTH in metres nor `sole`",
                         text);
    }
    if (!(length >= 0.0195 && length <= 1 && width >= 0.0195 && width <= 1)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "--plate: %g x %g m is outside 0.0195 .. 1 m (one element to a metre)", length, width);
    }
    tool->plate = press_plate_create(length, width, error);
    tool->sole = tool->plate;
    snprintf(tool->name, sizeof tool->name, "a plate of %g x %g m", length, width);
    return tool->plate ? MILD_OK : MILD_ERROR_ARGUMENT;
}

static MildStatus csv_write(const PressResult *result, const char *path, MildError *error) {
    char *text = NULL;
    size_t size = 0;
    FILE *memory = open_memstream(&text, &size);
    if (!memory) return mild_fail(error, MILD_ERROR_MEMORY, "press: out of memory");
    fprintf(memory, "time_s,depth_m,force_n,moment_x_nm,moment_y_nm,zmp_x_m,zmp_y_m\n");
    for (int i = 0; i < PRESS_ROWS; i++) {
        const PressRow *row = &result->rows[i];
        fprintf(memory, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", row->time, row->depth, row->force, row->moment_x,
                row->moment_y, row->zmp_x, row->zmp_y);
    }
    MildStatus status = MILD_OK;
    if (fclose(memory) != 0) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "press: out of memory");
    } else if (strcmp(path, "-") != 0) {
        status = path_write(path, text, size, error);
    } else if (fwrite(text, 1, size, stdout) != size || fflush(stdout) != 0) {
        status = mild_fail(error, MILD_ERROR_IO, "cannot write to standard output");
    }
    free(text);
    return status;
}

/* Eleven depths, the force on the way down and up beside each other. */
static void table_print(const PressResult *result) {
    enum { LINES = 10 };
    printf("%10s  %12s  %12s\n", "depth [mm]", "down [N]", "up [N]");
    for (int line = 0; line <= LINES; line++) {
        int down = line * PRESS_STEPS / LINES;
        const PressRow *row = &result->rows[down];
        printf("%10.2f  %12.3f  %12.3f\n", 1e3 * row->depth, row->force, result->rows[PRESS_ROWS - 1 - down].force);
    }
    printf("\n");
}

static void summary_print(const PressOptions *options, const Tool *tool, const PressResult *result, FILE *file) {
    fprintf(file, "%s under %s: %d elements, %.4f m^2, to %.1f mm at %g m/s", options->ground, tool->name,
            result->elements, result->area, 1e3 * options->depth, options->speed);
    if (options->tilt_deg != 0) fprintf(file, ", tilted %g deg", options->tilt_deg);
    fprintf(file, "\npeak %.1f N (%.2f kPa), work in %.3f J, given back %.3f J, print left %.1f mm\n",
            result->peak_force, 1e-3 * result->peak_force / result->area, result->work_in, result->work_out,
            1e3 * fmax(result->print_depth, 0));
}

static int options_read(int argc, char **argv, PressOptions *options, CliArgs *args) {
    char grounds[200], ground_help[320];
    snprintf(ground_help, sizeof ground_help, "one of %s", grounds_names(grounds, sizeof grounds));
    const CliOption table[] = {
        {"ground", CLI_TEXT, &options->ground, 0, 0, "NAME", ground_help},
        {"model", CLI_TEXT, &options->model, 0, 0, "NAME", "ground model; `mild` (default) is the only one so far"},
        {"plate", CLI_TEXT, &options->plate, 0, 0, "L,W|sole",
         "[m] length and width of a plate, or the robot's sole (default 0.2,0.1)"},
        {"depth", CLI_NUMBER, &options->depth, 1e-4, 1, "D", "[m] how deep it goes (default 0.03)"},
        {"speed", CLI_NUMBER, &options->speed, 1e-5, 10, "V", "[m/s] down, then up (default 0.01)"},
        {"tilt", CLI_NUMBER, &options->tilt_deg, -45, 45, "DEG", "[deg] front edge down (default 0)"},
        {"csv", CLI_TEXT, &options->csv, 0, 0, "FILE",
         "write time_s,depth_m,force_n,moment_x_nm,moment_y_nm,zmp_x_m,zmp_y_m; - for standard output"},
    };
    const CliCommand command = {
        .name = "press",
        .usage = "--ground NAME [options]",
        .summary =
            "Press a plate or the robot's sole into a ground at constant speed, draw it out again, and record the "
            "force. Depth, moments and zero moment point are those of the plate's centre (for the sole: the point "
            "under the ankle).",
        .options = table,
        .option_count = sizeof table / sizeof *table,
        .overrides = "any parameter of the ground, e.g. --ground.k_pen=500; `mild info grounds` lists them",
        .examples = "  mild press --ground sand_loose\n"
                    "  mild press --ground foam45 --plate sole --depth 0.02 --tilt 5 --csv foam.csv\n"
                    "  mild press --ground sand_loose --ground.k_pen=500 --csv - | head\n",
    };
    CliOutcome outcome = cli_parse(&command, argc, argv, args);
    if (outcome == CLI_BAD) return CLI_EXIT_BAD_INPUT;
    return outcome == CLI_DONE ? -1 : 0;
}

static MildStatus press_report(const PressOptions *options, const Tool *tool, const PressDef *def, MildError *error) {
    PressResult *result = malloc(sizeof *result);
    if (!result) return mild_fail(error, MILD_ERROR_MEMORY, "press: out of memory");
    MildStatus status = press_run(def, tool->sole, result, error);
    if (status == MILD_OK && options->csv) status = csv_write(result, options->csv, error);
    if (status == MILD_OK) {
        if (!options->csv) table_print(result);
        summary_print(options, tool, result, options->csv && strcmp(options->csv, "-") == 0 ? stderr : stdout);
    }
    free(result);
    return status;
}

int cmd_press(int argc, char **argv) {
    PressOptions options = {.model = "mild", .plate = "0.2,0.1", .depth = 0.03, .speed = 0.01};
    CliArgs args;
    int code = options_read(argc, argv, &options, &args);
    if (code) return code < 0 ? 0 : code;
    if (!options.ground) return cli_fail_text("press", "which ground? --ground NAME (mild info grounds lists all)");
    if (strcmp(options.model, "mild") != 0) {
        return cli_fail_text("press", "--model: '%s' is not known; `mild` is the only ground model so far",
                             options.model);
    }
    MildError error;
    PressDef def = {.depth = options.depth, .speed = options.speed, .tilt = options.tilt_deg * acos(-1.0) / 180};
    if (grounds_find(options.ground, &def.material, NULL, &error) != MILD_OK) return cli_fail("press", &error);
    ConfigSection section = grounds_section(&def.material);
    if (config_overrides(&section, 1, args.overrides, args.override_count, &error) != MILD_OK)
        return cli_fail("press", &error);
    Tool tool;
    MildStatus status = tool_open(&tool, options.plate, &error);
    if (status == MILD_OK) status = press_report(&options, &tool, &def, &error);
    tool_close(&tool);
    return status == MILD_OK ? 0 : cli_fail("press", &error);
}
