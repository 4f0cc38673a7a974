#include "view/view.h"

#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "view/model.h"
#include "view/relief.h"
#include "view/view_parts.h"

#define VIEW_OVERLAP 1.0015F   /* [-] scale of a tile, which prevents gaps between tiles */
#define VIEW_FINE 64           /* most tiles with imprints at once */
#define VIEW_PLAIN 96          /* most tiles without imprints but of mixed material */
#define VIEW_PLAIN_UNEVEN 192  /* the same on uneven ground, where every tile has a shape */
#define VIEW_RADIUS 9.0        /* [m] tiles farther from the robot are drawn as plain floor */
#define VIEW_RADIUS_UNEVEN 4.0 /* [m] the same on uneven ground */
#define VIEW_FLOOR 40.0        /* [m] half the size of the surrounding floor */
#define VIEW_GEOMS 4000
#define VIEW_GEOMS_OTHER 128         /* of a robot */
#define VIEW_OTHERS_FINE 224         /* VIEW_FINE with others */
#define VIEW_OTHERS_PRESSING 60      /* others that leave imprints */
#define VIEW_CAMERA_TIME 0.45        /* [s] time constant of the camera */
#define VIEW_LOOK_HEIGHT 0.6         /* [-] the camera looks at this share of the robot's height */
#define VIEW_CLOSE_TIME 0.25         /* [s] the same for the close-up of the feet */
#define VIEW_CLOSE_HEIGHT 0.04       /* [m] */
#define VIEW_CLOSE_TURN 22.0         /* [deg] azimuth relative to the main camera */
#define VIEW_CLOSE_ELEVATION (-22.0) /* [deg] */
#define VIEW_CLOSE_DISTANCE 0.80     /* [m] */
#define VIEW_LABEL 24                /* [pixels] height of a label */
#define VIEW_FORCE_SEEN 15.0         /* [N] smaller contact forces get no arrow */

/* A surface of the model, lent to a tile that is not plain: a skin, because a skin has smooth
 * normals and goes to the graphics card without a new display list. */
typedef struct {
    int tile; /* -1: free */
    int step; /* [vertices] between the vertices of the skin */
    int skin, texture, material;
    int drawn_once; /* bool: texture and vertices are those of `tile` */
    int frame;      /* in which it was lent last */
} Slot;

struct View {
    ViewDef def;
    const Robot *robot;
    int feet;
    int bodies; /* that stand on the ground: feet, then those with shells */
    const MildSole *const *soles,
        *const *rasters; /* what the feet have; their shape, for the prints */
    MildTerrain terrain;
    GlContext *gl;
    Window *window;
    mjModel *model;
    mjData *data;
    mjvScene scene;
    mjrContext context;
    mjvOption option;
    mjvCamera camera, close; /* close: on the feet */
    int scene_made, context_made;
    Follow base, foothold; /* what the two cameras look at */
    double time;           /* [s] of the last frame */
    int jumped;            /* bool: the cameras jump to the robot in the next frame */
    Relief *relief;
    Facet *facets;                                    /* of shells in the ground */
    Slot slots[VIEW_PLAIN_UNEVEN + VIEW_OTHERS_FINE]; /* first those without imprints */
    int frame;                                        /* number of the present one */
    int plain_count, slot_count;
    int *slot_of;                              /* [tiles] -1: none */
    int flat_material[MILD_MATERIALS_MAX + 1]; /* model material of untouched ground; last: rigid */
    int floor_material;
    InsetLayout layout;
    unsigned char *inset, *pixels;
    unsigned char *scene_pixels, *labelled, *luma; /* of smooth_picture and paste_labels */
};

ViewDef view_def_default(void) {
    return (ViewDef){.width = 960,
                     .height = 540,
                     .rate = 25,
                     .x_min = -2,
                     .x_max = 8,
                     .y_min = -2,
                     .y_max = 2,
                     .cell = 0.01,
                     .pressure_max = 40e3,
                     .force_arrow = 0.0012,
                     .closeup = 1,
                     .azimuth = 128,
                     .elevation = -20,
                     .distance = 2.35};
}

static unsigned char *texture_pixels(mjModel *model, int texture) {
    return model->tex_data + model->tex_adr[texture];
}

/* Finds the ids of what view_model added and hides the floor of the file. */
static void index_model(View *view) {
    mjModel *model = view->model;
    char name[32];
    for (int i = 0; i < view->slot_count; i++) {
        snprintf(name, sizeof name, "view_tile_%d", i);
        view->slots[i] = (Slot){-1,
                                i < view->plain_count ? VIEW_COARSE : 1,
                                mj_name2id(model, mjOBJ_SKIN, name),
                                mj_name2id(model, mjOBJ_TEXTURE, name),
                                mj_name2id(model, mjOBJ_MATERIAL, name),
                                0,
                                -1};
    }
    for (int m = 0; m <= MILD_MATERIALS_MAX; m++) {
        snprintf(name, sizeof name, "view_flat_%d", m);
        view->flat_material[m] = mj_name2id(model, mjOBJ_MATERIAL, name);
        int id = m == MILD_MATERIALS_MAX ? RELIEF_RIGID : m;
        if (id == RELIEF_RIGID || m < view->terrain.material_count) {
            relief_flat_pixels(view->relief, id,
                               texture_pixels(model, mj_name2id(model, mjOBJ_TEXTURE, name)));
        }
    }
    view->floor_material = mj_name2id(model, mjOBJ_MATERIAL, "view_floor");
    relief_flat_pixels(view->relief, RELIEF_RIGID,
                       texture_pixels(model, mj_name2id(model, mjOBJ_TEXTURE, "view_floor")));
    for (int g = 0; g < model->ngeom; g++) {
        if (model->geom_type[g] == mjGEOM_PLANE || model->geom_type[g] == mjGEOM_HFIELD) {
            model->geom_group[g] = LOOK_HIDDEN_GROUP;
        }
    }
}

/* ---- create, destroy ---- */

static int open_context(View *view, MildError *error) {
    if (view->def.window) {
        return (view->window = window_create(view->def.width, view->def.height, "mild", error)) !=
               NULL;
    }
    return (view->gl = gl_create(error)) != NULL;
}

/* Robots whose feet press the ground. */
static int pressing(const View *view) {
    const int others = view->def.others;
    return 1 + (others < VIEW_OTHERS_PRESSING ? others : VIEW_OTHERS_PRESSING);
}

static Relief *make_relief(const View *view, MildError *error) {
    const ViewDef *def = &view->def;
    ReliefDef relief = {def->x_min, def->x_max, def->y_min, def->y_max,
                        def->cell,  def->rigid, def->names, pressing(view)};
    return relief_create(&relief, &view->terrain, view->rasters, view->feet, error);
}

static Facet *make_facets(const View *view) {
    size_t elements = 1;
    for (int b = view->feet; b < view->bodies; b++) {
        elements += (size_t)mild_sole_elements(view->soles[b]);
    }
    return malloc(elements * sizeof(Facet));
}

static int make_buffers(View *view) {
    int tiles = relief_tile_columns(view->relief) * relief_tile_rows(view->relief);
    view->slot_of = malloc((size_t)tiles * sizeof *view->slot_of);
    view->layout = inset_layout(view->soles, view->feet, view->def.height / 72);
    size_t frame = (size_t)view->def.width * (size_t)view->def.height * 3;
    view->inset = malloc((size_t)view->layout.width * (size_t)view->layout.height * 3);
    view->pixels = malloc(frame);
    view->scene_pixels = malloc(frame);
    view->labelled = malloc(frame);
    view->luma = malloc(frame / 3 + (size_t)view->def.width);
    view->facets = make_facets(view);
    view->data = mj_makeData(view->model);
    if (!view->slot_of || !view->inset || !view->pixels || !view->scene_pixels || !view->labelled ||
        !view->luma || !view->facets || !view->data) {
        return 0;
    }
    for (int t = 0; t < tiles; t++) {
        view->slot_of[t] = -1;
    }
    return 1;
}

static void make_scene(View *view) {
    mjv_defaultScene(&view->scene);
    mjv_makeScene(view->model, &view->scene,
                  VIEW_GEOMS + view->def.others * (VIEW_GEOMS_OTHER + 1));
    view->scene_made = 1;
    mjv_defaultOption(&view->option);
    view->option.flags[mjVIS_SKIN] = 0; /* the only skins are the tiles, which draw_tile draws */
    mjr_defaultContext(&view->context);
    mjr_makeContext(view->model, &view->context,
                    view->def.height >= 700 ? mjFONTSCALE_150 : mjFONTSCALE_100);
    view->context_made = 1;
    mjr_setBuffer(view->window ? mjFB_WINDOW : mjFB_OFFSCREEN, &view->context);
    mjv_defaultCamera(&view->camera);
    view->camera.azimuth = view->def.azimuth;
    view->camera.elevation = view->def.elevation;
    view->camera.distance = view->def.distance;
    mjv_defaultCamera(&view->close);
    view->close.elevation = VIEW_CLOSE_ELEVATION;
    view->close.distance = VIEW_CLOSE_DISTANCE;
    view->jumped = 1;
}

View *view_create(const ViewDef *def, const Robot *robot, const MildTerrain *terrain,
                  MildError *error) {
    if (def->width < 64 || def->height < 64 || def->width > 7680 || def->height > 4320 ||
        !(def->rate > 0)) {
        mild_fail(error, MILD_ERROR_RANGE,
                  "view: %d x %d pixels at %g frames/s is outside 64..7680 x 64..4320", def->width,
                  def->height, def->rate);
        return NULL;
    }
    View *view = calloc(1, sizeof *view);
    if (!view) {
        mild_fail(error, MILD_ERROR_MEMORY, "view: out of memory");
        return NULL;
    }
    view->def = *def;
    view->robot = robot;
    view->feet = robot_feet(robot);
    view->bodies = robot_bodies(robot);
    view->soles = robot_soles(robot);
    view->rasters = robot_rasters(robot);
    view->terrain = *terrain;
    view->relief = make_relief(view, error);
    view->plain_count =
        view->relief && relief_is_uneven(view->relief) ? VIEW_PLAIN_UNEVEN : VIEW_PLAIN;
    view->slot_count = view->plain_count + (def->others > 0 ? VIEW_OTHERS_FINE : VIEW_FINE);
    const Surfaces surfaces = {view->plain_count, view->slot_count};
    const int size[2] = {def->width, def->height};
    char path[PATH_SIZE];
    const char *xml = robot_model_path(robot),
               *look = def->others > 0 ? NULL : look_path(xml, path);
    view->model = view->relief ? view_model(xml, look, size, view->relief, &surfaces, error) : NULL;
    if (view->model && def->others > 0) {
        sight_widen(view->model);
    }
    if (!view->model || !open_context(view, error)) {
        view_destroy(view);
        return NULL;
    }
    if (!make_buffers(view)) {
        mild_fail(error, MILD_ERROR_MEMORY, "view: out of memory");
        view_destroy(view);
        return NULL;
    }
    index_model(view);
    make_scene(view);
    return view;
}

void view_destroy(View *view) {
    if (!view) {
        return;
    }
    if (view->context_made) {
        mjr_freeContext(&view->context);
    }
    if (view->scene_made) {
        mjv_freeScene(&view->scene);
    }
    gl_destroy(view->gl);
    window_destroy(view->window);
    if (view->data) {
        mj_deleteData(view->data);
    }
    if (view->model) {
        mj_deleteModel(view->model);
    }
    relief_destroy(view->relief);
    free(view->slot_of);
    free(view->inset);
    free(view->pixels);
    free(view->scene_pixels);
    free(view->labelled);
    free(view->luma);
    free(view->facets);
    free(view);
}

MildStatus view_reset(View *view, const MildTerrain *terrain, MildError *error) {
    view->terrain = *terrain;
    Relief *relief = make_relief(view, error);
    if (!relief) {
        return error ? error->status : MILD_ERROR_MEMORY;
    }
    relief_destroy(view->relief);
    view->relief = relief;
    for (int i = 0; i < view->slot_count; i++) {
        if (view->slots[i].tile >= 0) {
            view->slot_of[view->slots[i].tile] = -1;
        }
        view->slots[i].tile = -1;
    }
    view->jumped = 1;
    return MILD_OK;
}

/* ---- ground ---- */

static void press_shells(View *view, const RobotSim *sim) {
    const MildContactInput *input = robot_sim_contact_input(sim);
    int count = 0;
    for (int b = view->feet; b < view->bodies; b++) {
        if (robot_sim_contact(sim)->foot[b].contacts > 0) {
            const MildElements elements = mild_scratch_elements(robot_sim_scratch(sim), b);
            count += facets_of(view->soles[b], input->rotation[b], &elements, view->facets + count);
        }
    }
    relief_press_facets(view->relief, view->facets, count);
}

void view_observe(View *view, const RobotSim *sim) {
    double position[ROBOT_FEET_MAX][3], rotation[ROBOT_FEET_MAX][9];
    for (int f = 0; f < view->feet; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        memcpy(position[f], foot->position, sizeof position[f]);
        memcpy(rotation[f], foot->rotation, sizeof rotation[f]);
    }
    relief_press(view->relief, 0, (const double(*)[3])position, (const double(*)[9])rotation);
    press_shells(view, sim);
}

static void press_others(View *view, const ViewOther *others) {
    for (int i = 0; i < pressing(view) - 1; i++) {
        double position[ROBOT_FEET_MAX][3];
        memcpy(position, others[i].position, sizeof position);
        for (int f = 0; f < view->feet; f++) {
            position[f][0] += others[i].place[0];
            position[f][1] += others[i].place[1];
        }
        relief_press(view->relief, i + 1, (const double(*)[3])position, others[i].rotation);
    }
}

static double tile_distance(const View *view, int tile) {
    double center[2];
    relief_tile_center(view->relief, tile, center);
    return hypot(center[0] - view->camera.lookat[0], center[1] - view->camera.lookat[1]);
}

static void slot_free(View *view, Slot *slot) {
    if (slot->tile >= 0) {
        view->slot_of[slot->tile] = -1;
    }
    slot->tile = -1;
}

/* A slot for the tile: a free one, otherwise that of the tile farthest away, whose heights remain
 * in the relief. */
static Slot *slot_take(View *view, int tile, int fine) {
    Slot *best = NULL;
    double farthest = tile_distance(view, tile);
    int end = fine ? view->slot_count : view->plain_count;
    for (int i = fine ? view->plain_count : 0; i < end; i++) {
        Slot *slot = &view->slots[i];
        if (slot->tile < 0) {
            best = slot;
            break;
        }
        if (slot->frame != view->frame && tile_distance(view, slot->tile) > farthest) {
            best = slot;
            farthest = tile_distance(view, slot->tile);
        }
    }
    if (!best) {
        return NULL;
    }
    slot_free(view, best);
    best->tile = tile;
    best->drawn_once = 0;
    view->slot_of[tile] = (int)(best - view->slots);
    return best;
}

/* The slot of a tile. A tile changes to another when it gets its first imprint or loses its last.
 */
static Slot *slot_for(View *view, int tile, int fine) {
    int at = view->slot_of[tile];
    if (at >= 0 && (view->slots[at].step == 1) == fine) {
        return &view->slots[at];
    }
    if (at >= 0) {
        slot_free(view, &view->slots[at]);
    }
    return slot_take(view, tile, fine);
}

static void slot_refresh(View *view, Slot *slot) {
    mjModel *model = view->model;
    if (!relief_tile_take_dirty(view->relief, slot->tile) && slot->drawn_once) {
        return;
    }
    relief_tile_pixels(view->relief, slot->tile, texture_pixels(model, slot->texture));
    mjr_uploadTexture(model, &view->context, slot->texture);
    double center[2];
    relief_tile_center(view->relief, slot->tile, center);
    float *vertex = view->scene.skinvert + 3 * view->scene.skinvertadr[slot->skin];
    relief_tile_surface(view->relief, slot->tile, slot->step, vertex,
                        view->scene.skinnormal + 3 * view->scene.skinvertadr[slot->skin]);
    for (int v = 0; v < view->scene.skinvertnum[slot->skin]; v++) {
        for (int k = 0; k < 2; k++) {
            float middle = (float)center[k];
            vertex[3 * v + k] = middle + VIEW_OVERLAP * (vertex[3 * v + k] - middle);
        }
    }
    slot->drawn_once = 1;
}

static mjvGeom *add_geom(View *view, int type, double sx, double sy, double sz,
                         const double position[3], int material) {
    if (view->scene.ngeom >= view->scene.maxgeom) {
        return NULL;
    }
    mjvGeom *geom = &view->scene.geoms[view->scene.ngeom++];
    const float white[4] = {1, 1, 1, 1};
    const double size[3] = {sx, sy, sz};
    mjv_initGeom(geom, type, size, position, NULL, white);
    geom->matid = material;
    geom->category = mjCAT_DECOR; /* casts no shadow; as a caster the ground fills the shadow map */
    geom->specular = 0.05F;
    geom->shininess = 0.1F;
    return geom;
}

static void draw_tile(View *view, int tile) {
    double edge = relief_tile_edge(view->relief), center[2];
    relief_tile_center(view->relief, tile, center);
    double position[3] = {center[0], center[1],
                          relief_height_at(view->relief, center[0], center[1])};
    int material = relief_tile_material(view->relief, tile);
    int pressed = relief_tile_pressed(view->relief, tile);
    int shaped = pressed || relief_is_uneven(view->relief);
    Slot *slot = NULL;
    if (shaped || material == -2) {
        slot = slot_for(view, tile, pressed);
        if (slot) {
            slot->frame = view->frame;
            slot_refresh(view, slot);
        }
    } else if (view->slot_of[tile] >= 0) {
        slot_free(view, &view->slots[view->slot_of[tile]]);
    }
    if (slot && shaped) {
        position[0] = position[1] = position[2] = 0; /* a skin has world coordinates */
        mjvGeom *geom = add_geom(view, mjGEOM_SKIN, 1, 1, 1, position, slot->material);
        if (geom) {
            geom->objid = slot->skin;
            geom->texcoord = 1;
        }
        return;
    }
    const int at = mild_terrain_material_at(&view->terrain, center[0], center[1]);
    int look = material == RELIEF_RIGID ? MILD_MATERIALS_MAX : material < 0 ? at : material;
    add_geom(view, mjGEOM_PLANE, 0.5 * edge, 0.5 * edge, 0.1, position,
             slot ? slot->material : view->flat_material[look]);
}

/* Only the skins up to the last slot in use go to the graphics card. */
static void count_skins(View *view) {
    view->scene.nskin = 0;
    for (int i = 0; i < view->slot_count; i++) {
        if (view->slots[i].tile >= 0 && view->slots[i].skin >= view->scene.nskin) {
            view->scene.nskin = view->slots[i].skin + 1;
        }
    }
}

/* Draws the floor as four plates around the tiles. It must not lie under them, because it would
 * cover the imprints. */
static void draw_floor(View *view, double x0, double x1, double y0, double y1) {
    double z = relief_low(view->relief), far = VIEW_FLOOR, cx = 0.5 * (x0 + x1),
           cy = 0.5 * (y0 + y1);
    double left[3] = {x0 - far, cy, z}, right[3] = {x1 + far, cy, z}, below[3] = {cx, y0 - far, z},
           above[3] = {cx, y1 + far, z};
    double wide = 0.5 * (x1 - x0) + 2 * far, high = 0.5 * (y1 - y0);
    add_geom(view, mjGEOM_PLANE, far, high, 1, left, view->floor_material);
    add_geom(view, mjGEOM_PLANE, far, high, 1, right, view->floor_material);
    add_geom(view, mjGEOM_PLANE, wide, far, 1, below, view->floor_material);
    add_geom(view, mjGEOM_PLANE, wide, far, 1, above, view->floor_material);
}

static int clamp_tile(double at, int count) {
    return at < 0 ? 0 : at > count ? count : (int)at;
}

static void draw_ground(View *view) {
    view->frame++;
    const Relief *relief = view->relief;
    int columns = relief_tile_columns(relief), rows = relief_tile_rows(relief);
    double edge = relief_tile_edge(relief), origin[2],
           radius = view->def.others > 0       ? SIGHT_FAR
                    : relief_is_uneven(relief) ? VIEW_RADIUS_UNEVEN
                                               : VIEW_RADIUS;
    relief_tile_center(relief, 0, origin);
    origin[0] -= 0.5 * edge, origin[1] -= 0.5 * edge;
    const double *look = view->camera.lookat;
    int c0 = clamp_tile(floor((look[0] - radius - origin[0]) / edge), columns);
    int c1 = clamp_tile(ceil((look[0] + radius - origin[0]) / edge), columns);
    int r0 = clamp_tile(floor((look[1] - radius - origin[1]) / edge), rows);
    int r1 = clamp_tile(ceil((look[1] + radius - origin[1]) / edge), rows);
    for (int r = r0; r < r1; r++) {
        for (int c = c0; c < c1; c++) {
            draw_tile(view, r * columns + c);
        }
    }
    count_skins(view);
    draw_floor(view, origin[0] + c0 * edge, origin[0] + c1 * edge, origin[1] + r0 * edge,
               origin[1] + r1 * edge);
}

/* ---- frame ---- */

/* Moves the camera that looks at `follow` for the time since the last frame. */
static void follow_target(const View *view, Follow *follow, const double target[3], double time,
                          double lag, double look[3]) {
    if (view->jumped) {
        follow_jump(follow, target);
    } else {
        follow_step(follow, target, time - view->time, lag);
    }
    follow_position(follow, look);
}

static void follow_base(View *view, const double *base, double time) {
    double target[3] = {base[0], base[1],
                        relief_height_at(view->relief, base[0], base[1]) +
                            VIEW_LOOK_HEIGHT * robot_nominal_height(view->robot)};
    follow_target(view, &view->base, target, time, VIEW_CAMERA_TIME, view->camera.lookat);
}

/* [m] Horizontal middle of the soles. */
static void feet_middle(const View *view, const RobotSim *sim, double middle[2]) {
    middle[0] = middle[1] = 0;
    for (int f = 0; f < view->feet; f++) {
        middle[0] += robot_sim_foot(sim, f)->sole_center[0] / view->feet;
        middle[1] += robot_sim_foot(sim, f)->sole_center[1] / view->feet;
    }
}

static void follow_feet(View *view, const RobotSim *sim, double time) {
    double target[3] = {0};
    feet_middle(view, sim, target);
    target[2] = relief_height_at(view->relief, target[0], target[1]) + VIEW_CLOSE_HEIGHT;
    follow_target(view, &view->foothold, target, time, VIEW_CLOSE_TIME, view->close.lookat);
}

static void draw_arrows(View *view, const RobotSim *sim) {
    for (int f = 0; f < view->feet && view->def.force_arrow > 0; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        double size = mju_norm3(foot->force);
        if (size < VIEW_FORCE_SEEN || view->scene.ngeom >= view->scene.maxgeom) {
            continue;
        }
        double from[3], to[3];
        mju_copy3(from, foot->sole_center);
        if (foot->result.contacts >
            0) { /* the centre of pressure; the engine's own contact reports none */
            from[0] = foot->position[0] + foot->result.zmp_sole[0];
            from[1] = foot->position[1] + foot->result.zmp_sole[1];
        }
        mju_addScl3(to, from, foot->force, view->def.force_arrow);
        mjvGeom *geom = &view->scene.geoms[view->scene.ngeom++];
        const float color[4] = {0.95F, 0.25F, 0.12F, 0.85F};
        mjv_initGeom(geom, mjGEOM_ARROW, NULL, NULL, NULL, color);
        mjv_connector(geom, mjGEOM_ARROW, 0.012, from, to);
        geom->category = mjCAT_DECOR;
    }
}

static const char *ground_name(const View *view, const RobotSim *sim) {
    if (view->def.rigid) {
        return "rigid";
    }
    double middle[2];
    feet_middle(view, sim, middle);
    int m = mild_terrain_material_at(&view->terrain, middle[0], middle[1]);
    return view->def.names && view->def.names[m] ? view->def.names[m] : "ground";
}

static void draw_text(View *view, mjrRect viewport, const RobotSim *sim, const ViewInfo *info) {
    const char *keys = info->fell ? "ground\ncommand\nspeed\ndeepest\ntime\n"
                                  : "ground\ncommand\nspeed\ndeepest\ntime";
    char values[240];
    char depths[80] = "";
    for (int f = 0; f < view->feet; f++) {
        size_t used = strlen(depths);
        snprintf(depths + used, sizeof depths - used, "%s%.0f", f ? "  " : "",
                 1e3 * fmax(0.0, -robot_sim_foot(sim, f)->sole_height));
    }
    snprintf(values, sizeof values, "%s\n%.2f m/s\n%.2f m/s\n%s mm\n%.1f s%s",
             ground_name(view, sim), info->command[0], info->speed, depths, info->time,
             info->fell ? "\nfell" : "");
    mjr_overlay(mjFONT_NORMAL, mjGRID_TOPLEFT, viewport, keys, values, &view->context);
}

static mjrRect inset_place(const View *view, mjrRect viewport) {
    return (mjrRect){viewport.width - view->layout.width - 10, 10, view->layout.width,
                     view->layout.height};
}

static void draw_inset(View *view, mjrRect viewport, const RobotSim *sim) {
    const double *normal[ROBOT_FEET_MAX];
    for (int f = 0; f < view->feet; f++) {
        normal[f] = mild_scratch_elements(robot_sim_scratch(sim), f).normal;
    }
    const InsetLayout *layout = &view->layout;
    inset_draw(layout, view->soles, view->feet, normal, view->def.pressure_max, view->inset);
    mjrRect box = inset_place(view, viewport);
    mjr_drawPixels(view->inset, NULL, box, &view->context);
    char text[32];
    mjrRect title = {box.left, box.bottom + layout->title_bottom, box.width, layout->title_height};
    mjr_label(title, mjFONT_NORMAL, "sole pressure, kPa", 0.12F, 0.13F, 0.15F, 1, 0.9F, 0.9F, 0.9F,
              &view->context);
    snprintf(text, sizeof text, "%.0f", view->def.pressure_max / 1e3);
    mjrRect label = {box.left + layout->bar_right, box.bottom + layout->bar_top - VIEW_LABEL,
                     layout->width - layout->bar_right, VIEW_LABEL};
    mjr_label(label, mjFONT_NORMAL, text, 0.12F, 0.13F, 0.15F, 1, 0.9F, 0.9F, 0.9F, &view->context);
    label.bottom = box.bottom + layout->bar_bottom;
    mjr_label(label, mjFONT_NORMAL, "0", 0.12F, 0.13F, 0.15F, 1, 0.9F, 0.9F, 0.9F, &view->context);
}

/* Moves the lights with the camera, because directional lights cast shadows only near their
 * position. */
static void move_lights(View *view) {
    for (int i = 0; i < view->scene.nlight; i++) {
        mjvLight *light = &view->scene.lights[i];
        if (light->headlight || light->type != mjLIGHT_DIRECTIONAL) {
            continue;
        }
        light->pos[0] += (float)view->camera.lookat[0];
        light->pos[1] += (float)view->camera.lookat[1];
        for (int k = 0; k < 3 && view->def.others > 0; k++) { /* nobody stands behind it */
            light->pos[k] -= 2 * (float)SIGHT_SHADOW * light->dir[k];
        }
    }
}

/* A close-up of the feet in the upper right corner, which shows how they sink. It has no shadows,
 * because a second shadow pass costs more than the rest of this small picture. */
static void draw_closeup(View *view, mjrRect viewport) {
    view->close.azimuth = view->camera.azimuth - VIEW_CLOSE_TURN;
    /* a third of the width, so that the robot in the middle is not covered */
    const int width = viewport.width / 3, height = viewport.height / 3;
    mjrRect box = {viewport.width - width - 10, viewport.height - height - 10, width, height};
    mjrRect frame = {box.left - 2, box.bottom - 2, box.width + 4, box.height + 4};
    mjr_rectangle(frame, 0.12F, 0.13F, 0.15F, 1);
    mjv_updateCamera(view->model, view->data, &view->close, &view->scene);
    view->scene.flags[mjRND_SHADOW] = 0;
    mjr_render(box, &view->scene, &view->context);
    view->scene.flags[mjRND_SHADOW] = 1;
}

/* Reads what was drawn and smooths it, before labels are drawn, whose letters must stay sharp. */
static void smooth_picture(View *view, mjrRect size) {
    mjr_readPixels(view->scene_pixels, NULL, size, &view->context);
    smooth_edges(view->scene_pixels, size.width, size.height, view->luma, view->labelled);
    smooth_flip(view->labelled, size.width, size.height, view->pixels);
}

/* What of the part lies in the picture, which may be smaller than the inset. */
static mjrRect part_inside(mjrRect size, mjrRect part) {
    const int left = part.left > 0 ? part.left : 0, bottom = part.bottom > 0 ? part.bottom : 0;
    const int right = part.left + part.width, top = part.bottom + part.height;
    return (mjrRect){left, bottom, (right < size.width ? right : size.width) - left,
                     (top < size.height ? top : size.height) - bottom};
}

/* Copies the pixels of a part of the picture that the labels changed. */
static void paste_labels(View *view, mjrRect size, mjrRect whole) {
    const mjrRect part = part_inside(size, whole);
    const size_t width = (size_t)size.width * 3, row = (size_t)part.width * 3;
    mjr_readPixels(view->labelled, NULL, part, &view->context);
    for (int r = 0; r < part.height; r++) {
        int y = part.bottom + r;
        size_t left = 3 * (size_t)part.left;
        const unsigned char *now = view->labelled + (size_t)r * row,
                            *before = view->scene_pixels + (size_t)y * width + left;
        unsigned char *to = view->pixels + (size_t)(size.height - 1 - y) * width + left;
        for (size_t i = 0; i < row; i++) {
            to[i] = now[i] != before[i] ? now[i] : to[i];
        }
    }
}

static void pose_robot(View *view, const double *qpos) {
    robot_engine_qpos(view->robot, qpos, view->data->qpos);
    mj_kinematics(view->model, view->data);
    mj_comPos(view->model, view->data);
    mj_camlight(view->model, view->data);
}

/* ---- others ---- */

static void draw_others(View *view, const ViewOther *others) {
    const Sight sight = sight_of(&view->scene, view->def.width, view->def.height);
    mjtNum qpos[ROBOT_NQ_MAX];
    for (int i = 0; i < view->def.others; i++) {
        memcpy(qpos, others[i].qpos, sizeof qpos);
        qpos[0] += others[i].place[0];
        qpos[1] += others[i].place[1];
        const double far = sight_distance(&sight, qpos), *middle = view->camera.lookat;
        const int first = view->scene.ngeom;
        const int shaded = hypot(qpos[0] - middle[0], qpos[1] - middle[1]) < SIGHT_SHADOW;
        if (far < 0) {
            continue;
        }
        pose_robot(view, qpos);
        mjv_addGeoms(view->model, view->data, &view->option, NULL, mjCAT_ALL, &view->scene);
        sight_thin_out(&view->scene, first, far, sight.pixels, shaded);
        if (!shaded) {
            const double under = relief_height_at(view->relief, qpos[0], qpos[1]);
            sight_draw_spot(&view->scene, qpos, under);
        }
    }
}

/* A crane: slow at both ends, and as many times as far in each second. */
static void move_away(View *view, double away) {
    const ViewDef *def = &view->def;
    const double share = away * away * (3 - 2 * away);
    view->camera.elevation = def->elevation + share * (def->away_elevation - def->elevation);
    view->camera.distance = def->distance * pow(def->away_distance / def->distance, share);
    const double gone = view->camera.distance - def->distance;
    for (int k = 0; k < 2; k++) {
        view->camera.lookat[k] += gone / (def->away_distance - def->distance) * def->away_aside[k];
    }
}

static void draw_labels(View *view, mjrRect viewport, const RobotSim *sim, const ViewInfo *info) {
    draw_text(view, viewport, sim, info);
    if (info->note) {
        mjr_overlay(mjFONT_NORMAL, mjGRID_BOTTOMLEFT, viewport, info->note, NULL, &view->context);
    }
    if (!view->def.rigid) {
        draw_inset(view, viewport, sim);
    }
}

void view_frame(View *view, const RobotSim *sim, const ViewInfo *info) {
    pose_robot(view, robot_sim_qpos(sim));
    view_observe(view, sim);
    follow_base(view, robot_sim_qpos(sim), info->time);
    follow_feet(view, sim, info->time);
    press_others(view, info->others);
    if (info->away > 0) {
        move_away(view, info->away);
    }
    view->time = info->time;
    view->jumped = 0;
    mjv_updateScene(view->model, view->data, &view->option, NULL, &view->camera, mjCAT_ALL,
                    &view->scene);
    move_lights(view);
    draw_ground(view);
    draw_arrows(view, sim);
    draw_others(view, info->others);

    mjrRect viewport = {0, 0, view->def.width, view->def.height};
    if (view->window) {
        window_size(view->window, &viewport.width, &viewport.height);
    }
    mjr_render(viewport, &view->scene, &view->context);
    if (view->def.closeup) {
        draw_closeup(view, viewport);
    }
    if (view->window) {
        draw_labels(view, viewport, sim, info);
        return;
    }
    smooth_picture(view, viewport);
    draw_labels(view, viewport, sim, info);
    mjrRect text = {0, viewport.height / 2, viewport.width / 2, viewport.height / 2};
    paste_labels(view, viewport, text);
    if (info->note) {
        text.bottom = 0;
        paste_labels(view, viewport, text);
    }
    if (!view->def.rigid) {
        paste_labels(view, viewport, inset_place(view, viewport));
    }
}

const unsigned char *view_pixels(const View *view) {
    return view->window ? NULL : view->pixels;
}

void view_show(View *view, WindowInput *input) {
    window_show(view->window, input);
    view->camera.azimuth += input->turn * 180.0 / mjPI;
    view->camera.elevation =
        fmin(fmax(view->camera.elevation + input->lift * 180.0 / mjPI, -89), -2);
    view->camera.distance = fmin(fmax(view->camera.distance * exp(-input->zoom), 0.5), 15);
}
