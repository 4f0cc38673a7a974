/* Command lines: named options bound to variables, config overrides, positional words, and help. */
#ifndef MILD_CLI_H
#define MILD_CLI_H

#include <stdint.h>

#include "mild/error.h"

enum { CLI_LIST_MAX = 16, CLI_NAME_SIZE = 256, CLI_OVERRIDES_MAX = 64, CLI_EXIT_BAD_INPUT = 2 };

typedef struct {
    int count;
    double value[CLI_LIST_MAX];
} CliNumbers; /* "0.3,0.6" */

typedef struct {
    int count;
    char name[CLI_LIST_MAX][CLI_NAME_SIZE];
} CliNames; /* "rubber,foam45" */

typedef struct {
    int count;
    CliNumbers each[CLI_LIST_MAX];
} CliNumbersEach; /* of an option that is given several times */

/* Type of the target: FLAG int *, TEXT const char **, INT int *, UINT64 uint64_t *, NUMBER
 * double *, NUMBERS CliNumbers *, NUMBERS_EACH CliNumbersEach *, NAMES CliNames *. Only a
 * NUMBERS_EACH may be given more than once, and a flag, which says the same twice. The value
 * that it holds before parsing is
 * the default. Files are const char ** too. INPUT is read. OUTPUT is written and may be `-`; an
 * output that cannot be written is refused before the command runs. OUTPUT_LATER is written to a
 * folder that the command makes, so the command checks it. Outputs are claimed (file_claim): they
 * may be neither another output nor any file that the command reads. */
typedef enum {
    CLI_FLAG,
    CLI_TEXT,
    CLI_INPUT,
    CLI_OUTPUT,
    CLI_OUTPUT_LATER,
    CLI_INT,
    CLI_UINT64,
    CLI_NUMBER,
    CLI_NUMBERS,
    CLI_NUMBERS_EACH,
    CLI_NAMES
} CliType;

typedef struct {
    const char *name; /* without the dashes */
    CliType type;
    void *target;
    double min, max; /* inclusive, for each number; ignored for FLAG, texts, files, NAMES, UINT64 */
    const char *value; /* how the help shows the value: "NAME[,NAME]"; NULL for a flag */
    const char *help;  /* with unit and default */
} CliOption;

/* A word that a command takes, for the list in its help. */
typedef struct {
    const char *name;
    const char *help;
} CliWord;

typedef struct {
    const char *name;    /* "press" */
    const char *usage;   /* "--ground NAME [options]" */
    const char *summary; /* sentences that say what the command does */
    const CliOption *options;
    int option_count;
    const char *words_title; /* heading of `words`; NULL: none */
    const CliWord *words;
    int word_count;
    const char *overrides; /* help on --section.key=value; NULL: the command takes none */
    const char *examples;  /* whole lines, or NULL */
    int positional_max;    /* largest number of words without dashes */
    const char *picture;   /* option whose picture gets a file of its numbers; NULL: none */
    const char *numbers;   /* that file's name ends in this instead of the picture's ".png" */
} CliCommand;

typedef struct {
    const char *positional[CLI_LIST_MAX];
    int positional_count;
    const char *overrides[CLI_OVERRIDES_MAX]; /* "section.key=value"; of one key the last counts */
    int override_count;
    uint64_t given;                      /* bit i: options[i] of the command is on the line */
    char joined[CLI_OVERRIDES_MAX][160]; /* storage of overrides given as two words */
} CliArgs;

enum { CLI_RUN = -1 };
/* Parses argv[1..]. Returns CLI_RUN, or the exit code of a command that ends here: 0 after its
 * help, CLI_EXIT_BAD_INPUT after an error. Both were printed. */
int cli_parse(const CliCommand *command, int argc, char **argv, CliArgs *args);

/* The first of the options that is on the line, or NULL. names: without dashes, ended by NULL. */
const char *cli_first_given(const CliCommand *command, const CliArgs *args,
                            const char *const *names);

/* For an output that no standard output takes: 0, or an error and its exit code when it is `-`. */
int cli_refuse_dash(const char *command, const char *option, const char *path);

/* Prints "mild COMMAND: text" to stderr. Returns CLI_EXIT_BAD_INPUT, so that `return cli_fail(...)`
 * ends a command. */
int cli_fail(const char *command, const MildError *error);
int cli_fail_text(const char *command, const char *format, ...);

#endif
