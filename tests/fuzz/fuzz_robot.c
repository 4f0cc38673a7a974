/* Any text as robot.ini. It is refused with one line, or what it says is within its bounds. */
#include "fuzz.h"
#include "robot/def.h"

static void check_foot(const RobotDef *def, const RobotFootDef *foot) {
    fuzz_check(foot->name[0] && foot->body[0] && foot->knee[0]);
    fuzz_check(foot->offset >= 0.0 && foot->offset < 1.0);
    fuzz_check(foot->corner_count >= 1 && foot->corner_count <= ROBOT_CORNERS_MAX);
    fuzz_check(foot->shape == ROBOT_SOLE_ROUND
                   ? foot->radius > 0.0
                   : foot->outline_points >= 3 && foot->outline_points <= ROBOT_OUTLINE_MAX);
    fuzz_check(def->mirror_shift == 0.0 || def->mirror_shift == 0.5);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static RobotDef def;
    MildError error = {0};
    char *text = malloc(size + 1);
    fuzz_check(text != NULL);
    memcpy(text, data, size);
    text[size] = '\0';
    memset(&def, 0, sizeof def);
    MildStatus status = robot_def_parse(text, "fuzz", &def, &error);
    fuzz_check(status == MILD_OK || (error.status == status && error.text[0]));
    fuzz_check(status == MILD_OK || !strchr(error.text, '\n'));
    if (status == MILD_OK) {
        fuzz_check(def.joints >= 1 && def.joints <= ROBOT_JOINTS_MAX);
        fuzz_check(def.feet >= 1 && def.feet <= ROBOT_FEET_MAX);
        fuzz_check(def.shells >= 0 && def.shells <= ROBOT_SHELLS_MAX);
        for (int i = 0; i < def.joints; i++) {
            fuzz_check(isfinite(def.pose[i]) && def.kp[i] >= 0.0 && def.joint[i][0]);
        }
        for (int f = 0; f < def.feet; f++) {
            check_foot(&def, &def.foot[f]);
        }
    }
    free(text);
    return 0;
}
