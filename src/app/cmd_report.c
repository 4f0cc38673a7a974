/* mild report: one page about training runs. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "app/cli.h"
#include "app/commands.h"
#include "app/report.h"
#include "app/run_page.h"
#include "base/file.h"
#include "run/config/experiment_keys.h"

_Static_assert((int)CLI_LIST_MAX <= (int)RUN_PAGE_RUNS_MAX, "a page has room for all runs");

static MildStatus read_defaults(Settings *defaults, MildError *error) {
    ExperimentDef def = experiment_def_default();
    ConfigSection sections[EXPERIMENT_SECTIONS];
    experiment_sections(&def, sections);
    char *text = config_text(sections, EXPERIMENT_SECTIONS, 0);
    if (!text) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    }
    MildStatus status = settings_read(text, "default.ini", defaults, error);
    free(text);
    return status;
}

static MildStatus write_page(const RunFiles *runs, int count, const char *path, MildError *error) {
    Settings defaults = {0};
    size_t size = 0;
    MildStatus status = read_defaults(&defaults, error);
    char *page =
        status == MILD_OK ? run_page_make(runs, count, &defaults, path, &size, error) : NULL;
    settings_free(&defaults);
    if (!page) {
        return error->status;
    }
    status = report_text(page, size, path, error);
    free(page);
    return status;
}

/* The page that nobody named: only an earlier one is overwritten. */
static MildStatus claim_page(const char *path, MildError *error) {
    char start[512] = "";
    MildStatus status = file_check_own(path, error);
    FILE *page = NULL;
    if (status == MILD_OK && access(path, F_OK) == 0) {
        page = file_open(path, error);
        status = page ? MILD_OK : error->status;
    }
    if (page) {
        start[fread(start, 1, sizeof start - 1, page)] = '\0';
        fclose(page);
        if (!strstr(start, RUN_PAGE_TITLE)) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "%.200s: exists, and is no earlier report; name the page with --out "
                             "FILE.html",
                             path);
        }
    }
    return status == MILD_OK ? file_claim(path, "the report", error) : status;
}

static MildStatus report(const CliArgs *args, const char *out, MildError *error) {
    static RunFiles runs[CLI_LIST_MAX];
    char beside[PATH_SIZE];
    int count = 0;
    MildStatus status = MILD_OK;
    if (!out) {
        status = path_join(args->positional[0], "report.html", beside, error);
        status = status == MILD_OK ? claim_page(beside, error) : status;
        out = beside;
    }
    while (status == MILD_OK && count < args->positional_count) {
        status = run_files_read(args->positional[count], &runs[count], error);
        count += status == MILD_OK;
    }
    if (status == MILD_OK) {
        status = write_page(runs, count, out, error);
    }
    if (status == MILD_OK && out == beside) {
        printf("report %s\n", out);
    }
    for (int i = 0; i < count; i++) {
        run_files_free(&runs[i]);
    }
    return status;
}

int cmd_report(int argc, char **argv) {
    const char *out = NULL;
    const CliOption options[] = {
        {"out", CLI_OUTPUT, &out, 0, 0, "FILE.html",
         "page to write (default report.html in the first run's folder)"},
    };
    const CliCommand command = {
        .name = "report",
        .usage = "RUN [RUN...] [--out FILE.html]",
        .summary =
            "Writes one page of HTML, with no other file needed, about training runs: curves, "
            "reward terms, how the configs differ, the evaluation in RUN/eval.json and the videos "
            "RUN/*.mp4 if there are any. Several runs are overlaid. Those that differ in "
            "train.seed alone are drawn as their mean in a band.",
        .options = options,
        .option_count = sizeof options / sizeof *options,
        .examples = "  mild report runs/mine\n"
                    "  mild eval --policy runs/mine/policy.safetensors --json runs/mine/eval.json\n"
                    "  mild report runs/seed1 runs/seed2 runs/other --out compare.html\n",
        .positional_max = CLI_LIST_MAX,
    };
    CliArgs args;
    CliOutcome outcome = cli_parse(&command, argc, argv, &args);
    if (outcome != CLI_RUN) {
        return outcome == CLI_DONE ? 0 : CLI_EXIT_BAD_INPUT;
    }
    if (!args.positional_count) {
        return cli_fail_text("report", "no run given; use mild report %s", command.usage);
    }
    MildError error = {0};
    return report(&args, out, &error) == MILD_OK ? 0 : cli_fail("report", &error);
}
