/* What a model file may hold once MuJoCo has compiled it: names missing, other joints, any numbers
 * in the soles' entries. Our reader refuses it with a message or makes soles of it. The file format
 * itself is MuJoCo's. */
#include "fuzz.h"
#include "robot/robot.c" /* its checks are static */

#define MODEL MILD_SOURCE_DIR "/models/sa01/sa01.xml"

enum { LONGEST = 8 }; /* [numbers] of an outline that is written anew */

static Robot loaded;    /* the models as they are */
static mjModel *edited; /* a copy */

static void load(void) {
    fuzz_check(load_models(&loaded, MODEL, NULL) == MILD_OK);
    mjModel *m = loaded.model;
    static const char *const names[] = {"sole_outline_left", "sole_outline_right", "sole_pitch",
                                        "sole_elements"};
    for (int i = 0; i < 4; i++) { /* coarse plates, for speed */
        int id = mj_name2id(m, mjOBJ_NUMERIC, names[i]), corner = i < 2 ? 8 : 0;
        static const double outline[8] = {-0.1, -0.05, 0.1, -0.05, 0.1, 0.05, -0.1, 0.05};
        if (corner) {
            m->numeric_size[id] = corner;
        }
        for (int k = 0; k < corner; k++) {
            m->numeric_data[m->numeric_adr[id] + k] = outline[k];
        }
        if (!corner) {
            m->numeric_data[m->numeric_adr[id]] = i == 2 ? 0.05 : 0.0;
        }
    }
    edited = mj_copyModel(NULL, m);
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
    memcpy(edited->numeric_size, from->numeric_size,
           (size_t)from->nnumeric * sizeof *from->numeric_size);
    memcpy(edited->numeric_data, from->numeric_data,
           (size_t)from->nnumericdata * sizeof *from->numeric_data);
    memcpy(edited->body_parentid, from->body_parentid,
           (size_t)from->nbody * sizeof *from->body_parentid);
}

static void edit(Bytes *bytes, mjModel *m) {
    int joint = take_below(bytes, (int)m->njnt), number = take_below(bytes, (int)m->nnumeric);
    int adr = m->numeric_adr[number], room = (int)m->nnumericdata - adr;
    switch (take_below(bytes, 9)) {
    case 0:
        m->names[((unsigned)take_byte(bytes) << 8 | take_byte(bytes)) % (unsigned)m->nnames] = 0;
        break;
    case 1: m->jnt_type[joint] = take_below(bytes, 4); break;
    case 2: m->jnt_limited[joint] = 0; break;
    case 3: m->jnt_actfrclimited[joint] = 0; break;
    case 4: m->jnt_range[2 * joint + take_below(bytes, 2)] = take_number(bytes, 1.0); break;
    case 5: m->jnt_bodyid[joint] = take_below(bytes, (int)m->nbody); break;
    case 6: m->numeric_size[number] = 1 + take_below(bytes, room < LONGEST ? room : LONGEST); break;
    case 7:
        m->numeric_data[adr + take_below(bytes, m->numeric_size[number])] = take_number(bytes, 0.1);
        break;
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
    robot->visual = loaded.visual;
    robot->model = edited;
    while (bytes.at < bytes.end) {
        edit(&bytes, edited);
    }
    MildStatus status = read_bodies(robot, "fuzz", &error);
    status = status == MILD_OK ? read_joints(robot, "fuzz", &error) : status;
    status = status == MILD_OK ? read_shells(robot, "fuzz", &error) : status;
    status = status == MILD_OK ? read_soles(robot, "fuzz", &error) : status;
    fuzz_check(status == MILD_OK || (error.status != MILD_OK && error.text[0]));
    fuzz_check(status != MILD_OK || (robot->soles[0] && robot->soles[1]));
    robot->visual = robot->model = NULL;
    robot_destroy(robot);
    return 0;
}
