/* libmild: soft ground for legged robots. It computes the forces between rigid feet and foam,
 * rubber, grass or sand for each element of the soles. The coupling is two-way: the ground carries
 * the robot, and the robot deforms the ground.
 *
 * The engine owns the mass matrix M, the foot Jacobian J (6 rows per foot: twist at the ankle,
 * world axes), the generalised velocity qvel, the applied forces tau and the bias forces b. Its
 * step is
 *
 *     A      = J M^-1 J^T
 *     V_free = J (qvel + dt M^-1 (tau - b))
 *     mild_ground_solve(...)       impulses on the feet; does not change the ground
 *     tau   += J^T force           add the wrench of each foot, then integrate
 *     mild_ground_advance(...)     update the ground; once for each accepted step
 *
 * Units are SI and radians, and z points up. The reference point of a foot is its ankle.
 * Penetration u = h0 - z is positive below the surface h0. Forces on the foot are positive upward.
 * Equation numbers are those of the paper, as interpreted in docs/model.md.
 *
 * Thread safety: soles and maps never change and may be shared, and so may a terrain that nobody
 * writes to. A MildGround and a MildScratch belong to one thread at a time. There is no global
 * state.
 *
 * No function prints or exits. Functions allocate only if their description says that they return
 * NULL when out of memory. Pointers must not be NULL, except `error` and where stated. Functions
 * that can fail reject bad numbers; the others compute with them. */
#ifndef MILD_GROUND_H
#define MILD_GROUND_H

#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"
#include "mild/field.h"
#include "mild/map.h"

MILD_API_BEGIN

#define MILD_FEET_MAX 16      /* feet in one contact problem */
#define MILD_MATERIALS_MAX 12 /* materials in one terrain */
#define MILD_PATCHES_MAX 16   /* patches in one terrain */

/* ---- ground models: the paper's and its rivals behind one contract (docs/model.md, "Ground
 * models") ----
 * A model defines where the elements are (the raster of the sole, or one element in its middle, see
 * mild_sole_concentric) and what force a material gives on an element. Solvers, memory, friction,
 * drift and results are the same for all models. A model consists of a row of this list and one
 * in a file, src/ground/models/model_*.c. All else that names models is derived from these two. */
/* clang-format off */
#define MILD_MODEL_LIST(ROW)                                                                       \
    ROW(MILD, mild)                  /* a developing cone under every element (the paper) */       \
    ROW(CON_CONE, con_cone)          /* one developing cone under the whole sole */                \
    ROW(CON_SPRING, con_spring)      /* one yielding spring under the whole sole */                \
    ROW(ECC_SPRING, ecc_spring)      /* one yielding spring under every element */                 \
    ROW(ECC_QUASI, ecc_quasi)        /* resistive force theory in the plane of motion */           \
    ROW(ECC_QUASI_3D, ecc_quasi_3d)  /* resistive force theory in three dimensions */              \
    ROW(BEKKER, bekker)              /* pressure a power of the sinkage, shear grows with slip */  \
    ROW(HUNT_CROSSLEY, hunt_crossley) /* damped elastic contact, as most simulators have it */     \
    ROW(MILD_MERGED, mild_merged)    /* the cones of one sole merge into a heap */                 \
    ROW(RIGID, rigid)                /* must be last: the engine's own contact, has no material */
/* clang-format on */

/* A row's enumerator: MILD_MODEL_MILD and so on. */
#define MILD_MODEL_ID(id, name) MILD_MODEL_##id,
/* A model, in the list's order. */
typedef enum {
    MILD_MODEL_LIST(MILD_MODEL_ID) /* one for each row */
} MildModel;
#define MILD_MODELS (MILD_MODEL_RIGID + 1) /* number of models */

#define MILD_MODEL_FIELDS 20 /* most fields of the material that a model may read */
#define MILD_MODEL_PRESETS 8 /* most presets that a model may have */
#define MILD_MODEL_SCALED 4  /* most fields that mild_model_match may scale */

/* Description of a model. The lists end at the first NULL, or are full. */
typedef struct {
    const char *summary;                     /* what the foot stands on */
    const char *source;                      /* who published it */
    const char *fields[MILD_MODEL_FIELDS];   /* names of the material's fields that it reads */
    const char *scaled[MILD_MODEL_SCALED];   /* those of them that mild_model_match scales */
    const char *presets[MILD_MODEL_PRESETS]; /* names of its presets, see mild_material_preset */
    const char *match_note;                  /* what else mild_model_match sets; NULL: nothing */
    int concentric;                          /* bool: one element in the middle of the sole */
} MildModelInfo;

/* Names of the models as users write them, in the order of the enum. */
extern const char *const mild_model_names[MILD_MODELS];
/* Finds a model by name. Returns false, and leaves *model alone, when the name is unknown. */
int mild_model_find(const char *name, MildModel *model);
/* The description of a model. It never changes. */
const MildModelInfo *mild_model_info(MildModel model);
/* Bool: the model has one element in the middle of the sole. */
int mild_model_is_concentric(MildModel model);

/* ---- materials: parameters of the element law (paper Table III; docs/model.md section 10) ---- */

/* A plain struct. Start from mild_material_default or a preset, change what differs, and check it
 * with mild_material_check. Numbers of an element (k_pen, k_drift, b_drift, and nu and c_g, which
 * go with the size of its cone) are those of an element of the paper's pitch, 0.0195 m, under any
 * sole: the pitch of a raster does not change the ground (docs/model.md section 16). Those of the
 * concentric models are of the whole sole. */
typedef struct {
    double k_pen;        /* [N/m] penetration stiffness of one element at the surface; for
                           hunt_crossley force divided by depth at a depth of 10 mm */
    double sigma_cone;   /* [N/m^3] depth-dependent conical stress */
    double alpha;        /* [rad] shear band angle */
    double nu;           /* [-] recruitment rate */
    double c_g;          /* [-] surrounding mass scale */
    double c_d;          /* [-] inertial drag scale */
    double phi;          /* [-] volume fraction */
    double rho;          /* [kg/m^3] grain density */
    double mu;           /* [-] friction coefficient */
    double k_drift;      /* [N/m^2] drift stiffness k_D per element */
    double b_drift;      /* [N s/m] drift damping b_D per element */
    double recovery;     /* [-] share of the depth that springs back: 1 elastic, 0 plastic */
    double bed_depth;    /* [m] depth of the firm bed below the surface */
    double zeta;         /* [-] ecc_quasi*: stress per depth under a level plate moving straight
                           down, in 1e6 N/m^3 */
    int passive;         /* bool: clamp c_g >= 0 and c_d >= 1/2, so that no energy is created */
    int model;           /* MildModel, not MILD_MODEL_RIGID: the law that reads these numbers;
                            mild_model_match makes another's */
    double exponent;     /* [-] bekker, hunt_crossley: exponent n of the depth */
    double dissipation;  /* [s/m] hunt_crossley: the coefficient of restitution is 1 - dissipation v
                           at a small impact speed v */
    double k_c;          /* [N/m^(n+1)] bekker: cohesive modulus, divided by plate_width; below 0
                           pressure grows with the plate's width, and k_c/b + k_phi below 0 is 0 */
    double k_phi;        /* [N/m^(n+2)] bekker: frictional modulus */
    double plate_width;  /* [m] bekker: b, shorter side of the loaded plate; 0: of the sole */
    double cohesion;     /* [N/m^2] bekker: c, shear strength without load */
    double shear_length; /* [m] bekker: K, slip over which the shear strength builds up */
    double slip_length;  /* [m] mild, mild_merged: j0, path over which slip halves the support; 0:
                           slip costs no support. Above 0 k_drift and b_drift are not read */
    double regain_length; /* [m] mild, mild_merged: u0, fresh penetration over which the support
                            comes back */
    double grip;          /* [-] mild, mild_merged with a slip_length: t, greatest friction of a
                            sliding element by its virgin load; 0: mu alone. Above 0, ground that is
                            struck is held by all of mu, and phi rho presses at a sole's sides */
    double slip_growth;   /* [-] mild, mild_merged with a slip_length: at a depth u the path is j0 +
                            slip_growth u, and regain_length is longer by the same factor */
    double refill;        /* [-] share of an imprint's depth that flows back as the foot leaves */
} MildMaterial;

/* Fields of MildMaterial with unit, range and meaning, for configuration files, sliders and random
 * draws: [mild_material_field_count]. */
extern const MildField mild_material_fields[];
extern const int mild_material_field_count;

/* The paper's loose sand: of mild, slip costs nothing. */
MildMaterial mild_material_default(void);
/* Writes a preset to *material. The paper's, of mild: rubber foam60 foam45 foam28 foam25 grass; of
 * mild_merged, and slip costs support: sand_loose sand_dense. Measured ones, of mild: rubber_tile
 * running_track artificial_turf gym_mat carpet groomed_snow; of mild_merged: dry_sand_loose
 * dry_sand_close moist_sand fresh_snow; of bekker: dry_sand sandy_loam clay snow lunar_soil.
 * Returns false, and leaves *material alone, when the name is unknown. (`rigid` is not a material
 * but the engine's own contact.) */
int mild_material_preset(const char *name, MildMaterial *material);
/* Number of presets of mild and mild_merged. */
int mild_material_preset_count(void);
/* Name of a preset; NULL when index is not 0 .. count - 1. */
const char *mild_material_preset_name(int index);
/* Checks that every field is in its range and that the model has a material (rigid has none). Fails
 * with the name of the first bad field. Besides mild_model_match, no other function checks a
 * material. */
MildStatus mild_material_check(const MildMaterial *material, MildError *error);

/* ---- terrain: height and material under a point ---- */

/* A rectangle of another material: x_min <= x < x_max, y_min <= y < y_max. */
typedef struct {
    double x_min; /* [m] world */
    double x_max; /* [m] world */
    double y_min; /* [m] world */
    double y_max; /* [m] world */
    int material; /* index into materials */
} MildPatch;

/* A plain struct. It may be copied, and its numbers may change between two steps. A loaded element
 * keeps the index of the material that it touched down on (docs/model.md section 5). The material
 * at a point is that of the first patch that contains the point, otherwise that of the map,
 * otherwise material 0. */
typedef struct {
    int material_count;                         /* materials in use */
    int patch_count;                            /* patches in use */
    double height;                              /* [m] of the surface, added to the map's height */
    MildMaterial materials[MILD_MATERIALS_MAX]; /* [material_count], checked by the caller */
    MildPatch patches[MILD_PATCHES_MAX];        /* [patch_count] */
    double map_x;                               /* [m] world position of the map's origin */
    double map_y;                               /* [m] the same */
    const MildMap *map; /* not owned; NULL: level ground without a pattern */
} MildTerrain;

/* The mixture of two materials near a border. */
typedef struct {
    int first;    /* index of the nearer material */
    int second;   /* index of the other material */
    double share; /* [-] of the second material, at most 1/2; 0 away from a border */
} MildBlend;

/* One material everywhere, surface at z = 0. */
MildTerrain mild_terrain_uniform(const MildMaterial *material);
/* Adds a patch. Infinite edges make strips and half planes. Fails, and leaves the terrain alone,
 * when the terrain is full, when the patch is empty, contains NaN or overlaps an earlier one, or
 * when its material does not exist. */
MildStatus mild_terrain_add_patch(MildTerrain *terrain, const MildPatch *patch, MildError *error);
/* Sets the map; NULL removes it. Fails, and leaves the terrain alone, when the map has a label
 * without a material. */
MildStatus mild_terrain_set_map(MildTerrain *terrain, const MildMap *map, MildError *error);
/* Index of the material at the world point (x, y) [m]; near a border, that of the nearer
 * material. */
int mild_terrain_material_at(const MildTerrain *terrain, double x, double y);
/* Both materials at the world point (x, y) [m]. */
MildBlend mild_terrain_blend_at(const MildTerrain *terrain, double x, double y);
/* [m] Undisturbed surface h0 at the world point (x, y) [m], in constant time. */
double mild_terrain_height_at(const MildTerrain *terrain, double x, double y);
/* [-] Gradient of h0 at the world point (x, y) [m]: slope[2] along x and y. */
void mild_terrain_slope_at(const MildTerrain *terrain, double x, double y, double slope[2]);

/* ---- soles: the footprint of a foot as square elements (docs/model.md section 4) ---- */

/* What a sole is made from. */
typedef struct {
    const double *outline; /* [points][2] [m] polygon in the foot frame, in either orientation; it
                              must not cross itself */
    int points;            /* points of the outline, 3 .. 4096 */
    double pitch;          /* [m] edge of an element: how fine the raster is, 0.001 .. 1; 0: the
                              paper's 0.0195 with target_elements; else near it, such that the
                              elements have the outline's area */
    double sole_z;         /* [m] sole plane in the foot frame, negative below the ankle */
    /* Number of elements wanted (77 for the SA01), or 0 for outline area divided by element area.
     * The raster is shifted until the count is nearest to this. Then border cells are dropped, or
     * added, in the order of their coverage by the outline. */
    int target_elements;
} MildSoleDef;

/* A rasterised sole. It never changes, so any number of threads, scratches and grounds may share
 * it. */
typedef struct MildSole MildSole;
/* Makes a sole. Returns NULL, with the name of the field in *error, when the outline encloses no
 * area, crosses itself or is not finite, when a number is out of range, when more than 65536 cells
 * would be needed, when the outline holds the centre of no cell or fewer cells than target_elements
 * touch it, or when out of memory. `def` is not kept. */
MildSole *mild_sole_create(const MildSoleDef *def, MildError *error);
/* Frees a sole; NULL is allowed. Scratches and grounds made from it stay valid. */
void mild_sole_destroy(MildSole *sole);
/* Number of elements, at least 1. */
int mild_sole_elements(const MildSole *sole);
/* [m] Edge of an element. The area of an element is its square. */
double mild_sole_pitch(const MildSole *sole);
/* Shorter side [m] of the outline's bounding box in the foot frame: Bekker's b, unless the material
 * has a plate_width of its own. That of mild_sole_concentric is that of its sole. That of a shell
 * is the second longest side of its bounding box. */
double mild_sole_width(const MildSole *sole);
/* Centres of the elements in the foot frame [m]: arrays of mild_sole_elements() numbers for x and
 * y, owned by the sole, and the common height z. */
const double *mild_sole_x(const MildSole *sole);
const double *mild_sole_y(const MildSole *sole);
double mild_sole_z(const MildSole *sole);
/* [m] Mean over the cell of each element of the distance to the edge of the outline, outside which
 * it is 0: an array of mild_sole_elements() numbers owned by the sole (docs/model.md section 21).
 * NULL for a shell. */
const double *mild_sole_edge(const MildSole *sole);
/* ---- shells: elements anywhere on a body (docs/model.md section 20) ---- */

/* What a shape is. Sizes are those of a MuJoCo geom. */
typedef enum {
    MILD_SHAPE_BOX = 0,     /* size: half of the edge along x, y and z */
    MILD_SHAPE_CAPSULE = 1, /* size[0]: radius. size[1]: half of its cylinder along z */
    MILD_SHAPE_SPHERE = 2,  /* size[0]: radius */
    MILD_SHAPE_MESH = 3     /* vertices and triangles */
} MildShapeType;

/* A part of a body. Pointers are not kept. */
typedef struct {
    int type;               /* MildShapeType */
    double size[3];         /* [m] above 0 where the type has it; at most 10 */
    double pos[3];          /* [m] its centre in the body's frame */
    double quat[4];         /* [-] its orientation, w x y z, of any length; all 0: none */
    const double *vertices; /* mesh: [vertex_count][3] [m] within 10 m, at most 2^20 */
    int vertex_count;       /* mesh */
    const int *triangles;   /* mesh: [triangle_count][3] vertices, counterclockwise from outside */
    int triangle_count;     /* mesh */
} MildShape;

/* What a shell is made from. */
typedef struct {
    const MildShape *shapes; /* [count] they may overlap */
    int count;               /* 1 .. 256 */
    double pitch;            /* [m] edge of an element in the law: that of the feet, 0.001 .. 1 */
    double spacing;          /* [m] distance of the elements, 0.001 .. 1; 0: pitch */
} MildSurfaceDef;

/* Makes a shell: a sole whose elements cover the outer surface of a body, each with an outward
 * normal and an area near spacing^2. The law is that of an element of area pitch^2; an element here
 * presses with as many of these as its area has. The frame is that of the body; its origin is what
 * other functions call the ankle. Elements inside another shape are left out; for that a mesh must
 * be closed. The areas sum to that of the surface. An element carries load while its normal
 * points down by more than 10 degrees below the horizontal, with its area projected on the
 * horizontal plane when it touched down. On ground of mild_merged that keeps its imprint a rounded
 * surface is carried from its rim, and elements steeper than 60 degrees carry next to nothing
 * (docs/model.md, section 23). A shell serves wherever a sole does, except in
 * mild_sole_concentric and mild_model_match, which refuse it, and mild_sole_sinkage, which takes it
 * for a level sole. Returns NULL, with the name of the field in *error, when a number is out of
 * range, when a closed mesh has its triangles turned inward, when nothing is left or more than
 * 65536 elements are, or when out of memory. `def` is not kept. */
MildSole *mild_sole_surface(const MildSurfaceDef *def, MildError *error);
/* Arrays of mild_sole_elements() numbers owned by the sole, for each element of a shell: height
 * above the frame's origin [m] (mild_sole_z is their mean), component of the outward unit normal
 * along an axis of the frame, axis 0 .. 2 [-], and area [m^2]. NULL for a sole of
 * mild_sole_create. */
const double *mild_sole_surface_z(const MildSole *sole);
const double *mild_sole_surface_normal(const MildSole *sole, int axis);
const double *mild_sole_surface_area(const MildSole *sole);

/* Makes a sole of one element for the concentric models. The element lies at the centroid of the
 * elements of `sole` and has their total area. It transmits a force but no moment about its centre.
 * Destroy it like any other sole. Returns NULL, with the reason in *error, for a shell or when out
 * of memory. */
MildSole *mild_sole_concentric(const MildSole *sole, MildError *error);

/* ---- element law in closed form (eqs 1 to 5, docs/model.md section 3) ---- */

/* Force of virgin ground on an element that moves down at the speed w > 0:
 *
 *     F = force + damping w + c_d added_mass_per_depth w^2 + added_mass dw/dt */
typedef struct {
    double force;                /* F_g [N] quasistatic */
    double stiffness;            /* dF_g/du [N/m] */
    double damping;              /* [N s/m] hunt_crossley; 0 for all other models */
    double added_mass;           /* m_a [kg] */
    double added_mass_per_depth; /* dm_a/du [kg/m] */
} MildElementLaw;
/* The law of an element of area pitch^2 [m^2] at a depth u >= 0 [m] in virgin ground. The firm bed
 * is part of it. A plate_width of 0 is `pitch` here, because the element is the whole plate; so an
 * element of mild_merged is that of mild. */
MildElementLaw mild_element_law(const MildMaterial *material, double pitch, double depth);
/* The same for a whole level sole: the sum over its elements. Of mild_merged each has the law of
 * its place in the sole. */
MildElementLaw mild_sole_law(const MildMaterial *material, const MildSole *sole, double depth);
/* [m] Depth at which a level sole that is pressed slowly into virgin ground carries `load` [N]. */
double mild_sole_sinkage(const MildSole *sole, const MildMaterial *material, double load);
/* Derives the material of another model for a fair comparison with `from`, a material of `mild` or
 * `mild_merged`: under `load` [N] a level foot sinks to the same depth. Half the weight of a biped
 * is a good load. Friction, drift, recovery and bed are those of `from`, apart from what
 * MildModelInfo.match_note names; from `mild_merged` into another model slip costs nothing. sole:
 * the raster. For a concentric model the result belongs to mild_sole_concentric of that raster.
 * Fails, with *rival unchanged, for rigid, for a shell unless `model` is that of `from`, when
 * `from` is a material of another model or fails mild_material_check, when the load is not
 * positive, or when the result fails mild_material_check. */
MildStatus mild_model_match(MildModel model, const MildMaterial *from, const MildSole *sole,
                            double load, MildMaterial *rival, MildError *error);

/* Resistive force theory. alpha [-] are the coefficients of the stress on a plate: force [N] =
 * alpha zeta 1e6 N/m^3 times depth times area.
 *
 * In a vertical plane (Li et al. 2013). beta [rad]: slope of the plate, positive when its leading
 * face points forward and down. gamma [rad], 0 .. pi/2: direction of motion below the horizontal.
 * alpha[2]: resistance backward and upward, (0.007, 1) for a level plate moving straight down. */
void mild_resist_plane(double beta, double gamma, double alpha[2]);
/* In three dimensions (Agarwal et al. 2023, scaled to 1 for a level plate moving straight down).
 * normal[3]: unit vector out of the plate into the ground. direction[3]: unit vector of the motion.
 * alpha[3]: coefficients of the force on the plate, world axes; 0 for a trailing face. */
void mild_resist_space(const double normal[3], const double direction[3], double alpha[3]);

/* ---- one contact step (docs/model.md sections 6, 7) ---- */

/* The first two solve the same implicit equations and give the same answer. The third is for
 * comparison: it creates energy, and on ground with much drag shorter steps do not cure it. */
typedef enum {
    MILD_SOLVER_NEWTON = 0,       /* Newton's method on the twists of the feet: the fast one */
    MILD_SOLVER_GAUSS_SEIDEL = 1, /* the paper's sweeps over the elements (Algorithm 1) */
    MILD_SOLVER_EXPLICIT = 2 /* Algorithm 1 to the letter: forces of the state before the step */
} MildSolver;
#define MILD_SOLVERS 3
extern const char *const mild_solver_names[MILD_SOLVERS];

/* What the engine knows before the step. A foot is any body with a sole. */
typedef struct {
    int feet;                          /* the same as in scratch and ground */
    double dt;                         /* [s] step size, from 1e-9; tested from 0.25 to 5 ms, and
                                          a falling foot needs less than 50 ms */
    double position[MILD_FEET_MAX][3]; /* [m] ankle, world */
    /* [-] Foot to world, row major, orthonormal. A sole presses with either side; tilted, its
     * elements keep their area in `mild`, as in the paper; in `mild_merged` they have its
     * projection and press in a direction between the ground's normal and the sole's. */
    double rotation[MILD_FEET_MAX][9];
    /* [m/s, rad/s] Present twist at the ankle: linear, then angular; world axes. */
    double velocity[MILD_FEET_MAX][6];
    /* A = J M^-1 J^T [1/kg, 1/(kg m), 1/(kg m^2)]: [6 feet][6 feet] numbers of the caller, only
     * read. Symmetric and positive semidefinite; it may be singular. */
    double *inverse_inertia;
    /* Bit f: A has the rows of foot f. The others touch nothing in this step (mild_ground_near),
     * and A is smaller by their rows and columns. 0: A has the rows of all feet. */
    uint32_t rows;
    /* [m/s, rad/s] Twists after a step without ground, V_free = J (qvel + dt M^-1 (tau - b)). */
    double free_velocity[6 * MILD_FEET_MAX];
    MildSolver solver; /* the solver to use */
    double tolerance;  /* [-] of the residual; 0: 1e-9 for Newton, 1e-10 for sweeps */
    /* Limit on Newton steps or sweeps; 0: 400 steps or 1000 sweeps. If Newton's method does not
     * converge, up to 40 more steps follow. If friction would create energy, the contact step is
     * solved again, at most twice. */
    int max_iterations;
} MildContactInput;

/* What the ground does to one foot, as means over the step (docs/model.md section 9). All 0 for a
 * foot in the air. */
typedef struct {
    double force[3];  /* [N] on the foot, world */
    double torque[3]; /* [N m] about the ankle, world: p x F */
    /* [m] Vector from the ankle to the nearest point of the wrench's central axis, F x tau/|F|^2. 0
     * where that overflows. */
    double zmp_axis[3];
    /* [m] Vector from the ankle, world axes, to the zero moment point on the horizontal plane
     * through the centroid of the elements. */
    double zmp_sole[2];
    /* [m] Centre of pressure, world: sum of p f divided by sum of f, with f the vertical forces of
     * the elements. For a level sole it is the ankle plus zmp_sole. 0 where their sum is not above
     * 0. It may lie outside the sole where drag nearly cancels the load. */
    double pressure_center[3];
    double area; /* [m^2] of the loaded elements; of a surface projected, see mild_sole_surface */
    double depth_max;  /* [m] largest depth of a loaded element */
    double depth_mean; /* [m] mean depth of the loaded elements */
    int contacts;      /* number of loaded elements */
} MildFootResult;

/* Result of a step, for the feet that the input has. */
typedef struct {
    MildFootResult foot[MILD_FEET_MAX]; /* [feet] */
    /* [m/s, rad/s] Twists at the ankles after the step, V = V_free + A W with W the wrench
     * impulses; V_free of a foot without rows. */
    double velocity[6 * MILD_FEET_MAX];
    /* [-] In the metric of kinetic energy. Newton: relative residual of V = V_free + A W(V).
     * Sweeps: relative change of the wrench in the last sweep; the two do not compare. A converged
     * step may exceed the tolerance if rounding permits no smaller residual. */
    double residual;
    int iterations; /* Newton steps or sweeps done */
    /* Bool. Also 0 when a pose, a twist or a result is not finite, when a number of a material is
     * NaN, or when dt is not positive. */
    int converged;
} MildContactResult;

/* ---- memory and working arrays (docs/model.md section 5) ---- */

/* What the ground remembers: greatest depth and drift of every element, and imprints. It is one
 * block of mild_ground_bytes() bytes without pointers. Copy it with memcpy to save, restore, send
 * or branch a simulation. */
typedef struct MildGround MildGround;
/* Working arrays of one thread. A scratch can serve any number of grounds with the same soles, one
 * after the other. */
typedef struct MildScratch MildScratch;

/* [B] Size of the block, a multiple of 64; 0 when feet is not 1 .. MILD_FEET_MAX. soles: [feet]. */
size_t mild_ground_bytes(const MildSole *const *soles, int feet);
/* Initialises a block of that size, which is aligned to 8 bytes and owned by the caller. Returns
 * the block as a MildGround that remembers nothing, or NULL when the block is NULL or feet is not
 * 1 .. MILD_FEET_MAX. */
MildGround *mild_ground_init(void *block, const MildSole *const *soles, int feet);
/* Forgets everything. Call it after moving the feet to another place. */
void mild_ground_reset(MildGround *ground);

/* [B] The same for ground that remembers imprints: pressed ground keeps its depth after the foot
 * has lifted off, and an element that comes down there later finds it (docs/model.md section 5).
 * Imprints are stored in the block, in `tiles` squares of 8 x 8 cells, whose edge is half the
 * largest pitch of the soles. When all tiles are in use the oldest are forgotten. The imprint of a
 * foot of 0.27 x 0.10 m takes about ten tiles. tiles: rounded up to a multiple of 8, at most
 * MILD_IMPRINT_TILES_MAX; 0: no imprints. */
#define MILD_IMPRINT_TILES_MAX 65536
size_t mild_ground_bytes_imprints(const MildSole *const *soles, int feet, int tiles);
/* Initialises a block of that size as mild_ground_init does. */
MildGround *mild_ground_init_imprints(void *block, const MildSole *const *soles, int feet,
                                      int tiles);
/* [B] Size of the block of an initialised ground. */
size_t mild_ground_size(const MildGround *ground);
/* Replaces what a ground remembers by a copy of `block`: [bytes] of a ground of the same soles and
 * tiles, aligned to 8 bytes, which may come from a file. Fails, with the ground unchanged, when
 * the size or a number shows that it is none. */
MildStatus mild_ground_restore(MildGround *ground, const void *block, size_t bytes,
                               MildError *error);
/* [m] Greatest depth that the imprint at the world point (x, y) remembers; 0 where there is none.
 * The surface there lies (1 - recovery) times that below h0. */
double mild_ground_imprint_at(const MildGround *ground, double x, double y);

/* Makes a scratch. Returns NULL when feet is not 1 .. MILD_FEET_MAX, or when out of memory. soles:
 * [feet], not kept. */
MildScratch *mild_scratch_create(const MildSole *const *soles, int feet, MildError *error);
/* Frees a scratch; NULL is allowed. */
void mild_scratch_destroy(MildScratch *scratch);

/* Bit f: foot f may touch the ground in the step of `input`, whose inverse_inertia and rows need
 * not be set yet. For robots of which many bodies have soles: ask, compute the rows of A for these
 * feet alone, and set input.rows. It overwrites scratch: do not call it between a solve and its
 * mild_ground_advance. Cost: a few dozen operations for each foot. */
uint32_t mild_ground_near(const MildTerrain *terrain, const MildContactInput *input,
                          MildScratch *scratch);
/* Solves one contact step: impulses by eqs 4, 5, 13 and 14, twists by eq 9. It reads the ground and
 * writes only scratch and result, so it may be called any number of times before
 * mild_ground_advance. Scratch and ground must have the same soles; if their numbers of elements
 * differ, or inverse_inertia is NULL, converged is 0, velocity is free_velocity, and
 * mild_ground_advance does nothing. It always returns; check result->converged. If that is 0, the
 * result is approximate: either the impulses are those of the ground at twists near the returned
 * ones, or they are exact except for the friction bound (docs/model.md section 7). */
void mild_ground_solve(const MildGround *ground, const MildTerrain *terrain,
                       const MildContactInput *input, MildScratch *scratch,
                       MildContactResult *result);
/* Checks what mild_ground_solve takes on trust, for engines that are being written: materials,
 * patches, the map's labels, number of feet, dt, poses and twists that are finite, rotations that
 * are orthonormal, and an A that is symmetric and positive semidefinite. Fails with the first that
 * is wrong. It costs about as much as a solve, so leave it out of a release. */
MildStatus mild_contact_check(const MildGround *ground, const MildTerrain *terrain,
                              const MildContactInput *input, MildError *error);
/* Updates the memory of the ground for the step that was just solved with this scratch, input and
 * result. It assumes that positions advance by dt times the new velocity. Call it once for each
 * step that the engine keeps, also where converged is 0. Where a number of the step is not finite,
 * it does nothing: the ground remembers what it did before. */
void mild_ground_advance(MildGround *ground, const MildTerrain *terrain,
                         const MildContactInput *input, const MildScratch *scratch,
                         const MildContactResult *result);
/* Call it when numbers of a terrain's materials have changed between two steps: `from` is the
 * terrain before, `to` that of the next step. It re-expresses what the ground remembers of loaded
 * elements in the new laws, so that none carries more than before or gives back more energy. Where
 * the new ground would, its surface lies lower under the element until it is out of the ground
 * (docs/model.md section 5). Without the call, ground that stiffens under a load throws it. The
 * scratch has the ground's soles; the result of its last solve is lost. Elements on a material that
 * only one of the terrains has stay as they are. */
void mild_ground_change(MildGround *ground, const MildTerrain *from, const MildTerrain *to,
                        MildScratch *scratch);

/* ---- derivatives of a contact step (docs/gradients.md) ---- */

/* What mild_ground_derivative is asked for: arrays of the caller, NULL for what is not wanted.
 * Matrices are row major. W: force and torque of each foot as in MildFootResult, row 6 f + i. V:
 * twists after the step. Rows and columns of a foot that touches nothing are 0, and of dV/dV_free
 * its columns are those of the identity. */
typedef struct {
    /* [N s/m, N s, N m s] [feet][6][6] dW/dV of each foot: the law alone, by a twist that is given,
     * as inverse dynamics needs. Exact. */
    double *law;
    /* [N s/m, N s, N m s] [6 feet][6 feet] dW/dV_free of the solved step. Exact. */
    double *wrench_by_free;
    double *velocity_by_free; /* [-, m, 1/m] [6 feet][6 feet] dV/dV_free. Exact. */
    /* [N/m, N/rad, N, N m/rad] [6 feet][6 feet] dW/d(pose): column 6 f + k moves foot f along the
     * world's axis k; column 6 f + 3 + k turns it about that axis through its ankle. V_free, A and
     * what the ground remembers stay. Differenced. */
    double *wrench_by_pose;
    /* [N s/m, N s, N m s] [6 feet][6 feet] dW/d(present twist), V_free and A stay. Differenced. */
    double *wrench_by_velocity;
    /* [N or N m by the field's unit] [6 feet][field_count] dW/d(fields of a material).
     * Differenced. */
    double *wrench_by_material;
    int material;     /* index into the terrain's materials */
    int field_count;  /* columns of wrench_by_material */
    const int *field; /* [field_count] indices into mild_material_fields, of numbers (DOUBLE) */
    /* Another scratch of the same soles, which is overwritten; NULL will do where nothing
     * differenced is wanted and the solver is Newton's. */
    MildScratch *work;
} MildContactDerivative;

/* Derivatives of the step that was just solved with this ground, terrain, input, scratch and
 * result, before mild_ground_advance, which it leaves as it would be. They are those of the law on
 * its present branch (each element sticks, slides, yields, unloads or is out of the ground) by the
 * implicit function theorem. *Exact* ones are in closed form. *Differenced* ones are differences of
 * the law at the twists of the solution, with no contact solve inside: two passes over the elements
 * a column for all feet at once, within some 1e-6 unless an element is at a kink. With an
 * inverse_inertia of zeros in `input` they are those at twists that are given. Of a number that
 * switches a rule off at 0 (slip_length, grip, plate_width) there is none at 0: its column is 0. So
 * is that of a number that is infinite. Cost: docs/gradients.md. Fails when the step has not
 * converged, when its solver is MILD_SOLVER_EXPLICIT, when input->feet is not the scratch's, when
 * `work` is missing or of other soles, when the material or a field does not exist or is no number,
 * and when the equations are singular. */
MildStatus mild_ground_derivative(const MildGround *ground, const MildTerrain *terrain,
                                  const MildContactInput *input, MildScratch *scratch,
                                  const MildContactResult *result,
                                  const MildContactDerivative *derivative, MildError *error);

/* What an element did in the last step. */
typedef enum {
    MILD_ELEMENT_FREE = 0,      /* carries no normal force */
    MILD_ELEMENT_UNLOADING = 1, /* loaded, on the unloading line: has been deeper before */
    MILD_ELEMENT_VIRGIN = 2     /* loaded, at its greatest depth since touchdown */
} MildElementState;

/* What the elements of one foot did in the last solve: arrays of mild_sole_elements() numbers. */
typedef struct {
    /* [m] u at the start of the step, negative above the ground. On uneven ground the law,
     * depth_max and depth_mean take the smaller of this and what the ground of the last step
     * gives. Where no element of a shell can touch, and of a foot without rows, an upper bound of
     * all as mild_ground_near found it. */
    const double *depth;
    const double *normal;    /* [N] vertical part of the force, mean over the step */
    const double *tangent_x; /* [N] horizontal part, world, mean over the step */
    const double *tangent_y; /* [N] the same */
    const double *point_x;   /* [m] centre, world */
    const double *point_y;   /* [m] the same */
    const double *point_z;   /* [m] the same */
    const double *flat;      /* [-] share of the area still flat after the step (eq 1): 1 when
                                untouched, 0 when the cone is complete */
    const uint8_t *state;    /* MildElementState */
    const uint8_t *slip;     /* bool: loaded, and friction is at its bound */
} MildElements;
/* Computes them for foot 0 .. feet - 1 after a solve. The arrays lie in the scratch, which it
 * writes to, and are valid until the next solve. Cost: one pass over the elements of the foot. */
MildElements mild_scratch_elements(const MildScratch *scratch, int foot);

/* [m] Greatest depth that each element has reached since touchdown, 0 in the air: array of
 * mild_sole_elements() numbers inside the block of the ground. */
const double *mild_ground_depth_max(const MildGround *ground, int foot);

MILD_API_END

#endif
