/* One function per command, one file per function: cmd_NAME.c. argv[0] is the command's name;
 * returns the exit code. */
#ifndef MILD_COMMANDS_H
#define MILD_COMMANDS_H

int cmd_train(int argc, char **argv);
int cmd_eval(int argc, char **argv);
int cmd_play(int argc, char **argv);
int cmd_press(int argc, char **argv);
int cmd_fit(int argc, char **argv);
int cmd_export(int argc, char **argv);
int cmd_drive(int argc, char **argv);
int cmd_bench(int argc, char **argv);
int cmd_info(int argc, char **argv);

#endif
