/* Every reward term against numbers worked out by hand from docs/task.md section 8, weights
 * included, at a good and at bad motions; their sum and its clip. */
#include "sa01.h"
#include "task_kit.h"

/* Left foot stands, right foot is in the middle of its swing (phase 1/4), default pose, upright, at
 * rest, nothing commanded, feet and knees and base where they should be. */
typedef struct {
    TaskDef def;
    TaskEnv env;
    TaskMotion motion;
} Scene;

static Scene scene;

static TaskMotion *new_scene(void) {
    memset(&scene, 0, sizeof scene);
    scene.def = task_def_default();
    scene.def.standing_below = 0; /* it walks in place */
    scene.env.phase = 0.25;
    TaskMotion *m = &scene.motion;
    m->def = &scene.def;
    m->env = &scene.env;
    m->robot = robot_table(robot);
    memcpy(m->q, robot_default_pose(robot), SA01_JOINTS * sizeof *m->q);
    scene.env.shape = task_shape(&scene.def, robot);
    m->gravity[2] = -1;
    m->base_height = 0.83;
    m->foot_distance = m->knee_distance = 0.2;
    m->contact[0] = m->wanted[0].stance = 1;
    m->wanted[1].height = 0.08;
    m->wanted[1].bend = 1;
    return m;
}

static double term(int which) {
    double terms[TASK_REWARD_COUNT];
    task_reward(&scene.motion, terms);
    return terms[which];
}

/* The weighted term, per second. 1e-7: the hand's numbers have eight digits. */
static void expect_term(int which, const char *motion, double wanted) {
    char what[96];
    snprintf(what, sizeof what, "%s, %s", task_reward_names[which], motion);
    expect_near(what, term(which), wanted, 1e-7 * fmax(fabs(wanted), 1e-3));
}

static void set_velocity(double vx, double vy, double wz) {
    scene.env.smooth_velocity[0] = vx;
    scene.env.smooth_velocity[1] = vy;
    scene.env.smooth_velocity[2] = wz;
}

static void set_command(double vx, double vy, double wz) {
    scene.env.command[0] = vx;
    scene.env.command[1] = vy;
    scene.env.command[2] = wz;
}

/* Of an error e the mean of a wide and a narrow curve, f(e) = (1 - n) exp(-5 e^2) + n exp(-10 e),
 * by hand: with n = 1/2, f(0.2) = (e^-0.2 + e^-2)/2 = 0.47703302, f(0.1) = 0.65955443 and f(0.4) =
 * 0.23382230. n = 0 is the paper's. Commanded are 0.6 and 0.1 m/s and -0.3 rad/s. */
TEST(tracking) {
    static const struct {
        const char *motion;
        double narrow, velocity[3], linear, yaw;
    } rows[] = {
        {"as commanded", 0.5, {0.6, 0.1, -0.3}, 2.0, 1.1},
        {"0.2 m/s too fast, 0.4 rad/s off", 0.5, {0.8, 0.1, 0.1}, 0.9540660363, 0.2572045317},
        {"0.2 m/s too slow", 0.5, {0.4, 0.1, -0.3}, 0.9540660363, 1.1},
        {"too fast and aside", 0.5, {0.8, 0.0, -0.3}, 0.6292584835, 1.1},
        {"the opposite way", 0.5, {-0.6, -0.1, 0.3}, 0.0003590770736, 0.0922777022},
        {"as printed, 0.2 m/s too fast", 0, {0.8, 0.1, -0.3}, 1.6374615062, 1.1},
        {"as printed, aside, 0.4 rad/s off", 0, {0.8, 0.0, 0.1}, 1.5576015661, 0.4942618605},
        {"a quarter, 0.2 m/s too fast", 0.25, {0.8, 0.1, -0.3}, 1.2957637713, 1.1},
    };
    new_scene();
    set_command(0.6, 0.1, -0.3);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        scene.def.reward.tracking_narrow = rows[i].narrow;
        set_velocity(rows[i].velocity[0], rows[i].velocity[1], rows[i].velocity[2]);
        expect_term(REWARD_linear_velocity, rows[i].motion, rows[i].linear);
        expect_term(REWARD_yaw_rate, rows[i].motion, rows[i].yaw);
    }
    scene.def.reward.tracking_narrow = 0.5;
    scene.def.reward.tracking_sharpness = 2;
    scene.def.reward.tracking_width = 0.3;
    set_velocity(0.8, 0.0, -0.3);
    expect_term(REWARD_linear_velocity, "sharpness 2, width 0.3", 1.2187047018);
}

/* Tilted by 60 degrees g_z = -1/2: upright (1 + 1/2)/2 = 3/4, on its back 0. The gate's third power
 * is 27/64, of all that is paid but of upright and of no price. */
TEST(upright_rise_and_gate) {
    TaskMotion *m = new_scene();
    double *weight = scene.def.reward.weight;
    weight[REWARD_upright] = 4;
    weight[REWARD_rise] = 2;
    weight[REWARD_power] = -0.01;
    m->torque[3] = 10;
    m->qd[3] = -5;
    expect_term(REWARD_upright, "upright", 4);
    expect_term(REWARD_rise, "at the nominal height", 2);
    m->base_height = 0.83 / 4;
    expect_term(REWARD_rise, "at a quarter of it", 0.5);
    m->base_height = -0.1;
    expect_term(REWARD_rise, "below its feet", 0);
    m->base_height = 2;
    expect_term(REWARD_rise, "above it", 2);
    set_command(0.6, 0.1, 0);
    set_velocity(0.6, 0.1, 0);
    m->gravity[0] = sqrt(0.75);
    m->gravity[2] = -0.5;
    expect_term(REWARD_upright, "tilted, no gate", 3);
    expect_term(REWARD_rise, "tilted, no gate", 2);
    scene.def.reward.gate = 3;
    expect_term(REWARD_upright, "tilted, gate 3", 3);
    expect_term(REWARD_rise, "tilted, gate 3", 2 * 0.421875);
    expect_term(REWARD_linear_velocity, "tilted, gate 3", 2 * 0.421875);
    expect_term(REWARD_power, "a price has no gate", -0.5);
    m->gravity[0] = 0;
    m->gravity[2] = 1;
    expect_term(REWARD_upright, "on its back", 0);
    expect_term(REWARD_linear_velocity, "on its back, gate 3", 0);
    expect_term(REWARD_power, "on its back", -0.5);
}

/* The left foot stands, the right is to be at 0.08 m. By hand, times 2.4: (pi/2) clip(h)/0.10 of
 * lift, where what is above the wanted height is taken off again; of rise the same from the print
 * of the foot that stands, (pi/2) clip(h + 0.06, 0, 0.14)/0.16; of error the paper's |h_des - h|,
 * which is paid for. */
TEST(feet_clearance) {
    static const struct {
        const char *motion;
        int form;
        double left, right, wanted;
    } rows[] = {
        {"lift, wanted height", TASK_CLEARANCE_LIFT, 0.3, 0.08, 3.0159289474},
        {"lift, 30 mm too low", TASK_CLEARANCE_LIFT, 0.3, 0.05, 1.8849555922},
        {"lift, 20 mm too high", TASK_CLEARANCE_LIFT, 0.3, 0.10, 2.6389378290},
        {"lift, far too high: 0.3 m counts", TASK_CLEARANCE_LIFT, 0.3, 0.50, -2.6389378290},
        {"lift, sunk", TASK_CLEARANCE_LIFT, 0.3, -0.02, 0},
        {"rise, wanted height", TASK_CLEARANCE_RISE, -0.06, 0.08, 3.2986722863},
        {"rise, at the surface", TASK_CLEARANCE_RISE, -0.06, 0, 1.4137166941},
        {"rise, deeper than the print", TASK_CLEARANCE_RISE, -0.06, -0.09, 0},
        {"rise, 20 mm too high", TASK_CLEARANCE_RISE, -0.06, 0.10, 3.0630528372},
        {"rise, not down yet: as lift", TASK_CLEARANCE_RISE, 0.3, 0.10, 2.6389378290},
        {"error, wanted height", TASK_CLEARANCE_ERROR, 0.3, 0.08, 0},
        {"error, 30 mm too low", TASK_CLEARANCE_ERROR, 0.3, 0.05, 0.072},
        {"error, 20 mm too high", TASK_CLEARANCE_ERROR, 0.3, 0.10, 0.048},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        TaskMotion *m = new_scene();
        scene.def.reward.clearance_form = rows[i].form;
        m->foot_height[0] = rows[i].left;
        m->foot_height[1] = rows[i].right;
        expect_term(REWARD_feet_clearance, rows[i].motion, rows[i].wanted);
        m->wanted[1].stance = 1;
        expect_term(REWARD_feet_clearance, "both stand", 0);
    }
    TaskMotion *m = new_scene();
    m->foot_height[1] = 0.05;
    scene.def.swing_apex = 0.2;
    expect_term(REWARD_feet_clearance, "twice the apex", 0.9424777961);
    scene.def.swing_apex = 0.1;
    m->wanted[0].stance = 0; /* both swing: the sum, not the mean */
    m->foot_height[0] = 0.02;
    m->wanted[0].height = 0.03;
    expect_term(REWARD_feet_clearance, "two feet, lift", 2.6389378290);
    scene.def.reward.clearance_form = TASK_CLEARANCE_ERROR;
    expect_term(REWARD_feet_clearance, "two feet, error", 0.096);
}

/* 1.4 times the mean of 1 of a foot that matches and -0.3 of one that does not; the paper's is
 * their sum, 1.3 (feet that match) - 0.3. */
TEST(gait) {
    static const struct {
        const char *motion;
        int left, right, either_left, either_right; /* contact, and either in double support */
        double mean, sum;
    } rows[] = {
        {"both as scheduled", 1, 0, 0, 0, 1.4, 3.22}, {"the right drags", 1, 1, 0, 0, 0.49, 1.4},
        {"both wrong", 0, 1, 0, 0, -0.42, -0.42},     {"left either", 0, 1, 1, 0, 0.49, 1.4},
        {"double support", 0, 1, 1, 1, 1.4, 3.22},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        TaskMotion *m = new_scene();
        m->contact[0] = rows[i].left;
        m->contact[1] = rows[i].right;
        m->wanted[0].either = rows[i].either_left;
        m->wanted[1].either = rows[i].either_right;
        expect_term(REWARD_gait, rows[i].motion, rows[i].mean);
        scene.def.reward.gait_form = TASK_GAIT_SUM;
        expect_term(REWARD_gait, rows[i].motion, rows[i].sum);
    }
}

/* Terms of one number of the motion, each changed alone in the scene. */
TEST(one_number) {
    static const struct {
        int term;
        const char *motion;
        size_t number;
        Real value;
        double wanted;
    } rows[] = {
        {REWARD_slip, "the foot in the air moves", offsetof(TaskMotion, foot_speed[1]), 0.7, 0},
        {REWARD_slip, "the left slips", offsetof(TaskMotion, foot_speed[0]), 0.3, -0.03},
        {REWARD_base_acceleration, "steady", offsetof(TaskMotion, twist_change), 0, 0.2},
        {REWARD_base_acceleration, "a jolt", offsetof(TaskMotion, twist_change), 0.5, 0.0446260320},
        {REWARD_base_height, "nominal", offsetof(TaskMotion, base_height), 0.83, 0.2},
        {REWARD_base_height, "too high", offsetof(TaskMotion, base_height), 0.84, 0.0735758882},
        {REWARD_base_height, "too low", offsetof(TaskMotion, base_height), 0.82, 0.0735758882},
        {REWARD_feet_distance, "within", offsetof(TaskMotion, foot_distance), 0.2, 0.2},
        {REWARD_feet_distance, "near", offsetof(TaskMotion, foot_distance), 0.12, 0.1367879441},
        {REWARD_feet_distance, "far", offsetof(TaskMotion, foot_distance), 0.28, 0.1135335283},
        {REWARD_feet_distance, "crossed", offsetof(TaskMotion, foot_distance), -0.9, 0.1},
        {REWARD_feet_distance, "knees near", offsetof(TaskMotion, knee_distance), 0.11, 0.2},
        {REWARD_knee_distance, "near", offsetof(TaskMotion, knee_distance), 0.11, 0.1367879441},
        {REWARD_knee_distance, "far", offsetof(TaskMotion, knee_distance), 0.28, 0.1135335283},
        {REWARD_knee_distance, "feet near", offsetof(TaskMotion, foot_distance), 0.12, 0.2},
        {REWARD_collision, "feet apart", offsetof(TaskMotion, foot_distance), 0.141, 0},
        {REWARD_collision, "feet", offsetof(TaskMotion, foot_distance), 0.139, -1},
        {REWARD_collision, "knees apart", offsetof(TaskMotion, knee_distance), 0.121, 0},
        {REWARD_collision, "knees", offsetof(TaskMotion, knee_distance), 0.119, -1},
        {REWARD_air_time, "no touchdown", offsetof(TaskMotion, landed_air_time), 0, 0},
        {REWARD_air_time, "0.3 s, in one step", offsetof(TaskMotion, landed_air_time), 0.3, 30},
        {REWARD_contact_force, "500 N", offsetof(TaskMotion, foot_force[0]), 500, 0},
        {REWARD_contact_force, "700 N", offsetof(TaskMotion, foot_force[0]), 700, -4},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char *motion = (char *)new_scene();
        memcpy(motion + rows[i].number, &rows[i].value, sizeof rows[i].value);
        expect_term(rows[i].term, rows[i].motion, rows[i].wanted);
    }
}

/* What two feet add up to, and keys that go before the robot's. */
TEST(feet_and_keys) {
    TaskMotion *m = new_scene();
    m->foot_speed[0] = 0.3;
    m->foot_speed[1] = 0.7;
    m->contact[1] = 1;
    expect_term(REWARD_slip, "both slip", -0.1);
    m->foot_force[0] = 700;
    m->foot_force[1] = 1000;
    expect_term(REWARD_contact_force, "700 and 1000 N: 200 and 400 count", -12);
    set_command(3, 0, 0); /* a run's feet bear 0.5/0.4 of that */
    scene.def.stance_share[0] = 0.4;
    expect_term(REWARD_contact_force, "700 and 1000 N: 75 and 375 count", -9);
    m = new_scene();
    m->landed_air_time = 0.3;
    m->standing = 1;
    expect_term(REWARD_air_time, "standing", 0);
    m->base_height = scene.def.reward.nominal_height = 0.82;
    expect_term(REWARD_base_height, "another nominal height", 0.2);
    const double feet[2] = {0, 0.19}, knees[2] = {0.05, 0.27};
    memcpy(scene.def.reward.feet_range, feet, sizeof feet);
    memcpy(scene.def.reward.knee_range, knees, sizeof knees);
    m->knee_distance = 0.28;
    expect_term(REWARD_feet_distance, "10 mm beyond the key's", 0.1367879441);
    expect_term(REWARD_knee_distance, "10 mm beyond the key's", 0.1367879441);
    m->foot_distance = 0.01;
    m->knee_distance = 0.06;
    expect_term(REWARD_feet_distance, "within the key's", 0.2);
    expect_term(REWARD_knee_distance, "within the key's", 0.2);
}

/* joint 0: 0.5^2 + (1 - 1 - 0.25)^2 = 0.3125; joint 11: 0.75^2 + (-0.25 - 1 + 0.125)^2 = 1.828125.
 */
TEST(action_smoothness) {
    new_scene();
    for (int age = 0; age < 3; age++) {
        scene.env.action[age][5] = 2;
    }
    expect_term(REWARD_action_smoothness, "constant", 0);
    const float first[3] = {1, 0.5f, -0.25f}, last[3] = {-0.25f, 0.5f, 0.125f};
    for (int age = 0; age < 3; age++) {
        scene.env.action[age][0] = first[age];
    }
    expect_term(REWARD_action_smoothness, "one joint", -0.0009375);
    for (int age = 0; age < 3; age++) {
        scene.env.action[age][SA01_JOINTS - 1] = last[age];
    }
    expect_term(REWARD_action_smoothness, "two joints", -0.006421875);
}

static void bend(int leg, double angle) {
    double *q = scene.motion.q + LEG_JOINTS * leg;
    q[HIP_PITCH] -= angle;
    q[KNEE] += 2 * angle;
    q[ANKLE_PITCH] -= angle;
}

/* In the middle of the swing the leg bends by 0.4 (1, 2, 1) rad: 0.4 sqrt(6) = 0.97979590 apart
 * from the default pose. */
TEST(reference_motion) {
    TaskMotion *m = new_scene();
    expect_term(REWARD_reference_motion, "stiff leg", 0.0900150501);
    bend(1, 0.4);
    expect_term(REWARD_reference_motion, "as the reference", 2.2);
    m->q[LEG_JOINTS + HIP_YAW] += 0.3;
    expect_term(REWARD_reference_motion, "0.3 rad off", 1.0753855994);
    new_scene();
    bend(0, 0.4);
    expect_term(REWARD_reference_motion, "the wrong leg", -0.0823201108);
    m->wanted[0].bend = 1;
    m->wanted[1].bend = 0;
    expect_term(REWARD_reference_motion, "the right leg", 2.2);
    m->wanted[0].bend = 0;
    expect_term(REWARD_reference_motion, "bent while standing", 0.0900150501);
    bend(0, -0.4);
    expect_term(REWARD_reference_motion, "standing", 2.2);
}

/* y = 0.05 + 0.10: (e^-5 + e^-0.45)/2 - 0.01 sqrt(0.0125). */
TEST(default_pose) {
    TaskMotion *m = new_scene();
    expect_term(REWARD_default_pose, "default pose", 1.2);
    m->q[HIP_ROLL] += 0.03;
    m->q[HIP_YAW] -= 0.04;
    expect_term(REWARD_default_pose, "left hip 0.05 rad off", 1.1158247859);
    m->q[LEG_JOINTS + HIP_ROLL] -= 0.06;
    m->q[LEG_JOINTS + HIP_YAW] += 0.08;
    expect_term(REWARD_default_pose, "both hips", 0.3852780184);
    m = new_scene();
    m->q[KNEE] += 0.5;
    expect_term(REWARD_default_pose, "bent knee", 1.194);
}

/* abs sum 0.07, norm 0.05: 1.5 (e^-0.7 + e^-0.2)/2. */
TEST(orientation) {
    TaskMotion *m = new_scene();
    expect_term(REWARD_orientation, "upright", 1.5);
    m->gravity[0] = 0.03;
    m->gravity[1] = -0.04;
    expect_term(REWARD_orientation, "tilted", 0.9864870427);
    m->gravity[0] = -0.03;
    m->gravity[1] = 0.04;
    expect_term(REWARD_orientation, "tilted the other way", 0.9864870427);
}

/* 0.25 (e^(-10 0.04) + e^(-5 0.5)). */
TEST(base_motion) {
    TaskMotion *m = new_scene();
    m->velocity[0] = 2;
    m->velocity[1] = -2;
    m->omega[2] = 9;
    expect_term(REWARD_base_motion, "level, no roll, no pitch", 0.5);
    m->velocity[2] = -0.2;
    m->omega[0] = 0.3;
    m->omega[1] = -0.4;
    expect_term(REWARD_base_motion, "bobbing and rocking", 0.1881012612);
}

TEST(efforts) {
    TaskMotion *m = new_scene();
    m->torque[0] = 30;
    m->torque[11] = -40;
    expect_term(REWARD_torque, "30, -40 N m", -2.5e-7);
    m->qd[0] = 3;
    m->qd[11] = -4;
    m->qd_before[0] = 3;
    m->qd_before[11] = -4;
    expect_term(REWARD_joint_speed, "3, -4 rad/s", -2.5e-4);
    expect_term(REWARD_joint_acceleration, "steady", 0);
    m->qd_before[0] = 2.7;   /* 30 rad/s^2 */
    m->qd_before[11] = -3.6; /* -40 rad/s^2 */
    expect_term(REWARD_joint_acceleration, "30, -40 rad/s^2", -1.25e-5);
    m->qd[0] = -3; /* a joint that gives 90 W, one that takes 160 */
    expect_term(REWARD_power, "no weight", 0);
    scene.def.reward.weight[REWARD_power] = -0.01;
    expect_term(REWARD_power, "90 and 160 W", -2.5);
}

/* Of the scene: f(0) f(0) 2 + 1.1 + 0 + 1.4 - 0 + 0.2 - 0 + 0.09001505 (stiff leg) + 1.2 + 3 times
 * 0.2 + 1.5 + 0 + 0.5 = 8.59001505 per second. */
TEST(sum_is_clipped) {
    TaskMotion *m = new_scene();
    double terms[TASK_REWARD_COUNT];
    expect_near("reward of a step", task_reward(m, terms), 0.0859001505, 1e-10);
    m->foot_force[0] = m->foot_force[1] = 900; /* -16 */
    expect_near("below zero", task_reward(m, terms), 0, 0);
    expect_near("the term itself is not clipped", terms[REWARD_contact_force], -16, 1e-9);
    scene.def.reward.clip_sum = 0;
    expect_near("no clip", task_reward(m, terms), -0.0740998495, 1e-10);
    scene.def.reward.weight[REWARD_contact_force] = 0;
    expect_near("weight 0", task_reward(m, terms), 0.0859001505, 1e-10);
    expect_near("weight 0", terms[REWARD_contact_force], 0, 0);
    scene.def.reward.weight[REWARD_contact_force] = -0.01;
    expect_near("half the weight", task_reward(m, terms), 0.0059001505, 1e-10);
}

TEST_MAIN(kit_setup, kit_teardown)
