/* Any bytes as a log.csv and as a config.ini. Refused with a message, or rows whose iterations
 * rise, means within their extremes, and every key found again. */
#include "fuzz.h"
#include "run/train/history.h"
#include "run/train/settings.h"
#include "unnamed_file.h"

enum { POINTS = 7 };

static char *text_of(const uint8_t *data, size_t size) {
    char *text = malloc(size + 1);
    fuzz_check(text != NULL);
    memcpy(text, data, size);
    text[size] = '\0';
    return text;
}

static void check_column(const History *history, int column) {
    const double *last = history->value + (size_t)(history->rows - 1) * (size_t)history->columns;
    double mean[POINTS], low = INFINITY, high = -INFINITY;
    history_means(history, column, history->value[0], last[0], POINTS, mean);
    for (int i = 0; i < history->rows; i++) {
        const double value = history->value[(size_t)i * (size_t)history->columns + (size_t)column];
        low = isfinite(value) ? fmin(low, value) : low;
        high = isfinite(value) ? fmax(high, value) : high;
    }
    const double room = 1e-12 * fmax(fabs(low), fabs(high));
    for (int k = 0; k < POINTS; k++) { /* a sum may pass the greatest number */
        fuzz_check(!isfinite(mean[k]) || (mean[k] >= low - room && mean[k] <= high + room));
    }
}

static void read_history(const uint8_t *data, size_t size) {
    History history;
    MildError error = {0};
    const MildStatus status = history_read(unnamed_file(data, size), &history, &error);
    if (status != MILD_OK) {
        fuzz_check(error.status == status && error.text[0] && !history.text);
        return;
    }
    fuzz_check(history.rows > 0 && history.columns > 1);
    for (int i = 1; i < history.rows; i++) {
        const double *row = history.value + (size_t)i * (size_t)history.columns;
        fuzz_check(row[0] > row[-history.columns]);
    }
    for (int c = 0; c < history.columns; c++) {
        const int found = history_column(&history, history.name[c]);
        fuzz_check(found >= 0 && found <= c);
        check_column(&history, c);
    }
    history_free(&history);
}

static void read_settings(const uint8_t *data, size_t size) {
    char *text = text_of(data, size);
    Settings settings;
    MildError error = {0};
    if (settings_read(text, "config.ini", &settings, &error) == MILD_OK) {
        for (int i = 0; i < settings.count; i++) {
            fuzz_check(settings_find(&settings, settings.list[i].key) != NULL);
        }
        settings_free(&settings);
    } else {
        fuzz_check(error.text[0] && !settings.list);
    }
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    read_history(data, size);
    read_settings(data, size);
    return 0;
}
