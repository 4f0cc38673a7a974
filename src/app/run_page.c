#include "app/run_page.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "app/chart.h"
#include "app/run_video.h"

enum { POINTS = 300 }; /* of a curve at most */

/* Values of a group of runs over the iterations. */
typedef struct {
    double x[POINTS], mean[POINTS], low[POINTS], high[POINTS];
} Band;

typedef struct {
    const RunFiles *runs;
    int count;
    const Settings *defaults;
    const char *path;
    int group[RUN_PAGE_RUNS_MAX]; /* of each run */
    int first[RUN_PAGE_RUNS_MAX]; /* first run of each group */
    int groups;
    int points; /* of a curve */
    double iteration[2];
    Band band[RUN_PAGE_RUNS_MAX]; /* of each group, of the chart that is being drawn */
    FILE *html;
} Page;

/* ---- groups ---- */

static void find_groups(Page *page) {
    for (int i = 0; i < page->count; i++) {
        int g = 0;
        while (g < page->groups && !run_files_alike(&page->runs[page->first[g]], &page->runs[i])) {
            g++;
        }
        if (g == page->groups) {
            page->first[page->groups++] = i;
        }
        page->group[i] = g;
    }
}

static int group_size(const Page *page, int group) {
    int size = 0;
    for (int i = 0; i < page->count; i++) {
        size += page->group[i] == group;
    }
    return size;
}

/* The folder of a group's first run, without the folders above it, and the number of seeds. */
static void write_group_name(const Page *page, int group) {
    const char *folder = page->runs[page->first[group]].folder, *name = folder + strlen(folder);
    while (name > folder && name[-1] == '/') {
        name--;
    }
    while (name > folder && name[-1] != '/') {
        name--;
    }
    chart_write_text(name, page->html);
    if (group_size(page, group) > 1) {
        fprintf(page->html, " (%d seeds)", group_size(page, group));
    }
}

static void write_chip(const Page *page, int group) {
    fprintf(page->html, "<i style=\"background:%s\"></i>", chart_color(group));
}

/* ---- curves ---- */

static void find_extent(Page *page) {
    int rows = 2;
    page->iteration[0] = INFINITY, page->iteration[1] = -INFINITY;
    for (int i = 0; i < page->count; i++) {
        const History *history = &page->runs[i].history;
        const double *last =
            history->value + (size_t)(history->rows - 1) * (size_t)history->columns;
        page->iteration[0] = fmin(page->iteration[0], history->value[0]);
        page->iteration[1] = fmax(page->iteration[1], last[0]);
        rows = history->rows > rows ? history->rows : rows;
    }
    page->points = rows < POINTS ? rows : POINTS;
}

/* Adds a run to the sums of a band, whose runs are counted in `runs`. */
static void band_add(Band *band, const double *mean, int points, int *runs) {
    for (int k = 0; k < points; k++) {
        if (!isfinite(mean[k])) {
            continue;
        }
        band->mean[k] = (runs[k] ? band->mean[k] * runs[k] + mean[k] : mean[k]) / (runs[k] + 1);
        band->low[k] = runs[k] ? fmin(band->low[k], mean[k]) : mean[k];
        band->high[k] = runs[k] ? fmax(band->high[k], mean[k]) : mean[k];
        runs[k]++;
    }
}

/* Mean and extremes of a column over the runs of a group. Returns how many have it. */
static int band_fill(Page *page, int group, const char *column) {
    Band *band = &page->band[group];
    int runs[POINTS] = {0}, found = 0;
    for (int k = 0; k < page->points; k++) {
        band->x[k] =
            page->iteration[0] + k * (page->iteration[1] - page->iteration[0]) / (page->points - 1);
        band->mean[k] = band->low[k] = band->high[k] = NAN;
    }
    for (int i = 0; i < page->count; i++) {
        const History *history = &page->runs[i].history;
        const int index = history_column(history, column);
        if (page->group[i] == group && index >= 0) {
            double mean[POINTS];
            history_means(history, index, page->iteration[0], page->iteration[1], page->points,
                          mean);
            band_add(band, mean, page->points, runs);
            found++;
        }
    }
    return found;
}

static int band_is_zero(const Page *page, int group) {
    for (int k = 0; k < page->points; k++) {
        if (page->band[group].mean[k] < 0 || page->band[group].mean[k] > 0) {
            return 0;
        }
    }
    return 1;
}

/* Draws a column of the runs that have it; nothing where it is 0 throughout. */
static void write_chart(Page *page, const char *column, const char *title, int logarithmic) {
    ChartCurve curves[RUN_PAGE_RUNS_MAX];
    int count = 0;
    for (int g = 0; g < page->groups; g++) {
        const Band *band = &page->band[g];
        const int runs = band_fill(page, g, column);
        if (runs && !band_is_zero(page, g)) {
            curves[count++] = (ChartCurve){
                page->points, band->x, band->mean, runs > 1 ? band->low : NULL, band->high, g};
        }
    }
    const Chart chart = {title, logarithmic, page->iteration[0], page->iteration[1], curves, count};
    if (count) {
        chart_write(&chart, page->html);
    }
}

/* The columns that have a place of their own. All others follow below "others". */
static const struct {
    const char *section; /* of this row and those below it; NULL: that above */
    const char *column, *title;
    int logarithmic;
} charts[] = {
    {"Episodes", "episode/reward", "return of an episode", 0},
    {NULL, "episode/length_s", "length of an episode [s]", 0},
    {NULL, "episode/speed_error", "speed error [m/s]", 0},
    {NULL, "episode/falls", "falls in an iteration", 0},
    {NULL, "episode/ended", "episodes that ended in an iteration", 0},
    {NULL, "episode/assist", "help of the robots, 0 to 1", 0},
    {NULL, "episode/diverged", "diverged simulations in an iteration", 0},
    {"Learner", "loss/value", "value loss", 1},
    {NULL, "ppo/explained", "explained variance of the value", 0},
    {NULL, "loss/kl", "KL of the update [nat]", 0},
    {NULL, "loss/clip_share", "clipped share of the samples", 0},
    {NULL, "ppo/learning_rate", "learning rate", 1},
    {NULL, "ppo/action_std", "std of the action noise", 0},
    {NULL, "loss/entropy", "entropy [nat]", 0},
    {NULL, "loss/surrogate", "surrogate loss", 0},
    {NULL, "loss/mirror", "mirror loss", 1},
    {NULL, "ppo/gradient", "norm of the gradient", 1},
    {NULL, "ppo/skipped", "skipped minibatches", 0},
    {"Estimates and VAE", "loss/base_velocity", "error of the base velocity (loss)", 1},
    {NULL, "loss/feet_velocity", "error of the feet's velocity (loss)", 1},
    {NULL, "loss/feet_height", "error of the feet's height (loss)", 1},
    {NULL, "loss/reconstruction", "reconstruction (loss)", 1},
    {NULL, "loss/vae_kl", "KL of the latent [nat]", 0},
    {"Speed", "rate/steps_per_s", "policy steps per second", 0},
    {NULL, "rate/steps", "policy steps", 0},
};
enum { CHARTS = sizeof charts / sizeof *charts };

static void begin_section(const Page *page, const char *title) {
    fprintf(page->html, "<h2>%s</h2>\n<div class=charts>\n", title);
}

static void write_known(Page *page) {
    for (int i = 0; i < CHARTS; i++) {
        if (charts[i].section) {
            fputs(i ? "</div>\n" : "", page->html);
            begin_section(page, charts[i].section);
        }
        write_chart(page, charts[i].column, charts[i].title, charts[i].logarithmic);
    }
    fputs("</div>\n", page->html);
}

static int is_known(const char *column) {
    int known = strcmp(column, "iteration") == 0;
    for (int i = 0; i < CHARTS && !known; i++) {
        known = strcmp(charts[i].column, column) == 0;
    }
    return known;
}

/* Whether a run before this one has the column, so that its chart is there already. */
static int is_drawn(const Page *page, int run, const char *column) {
    for (int i = 0; i < run; i++) {
        if (history_column(&page->runs[i].history, column) >= 0) {
            return 1;
        }
    }
    return 0;
}

/* Columns without a place of their own: the reward terms, or the others. */
static void write_rest(Page *page, int rewards, const char *section) {
    static const char prefix[] = "reward/";
    int any = 0;
    for (int i = 0; i < page->count; i++) {
        const History *history = &page->runs[i].history;
        for (int c = 1; c < history->columns; c++) {
            const char *column = history->name[c];
            const int reward = strncmp(column, prefix, strlen(prefix)) == 0;
            if (reward != rewards || is_known(column) || is_drawn(page, i, column)) {
                continue;
            }
            if (!any++) {
                begin_section(page, section);
            }
            write_chart(page, column, reward ? column + strlen(prefix) : column, 0);
        }
    }
    fputs(any ? "</div>\n" : "", page->html);
}

/* ---- tables ---- */

/* Mean of a column over the last twentieth of the run, as a table's cell. */
static void write_last(const Page *page, const RunFiles *run, const char *column,
                       const char *format) {
    const History *history = &run->history;
    const int index = history_column(history, column),
              from = history->rows - history->rows / 20 - 1;
    double sum = 0;
    int count = 0;
    for (int i = from; index >= 0 && i < history->rows; i++) {
        const double value = history->value[(size_t)i * (size_t)history->columns + (size_t)index];
        sum += isfinite(value) ? value : 0;
        count += isfinite(value) != 0;
    }
    fputs("<td class=n>", page->html);
    if (count) {
        fprintf(page->html, format, sum / count);
    }
}

static void write_runs(const Page *page) {
    fputs(
        "<table><tr><th>run<th>iterations<th>return<th>episode [s]<th>speed error [m/s]<th>policy "
        "steps/s<th>made by\n",
        page->html);
    for (int i = 0; i < page->count; i++) {
        const RunFiles *run = &page->runs[i];
        const History *history = &run->history;
        fputs("<tr><td>", page->html);
        write_chip(page, page->group[i]);
        chart_write_text(run->folder, page->html);
        fprintf(page->html, "<td class=n>%.0f",
                history->value[(size_t)(history->rows - 1) * (size_t)history->columns]);
        write_last(page, run, "episode/reward", "%.2f");
        write_last(page, run, "episode/length_s", "%.2f");
        write_last(page, run, "episode/speed_error", "%.3f");
        write_last(page, run, "rate/steps_per_s", "%.0f");
        fputs("<td class=small>", page->html);
        chart_write_text(run->version ? run->version : "", page->html);
        fputs("\n", page->html);
    }
    fputs(
        "</table><p class=small>Means over the last twentieth of each run. Runs whose configs "
        "differ in train.seed alone have one colour: the curve is their mean, the band reaches "
        "from the least to the greatest. A point is the mean over the iterations around it.</p>\n",
        page->html);
}

static const struct {
    const char *key, *title, *format;
    double factor;
} eval_columns[] = {{"speed", "asked [m/s]", "%.2f", 1},
                    {"velocity", "measured [m/s]", "%.2f", 1},
                    {"cot", "cost of transport", "%.2f", 1},
                    {"torque_max", "largest torque [N m]", "%.0f", 1},
                    {"clearance", "clearance [mm]", "%.0f", 1e3},
                    {"penetration", "sinkage [mm]", "%.0f", 1e3},
                    {"drift", "drift of a stance [mm]", "%.0f", 1e3}};
enum { EVAL_COLUMNS = sizeof eval_columns / sizeof *eval_columns };

static double number_of(const cJSON *row, const char *key) {
    const cJSON *item = cJSON_GetObjectItem(row, key);
    return cJSON_IsNumber(item) ? item->valuedouble : NAN;
}

/* A measure; NAN where no trial lasted long enough for it. */
static double measure_of(const cJSON *row, const char *key) {
    const int steady = strcmp(key, "velocity") == 0 || strcmp(key, "cot") == 0;
    return steady && number_of(row, "measured") == 0 ? NAN : number_of(row, key);
}

static void write_eval_row(const Page *page, const cJSON *row) {
    const cJSON *ground = cJSON_GetObjectItem(row, "ground");
    fputs("<tr><td>", page->html);
    chart_write_text(cJSON_IsString(ground) ? ground->valuestring : "", page->html);
    fprintf(page->html, "<td class=n>%.0f of %.0f", number_of(row, "success"),
            number_of(row, "trials"));
    for (int i = 0; i < EVAL_COLUMNS; i++) {
        const double value = eval_columns[i].factor * measure_of(row, eval_columns[i].key);
        fputs("<td class=n>", page->html);
        if (isfinite(value)) {
            fprintf(page->html, eval_columns[i].format, value);
        }
    }
    fputs("\n", page->html);
}

static void write_eval(const Page *page, const RunFiles *run) {
    const cJSON *row;
    if (!run->eval) {
        return;
    }
    fputs("<h2>Evaluation of ", page->html);
    chart_write_text(run->folder, page->html);
    fputs("</h2>\n<table><tr><th>ground<th>upright", page->html);
    for (int i = 0; i < EVAL_COLUMNS; i++) {
        fprintf(page->html, "<th>%s", eval_columns[i].title);
    }
    fputs("\n", page->html);
    cJSON_ArrayForEach(row, cJSON_GetObjectItem(run->eval, "rows")) {
        write_eval_row(page, row);
    }
    fputs("</table>\n", page->html);
}

/* ---- configs ---- */

/* A key's value in the configs of a group; NULL: it has none. */
static const char *value_of(const Page *page, int group, const char *key) {
    return settings_find(&page->runs[page->first[group]].settings, key);
}

static int texts_differ(const char *a, const char *b) {
    return a && b ? strcmp(a, b) != 0 : a != b;
}

/* The first group that has a config; page->groups: none. Those without one are not compared. */
static int first_with_config(const Page *page) {
    int g = 0;
    while (g < page->groups && !page->runs[page->first[g]].config) {
        g++;
    }
    return g;
}

static int groups_differ(const Page *page, const char *key) {
    const int first = first_with_config(page);
    for (int g = first + 1; g < page->groups; g++) {
        if (page->runs[page->first[g]].config &&
            texts_differ(value_of(page, first, key), value_of(page, g, key))) {
            return 1;
        }
    }
    return 0;
}

static int differs_from_default(const Page *page, const char *key) {
    return texts_differ(value_of(page, first_with_config(page), key),
                        settings_find(page->defaults, key));
}

static void write_value(const Page *page, const char *value) {
    fputs("<td>", page->html);
    chart_write_text(value ? value : "–", page->html);
}

/* The value in a group; of train.seed all. */
static void write_group_value(const Page *page, int group, const char *key) {
    write_value(page, value_of(page, group, key));
    for (int i = page->first[group] + 1; i < page->count; i++) {
        const char *value = settings_find(&page->runs[i].settings, key);
        if (page->group[i] == group && strcmp(key, "train.seed") == 0 && value) {
            fputs(", ", page->html);
            chart_write_text(value, page->html);
        }
    }
}

/* The row of a key. between: bool, the groups differ in it; otherwise they have it alike, and not
 * as the default. */
static void write_key(const Page *page, const char *key, int between) {
    const int differ = groups_differ(page, key);
    if (between ? !differ : differ || !differs_from_default(page, key)) {
        return;
    }
    fputs("<tr><td>", page->html);
    chart_write_text(key, page->html);
    if (between) {
        for (int g = 0; g < page->groups; g++) {
            write_group_value(page, g, key);
        }
    } else {
        write_group_value(page, first_with_config(page), key);
    }
    write_value(page, settings_find(page->defaults, key));
    fputs("\n", page->html);
}

/* Whether a group before this one has the key, or this version. */
static int is_listed(const Page *page, int group, const char *key) {
    int listed = settings_find(page->defaults, key) != NULL;
    for (int g = 0; g < group && !listed; g++) {
        listed = value_of(page, g, key) != NULL;
    }
    return listed;
}

static void write_keys(const Page *page, int between) {
    for (int i = 0; i < page->defaults->count; i++) {
        write_key(page, page->defaults->list[i].key, between);
    }
    for (int g = 0; g < page->groups; g++) { /* keys of other versions */
        const Settings *settings = &page->runs[page->first[g]].settings;
        for (int i = 0; i < settings->count; i++) {
            if (!is_listed(page, g, settings->list[i].key)) {
                write_key(page, settings->list[i].key, between);
            }
        }
    }
}

static void write_differences(const Page *page, int between) {
    fprintf(page->html, "<h3>%s</h3>\n<table><tr><th>key",
            between ? "Between the runs" : "From the defaults");
    for (int g = 0; between && g < page->groups; g++) {
        fputs("<th>", page->html);
        write_chip(page, g);
        write_group_name(page, g);
    }
    fputs(between            ? "<th>default\n"
          : page->groups > 1 ? "<th>all runs<th>default\n"
                             : "<th>run<th>default\n",
          page->html);
    write_keys(page, between);
    fputs("</table>\n", page->html);
}

static void write_configs(const Page *page) {
    if (first_with_config(page) == page->groups) {
        return;
    }
    fputs("<h2>Configs</h2>\n", page->html);
    if (page->groups > 1) {
        write_differences(page, 1);
    }
    write_differences(page, 0);
    for (int i = 0; i < page->count; i++) {
        if (page->runs[i].config) {
            fputs("<details><summary>", page->html);
            chart_write_text(page->runs[i].folder, page->html);
            fputs("/config.ini</summary><pre>", page->html);
            chart_write_text(page->runs[i].config, page->html);
            fputs("</pre></details>\n", page->html);
        }
    }
}

/* ---- the page ---- */

static const char head[] =
    "<!doctype html>\n<html lang=en><head><meta charset=utf-8>\n"
    "<meta name=viewport content=\"width=device-width\">" RUN_PAGE_TITLE "\n<style>\n"
    "body{font:15px/1.45 system-ui,sans-serif;max-width:75rem;margin:1.5rem auto;padding:0 "
    "1rem;color:#222}\n"
    "h2{margin-top:2.2rem}table{border-collapse:collapse;font-size:.9rem;display:block;"
    "overflow-x:auto}\n"
    "td,th{padding:.2rem .7rem;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}\n"
    "td:first-child{white-space:nowrap}\n"
    ".n{text-align:right}.small{font-size:.8rem;color:#555;white-space:pre-line}\n"
    ".charts{display:grid;grid-template-columns:repeat(auto-fill,minmax(330px,1fr));gap:.8rem}\n"
    "svg{width:100%}svg text{font:10px system-ui,sans-serif;fill:#555}svg .title{font-size:12px;"
    "fill:#222}\n"
    ".grid{stroke:#e4e4e4}i{display:inline-block;width:.8em;height:.8em;margin-right:.5em;"
    "border-radius:2px}\n"
    "pre{font-size:.8rem}video{max-width:100%;max-height:30rem}\n"
    "</style></head><body>\n";

static MildStatus write_page(Page *page, MildError *error) {
    MildStatus status = MILD_OK;
    fputs(head, page->html);
    fprintf(page->html, "<h1>%s</h1>\n", page->count > 1 ? "Training runs" : "Training run");
    write_runs(page);
    write_known(page);
    write_rest(page, 1, "Reward terms, per second lived");
    write_rest(page, 0, "Others");
    for (int i = 0; i < page->count; i++) {
        write_eval(page, &page->runs[i]);
    }
    for (int i = 0; i < page->count && status == MILD_OK; i++) {
        status = run_video_write(&page->runs[i], page->path, page->html, error);
    }
    write_configs(page);
    fputs("</body></html>\n", page->html);
    return status;
}

char *run_page_make(const RunFiles *runs, int count, const Settings *defaults, const char *path,
                    size_t *size, MildError *error) {
    char *text = NULL;
    MildStatus status = MILD_OK;
    Page *page = calloc(1, sizeof *page);
    FILE *html = page ? open_memstream(&text, size) : NULL;
    if (html) {
        page->runs = runs;
        page->count = count;
        page->defaults = defaults;
        page->path = path;
        page->html = html;
        find_groups(page);
        find_extent(page);
        status = write_page(page, error);
    }
    free(page);
    int failed = !html || ferror(html);
    failed |= html && fclose(html) != 0;
    if (failed) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "out of memory for the page");
    }
    if (status != MILD_OK) {
        free(text);
        return NULL;
    }
    return text;
}
