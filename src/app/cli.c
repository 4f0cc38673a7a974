#include "app/cli.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"
#include "base/text.h"

enum { HELP_COLUMN = 28, HELP_WIDTH = 100 };

int cli_fail(const char *command, const MildError *error) {
    return cli_fail_text(command, "%s", error->text);
}

int cli_fail_text(const char *command, const char *format, ...) {
    va_list arguments;
    fflush(stdout);
    fprintf(stderr, "mild %s: ", command);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    return CLI_EXIT_BAD_INPUT;
}

int cli_refuse_dash(const char *command, const char *option, const char *path) {
    return path && strcmp(path, "-") == 0
               ? cli_fail_text(command, "--%s: - is no file; name one", option)
               : 0;
}

/* ---- help ---- */

/* Prints the words of `text` in lines of HELP_WIDTH characters. A line end counts as a blank. The
 * cursor is at `column` now; further lines start at `indent`. */
static void print_wrapped(const char *text, int column, int indent) {
    while (*text) {
        text += strspn(text, " \n");
        int length = (int)strcspn(text, " \n");
        if (length == 0) {
            break;
        }
        if (column > indent && column + 1 + length > HELP_WIDTH) {
            printf("\n%*s", indent, "");
            column = indent;
        }
        column += printf(column > indent ? " %.*s" : "%.*s", length, text);
        text += length;
    }
    printf("\n");
}

/* Help of an option or a word, in the right column. */
static void print_entry(const char *left, const char *help) {
    if ((int)strlen(left) < HELP_COLUMN) {
        printf("%-*s", HELP_COLUMN, left);
    } else {
        printf("%s\n%*s", left, HELP_COLUMN, "");
    }
    print_wrapped(help, HELP_COLUMN, HELP_COLUMN);
}

static void print_option(const char *name, const char *value, const char *help) {
    char left[80];
    snprintf(left, sizeof left, "  --%s%s%s", name, value ? " " : "", value ? value : "");
    print_entry(left, help);
}

static void print_words(const CliCommand *command) {
    printf("\n%s:\n", command->words_title);
    for (int i = 0; i < command->word_count; i++) {
        char left[80];
        snprintf(left, sizeof left, "  %s", command->words[i].name);
        print_entry(left, command->words[i].help);
    }
}

static void print_command_help(const CliCommand *command) {
    printf("usage: mild %s %s\n\n", command->name, command->usage);
    print_wrapped(command->summary, 0, 0);
    if (command->words_title) {
        print_words(command);
    }
    printf("\noptions:\n");
    for (int i = 0; i < command->option_count; i++) {
        print_option(command->options[i].name, command->options[i].value, command->options[i].help);
    }
    print_option("help", NULL, "print this help");
    if (command->overrides) {
        printf("\noverrides:\n");
        print_option("SECTION.KEY=VALUE", NULL, command->overrides);
    }
    if (command->examples) {
        printf("\nexamples:\n%s", command->examples);
    }
}

/* ---- values ---- */

static int out_of_range(const CliCommand *command, const CliOption *option, const char *text) {
    return cli_fail_text(command->name, "--%s: %s is outside %g .. %g", option->name, text,
                         option->min, option->max);
}

static int set_number(const CliCommand *command, const CliOption *option, const char *text,
                      double *target) {
    double number;
    if (!text_double(text, &number)) {
        return cli_fail_text(command->name, "--%s: '%s' is not a number", option->name, text);
    }
    if (!(number >= option->min && number <= option->max)) {
        return out_of_range(command, option, text);
    }
    *target = number;
    return 0;
}

static int set_int(const CliCommand *command, const CliOption *option, const char *text) {
    int number;
    if (!text_int(text, &number)) {
        return cli_fail_text(command->name, "--%s: '%s' is not a whole number", option->name, text);
    }
    if (number < option->min || number > option->max) {
        return out_of_range(command, option, text);
    }
    *(int *)option->target = number;
    return 0;
}

/* Stores one value of a comma list in slot `index`. */
static int set_piece(const CliCommand *command, const CliOption *option, const char *piece,
                     int index) {
    if (index >= CLI_LIST_MAX) {
        return cli_fail_text(command->name, "--%s: more than %d values", option->name,
                             (int)CLI_LIST_MAX);
    }
    if (!*piece) {
        return cli_fail_text(command->name, "--%s: an empty value in the list", option->name);
    }
    if (option->type == CLI_NUMBERS) {
        return set_number(command, option, piece, &((CliNumbers *)option->target)->value[index]);
    }
    strcpy(((CliNames *)option->target)->name[index], piece);
    return 0;
}

static int set_list(const CliCommand *command, const CliOption *option, const char *text) {
    int count = 0;
    for (const char *rest = text; rest; count++) {
        char piece[CLI_NAME_SIZE];
        size_t length = strcspn(rest, ",");
        if (length >= sizeof piece) {
            return cli_fail_text(command->name, "--%s: '%.40s...' is too long", option->name, rest);
        }
        memcpy(piece, rest, length);
        piece[length] = '\0';
        int failed = set_piece(command, option, piece, count);
        if (failed) {
            return failed;
        }
        rest = rest[length] ? rest + length + 1 : NULL;
    }
    *(option->type == CLI_NUMBERS ? &((CliNumbers *)option->target)->count
                                  : &((CliNames *)option->target)->count) = count;
    return 0;
}

/* Stores one more list of an option that may be given several times. */
static int add_list(const CliCommand *command, const CliOption *option, const char *text) {
    CliNumbersEach *lists = option->target;
    if (lists->count >= CLI_LIST_MAX) {
        return cli_fail_text(command->name, "--%s: given more than %d times", option->name,
                             (int)CLI_LIST_MAX);
    }
    CliOption one = *option;
    one.type = CLI_NUMBERS;
    one.target = &lists->each[lists->count];
    const int failed = set_list(command, &one, text);
    lists->count += !failed;
    return failed;
}

/* Checks an output before the command runs, because a missing folder must not cost an hour of
 * trials. */
static int set_output(const CliCommand *command, const CliOption *option, const char *path) {
    MildError error = {0};
    if (strcmp(path, "-") != 0 && file_check_write(path, &error) != MILD_OK) {
        return cli_fail_text(command->name, "--%s: %s", option->name, error.text);
    }
    *(const char **)option->target = path;
    return 0;
}

static int set_option(const CliCommand *command, const CliOption *option, const char *text) {
    switch (option->type) {
    case CLI_FLAG: *(int *)option->target = 1; return 0;
    case CLI_TEXT:
    case CLI_INPUT:
    case CLI_OUTPUT_LATER: *(const char **)option->target = text; return 0;
    case CLI_OUTPUT: return set_output(command, option, text);
    case CLI_INT: return set_int(command, option, text);
    case CLI_UINT64:
        if (text_uint64(text, option->target)) {
            return 0;
        }
        return cli_fail_text(command->name, "--%s: '%s' is not a whole number from 0", option->name,
                             text);
    case CLI_NUMBER: return set_number(command, option, text, option->target);
    case CLI_NUMBERS:
    case CLI_NAMES: return set_list(command, option, text);
    case CLI_NUMBERS_EACH: return add_list(command, option, text);
    }
    return CLI_EXIT_BAD_INPUT;
}

/* ---- words ---- */

static int fail_unknown(const CliCommand *command, const char *name) {
    const char *names[64];
    int count = 0;
    for (int i = 0; i < command->option_count && count < 63; i++) {
        names[count++] = command->options[i].name;
    }
    names[count++] = "help";
    return cli_fail_text(command->name,
                         "unknown option --%s; nearest is --%s (mild %s --help lists all)", name,
                         text_nearest(name, names, count), command->name);
}

static int take_override(const CliCommand *command, int argc, char **argv, int *index,
                         CliArgs *args) {
    const char *word = argv[*index] + 2;
    if (args->override_count >= CLI_OVERRIDES_MAX) {
        return cli_fail_text(command->name, "more than %d overrides", (int)CLI_OVERRIDES_MAX);
    }
    if (!strchr(word, '=')) { /* "--train.minutes 5" is as good as "--train.minutes=5" */
        if (*index + 1 >= argc) {
            return cli_fail_text(command->name, "--%s needs a value: --%s=VALUE", word, word);
        }
        char *joined = args->joined[args->override_count];
        int length = snprintf(joined, sizeof args->joined[0], "%s=%s", word, argv[++*index]);
        if (length >= (int)sizeof args->joined[0]) {
            return cli_fail_text(command->name, "--%s: value too long", word);
        }
        word = joined;
    }
    args->overrides[args->override_count++] = word;
    return 0;
}

static int take_option(const CliCommand *command, int argc, char **argv, int *index,
                       CliArgs *args) {
    const char *word = argv[*index] + 2, *equals = strchr(word, '=');
    char name[64];
    snprintf(name, sizeof name, "%.*s", equals ? (int)(equals - word) : (int)strlen(word), word);
    for (int i = 0; i < command->option_count; i++) {
        const CliOption *option = &command->options[i];
        if (strcmp(option->name, name) != 0) {
            continue;
        }
        if (args->given >> i & 1 && option->type != CLI_FLAG && option->type != CLI_NUMBERS_EACH) {
            return cli_fail_text(command->name, "--%s is given twice; leave out one", name);
        }
        args->given |= UINT64_C(1) << i;
        if (option->type == CLI_FLAG) {
            if (equals) {
                return cli_fail_text(command->name, "--%s takes no value", name);
            }
            return set_option(command, option, NULL);
        }
        if (equals) {
            return set_option(command, option, equals + 1);
        }
        if (*index + 1 >= argc) {
            return cli_fail_text(command->name, "--%s needs a value: --%s %s", name, name,
                                 option->value);
        }
        return set_option(command, option, argv[++*index]);
    }
    return fail_unknown(command, name);
}

static int take_word(const CliCommand *command, int argc, char **argv, int *index, CliArgs *args) {
    const char *word = argv[*index];
    if (strncmp(word, "--", 2) == 0 && word[2]) {
        const char *dot = strchr(word, '.'), *equals = strchr(word, '=');
        int is_override = dot && (!equals || dot < equals);
        if (is_override && command->overrides) {
            return take_override(command, argc, argv, index, args);
        }
        return take_option(command, argc, argv, index, args);
    }
    if (word[0] == '-' && word[1]) {
        return cli_fail_text(command->name, "unknown option %s; options start with two dashes",
                             word);
    }
    if (args->positional_count >= command->positional_max) {
        return command->positional_max > 0
                   ? cli_fail_text(command->name,
                                   "unexpected word '%s'; it takes at most %d (mild %s --help)",
                                   word, command->positional_max, command->name)
                   : cli_fail_text(command->name, "unexpected word '%s' (mild %s --help)", word,
                                   command->name);
    }
    args->positional[args->positional_count++] = word;
    return 0;
}

/* ---- files ---- */

static int claim(const CliCommand *command, const char *path, const char *what) {
    MildError error = {0};
    return file_claim(path, what, &error) == MILD_OK ? 0 : cli_fail(command->name, &error);
}

/* Whether the command writes its numbers to the file of --csv. */
static int has_csv(const CliCommand *command) {
    for (int i = 0; i < command->option_count; i++) {
        const CliOption *option = &command->options[i];
        if (option->type == CLI_OUTPUT && strcmp(option->name, "csv") == 0) {
            return *(const char *const *)option->target != NULL;
        }
    }
    return 0;
}

/* A picture gets a file of its numbers beside it, which nobody named. If it is there without the
 * picture, it is not from an earlier call. */
static int claim_numbers(const CliCommand *command, const char *name, const char *picture) {
    char numbers[PATH_SIZE], what[80];
    MildError error = {0};
    if (!command->picture || strcmp(command->picture, name) != 0 || has_csv(command)) {
        return 0;
    }
    if (path_beside(picture, command->numbers, numbers, &error) != MILD_OK) {
        return cli_fail(command->name, &error);
    }
    if (strcmp(numbers, picture) == 0) {
        return 0;
    }
    if (access(numbers, F_OK) == 0 && access(picture, F_OK) != 0) {
        return cli_fail_text(command->name,
                             "--%s: %.150s exists and would be overwritten by the picture's "
                             "numbers; name another picture, or move it away",
                             name, numbers);
    }
    snprintf(what, sizeof what, "--%s (its numbers)", name);
    return claim(command, numbers, what);
}

/* Claims every output, so that no input can be one. */
static int claim_outputs(const CliCommand *command) {
    int bad = 0;
    for (int i = 0; i < command->option_count && !bad; i++) {
        const CliOption *option = &command->options[i];
        const char *output = option->type == CLI_OUTPUT || option->type == CLI_OUTPUT_LATER
                                 ? *(const char *const *)option->target
                                 : NULL;
        if (output && strcmp(output, "-") != 0) {
            char what[64];
            snprintf(what, sizeof what, "--%s", option->name);
            bad = claim(command, output, what);
            bad = bad ? bad : claim_numbers(command, option->name, output);
        }
    }
    return bad;
}

const char *cli_first_given(const CliCommand *command, const CliArgs *args,
                            const char *const *names) {
    for (; *names; names++) {
        for (int i = 0; i < command->option_count; i++) {
            if (args->given >> i & 1 && strcmp(command->options[i].name, *names) == 0) {
                return *names;
            }
        }
    }
    return NULL;
}

int cli_parse(const CliCommand *command, int argc, char **argv, CliArgs *args) {
    args->positional_count = args->override_count = 0;
    args->given = 0;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            print_command_help(command);
            return 0;
        }
    }
    for (int i = 1; i < argc; i++) {
        if (take_word(command, argc, argv, &i, args)) {
            return CLI_EXIT_BAD_INPUT;
        }
    }
    return claim_outputs(command) ? CLI_EXIT_BAD_INPUT : CLI_RUN;
}
