/* Completion for bash, and for zsh by its bashcompinit, from the tables that --help prints. */
#include <stdio.h>
#include <string.h>

#include "app/commands.h"
#include "app/grounds.h"
#include "control/controller.h"
#include "robot/robot.h"
#include "run/config/experiment_keys.h"

static const char head[] =
    "# Completion of mild for bash: source this file, or install it as\n"
    "# share/bash-completion/completions/mild. For zsh, in ~/.zshrc:\n"
    "#   autoload -U +X compinit bashcompinit && compinit && bashcompinit && source FILE\n"
    "\n"
    "# Offers the words of $1 that continue what is typed, behind the prefix $2.\n"
    "_mild_offer() {\n"
    "    local before=${2-} one\n"
    "    local typed=${word#\"$before\"}\n"
    "    for one in $1; do\n"
    "        [[ $one == \"$typed\"* ]] && COMPREPLY+=(\"$before$one\")\n"
    "    done\n"
    "}\n"
    "\n"
    "_mild() {\n"
    "    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
    "    local flags= topics= files= keys= choices= prefix= command=\n"
    "    COMPREPLY=()\n"
    "    [[ $COMP_CWORD -lt 2 ]] || command=\"${COMP_WORDS[1]} \"\n"
    "    [[ $COMP_CWORD -lt 3 ]] || command+=\"${COMP_WORDS[2]} \"\n"
    "    if [[ $word == '=' ]]; then # --option=, which the shell takes apart\n"
    "        word=\n"
    "    elif [[ $before == '=' ]]; then\n"
    "        before=${COMP_WORDS[COMP_CWORD-2]}\n"
    "    fi\n";

static const char tail[] = "    if [[ $before == --* && \" $files \" == *\" $before \"* ]]; then\n"
                           "        return 0 # the shell offers files\n"
                           "    elif [[ $before == --* && -n $choices ]]; then\n"
                           "        [[ $word != *,* ]] || prefix=${word%,*},\n"
                           "        _mild_offer \"$choices\" \"$prefix\"\n"
                           "    elif [[ $word == --*.* ]]; then\n"
                           "        _mild_offer \"$keys\"\n"
                           "        type compopt >/dev/null 2>&1 && compopt -o nospace\n"
                           "    elif [[ $word == -* ]]; then\n"
                           "        _mild_offer \"$flags\"\n"
                           "    else\n"
                           "        _mild_offer \"$topics\"\n"
                           "    fi\n"
                           "    return 0\n"
                           "}\n"
                           "complete -o default -F _mild mild\n";

/* ---- the values of options, by the option's name ---- */

static void print_grounds(void) {
    const char *names[GROUNDS_MAX];
    const int count = grounds_all(names);
    for (int i = 0; i < count; i++) {
        printf("%s ", names[i]);
    }
    fputs("rigid", stdout);
}

static void print_models(void) {
    for (int m = 0; m < MILD_MODELS; m++) {
        printf("%s%s", m ? " " : "", mild_model_names[m]);
    }
}

static void print_controllers(void) {
    for (int i = 0; i < controller_count(); i++) {
        printf("%s%s", i ? " " : "", controller_name(i));
    }
}

static void print_robots(void) {
    char names[ROBOT_LISTED_MAX][ROBOT_LISTED_SIZE];
    const int count = robot_list(names, ROBOT_LISTED_MAX);
    for (int i = 0; i < count; i++) {
        printf("%s%s", i ? " " : "", names[i]);
    }
}

static const struct {
    const char *option;
    void (*print)(void);
} values[] = {
    {"ground", print_grounds},
    {"model", print_models},
    {"controller", print_controllers},
    {"robot", print_robots},
};

/* ---- a command ---- */

static int is_file(const CliOption *option) {
    return option->type == CLI_INPUT || option->type == CLI_OUTPUT ||
           option->type == CLI_OUTPUT_LATER;
}

static void print_options(const CliCommand *command, int files) {
    for (int i = 0; i < command->option_count; i++) {
        if (!files || is_file(&command->options[i])) {
            printf("--%s ", command->options[i].name);
        }
    }
}

static void print_keys(const ConfigSection *section) {
    for (int i = 0; i < section->count; i++) {
        printf("--%s.%s= ", section->name, section->fields[i].name);
    }
}

static void print_overrides(const CliCommand *command) {
    ExperimentDef def = experiment_def_default();
    ConfigSection sections[EXPERIMENT_SECTIONS + 1];
    experiment_sections(&def, sections);
    MildMaterial material = mild_material_default();
    sections[EXPERIMENT_SECTIONS] = ground_section(&material);
    for (int i = 0; i <= EXPERIMENT_SECTIONS; i++) {
        if (command->sections ? strstr(command->sections, sections[i].name) != NULL
                              : i < EXPERIMENT_SECTIONS) {
            print_keys(&sections[i]);
        }
    }
}

/* Of a part such as `actuator fit` after those of its command, in whose place they come. */
static void print_command(const CliCommand *command) {
    printf("    if [[ $command == '%s '* ]]; then\n        flags='", command->name);
    print_options(command, 0);
    printf("--help'\n        files='");
    print_options(command, 1);
    printf("'\n        topics='");
    for (int i = 0; i < command->word_count; i++) {
        printf("%s ", command->words[i].name);
    }
    printf("'\n        keys='");
    if (command->overrides) {
        print_overrides(command);
    }
    printf("'\n    fi\n");
}

int completion_print(void) {
    fputs(head, stdout);
    printf("    if [[ -z $command ]]; then\n        flags='--help --version' topics='");
    for (int i = 0; i < command_count; i++) {
        printf("%s%s", i ? " " : "", commands[i].name);
    }
    printf("'\n    fi\n");
    commands_describe(print_command);
    printf("    case $before in\n");
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        printf("    --%s) choices='", values[i].option);
        values[i].print();
        printf("' ;;\n");
    }
    printf("    esac\n");
    fputs(tail, stdout);
    return 0;
}
