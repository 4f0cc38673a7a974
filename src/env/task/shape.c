/* Widths of a robot's observations, and their mirror image. */
#include "env/task/scan.h"
#include "env/task/task.h"

#define TASK_END_NAME(name, help) #name,
const char *const task_end_names[] = {TASK_ENDS(TASK_END_NAME)};

/* Numbers of TASK_FRAME_LIST that the task has. */
static int frame_last(const TaskDef *def) {
    int count = 0;
#define FRAME_COUNT(name, has, value, sign) count += (has) ? 1 : 0;
    TASK_FRAME_LIST(FRAME_COUNT)
    return count;
}

TaskShape task_shape(const TaskDef *def, const Robot *robot) {
    int joints = robot_joints(robot), actions = robot_actions(robot), feet = robot_feet(robot);
    TaskShape shape = {.joints = joints,
                       .feet = feet,
                       .observation = 9 + 2 * joints + actions + frame_last(def),
                       .scan = def->scan > 0 ? task_scan_rows(def) * task_scan_columns(def) : 0,
                       .actions = actions,
                       .estimates = 3 + 4 * feet};
    shape.history = TASK_FRAMES * shape.observation + shape.scan;
    shape.critic = shape.observation + shape.estimates + 6 * feet + 34 + shape.scan;
    return shape;
}

int task_critic_ground(const TaskShape *shape) {
    return shape->observation + shape->estimates + 6 * shape->feet + 10; /* push 6, masses 4 */
}

/* Mirror image in the x-z plane. y components, roll, yaw and their rates change sign, and the
 * joints swap sides. If left and right legs alternate, the clock shifts by half a period, (sin,
 * cos) -> (-sin, -cos). If they move together, it does not change. */
TaskMirror task_mirror(const TaskDef *def, const Robot *robot) {
    static const float head[9] = {-1, 1, -1, 1, -1, -1, 1, -1, 1};
    TaskMirror mirror = {.observation_index = {0}};
    const int joints = robot_joints(robot), actions = robot_actions(robot);
    int at = 9 + 2 * joints + actions;
    for (int i = 0; i < 9; i++) {
        mirror.observation_index[i] = i;
        mirror.observation_sign[i] = head[i];
    }
    for (int i = 0; i < joints; i++) {
        int other = robot_mirror_joint(robot)[i];
        float sign = (float)robot_mirror_sign(robot)[i];
        if (i < actions) { /* the mirrored one too: see take_driven of robot/def.c */
            mirror.action_index[i] = other;
            mirror.action_sign[i] = sign;
        }
        for (int block = 0; block < (i < actions ? 3 : 2); block++) { /* angles, speeds, actions */
            mirror.observation_index[9 + block * joints + i] = 9 + block * joints + other;
            mirror.observation_sign[9 + block * joints + i] = sign;
        }
    }
#define FRAME_MIRROR(name, has, value, sign)                                                       \
    if (has) {                                                                                     \
        mirror.observation_index[at] = at;                                                         \
        mirror.observation_sign[at++] = sign;                                                      \
    }
    TASK_FRAME_LIST(FRAME_MIRROR)
    const int scan = task_shape(def, robot).scan, columns = task_scan_columns(def);
    for (int n = 0; n < scan; n++) { /* left and right points of a row change places */
        mirror.observation_index[at + n] = at + n + columns - 1 - 2 * (n % columns);
        mirror.observation_sign[at + n] = 1;
    }
    return mirror;
}
