#include "deploy/export/export.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Adds a text; a long one ends where there is no more room. */
static void add(Description *d, const char *key, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    snprintf(d->key[d->count], DESCRIBE_KEY, "%s", key);
    vsnprintf(d->value[d->count++], DESCRIBE_VALUE, format, arguments);
    va_end(arguments);
}

static void add_numbers(Description *d, const char *key, const double *numbers, int count) {
    char *value = d->value[d->count];
    size_t used = 0;
    for (int i = 0; i < count; i++) {
        used += (size_t)snprintf(value + used, DESCRIBE_VALUE - used, "%s%.6g", i ? "," : "",
                                 numbers[i]);
    }
    snprintf(d->key[d->count++], DESCRIBE_KEY, "%s", key);
}

/* The first `count` joints. */
static void add_joint_names(Description *d, const char *key, const Robot *robot, int count) {
    char *value = d->value[d->count];
    size_t used = 0;
    for (int i = 0; i < count; i++) {
        used += (size_t)snprintf(value + used, DESCRIBE_VALUE - used, "%s%s", i ? "," : "",
                                 robot_joint_name(robot, i));
    }
    snprintf(d->key[d->count++], DESCRIBE_KEY, "%s", key);
}

#define FRAME_NAME(name, has, value, sign) #name,
#define FRAME_HAS(name, has, value, sign) has,

static void add_robot(Description *d, const Export *export, const TaskGains *gains) {
    const Robot *robot = export->robot;
    const int joints = robot_joints(robot);
    add(d, "robot", "%s", robot_name(robot));
    add_joint_names(d, "joint_names", robot, joints);
    if (robot_actions(robot) < joints) {
        add_joint_names(d, "action_joint_names", robot, robot_actions(robot));
    }
    add_numbers(d, "default_joint_pos", robot_default_pose(robot), joints);
    add_numbers(d, "joint_stiffness", gains->kp, joints);
    add_numbers(d, "joint_damping", gains->kd, joints);
    add_numbers(d, "joint_effort_limit", gains->limit, joints);
    add_numbers(d, "joint_velocity_limit", robot_speed(robot), joints);
    add_numbers(d, "joint_pos_low", robot_joint_low(robot), joints);
    add_numbers(d, "joint_pos_high", robot_joint_high(robot), joints);
}

/* Neighbours of one name in TASK_FRAME_LIST are one quantity. */
static void add_frame(Description *d, const TaskDef *def, const Robot *robot) {
    static const char *const name[] = {TASK_FRAME_LIST(FRAME_NAME) ""};
    const int has[] = {TASK_FRAME_LIST(FRAME_HAS)};
    char names[DESCRIBE_VALUE] = "", widths[DESCRIBE_VALUE] = "";
    int width = 0;
    for (size_t i = 0; i < sizeof has / sizeof *has; i++) {
        width += has[i] != 0;
        if (width > 0 && strcmp(name[i], name[i + 1]) != 0) {
            const size_t at = strlen(names), to = strlen(widths);
            snprintf(names + at, sizeof names - at, ",%s", name[i]);
            snprintf(widths + to, sizeof widths - to, ",%d", width);
            width = 0;
        }
    }
    add(d, "observation_names",
        "base_ang_vel,command,projected_gravity,joint_pos,joint_vel,last_action%s", names);
    add(d, "observation_widths", "3,3,3,%d,%d,%d%s", robot_joints(robot), robot_joints(robot),
        robot_actions(robot), widths);
}

static void add_rules(Description *d, const Export *export) {
    const TaskDef *task = export->task;
    const int stride = task->history_stride;
    add(d, "policy_period", "%g", TASK_PERIOD);
    add(d, "action_scale", "%.9g", task_action_scale(task, robot_table(export->robot)));
    add(d, "action_clip", "%.9g", task->action_clip);
    add(d, "action_rule", "joint target [rad] = default_joint_pos + action_scale * action");
    add_frame(d, task, export->robot);
    add(d, "observation_rule",
        "angular velocity [rad/s] and unit gravity in the base's axes; command (forward, left "
        "[m/s], turning left [rad/s]) times 2, 2, 1; joint_pos minus default_joint_pos [rad]; "
        "joint_vel times 0.05; last action after its clip");
    add(d, "history_means", "%d", TASK_FRAMES - 1);
    add(d, "history_stride", "%d", stride);
    add(d, "history_rule",
        "%d means of %d frames each, oldest first, of the %d frames before the newest, then the "
        "newest; before the first step all are the first frame",
        TASK_FRAMES - 1, stride, (TASK_FRAMES - 1) * stride);
    add(d, "clock", "%d", task->clock);
    add(d, "gait_period", "%.9g", task->gait_period);
    add(d, "gait_slowing", "%.9g", task->gait_slowing);
    add(d, "gait_slow_below", "%.9g", task->gait_slow_below);
    add(d, "standing_below", "%.9g", task->standing_below);
    add(d, "clock_rule",
        "sin, cos of 2 pi phase, which grows by policy_period / period a step, period = "
        "gait_period (1 + gait_slowing max(0, 1 - v / gait_slow_below)), v = |forward| + 3 |left| "
        "+ |turning| of the frame's command; 0, 0 when "
        "clock is 0 or all parts of the command are below standing_below");
    add(d, "estimate_rule",
        "base velocity times %g, velocity of each foot [m/s], in the base's axes; height of each "
        "foot times %g",
        task->velocity_scale, task->height_scale);
}

MildStatus describe(const Export *export, Description *description, MildError *error) {
    TaskGains gains;
    const MildStatus status = task_gains(export->task, export->robot, &gains, error);
    description->count = 0;
    if (status == MILD_OK) {
        add(description, "producer", "mild %s", export->version);
        add(description, "note", "%s", export->note);
        add_robot(description, export, &gains);
        add_rules(description, export);
    }
    return status;
}
