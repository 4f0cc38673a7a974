/* The run log: CSV that survives a kill and reads back, TensorBoard records whose frames check and
 * which hold the config; and each column has the number that its name says, of the report of that
 * iteration. */
#include <dirent.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/paths.h"
#include "files.h"
#include "run/train/log.h"
#include "run/train/run.h"

static char folder[64];

static int make_folder(void **state) {
    (void)state;
    strcpy(folder, "/tmp/mild_log_XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state) {
    (void)state;
    char path[PATH_SIZE];
    DIR *dir = opendir(folder);
    for (struct dirent *entry; dir && (entry = readdir(dir));) {
        if (entry->d_name[0] != '.' && path_join(folder, entry->d_name, path, NULL) == MILD_OK) {
            remove(path);
        }
    }
    if (dir) {
        closedir(dir);
    }
    return rmdir(folder);
}

static size_t read_file(const char *path, char *data, size_t size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t length = fread(data, 1, size - 1, file);
    fclose(file);
    data[length] = '\0';
    return length;
}

static uint32_t little_endian(const unsigned char *bytes) {
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
           (uint32_t)bytes[3] << 24;
}

static uint32_t masked(uint32_t crc) {
    return ((crc >> 15) | (crc << 17)) + 0xa282ead8u;
}

/* Castagnoli's CRC, bit by bit. */
static uint32_t crc32c(const void *data, size_t size) {
    const unsigned char *byte = data;
    uint32_t crc = ~0u;
    for (size_t bit = 0; bit < 8 * size; bit++) {
        const uint32_t out = (crc ^ byte[bit / 8] >> bit % 8) & 1;
        crc = crc >> 1 ^ (out ? 0x82f63b78u : 0);
    }
    return ~crc;
}

/* The path of the folder's event file. */
static void find_events(char path[PATH_SIZE]) {
    DIR *dir = opendir(folder);
    path[0] = '\0';
    for (struct dirent *entry; (entry = readdir(dir));) {
        if (strncmp(entry->d_name, "events.", 7) == 0) {
            path_join(folder, entry->d_name, path, NULL);
        }
    }
    closedir(dir);
}

/* Checks the frame of every record of the folder's event file: length, CRC of the length, data, CRC
 * of the data. Returns how many records there are; texts: how many of them and places in them hold
 * `text`, or NULL. */
static int check_frames(const char *text, int *texts) {
    static char data[400000];
    char path[PATH_SIZE];
    int records = 0;
    find_events(path);
    const size_t length = read_file(path, data, sizeof data);
    size_t at = 0;
    for (; at < length; records++) {
        const unsigned char *record = (const unsigned char *)data + at;
        const uint32_t size = little_endian(record);
        assert_int_equal(little_endian(record + 4), 0);
        assert_int_equal(little_endian(record + 8), masked(crc32c(record, 8)));
        assert_int_equal(little_endian(record + 12 + size), masked(crc32c(record + 12, size)));
        for (uint32_t i = 12; text && i + strlen(text) <= 12 + size; i++) {
            *texts += memcmp(record + i, text, strlen(text)) == 0;
        }
        at += 16 + size;
    }
    assert_int_equal(at, length);
    return records;
}

/* The records of a log are framed by the CRC whose known values are these. */
TEST_WITH(test_crc32c, make_folder, remove_folder) {
    static const unsigned char zeros[32] = {0};
    static const char *const columns[] = {"rate"};
    MildError error = {0};
    assert_int_equal(crc32c("123456789", 9), 0xe3069283u); /* of the CRC catalogue */
    assert_int_equal(crc32c(zeros, 32), 0x8a9136aau);      /* RFC 3720, appendix B.4 */
    log_close(log_open(folder, columns, 1, -1, &error));
    assert_int_equal(check_frames(NULL, NULL), 1); /* the version */
}

TEST_WITH(test_csv_resume, make_folder, remove_folder) {
    static const char *const columns[] = {"reward/gait", "rate"};
    char path[PATH_SIZE], text[1024];
    MildError error = {0};
    path_join(folder, "log.csv", path, NULL);
    Log *log = log_open(folder, columns, 2, -1, &error);
    assert_non_null(log);
    for (int i = 1; i <= 4; i++) {
        assert_int_equal(log_row(log, i, (double[]){0.5 * i, 1e9}, &error), MILD_OK);
    }
    log_close(log);
    FILE *torn = fopen(path, "a"); /* killed in the middle of a row */
    fputs("5,2.5", torn);
    fclose(torn);
    log = log_open(folder, columns, 2, 2, &error);
    assert_non_null(log);
    assert_int_equal(log_row(log, 3, (double[]){-1, 2}, &error), MILD_OK);
    log_close(log);
    read_file(path, text, sizeof text);
    assert_string_equal(text, "iteration,reward/gait,rate\n1,0.5,1e+09\n2,1,1e+09\n3,-1,2\n");
    static const char *const other[] = {"reward/gait", "speed"};
    assert_null(log_open(folder, other, 2, 2, &error));
    assert_error(&error, MILD_ERROR_FORMAT, path);
}

/* The bytes of a protobuf field, by its number: of the first, or of the one after `previous`. */
typedef struct {
    const unsigned char *data;
    size_t size; /* of a varint: 0, and `number` is its value */
    uint64_t number;
} Part;

static uint64_t varint(const unsigned char **at) {
    uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
        value |= (uint64_t)(**at & 0x7f) << shift;
        if (!(*(*at)++ & 0x80)) {
            return value;
        }
    }
}

/* The field at *at, and steps over it. */
static Part next_part(const unsigned char **at, uint64_t *field) {
    const uint64_t key = varint(at), wire = key & 7;
    Part found = {*at, wire == 1 ? 8 : wire == 5 ? 4 : 0, 0};
    if (wire == 0 || wire == 2) {
        found.number = varint(at);
        found.data = *at;
        found.size = wire == 2 ? found.number : 0;
    }
    *at = found.data + found.size;
    *field = key >> 3;
    return found;
}

static Part part(Part whole, uint64_t field, int skip) {
    const unsigned char *at = whole.data, *end = whole.data + whole.size;
    while (at < end) {
        uint64_t number;
        const Part found = next_part(&at, &number);
        if (number == field && skip-- == 0) {
            return found;
        }
    }
    fail_msg("no field %d", (int)field);
    return whole;
}

static int count_of(Part whole, uint64_t field) {
    const unsigned char *at = whole.data, *end = whole.data + whole.size;
    int count = 0;
    while (at < end) {
        uint64_t number;
        next_part(&at, &number);
        count += number == field;
    }
    return count;
}

/* Follows a path of field numbers. */
static Part follow(Part whole, const int *path) {
    for (; *path; path++) {
        whole = part(whole, (uint64_t)*path, 0);
    }
    return whole;
}
#define FOLLOW(whole, ...) follow(whole, (const int[]){__VA_ARGS__, 0})

static void assert_text(Part found, const char *text) {
    assert_int_equal(found.size, strlen(text));
    assert_memory_equal(found.data, text, found.size);
}

static double number_in(Part found) {
    double value;
    assert_int_equal(found.size, 8);
    memcpy(&value, found.data, 8);
    return value;
}

/* The n-th record of the folder's event file. */
static Part record(const char *data, int n) {
    for (; n--; data += 16 + little_endian((const unsigned char *)data)) {
        continue;
    }
    return (Part){(const unsigned char *)data + 12, little_endian((const unsigned char *)data), 0};
}

/* Field numbers of TensorBoard's event.proto, summary.proto, tensor.proto and hparams' plugin_data
 * .proto: an event's summary (5), its value (1): tag 1, tensor 8, metadata 9. */
TEST_WITH(test_config, make_folder, remove_folder) {
    static const char *const columns[] = {"rate"};
    static char data[4096];
    MildError error = {0};
    Log *log = log_open(folder, columns, 1, -1, &error);
    assert_non_null(log);
    assert_int_equal(
        log_config(log, "[train]\nenvs = 64\nvx = 0 1.2\n\n[ppo]\nmirror = true\n", &error),
        MILD_OK);
    assert_refused(log_config(log, "[train]\nenvs\n", &error), MILD_ERROR_FORMAT, &error,
                   "config.ini:2");
    log_close(log);
    char path[PATH_SIZE];
    find_events(path);
    read_file(path, data, sizeof data);

    const Part text = FOLLOW(record(data, 1), 5, 1);
    assert_text(FOLLOW(text, 1), "config");
    assert_text(FOLLOW(text, 9, 1, 1), "text");
    assert_int_equal(FOLLOW(text, 8, 1).number, 7); /* DT_STRING */
    assert_text(FOLLOW(text, 8, 8), "    [train]\n    envs = 64\n    vx = 0 1.2\n    \n    [ppo]\n"
                                    "    mirror = true\n");

    const Part session = FOLLOW(record(data, 2), 5, 1);
    assert_text(FOLLOW(session, 1), "_hparams_/session_start_info");
    assert_text(FOLLOW(session, 9, 1, 1), "hparams");
    const Part start = FOLLOW(session, 9, 1, 2, 3);
    assert_true(number_in(FOLLOW(start, 5)) > 1e9);
    assert_text(FOLLOW(part(start, 1, 0), 1), "train.envs");
    assert_true(number_in(FOLLOW(part(start, 1, 0), 2, 2)) == 64);
    assert_text(FOLLOW(part(start, 1, 1), 1), "train.vx");
    assert_text(FOLLOW(part(start, 1, 1), 2, 3), "0 1.2");
    assert_text(FOLLOW(part(start, 1, 2), 1), "ppo.mirror");
    assert_int_equal(FOLLOW(part(start, 1, 2), 2, 4).number, 1);
}

/* A log that goes on after iteration 76: readers drop what earlier files have from 77 on. Of an
 * event: step 2, session_log 7, in which status 1 is START. */
TEST_WITH(test_resumed, make_folder, remove_folder) {
    static const char *const columns[] = {"rate"};
    static char data[4096];
    char path[PATH_SIZE];
    MildError error = {0};
    log_close(log_open(folder, columns, 1, -1, &error));
    find_events(path);
    remove(path);
    log_close(log_open(folder, columns, 1, 76, &error));
    assert_int_equal(check_frames(NULL, NULL), 2);
    find_events(path);
    read_file(path, data, sizeof data);
    assert_text(FOLLOW(record(data, 0), 3), "brain.Event:2");
    assert_int_equal(FOLLOW(record(data, 1), 2).number, 77);
    assert_int_equal(FOLLOW(record(data, 1), 7, 1).number, 1);
}

/* A number as the log's CSV has it, and as TensorBoard does: in 32 bits. */
static void assert_same(Part summary, int n, const char *name, double number) {
    const Part scalar = part(summary, 1, n);
    float value;
    assert_text(FOLLOW(scalar, 1), name);
    assert_int_equal(FOLLOW(scalar, 2).size, 4);
    memcpy(&value, FOLLOW(scalar, 2).data, 4);
    assert_true(value == (float)number || (isnan(value) && isnan(number)));
}

/* The numbers of a log.csv below its first line: as many as `count`, and nothing else. */
static void read_rows(const char *path, double *number, int count) {
    static char text[400000];
    read_file(path, text, sizeof text);
    char *at = strchr(text, '\n') + 1;
    for (int i = 0; i < count; i++, at++) {
        number[i] = strtod(at, &at);
        assert_true(*at == ',' || *at == '\n');
    }
    assert_int_equal(*at, '\0');
}

/* TensorBoard shows the numbers of log.csv under their names, at their iterations: as many as make
 * several events of each row. Of an event: wall time 1, step 2, summary 5; of its value: tag 1,
 * simple_value 2. */
TEST_WITH(test_scalars, make_folder, remove_folder) {
    enum { COLUMNS = 300, ROWS = 3 };
    static char names[COLUMNS][120], data[400000];
    static const char *columns[COLUMNS];
    static double values[COLUMNS], rows[ROWS][1 + COLUMNS];
    const double start = (double)time(NULL);
    int scalars = 0;
    char path[PATH_SIZE];
    MildError error = {0};
    for (int i = 0; i < COLUMNS; i++) {
        snprintf(names[i], sizeof names[i], "group/%090d", i);
        columns[i] = names[i];
    }
    Log *log = log_open(folder, columns, COLUMNS, -1, &error);
    for (int row = 0; row < ROWS; row++) {
        for (int i = 0; i < COLUMNS; i++) {
            values[i] = i == 7 ? NAN : (i % 2 ? -1e-6 : 1e3) * (1 + COLUMNS * row + i);
        }
        assert_int_equal(log_row(log, 200 + 3 * row, values, &error), MILD_OK);
    }
    log_close(log);
    assert_true(check_frames("group/", &scalars) > ROWS);
    assert_int_equal(scalars, ROWS * (COLUMNS - 1));
    path_join(folder, "log.csv", path, NULL);
    read_rows(path, rows[0], ROWS * (1 + COLUMNS));
    find_events(path);
    const size_t length = read_file(path, data, sizeof data);
    int seen = 0;
    for (size_t at = 0; at < length; at += 16 + little_endian((unsigned char *)data + at)) {
        const Part event = record(data + at, 0);
        for (int n = 0; at > 0 && n < count_of(FOLLOW(event, 5), 1); n++, seen++) {
            const int written = COLUMNS - 1; /* a row; what was not measured is left out */
            const int column = seen % written + (seen % written >= 7);
            const double *row = rows[seen / written];
            assert_int_equal(FOLLOW(event, 2).number, (uint64_t)row[0]);
            assert_in_range(number_in(FOLLOW(event, 1)), start, start + 60);
            assert_same(FOLLOW(event, 5), n, names[column], row[1 + column]);
        }
    }
    assert_int_equal(seen, ROWS * (COLUMNS - 1));
}

/* ---- the log of a run ---- */

enum { ITERATIONS = 3, ENVS = 12, STEPS = 30, COLUMNS_MAX = 80 };
#define RUN "build_test_run"

static TrainReport reports[ITERATIONS];

static void keep(void *self, int64_t iteration, const TrainReport *report, double share) {
    (void)self;
    assert_true(iteration >= 1 && iteration <= ITERATIONS);
    assert_true(fabs(share - (double)iteration / ITERATIONS) < 1e-12);
    reports[iteration - 1] = *report;
}

/* The number of a name; written down here a second time, by its meaning. */
static double number_of(const char *name, const TrainReport *r, int iteration) {
    const struct {
        const char *name;
        double value;
    } known[] = {{"iteration", iteration},
                 {"episode/reward", r->episodes.reward},
                 {"episode/length_s", r->episodes.length},
                 {"episode/speed_error", r->episodes.speed_error},
                 {"episode/falls", r->episodes.falls},
                 {"episode/ended", r->episodes.episodes},
                 {"episode/diverged", r->episodes.diverged},
                 {"episode/assist", r->episodes.assist},
                 {"loss/surrogate", r->ppo.surrogate},
                 {"loss/value", r->ppo.value_loss},
                 {"loss/entropy", r->ppo.entropy},
                 {"loss/kl", r->ppo.kl},
                 {"loss/clip_share", r->ppo.clip_share},
                 {"loss/mirror", r->ppo.mirror},
                 {"loss/reconstruction", r->ppo.vae_reconstruction},
                 {"loss/vae_kl", r->ppo.vae_kl},
                 {"loss/base_velocity", r->ppo.estimate_loss[0]},
                 {"loss/feet_velocity", r->ppo.estimate_loss[1]},
                 {"loss/feet_height", r->ppo.estimate_loss[2]},
                 {"ppo/learning_rate", r->ppo.learning_rate},
                 {"ppo/gradient", r->ppo.gradient_norm},
                 {"ppo/action_std", r->ppo.action_std},
                 {"ppo/explained", r->ppo.explained_variance},
                 {"ppo/skipped", r->ppo.skipped},
                 {"rate/steps_per_s", r->steps_per_s},
                 {"rate/steps", (double)iteration * ENVS * STEPS}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        if (strcmp(known[i].name, name) == 0) {
            return known[i].value;
        }
    }
    for (int t = 0; t < TASK_REWARD_COUNT; t++) {
        if (strncmp(name, "reward/", 7) == 0 && strcmp(task_reward_names[t], name + 7) == 0) {
            return r->episodes.terms[t];
        }
    }
    fail_msg("what is %s?", name);
    return NAN;
}

static void run(const ExperimentDef *def) {
    MildError error = {0};
    const TrainRunDef of = {.folder = RUN,
                            .def = def,
                            .config = "[train]\nrobot = sa01\n",
                            .version = "0",
                            .note = "test"};
    const TrainCallbacks callbacks = {.iterated = keep};
    TrainRun *run = train_run_open(&of, &callbacks, &error);
    expect_good(run != NULL, &error);
    assert_int_equal(train_run_loop(run, &error), MILD_OK);
    train_run_close(run);
}

static int remove_run(void **state) {
    (void)state;
    return system("rm -rf " RUN);
}

TEST_WITH(a_column_is_what_it_names, remove_run, remove_run) {
    char header[4096], line[4096], *names[COLUMNS_MAX], *more;
    ExperimentDef def = experiment_def_default();
    int columns = 0, rows = 0, ended = 0;
    def.train.envs = ENVS;
    def.train.threads = 2;
    def.train.iterations = ITERATIONS;
    def.train.minutes = 0;
    def.ppo.steps = STEPS;
    def.ppo.minibatches = 2;
    def.task.episode = 0.5;
    run(&def);
    FILE *csv = fopen(RUN "/log.csv", "r");
    assert_non_null(csv);
    assert_non_null(fgets(header, sizeof header, csv));
    for (char *word = strtok_r(header, ",\n", &more); word; word = strtok_r(NULL, ",\n", &more)) {
        assert_true(columns < COLUMNS_MAX);
        names[columns++] = word;
    }
    assert_int_equal(columns, 26 + TASK_REWARD_COUNT);
    for (; fgets(line, sizeof line, csv); rows++) {
        char *at = line;
        assert_true(rows < ITERATIONS);
        ended += reports[rows].episodes.episodes;
        for (int c = 0; c < columns; c++, at++) {
            const double is = strtod(at, &at),
                         wanted = number_of(names[c], &reports[rows], rows + 1);
            if (!(fabs(is - wanted) <= 1e-8 * fabs(wanted)) && !(isnan(is) && isnan(wanted))) {
                fail_msg("%s of iteration %d: %g, not %g", names[c], rows + 1, is, wanted);
            }
        }
    }
    fclose(csv);
    print_message("%d columns, %d rows, %d episodes ended\n", columns, rows, ended);
    assert_int_equal(rows, ITERATIONS);
    assert_true(ended > 0);
}

TEST_MAIN(NULL, NULL)
