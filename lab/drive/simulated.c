#include "drive/drive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/random.h"
#include "drive/packet.h"

#define SILENCE 0.1 /* [s] without a target after which the robot damps itself */
#define RESEND 0.01 /* [s] between the states that wait for the first target */
#define END_PACKETS 3
#define PACKETS 512 /* taken at once */
#define RANDOM_USE_LOSS 0x4c4f5353u
enum { PENDING = 64 }; /* delayed states, at most */

typedef struct {
    double due; /* [s] of the robot's time */
    size_t size;
    uint8_t bytes[PACKET_MAX];
} Pending;

typedef struct {
    const SimulatedDef *def;
    SimulatedReport *report;
    TaskEnv *env;
    RobotSim *sim;
    int joints;
    PacketFormat format;
    uint64_t runner;   /* its session; 0: not known yet */
    double time;       /* [s] its own, since the first target */
    uint32_t sequence; /* of the newest state */
    TargetPacket target;
    double target_time; /* [s] when it came */
    int has_target;     /* bool */
    int silent;         /* bool: in lockstep, no answer came in time */
    Pending pending[PENDING];
    int pending_count;
} Simulated;

/* ---- packets ---- */

static StatePacket make_state(Simulated *s, PacketMode mode) {
    const double *qpos = robot_sim_qpos(s->sim), *qvel = robot_sim_qvel(s->sim);
    StatePacket state = {.mode = mode,
                         .sequence = ++s->sequence,
                         .answers = s->target.sequence,
                         .time = (uint64_t)(1e6 * clock_seconds()),
                         .session = s->def->session,
                         .peer = s->runner};
    for (int i = 0; i < 4; i++) {
        state.quaternion[i] = (float)qpos[3 + i];
    }
    for (int i = 0; i < 3; i++) {
        state.angular_velocity[i] = (float)qvel[3 + i];
    }
    for (int i = 0; i < s->joints; i++) {
        state.angle[i] = (float)qpos[7 + i];
        state.speed[i] = (float)qvel[6 + i];
    }
    return state;
}

static void send_pending(Simulated *s) {
    int kept = 0;
    for (int i = 0; i < s->pending_count; i++) {
        if (s->pending[i].due <= s->time) {
            udp_send(s->def->udp, s->pending[i].bytes, s->pending[i].size);
        } else {
            s->pending[kept++] = s->pending[i];
        }
    }
    s->pending_count = kept;
}

/* Sends a state, or loses or delays it. Bool: it was sent at once. */
static int send_state(Simulated *s) {
    const SimulatedDef *def = s->def;
    uint8_t bytes[PACKET_MAX];
    const StatePacket state = make_state(s, PACKET_walk);
    const size_t size = packet_write_state(&state, &s->format, bytes);
    Random r = random_at(def->seed ^ RANDOM_USE_LOSS, 0, s->sequence);
    s->report->sent++;
    send_pending(s);
    if (random_unit(&r) < def->drop) {
        s->report->dropped++;
        return 0;
    }
    if (random_unit(&r) < def->delay_share && s->pending_count < PENDING) {
        Pending *p = &s->pending[s->pending_count++];
        p->due = s->time + def->delay;
        p->size = size;
        memcpy(p->bytes, bytes, size);
        s->report->delayed++;
        return 0;
    }
    udp_send(def->udp, bytes, size);
    return 1;
}

/* Bool: the target speaks to this robot, and is of the session that its first one began. */
static int is_of_session(Simulated *s, const TargetPacket *target) {
    if (target->peer != s->def->session || target->session == 0) {
        return 0;
    }
    s->runner = s->runner ? s->runner : target->session;
    return s->runner == target->session;
}

static void take_target(Simulated *s, const uint8_t *bytes, size_t size) {
    TargetPacket target;
    if (packet_read_target(bytes, size, &s->format, &target) != PACKET_FAULT_none ||
        !is_of_session(s, &target)) {
        s->report->refused++;
    } else if (!s->has_target || (int32_t)(target.sequence - s->target.sequence) > 0) {
        s->target = target;
        s->target_time = s->time;
        s->has_target = 1;
        s->silent = 0;
        s->report->targets++;
    }
}

static void take_targets(Simulated *s) {
    uint8_t bytes[PACKET_MAX + 1];
    struct sockaddr_in from;
    int size;
    for (int i = 0;
         i < PACKETS && (size = udp_receive(s->def->udp, bytes, sizeof bytes, &from)) >= 0; i++) {
        if (udp_sender(&from) == udp_sender(&s->def->udp->peer)) {
            take_target(s, bytes, (size_t)size);
        } else {
            s->report->strangers++;
        }
    }
}

/* Until a target answers the newest state, at most so long. Bool: one does. */
static int wait_for_answer(Simulated *s, double seconds) {
    const double until = clock_seconds() + seconds;
    for (;;) {
        take_targets(s);
        const double left = until - clock_seconds();
        if ((s->has_target && s->target.answers == s->sequence) || left <= 0) {
            return left > 0;
        }
        udp_wait(s->def->udp, left);
    }
}

/* In lockstep: a state for this policy period, and its answer. One that is lost has none. */
static void exchange(Simulated *s) {
    if (!send_state(s)) {
        wait_for_answer(s, TASK_PERIOD);
    } else if (!s->silent && !wait_for_answer(s, s->def->patience)) {
        s->silent = 1;
    } else {
        take_targets(s);
    }
}

static void wait_until(Simulated *s, double when) {
    do {
        take_targets(s);
        udp_wait(s->def->udp, when - clock_seconds());
    } while (clock_seconds() < when);
    take_targets(s);
}

/* ---- the robot ---- */

/* Torques of the joints' PD on the newest target; without one for a while, kp is 0. */
static void set_torques(Simulated *s, double *torque) {
    const Robot *robot = s->def->robot;
    const double *q = robot_sim_qpos(s->sim) + 7, *qd = robot_sim_qvel(s->sim) + 6;
    const int silent = s->silent || s->time - s->target_time > SILENCE;
    for (int i = 0; i < s->joints; i++) {
        const double most = task_env_rest(s->env)->gains.limit[i];
        const TaskMotor motor = {.target = {(double)s->target.angle[i]},
                                 .kp = silent ? 0 : (double)s->target.kp[i],
                                 .kd = (double)s->target.kd[i],
                                 .limit = fmin(fabs((double)s->target.limit[i]), most),
                                 .fastest = robot_speed(robot)[i],
                                 .full = robot_table(robot)->full_speed[i]};
        torque[i] = task_torque(&motor, 0, q[i], qd[i]);
    }
    if (silent || s->target.mode >= PACKET_damp) {
        s->report->damped += robot_sim_dt(s->sim);
    }
}

static int has_fallen(const Simulated *s) {
    return robot_sim_base_rotation(s->sim)[8] < cos(s->def->task->tilt_limit) ||
           robot_sim_base_clearance(s->sim, task_env_terrain(s->env)) < 0;
}

/* Stands in its start until the runner answers. */
static MildStatus wait_for_runner(Simulated *s, MildError *error) {
    const double until = clock_seconds() + s->def->patience;
    while (!s->has_target || s->target.mode == PACKET_wait) {
        if (clock_seconds() > until) {
            char text[32];
            return mild_fail(error, MILD_ERROR_IO,
                             "no answer from %s for %g s; start mild drive there",
                             udp_text(&s->def->udp->peer, text), s->def->patience);
        }
        const StatePacket state = make_state(s, PACKET_walk);
        uint8_t bytes[PACKET_MAX];
        udp_send(s->def->udp, bytes, packet_write_state(&state, &s->format, bytes));
        wait_for_answer(s, RESEND);
    }
    return MILD_OK;
}

static void walk(Simulated *s) {
    const SimulatedDef *def = s->def;
    const double dt = robot_sim_dt(s->sim), start = clock_seconds();
    const long steps = (long)(def->seconds / dt + 0.5);
    const int per = (int)(TASK_PERIOD / dt + 0.5);
    double torque[ROBOT_JOINTS_MAX];
    s->report->end = "time";
    for (long k = 0; k < steps; k++) {
        if (def->lockstep && k % per == 0) {
            exchange(s);
        } else if (!def->lockstep) {
            send_state(s);
            wait_until(s, start + (double)k * dt);
        }
        set_torques(s, torque);
        const int diverged =
            robot_sim_step(s->sim, torque, NULL, task_env_terrain(s->env), task_env_ground(s->env));
        s->time += dt;
        if (diverged || has_fallen(s) || s->target.mode == PACKET_end) {
            s->report->fallen = diverged || has_fallen(s);
            s->report->end = diverged ? "diverged" : s->report->fallen ? "fallen" : "runner";
            break;
        }
    }
    const double real = clock_seconds() - start;
    s->report->seconds = dt * floor(s->time / dt + 0.5);
    s->report->rate = real > 0 ? s->time / real : 0;
    s->report->way[0] = robot_sim_qpos(s->sim)[0];
    s->report->way[1] = robot_sim_qpos(s->sim)[1];
}

static void say_end(Simulated *s) {
    uint8_t bytes[PACKET_MAX];
    for (int i = 0; i < END_PACKETS; i++) {
        const StatePacket state = make_state(s, PACKET_end);
        udp_send(s->def->udp, bytes, packet_write_state(&state, &s->format, bytes));
    }
}

MildStatus simulated_run(const SimulatedDef *def, SimulatedReport *report, MildError *error) {
    const EnvsView none = {0};
    Simulated *s = calloc(1, sizeof *s);
    TaskEnv *env = aligned_alloc(64, task_env_bytes(def->task, def->robot));
    RobotSim *sim = robot_sim_create(def->robot, def->task->physics_dt, error);
    memset(report, 0, sizeof *report);
    MildStatus status = s && env && sim ? MILD_OK : MILD_ERROR_MEMORY;
    if (status != MILD_OK) {
        mild_fail(error, status, "out of memory for a simulated robot");
    } else {
        *s = (Simulated){.def = def,
                         .report = report,
                         .env = env,
                         .sim = sim,
                         .joints = robot_joints(def->robot),
                         .format = {robot_joints(def->robot), packet_robot(def->robot), def->key}};
        task_env_init(env, def->task, def->robot, def->seed, 0);
        env->command_frozen = 1;
        task_env_reset_on(env, def->task, def->robot, sim, def->terrain, def->rigid, &none);
        task_env_rest(env)->terrain.map = def->task->map;
        robot_sim_set_solver(sim, (MildSolver)def->task->solver, def->task->contact_tolerance,
                             def->task->contact_iterations);
        status = wait_for_runner(s, error);
    }
    if (status == MILD_OK) {
        walk(s);
        say_end(s);
    }
    robot_sim_destroy(sim);
    free(env);
    free(s);
    return status;
}
