#include "app/context.h"

#include "run/config/experiment_keys.h"

Context context_default(void) {
    return (Context){.terrain = terrain_def_default(), .train = train_def_default()};
}

int context_has_policy(const Context *c) {
    return !c->without_policy &&
           (!c->controller || controller_has(c->controller, CONTROLLER_POLICY));
}

/* The task: from config and policy, and from the overrides if no ground reads them. */
static MildStatus open_task(Context *c, const CliArgs *args, MildError *error) {
    const ConfigSection section = {"task", task_fields, task_field_count, &c->task};
    const char *policy = context_has_policy(c) ? c->policy : NULL;
    MildStatus status =
        experiment_task(&c->task, c->randomized, c->named, c->config, policy, error);
    return status == MILD_OK && !c->on_ground
               ? config_overrides(&section, 1, args->overrides, args->override_count, error)
               : status;
}

MildStatus context_open(Context *c, const CliArgs *args, MildError *error) {
    int model;
    if (!c->policy && !c->without_policy) {
        c->policy = robot_policy(c->robot_name, c->shipped);
    } else if (c->policy) {
        c->policy = path_given(c->policy, c->shipped);
    }
    MildStatus status = open_task(c, args, error);
    if (status == MILD_OK && c->controller) {
        status = controller_check(c->controller, error);
    }
    if (status == MILD_OK && c->on_ground) {
        status = grounds_model(c->model, args, &model, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    c->robot = robots_open(c->robot_name, c->named, error);
    if (!c->robot) {
        return error->status;
    }
    if (c->on_ground) {
        c->grounds = grounds_for_robot(model, c->robot, &c->task, &c->terrain, args);
        c->grounds.train = c->machine ? &c->train : NULL;
        return MILD_OK;
    }
    status = task_def_check_robot(&c->task, c->robot, error);
    return status == MILD_OK ? task_set_robot(&c->task, c->robot, error) : status;
}

MildStatus context_scene(Context *c, const char *name, double patch, Scene *scene,
                         MildError *error) {
    mild_map_destroy(c->map);
    c->map = NULL;
    c->task.map = NULL;
    MildStatus status = scene_make(scene, name, patch, error);
    if (status == MILD_OK) {
        status = grounds_finish_scene(&c->grounds, scene, error);
        robot_set_shells(c->robot, c->task.shells_stand);
    }
    if (status == MILD_OK) {
        status = task_def_check(&c->task, error); /* its actuator is opened later */
    }
    if (status == MILD_OK) {
        status = task_set_robot(&c->task, c->robot, error);
    }
    return status == MILD_OK ? grounds_lay_map(&c->grounds, scene, &c->map, error) : status;
}

MildStatus context_move(Context *c, int rows, MildError *error) {
    const ControllerDef def = {c->policy, &c->task, c->robot, c->pool, rows};
    MildStatus status = actuator_open(&c->task, c->robot, &c->actuator, error);
    return status == MILD_OK ? controller_make(c->controller, &def, &c->mover, error) : status;
}

void context_close(Context *c) {
    controller_destroy(&c->mover);
    actuator_destroy(c->actuator);
    mild_map_destroy(c->map);
    robot_destroy(c->robot);
    pool_destroy(c->pool);
}

/* ---- options ---- */

CliOption context_policy(Context *c, const char *help) {
    return (CliOption){"policy", CLI_INPUT, &c->policy, 0, 0, "FILE", help};
}

CliOption context_robot(Context *c) {
    return (CliOption){"robot",
                       CLI_TEXT,
                       &c->robot_name,
                       0,
                       0,
                       "NAME|DIR",
                       ROBOTS_HELP " (default: the config's, the policy's, or sa01)"};
}

CliOption context_controller(Context *c) {
    return (CliOption){"controller",
                       CLI_TEXT,
                       &c->controller,
                       0,
                       0,
                       "NAME",
                       robots_controller_help(c->controller_help, sizeof c->controller_help)};
}

CliOption context_config(Context *c) {
    return (CliOption){"config",
                       CLI_INPUT,
                       &c->config,
                       0,
                       0,
                       "FILE",
                       "config whose section [task] goes before what the policy's file says, such "
                       "as that of its training"};
}

CliOption context_model(Context *c) {
    return (CliOption){"model",
                       CLI_TEXT,
                       &c->model,
                       0,
                       0,
                       "NAME",
                       grounds_model_help(c->model_help, sizeof c->model_help)};
}
