/* libmild: soft ground for legged robots. Forces between rigid feet and foam, rubber, grass or
 * sand, computed for each element of the soles, in both directions: the ground carries the robot
 * and the robot deforms the ground.
 *
 * The engine owns the mass matrix M, the foot Jacobian J (6 rows a foot, twist at the ankle, world
 * axes), the generalised velocity qvel, the applied forces tau and the bias forces b. Its step is
 *
 *     A      = J M^-1 J^T
 *     V_free = J (qvel + dt M^-1 (tau - b))
 *     mild_ground_solve(...)       impulses on the feet; the ground is not changed
 *     tau   += J^T force           the wrench of each foot, then integrate
 *     mild_ground_advance(...)     the ground remembers the step; once for each accepted step
 *
 * SI units, radians, z up. The reference point of a foot is its ankle. Penetration u = h0 - z is
 * positive below the surface h0. Forces on the foot are positive upward. Equation numbers are those
 * of the paper, read as docs/model.md says.
 *
 * Thread safety: a sole or a map never changes and may be shared, and so may a terrain that nobody
 * writes to. A MildGround and a MildScratch belong to one thread at a time. There is no global
 * state. No function prints or exits. Only functions that say that they return NULL when out of
 * memory allocate. Pointers must not be NULL, except `error` and where it is said. A function that
 * can fail refuses bad numbers; the others compute with them. */
#ifndef MILD_GROUND_H
#define MILD_GROUND_H

#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"
#include "mild/field.h"
#include "mild/map.h"

MILD_API_BEGIN

#define MILD_FEET_MAX 4       /* feet in one contact problem */
#define MILD_MATERIALS_MAX 12 /* in one terrain */
#define MILD_PATCHES_MAX 16   /* in one terrain */

/* ---- ground models: the paper's and its rivals behind one contract (docs/model.md, "Ground
 * models") ----
 *
 * A model is where the elements are (one in the middle of the sole, mild_sole_concentric, or the
 * raster) and what a material means to an element. Solvers, memory, friction, drift and results are
 * the same for all. A model is a row of this list and a file, src/ground/model_NAME.c; all else
 * that names models derives from the two. */
/* clang-format off */
#define MILD_MODEL_LIST(ROW)                                                                       \
    ROW(MILD, mild)                  /* a developing cone under every element (the paper) */       \
    ROW(CON_CONE, con_cone)          /* one developing cone under the whole sole */                \
    ROW(CON_SPRING, con_spring)      /* one yielding spring under the whole sole */                \
    ROW(ECC_SPRING, ecc_spring)      /* the same spring under every element */                     \
    ROW(ECC_QUASI, ecc_quasi)        /* resistive force theory in the plane of motion */           \
    ROW(ECC_QUASI_3D, ecc_quasi_3d)  /* the same in three dimensions */                            \
    ROW(BEKKER, bekker)              /* pressure by a power of the sinkage, shear by the path */   \
    ROW(HUNT_CROSSLEY, hunt_crossley) /* damped and elastic: what most simulators offer */         \
    ROW(RIGID, rigid)                /* the last: the engine's contact; no material has it */
/* clang-format on */

/* A row's enumerator: MILD_MODEL_MILD and so on. */
#define MILD_MODEL_ID(id, name) MILD_MODEL_##id,
/* A model, in the list's order. */
typedef enum {
    MILD_MODEL_LIST(MILD_MODEL_ID) /* one of each row */
} MildModel;
#define MILD_MODELS (MILD_MODEL_RIGID + 1) /* how many there are */

#define MILD_MODEL_FIELDS 20 /* of the material that a model reads, at most */
#define MILD_MODEL_PRESETS 8 /* materials of its own, at most */
#define MILD_MODEL_SCALED 4  /* of them those by which it is matched, at most */

/* What a model says of itself. The lists end at the first NULL, or are full. */
typedef struct {
    const char *summary;                     /* what the foot stands on */
    const char *source;                      /* who published it */
    const char *fields[MILD_MODEL_FIELDS];   /* of the material that it reads */
    const char *scaled[MILD_MODEL_SCALED];   /* of them those by which mild_model_match fits it */
    const char *presets[MILD_MODEL_PRESETS]; /* names of its materials: mild_material_preset */
    const char *match_note;                  /* what that sets besides; NULL: nothing */
    int concentric; /* bool: one element in the middle of the sole, not the raster */
} MildModelInfo;

/* Names of the models as users write them, in the order of the enum. */
extern const char *const mild_model_names[MILD_MODELS];
/* Finds a model by name. Returns false, and leaves *model alone, when the name is unknown. */
int mild_model_find(const char *name, MildModel *model);
/* What a model says of itself. It never changes. */
const MildModelInfo *mild_model_info(MildModel model);
/* Bool: the model has one element in the middle of the sole. */
int mild_model_is_concentric(MildModel model);

/* ---- materials: parameters of the element law (paper Table III; docs/model.md section 10) ---- */

/* A plain struct. Start from mild_material_default or a preset, change what differs, and check it
 * with mild_material_check. */
typedef struct {
    double k_pen;       /* [N/m] penetration stiffness of one element at the surface; of
                           hunt_crossley its force by its depth at 10 mm */
    double sigma_cone;  /* [N/m^3] depth-dependent conical stress */
    double alpha;       /* [rad] shear band angle */
    double nu;          /* [-] recruitment rate */
    double c_g;         /* [-] surrounding mass scale */
    double c_d;         /* [-] inertial drag scale */
    double phi;         /* [-] volume fraction */
    double rho;         /* [kg/m^3] grain density */
    double mu;          /* [-] friction coefficient */
    double k_drift;     /* [N/m^2] drift stiffness k_D per element */
    double b_drift;     /* [N s/m] drift damping b_D per element */
    double recovery;    /* [-] share of the depth that springs back: 1 elastic, 0 plastic */
    double bed_depth;   /* [m] firm bottom below the surface */
    double zeta;        /* [-] ecc_quasi*: 1 is 1e6 N/m^3 under a level plate going straight down */
    int passive;        /* bool: clamp c_g >= 0 and c_d >= 1/2 so that no energy is created */
    int model;          /* MildModel, not MILD_MODEL_RIGID */
    double exponent;    /* [-] bekker, hunt_crossley: power n of the depth */
    double dissipation; /* [s/m] hunt_crossley: restitution is 1 - dissipation v, v small */
    double k_c;         /* [N/m^(n+1)] bekker: modulus of deformation, by the plate's width */
    double k_phi;       /* [N/m^(n+2)] bekker: the same, whatever the width */
    double plate_width; /* [m] bekker: b, smaller side of the loaded plate */
    double cohesion;    /* [N/m^2] bekker: c, shear strength without load */
    double shear_length; /* [m] bekker: K, over which the shear strength builds up */
} MildMaterial;

/* Fields of MildMaterial with unit, range and meaning, for configuration files, sliders and random
 * draws: [mild_material_field_count]. */
extern const MildField mild_material_fields[];
extern const int mild_material_field_count;

/* The preset sand_loose. */
MildMaterial mild_material_default(void);
/* Writes a preset to *material. Of mild: rubber foam60 foam45 foam28 foam25 grass sand_loose
 * sand_dense. Of bekker: dry_sand sandy_loam clay snow lunar_soil. Returns false, and leaves
 * *material alone, when the name is unknown. (`rigid` is no material: it is the engine's contact.)
 */
int mild_material_preset(const char *name, MildMaterial *material);
/* Number of presets of mild. */
int mild_material_preset_count(void);
/* Name of a preset; NULL when index is not 0 .. count - 1. */
const char *mild_material_preset_name(int index);
/* Checks every field against its range, and that the model has a material (rigid has none). Fails
 * with the name of the first bad field. No other function checks a material. */
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
 * at a point is that of the first patch that holds it, else that of the map, else material 0. */
typedef struct {
    int material_count;                         /* materials in use */
    int patch_count;                            /* patches in use */
    double height;                              /* [m] of the surface, added to the map's */
    MildMaterial materials[MILD_MATERIALS_MAX]; /* [material_count], checked by the caller */
    MildPatch patches[MILD_PATCHES_MAX];        /* [patch_count] */
    double map_x;                               /* [m] world position of the map's origin */
    double map_y;                               /* [m] the same */
    const MildMap *map; /* not owned; NULL: a level surface without a pattern */
} MildTerrain;

/* The mixture of two materials near a border. */
typedef struct {
    int first;    /* index of the nearer material */
    int second;   /* index of the other one */
    double share; /* [-] of the second, at most 1/2; 0 away from a border */
} MildBlend;

/* One material everywhere, surface at z = 0. */
MildTerrain mild_terrain_uniform(const MildMaterial *material);
/* Adds a patch. Infinite edges make strips and half planes. Fails, and leaves the terrain alone,
 * when the terrain is full, when the patch is empty, NaN or overlaps an earlier one, and when its
 * material does not exist. */
MildStatus mild_terrain_add_patch(MildTerrain *terrain, const MildPatch *patch, MildError *error);
/* Sets the map; NULL removes it. Fails, and leaves the terrain alone, when the map has a label
 * without a material. */
MildStatus mild_terrain_set_map(MildTerrain *terrain, const MildMap *map, MildError *error);
/* Index of the material at the world point (x, y) [m]; near a border that of the nearer one. */
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
    const double *outline; /* [points][2] [m] polygon in the foot frame, clockwise or not, that does
                              not cross itself */
    int points;            /* of the outline, 3 .. 4096 */
    double pitch;          /* [m] edge of an element; 0.0195 in the paper */
    double sole_z;         /* [m] sole plane in the foot frame, negative below the ankle */
    /* Number of elements wanted (77 for the SA01), or 0 for the natural one. The raster is shifted
       until the count comes nearest; then the least covered border cells are dropped or added. */
    int target_elements;
} MildSoleDef;

/* A rasterised sole. It never changes, so any number of threads, scratches and grounds share it. */
typedef struct MildSole MildSole;
/* Makes a sole. Returns NULL, with the field's name in *error, when the outline encloses no area,
 * crosses itself or is not finite, when pitch or target_elements are out of range or make more than
 * 65536 cells, or when out of memory. `def` is not kept. */
MildSole *mild_sole_create(const MildSoleDef *def, MildError *error);
/* Frees a sole; NULL is allowed. Scratches and grounds made from it stay valid. */
void mild_sole_destroy(MildSole *sole);
/* Number of elements, at least 1. */
int mild_sole_elements(const MildSole *sole);
/* [m] Edge of an element. Its area is the square of that. */
double mild_sole_pitch(const MildSole *sole);
/* Centres of the elements in the foot frame [m]: arrays of mild_sole_elements() for x and y, owned
 * by the sole, and the height z of all. */
const double *mild_sole_x(const MildSole *sole);
const double *mild_sole_y(const MildSole *sole);
double mild_sole_z(const MildSole *sole);
/* Makes a sole of one element for the concentric models: it lies at the centroid of the elements
 * and has their whole area. It carries force, but no moment about its centre. Destroy it like any
 * sole. NULL when out of memory. */
MildSole *mild_sole_concentric(const MildSole *sole, MildError *error);

/* ---- element law in closed form (eqs 1 to 5, docs/model.md section 3) ---- */

/* Force of virgin ground on an element that goes down with the speed w > 0:
 *     F = force + damping w + c_d added_mass_per_depth w^2 + added_mass dw/dt */
typedef struct {
    double force;                /* F_g [N] quasistatic */
    double stiffness;            /* dF_g/du [N/m] */
    double damping;              /* [N s/m] hunt_crossley; 0 of all others */
    double added_mass;           /* m_a [kg] */
    double added_mass_per_depth; /* dm_a/du [kg/m] */
} MildElementLaw;
/* The law of an element of area pitch^2 [m^2] at a depth u >= 0 [m] in virgin ground. The firm bed
 * is part of it. */
MildElementLaw mild_element_law(const MildMaterial *material, double pitch, double depth);
/* [m] Depth at which a level sole that is pressed down slowly into virgin ground carries
 * `load` [N].
 */
double mild_sole_sinkage(const MildSole *sole, const MildMaterial *material, double load);
/* Derives the material of another model for a fair comparison with `mild`, a material of
 * MILD_MODEL_MILD: under `load` [N] one level foot sinks to the same depth. Half the weight of the
 * robot is a good load. Friction, drift, recovery and bed are those of `mild` where the model has
 * them. sole: the raster; when the model is concentric the result is for mild_sole_concentric of
 * it. Fails, with *rival unchanged, for rigid, when `mild` is a material of another model or one
 * that mild_material_check refuses, when the load is not positive, and when the rival would need a
 * number that mild_material_check refuses. */
MildStatus mild_model_match(MildModel model, const MildMaterial *mild, const MildSole *sole,
                            double load, MildMaterial *rival, MildError *error);

/* Resistive force theory. Coefficients alpha [-] of the stress on a plate: force [N] = alpha zeta
 * 1e6 N/m^3 times depth times area.
 *
 * In a vertical plane (Li et al. 2013). beta [rad]: slope of the plate, positive when its leading
 * face looks forward and down. gamma [rad], 0 .. pi/2: direction of motion below the horizontal.
 * alpha[2]: resistance backward and upward; (0.007, 1) for a level plate that goes straight
 * down. */
void mild_resist_plane(double beta, double gamma, double alpha[2]);
/* In space (Agarwal et al. 2023, scaled to 1 for a level plate that goes straight down). normal[3]:
 * unit vector out of the plate into the ground. direction[3]: unit vector of the motion. alpha[3]:
 * of the force on the plate, world axes; 0 for a face that trails. */
void mild_resist_space(const double normal[3], const double direction[3], double alpha[3]);

/* ---- one contact step (docs/model.md sections 6, 7) ---- */

/* Both solvers give the same answer. */
typedef enum {
    MILD_SOLVER_NEWTON = 0,      /* Newton's method on the twists of the feet: the fast one */
    MILD_SOLVER_GAUSS_SEIDEL = 1 /* the paper's sweeps over the elements (Algorithm 1) */
} MildSolver;

/* What the engine knows before the step. Fixed size, no pointers. */
typedef struct {
    int feet;                          /* as in scratch and ground */
    double dt;                         /* [s] above 0 */
    double position[MILD_FEET_MAX][3]; /* [m] ankle, world */
    double rotation[MILD_FEET_MAX][9]; /* [-] foot to world, row major, orthonormal */
    /* [m/s, rad/s] Present twist at the ankle: linear, then angular, world axes. */
    double velocity[MILD_FEET_MAX][6];
    /* A = J M^-1 J^T [1/kg, 1/(kg m), 1/(kg m^2)], row major with stride 6 feet. Symmetric and
     * positive semidefinite; it may be singular. */
    double inverse_inertia[6 * MILD_FEET_MAX * 6 * MILD_FEET_MAX];
    /* [m/s, rad/s] Twists after a step without ground, V_free = J (qvel + dt M^-1 (tau - b)). */
    double free_velocity[6 * MILD_FEET_MAX];
    MildSolver solver; /* which of the two */
    double tolerance;  /* [-] of the residual; 0: 1e-9 (sweeps 1e-10) */
    /* Bound of Newton steps or sweeps; 0: 400 steps or 1000 sweeps. A step that Newton's method
     * leaves unsolved takes up to 40 more. One in which friction would create energy is solved up
     * to twice again. */
    int max_iterations;
} MildContactInput;

/* What the ground does to one foot, mean over the step (docs/model.md section 9). All 0 for a foot
 * in the air. */
typedef struct {
    double force[3];  /* [N] on the foot, world */
    double torque[3]; /* [N m] about the ankle, world: p x F */
    /* [m] From the ankle: point of the wrench's central axis nearest the ankle, F x tau/|F|^2. 0
     * where that overflows. */
    double zmp_axis[3];
    /* [m] From the ankle, world axes: zero moment point on the level plane through the centroid of
     * the elements. */
    double zmp_sole[2];
    /* [m] World: sum of p f over sum of f, with f the normal forces of the elements. For a level
     * sole it is the ankle plus zmp_sole. 0 without load. */
    double pressure_center[3];
    double area;       /* [m^2] of the loaded elements */
    double depth_max;  /* [m] over the loaded elements */
    double depth_mean; /* [m] over the loaded elements */
    int contacts;      /* number of loaded elements */
} MildFootResult;

/* Result of a step. Fixed size, no pointers. */
typedef struct {
    MildFootResult foot[MILD_FEET_MAX]; /* [feet] */
    double velocity[6 * MILD_FEET_MAX]; /* [m/s, rad/s] twists at the ankles after the step,
                                           V = V_free + A W, W the wrench impulses */
    /* [-] Relative, in the metric of kinetic energy. Converged above the tolerance: all of it is
     * rounding. */
    double residual;
    int iterations; /* Newton steps or sweeps done */
    /* Bool. It is 0 also when a pose or a result is not finite, when a number of a material is NaN
     * and when dt is not positive. */
    int converged;
} MildContactResult;

/* ---- memory and working arrays (docs/model.md section 5) ---- */

/* What the ground remembers: greatest depth and drift of every element, and imprints. It is one
 * block of mild_ground_bytes() bytes without pointers. Copy it with memcpy to save, restore, send
 * or branch a simulation. */
typedef struct MildGround MildGround;
/* Working arrays of one thread. It serves any number of grounds with the same soles in turn. */
typedef struct MildScratch MildScratch;

/* [B] Size of the block, a multiple of 64. soles: [feet], feet 1 .. MILD_FEET_MAX. */
size_t mild_ground_bytes(const MildSole *const *soles, int feet);
/* Initialises a block of that size, aligned to 8 and owned by the caller. Returns the block as a
 * MildGround on which nothing has stepped yet. */
MildGround *mild_ground_init(void *block, const MildSole *const *soles, int feet);
/* Forgets everything. Call it when the feet were moved to another place. */
void mild_ground_reset(MildGround *ground);

/* [B] The same for ground that remembers imprints: pressed ground keeps its depth after the foot
 * has lifted off, and an element that comes down there later meets it (docs/model.md section 5).
 * Imprints are kept in the block, in `tiles` squares of 8 x 8 cells with half the pitch of the
 * first sole. When all are in use the oldest are forgotten. The imprint of a foot of 0.27 x 0.10 m
 * takes about ten tiles. tiles: rounded up to a multiple of 8, at most MILD_PRINT_TILES_MAX; 0: no
 * imprints. */
#define MILD_PRINT_TILES_MAX 65536
size_t mild_ground_bytes_prints(const MildSole *const *soles, int feet, int tiles);
/* Initialises a block of that size as mild_ground_init does. */
MildGround *mild_ground_init_prints(void *block, const MildSole *const *soles, int feet, int tiles);
/* [B] Size of the block of an initialised ground. */
size_t mild_ground_size(const MildGround *ground);
/* [m] Greatest depth that the imprint at the world point (x, y) remembers; 0 where there is none.
 * The surface there lies (1 - recovery) times that below h0. */
double mild_ground_print_at(const MildGround *ground, double x, double y);

/* Makes a scratch. NULL when feet is not 1 .. MILD_FEET_MAX or out of memory. soles: [feet], not
 * kept. */
MildScratch *mild_scratch_create(const MildSole *const *soles, int feet, MildError *error);
/* Frees a scratch; NULL is allowed. */
void mild_scratch_destroy(MildScratch *scratch);

/* Solves one contact step: impulses by eqs 4, 5, 13 and 14, twists by eq 9. It reads the ground and
 * writes scratch and result only, so it may be called any number of times before
 * mild_ground_advance. Scratch and ground must have the same soles. It always returns:
 * look at result->converged. Where that is 0, either the impulses are those of the ground at twists
 * near the returned ones, or everything but the friction bound is (docs/model.md section 7). */
void mild_ground_solve(const MildGround *ground, const MildTerrain *terrain,
                       const MildContactInput *input, MildScratch *scratch,
                       MildContactResult *result);
/* Moves the memory of the ground to the end of the step that was just solved with this scratch,
 * input and result; positions are taken to advance by dt times the new velocity. Call it once for
 * each step that the engine keeps. */
void mild_ground_advance(MildGround *ground, const MildTerrain *terrain,
                         const MildContactInput *input, const MildScratch *scratch,
                         const MildContactResult *result);

/* What an element did in the last step. */
typedef enum {
    MILD_ELEMENT_FREE = 0,      /* carries no normal force */
    MILD_ELEMENT_UNLOADING = 1, /* loaded, on the unloading line: not deeper than before */
    MILD_ELEMENT_VIRGIN = 2 /* loaded, at the end of the step deeper than ever since touchdown */
} MildElementState;

/* What the elements of one foot did in the last solve: arrays of mild_sole_elements(). */
typedef struct {
    const double *depth;     /* [m] u at the start of the step, negative above the ground */
    const double *normal;    /* [N] vertical part of the force, mean over the step */
    const double *tangent_x; /* [N] horizontal part, world, mean over the step */
    const double *tangent_y; /* [N] the same */
    const double *point_x;   /* [m] centre, world */
    const double *point_y;   /* [m] the same */
    const double *point_z;   /* [m] the same */
    const double *flat;   /* [-] share of the area that is still flat after the step (eq 1): 1 when
                                untouched, 0 when the cone is complete */
    const uint8_t *state; /* MildElementState */
    const uint8_t *slip;  /* bool: loaded and friction at its bound */
} MildElements;
/* Computes that for foot 0 .. feet - 1 after a solve. The arrays lie in the scratch and are valid
 * until the next solve. Cost: one pass over the elements of the foot. */
MildElements mild_scratch_elements(const MildScratch *scratch, int foot);

/* [m] Greatest depth that each element has reached since touchdown, 0 in the air: array of
 * mild_sole_elements() inside the block of the ground. */
const double *mild_ground_depth_max(const MildGround *ground, int foot);

MILD_API_END

#endif
