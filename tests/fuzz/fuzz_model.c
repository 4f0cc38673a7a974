/* What a robot's model may hold once MuJoCo has compiled it: names missing, other joints, other
 * ranges; and any numbers in the soles of its robot.ini. Our reader refuses it with a message or
 * makes soles of it. The format of model files itself is MuJoCo's. */
#include "fuzz.h"
#include "robot/description.h"
#include "robot/robot.h"

static Robot loaded;    /* the robot as it is, with coarse soles for speed */
static mjModel *edited; /* a copy of its model */

static void load(void) {
    static const double outline[8] = {-0.1, -0.05, 0.1, -0.05, 0.1, 0.05, -0.1, 0.05};
    const char *folder = MILD_SOURCE_DIR "/robots/sa01";
    fuzz_check(robot_def_read(folder, &loaded.def, NULL) == MILD_OK);
    strcpy(loaded.path, MILD_SOURCE_DIR "/robots/sa01/sa01.xml");
    fuzz_check(robot_load_models(&loaded, NULL) == MILD_OK);
    for (int f = 0; f < loaded.def.feet; f++) {
        RobotFootDef *foot = &loaded.def.foot[f];
        memcpy(foot->outline, outline, sizeof outline);
        foot->outline_points = 4;
        foot->pitch = 0.05;
        foot->elements = 0;
    }
    edited = mj_copyModel(NULL, loaded.model);
    fuzz_check(edited != NULL);
}

/* Undoes what edit does. */
static void restore(void) {
    const mjModel *from = loaded.model;
    memcpy(edited->names, from->names, (size_t)from->nnames);
    memcpy(edited->jnt_type, from->jnt_type, (size_t)from->njnt * sizeof *from->jnt_type);
    memcpy(edited->jnt_limited, from->jnt_limited, (size_t)from->njnt * sizeof *from->jnt_limited);
    memcpy(edited->jnt_actfrclimited, from->jnt_actfrclimited,
           (size_t)from->njnt * sizeof *from->jnt_actfrclimited);
    memcpy(edited->jnt_range, from->jnt_range, 2 * (size_t)from->njnt * sizeof *from->jnt_range);
    memcpy(edited->jnt_bodyid, from->jnt_bodyid, (size_t)from->njnt * sizeof *from->jnt_bodyid);
    memcpy(edited->body_parentid, from->body_parentid,
           (size_t)from->nbody * sizeof *from->body_parentid);
}

static void edit_sole(Bytes *bytes, RobotFootDef *foot) {
    switch (take_below(bytes, 5)) {
    case 0: foot->outline_points = take_below(bytes, 6); break;
    case 1: foot->pitch = take_number(bytes, 0.1); break;
    case 2: foot->elements = take_below(bytes, 1000); break;
    case 3: foot->z = take_number(bytes, 0.1); break;
    default: foot->outline[take_below(bytes, 8)] = take_number(bytes, 0.1); break;
    }
}

static void edit(Bytes *bytes, mjModel *m, RobotDef *def) {
    int joint = take_below(bytes, (int)m->njnt), foot = take_below(bytes, def->feet);
    switch (take_below(bytes, 8)) {
    case 0:
        m->names[((unsigned)take_byte(bytes) << 8 | take_byte(bytes)) % (unsigned)m->nnames] = 0;
        break;
    case 1: m->jnt_type[joint] = take_below(bytes, 4); break;
    case 2: m->jnt_limited[joint] = 0; break;
    case 3: m->jnt_actfrclimited[joint] = 0; break;
    case 4: m->jnt_range[2 * joint + take_below(bytes, 2)] = take_number(bytes, 1.0); break;
    case 5: m->jnt_bodyid[joint] = take_below(bytes, (int)m->nbody); break;
    case 6: edit_sole(bytes, &def->foot[foot]); break;
    default: m->body_parentid[take_below(bytes, (int)m->nbody)] = 0; break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (!loaded.model) {
        load();
    }
    restore();
    Bytes bytes = {data, data + size};
    MildError error = {0};
    Robot *robot = calloc(1, sizeof *robot);
    fuzz_check(robot != NULL);
    *robot = loaded;
    robot->model = edited;
    while (bytes.at < bytes.end) {
        edit(&bytes, edited, &robot->def);
    }
    const MildStatus status = robot_read_models(robot, &error);
    fuzz_check(status == MILD_OK || (error.status != MILD_OK && error.text[0]));
    fuzz_check(status != MILD_OK || (robot->soles[0] && robot->soles[1]));
    robot->visual = robot->model = NULL;
    robot_destroy(robot);
    return 0;
}
