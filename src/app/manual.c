/* The man page, from the tables that --help prints. */
#include <stdio.h>
#include <string.h>

#include "app/build.h"
#include "app/commands.h"

/* Prints a text that roff shows as it is. A line end counts as a blank where `lines` is 0. */
static void put(const char *text, int lines) {
    int start = 1; /* of a line */
    for (; *text; text++) {
        if (start && (*text == '.' || *text == '\'')) {
            fputs("\\&", stdout);
        }
        start = 0;
        switch (*text) {
        case '\\': fputs("\\e", stdout); break;
        case '-': fputs("\\-", stdout); break;
        case '`': fputs("\\(ga", stdout); break;
        case '\'': fputs("\\(aq", stdout); break;
        case '\n':
            putchar(lines ? '\n' : ' ');
            start = lines;
            break;
        default: putchar(*text);
        }
    }
}

static void put_section(const char *title, const char *text, int lines) {
    printf(".SH %s\n", title);
    put(text, lines);
    putchar('\n');
}

/* A term in bold, what follows it in italics, and its help. */
static void put_entry(const char *dashes, const char *name, const char *value, const char *help) {
    fputs(".TP\n\\fB", stdout);
    put(dashes, 0);
    put(name, 0);
    fputs("\\fR", stdout);
    if (value) {
        fputs(" \\fI", stdout);
        put(value, 0);
        fputs("\\fR", stdout);
    }
    putchar('\n');
    put(help, 0);
    putchar('\n');
}

static void put_example(const char *lines) {
    fputs(".nf\n", stdout);
    put(lines, 1);
    fputs(".fi\n", stdout);
}

static void put_command(const CliCommand *command) {
    printf(".SS mild %s\n\\fBmild %s\\fR ", command->name, command->name);
    put(command->usage, 0);
    fputs("\n.PP\n", stdout);
    put(command->summary, 0);
    putchar('\n');
    for (int i = 0; i < command->word_count; i++) {
        put_entry("", command->words[i].name, NULL, command->words[i].help);
    }
    for (int i = 0; i < command->option_count; i++) {
        const CliOption *option = &command->options[i];
        put_entry("--", option->name, option->value, option->help);
    }
    if (command->overrides) {
        put_entry("--", "SECTION.KEY=VALUE", NULL, command->overrides);
    }
    if (command->examples) {
        fputs(".PP\n", stdout);
        put_example(command->examples);
    }
}

int manual_print(void) {
    printf(".TH MILD 1 \"\" \"mild %.*s\"\n.SH NAME\nmild \\- ", (int)strcspn(build_version(), "+"),
           build_version());
    put(commands_about, 0);
    fputs("\n.SH SYNOPSIS\n\\fBmild\\fR \\fICOMMAND\\fR [options]\n.SH COMMANDS\n", stdout);
    for (int i = 0; i < command_count; i++) {
        put_entry("", commands[i].name, NULL, commands[i].help);
    }
    commands_describe(put_command);
    put_section("EXIT STATUS", commands_exit, 0);
    put_section("ENVIRONMENT",
                "MILD_HOME: the folder with robots, configs and policies, in the place of the "
                "installed one.",
                0);
    fputs(".SH EXAMPLES\n", stdout);
    put_example(commands_examples);
    return 0;
}
