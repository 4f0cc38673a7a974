/* libmild: soft ground for legged robots. Two-way, per-element forces between rigid feet and foam, rubber, grass, sand.
 *
 * A step of an engine that owns M, J and the smooth forces:
 *     A = J M^-1 J^T,  v_free = J (nu + dt M^-1 (tau - b))          (6 rows per foot, twist at the ankle, world axes)
 *     mild_ground_solve(...)    pure: wrench impulses and everything per element, into the scratch
 *     tau += J^T wrench/dt, integrate
 *     mild_ground_advance(...)  moves the memory (depth maxima, drift length), once per accepted step
 *
 * SI units, radians, z up. A foot's reference point is its ankle. Penetration u = h0 - z is positive down; forces on the
 * foot are positive up. Thread safety: constant objects (sole, terrain while nobody writes it) may be shared; a
 * MildGround and a MildScratch belong to one thread at a time. No function prints, exits or allocates except *_create. */
#ifndef MILD_GROUND_H
#define MILD_GROUND_H

#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"
#include "mild/field.h"
#include "mild/map.h"

MILD_API_BEGIN

#define MILD_FEET_MAX 2
#define MILD_MATERIALS_MAX 12
#define MILD_PATCHES_MAX 16

/* ---- ground models: the paper's and its rivals behind one contract (docs/model.md section 15) ----
 * A model is where the elements are (con_*: one in the middle of the sole, mild_sole_concentric; the others: the raster)
 * and what a material means to an element. Solvers, memory, friction, drift and results are the same for all. */
typedef enum {
    MILD_MODEL_MILD,       /* a developing cone under every element (the paper) */
    MILD_MODEL_CON_CONE,   /* one developing cone under the whole sole (Choi et al. 2023) */
    MILD_MODEL_CON_SPRING, /* one yielding spring (Lynch et al. 2020): F = k_pen u going down, up to that at rest, 0 up */
    MILD_MODEL_ECC_SPRING, /* the same spring under every element */
    MILD_MODEL_ECC_QUASI,  /* resistive force theory under every element (Li et al. 2013), no inertia */
    MILD_MODEL_RIGID       /* the engine's own contact: a name only, no material has it */
} MildModel;
#define MILD_MODELS 6

extern const char *const mild_model_names[MILD_MODELS];
/* False when the name is unknown. */
int mild_model_find(const char *name, MildModel *model);
/* True for con_cone and con_spring. */
int mild_model_is_concentric(MildModel model);

/* ---- material: the element law's parameters (paper Table III, docs/model.md) ---- */
typedef struct {
    double k_pen;      /* [N/m] penetration stiffness of one element at the surface */
    double sigma_cone; /* [N/m^3] depth-dependent conical stress */
    double alpha;      /* [rad] shear band angle */
    double nu;         /* [-] recruitment rate */
    double c_g;        /* [-] surrounding mass scale */
    double c_d;        /* [-] inertial drag scale */
    double phi;        /* [-] volume fraction */
    double rho;        /* [kg/m^3] grain density */
    double mu;         /* [-] friction coefficient */
    double k_drift;    /* [N/m^2] drift stiffness k_D per element */
    double b_drift;    /* [N s/m] drift damping b_D per element */
    double recovery;   /* [-] share of the depth that springs back: 1 elastic, 0 plastic */
    double bed_depth;  /* [m] firm bottom below the surface */
    double zeta;       /* [-] ecc_quasi: 1 is 1e6 N/m^3 under a level plate going straight down */
    int passive;       /* bool: clamp c_g >= 0 and c_d >= 1/2 so that no energy is created */
    int model;         /* MildModel, not MILD_MODEL_RIGID */
} MildMaterial;

extern const MildField mild_material_fields[];
extern const int mild_material_field_count;

/* sand_loose's numbers: a complete, valid default. */
MildMaterial mild_material_default(void);
/* rubber foam60 foam45 foam28 foam25 grass sand_loose sand_dense; false when the name is unknown.
 * (`rigid` is no material: it is the engine's own contact.) */
int mild_material_preset(const char *name, MildMaterial *material);
int mild_material_preset_count(void);
const char *mild_material_preset_name(int index);
/* Every range, and that the model is one with a material (not rigid). */
MildStatus mild_material_check(const MildMaterial *material, MildError *error);

/* ---- terrain: height and material under a point; small, copyable, may change between steps ---- */
typedef struct {
    double x_min, x_max, y_min, y_max; /* [m] world rectangle, half-open */
    int material;                      /* index into materials */
} MildPatch;

typedef struct {
    int material_count, patch_count;
    double height; /* [m] undisturbed surface h0; added to the map's */
    MildMaterial materials[MILD_MATERIALS_MAX];
    MildPatch patches[MILD_PATCHES_MAX]; /* the first patch that holds the point wins, else the map, else material 0 */
    double map_x, map_y;                 /* [m] world point that lies on the map's origin */
    const MildMap *map;                  /* borrowed, shared; NULL: a level surface without a pattern */
} MildTerrain;

/* Two materials that blend: `share` of the second, at most 1/2; 0 away from a border. */
typedef struct {
    int first, second;
    double share; /* [-] */
} MildBlend;

/* One material everywhere, surface at z = 0. */
MildTerrain mild_terrain_uniform(const MildMaterial *material);
/* Appends a patch. Fails when full, empty, NaN, overlapping an earlier patch, or with an unknown material. */
MildStatus mild_terrain_add_patch(MildTerrain *terrain, const MildPatch *patch, MildError *error);
/* Lays the terrain on a map (NULL: none). Fails, and changes nothing, when the map has a label without a material. */
MildStatus mild_terrain_set_map(MildTerrain *terrain, const MildMap *map, MildError *error);
/* Index of the material at (x, y); at a border the nearer one. */
int mild_terrain_material_at(const MildTerrain *terrain, double x, double y);
MildBlend mild_terrain_blend_at(const MildTerrain *terrain, double x, double y);
/* [m] undisturbed surface h0 at (x, y); O(1), any finite point. */
double mild_terrain_height_at(const MildTerrain *terrain, double x, double y);
/* [-] gradient of h0 at (x, y). */
void mild_terrain_slope_at(const MildTerrain *terrain, double x, double y, double slope[2]);

/* ---- sole: the footprint of one foot, rasterised from its outline ---- */
typedef struct {
    const double *outline; /* [points][2] [m] polygon in the foot frame, either orientation, no self-crossing */
    int points;
    double pitch;  /* [m] element edge a; 0.0195 in the paper */
    double sole_z; /* [m] sole plane in the foot frame (negative: below the ankle) */
    int target_elements; /* 0, or the count wanted (77): the raster's offset is chosen to come nearest, then exact by
                            dropping or adding the least covered border cells */
} MildSoleDef;

typedef struct MildSole MildSole;
MildSole *mild_sole_create(const MildSoleDef *def, MildError *error);
void mild_sole_destroy(MildSole *sole);
int mild_sole_elements(const MildSole *sole);
double mild_sole_pitch(const MildSole *sole);
/* x, y, z of element centres in the foot frame; arrays of mild_sole_elements() [m], owned by the sole. */
const double *mild_sole_x(const MildSole *sole);
const double *mild_sole_y(const MildSole *sole);
double mild_sole_z(const MildSole *sole);
/* One element at the sole's centroid with the area of all its elements, for the concentric models: it carries force, but
 * no moment about its centre. NULL when out of memory. */
MildSole *mild_sole_concentric(const MildSole *sole, MildError *error);

/* ---- element law, closed forms (eqs 1-5 of the paper as read in docs/model.md) ---- */
typedef struct {
    double force;          /* F_g [N] quasistatic */
    double stiffness;      /* dF_g/du [N/m] */
    double added_mass;     /* m_a [kg] */
    double added_mass_per_depth; /* dm_a/du [kg/m] */
} MildElementLaw;
/* The law of one element of area pitch^2 at depth u >= 0 (virgin loading), firm bed included. */
MildElementLaw mild_element_law(const MildMaterial *material, double pitch, double depth);
/* Depth [m] at which the level sole carries `load` [N] at rest, going down slowly on virgin ground. */
double mild_sole_sinkage(const MildSole *sole, const MildMaterial *material, double load);
/* The material of a rival model that compares fairly with `mild`, a material of MILD_MODEL_MILD: under `load` [N] (half
 * the robot's weight) one level foot sinks as deep. Friction, drift, recovery and bed are mild's where the rival has them.
 * sole: the raster; the result is for that raster, or for mild_sole_concentric of it when the model is concentric.
 * Fails for rigid, for a material of another model, and without a load. */
MildStatus mild_model_match(MildModel model, const MildMaterial *mild, const MildSole *sole, double load,
                            MildMaterial *rival, MildError *error);

/* ---- one contact step ---- */
typedef enum { MILD_SOLVER_NEWTON = 0, MILD_SOLVER_GAUSS_SEIDEL = 1 } MildSolver;

typedef struct {
    int feet;
    double dt;                             /* [s] */
    double position[MILD_FEET_MAX][3];     /* [m] ankle, world */
    double rotation[MILD_FEET_MAX][9];     /* foot -> world, row major */
    double velocity[MILD_FEET_MAX][6];     /* [m/s, rad/s] twist at the ankle (linear, angular), world axes, now */
    double inverse_inertia[6 * MILD_FEET_MAX * 6 * MILD_FEET_MAX]; /* A, row major with stride 6*feet, symmetric PSD, may be singular */
    double free_velocity[6 * MILD_FEET_MAX]; /* V^ = J (nu + dt M^-1 (tau - b)) */
    MildSolver solver;
    double tolerance;   /* relative; 0 = default */
    int max_iterations; /* 0 = default; the hard bound of work */
} MildContactInput;

typedef struct {
    double force[3];   /* [N] on the foot, world */
    double torque[3];  /* [N m] about the ankle, world, p x F */
    double zmp_axis[3];  /* [m] from the ankle: point of the central axis nearest the ankle, F x tau/|F|^2 */
    double zmp_sole[2];  /* [m] from the ankle, world axes, on the plane through the sole centre */
    double pressure_center[3]; /* [m] world: sum of p f over sum of f, f the elements' normal forces; 0 without load.
                                  For a level sole it is the ankle plus zmp_sole */
    double area;         /* [m^2] sum of loaded elements */
    double depth_max, depth_mean; /* [m] over the loaded elements */
    int contacts;        /* loaded elements */
} MildFootResult;

typedef struct {
    MildFootResult foot[MILD_FEET_MAX];
    double velocity[6 * MILD_FEET_MAX]; /* V+ after the step */
    double residual;   /* relative, at exit */
    int iterations;
    int converged;     /* bool; 0 whenever a pose or a result is not finite, or dt is not positive */
} MildContactResult;

typedef struct MildGround MildGround; /* memory of all feet: one pointer-free block of mild_ground_bytes() bytes */
typedef struct MildScratch MildScratch; /* working arrays of one thread */

/* soles: [feet]. Bytes of the state block, a multiple of 64. */
size_t mild_ground_bytes(const MildSole *const *soles, int feet);
/* Initialise a block the caller owns (aligned to 8); returns it as a MildGround. */
MildGround *mild_ground_init(void *block, const MildSole *const *soles, int feet);
void mild_ground_reset(MildGround *ground);

/* The same for ground that remembers prints: pressed ground keeps its depth after lift-off, and a later element finds it
 * (docs/model.md section 5). Prints live in the block, in `tiles` squares of 8 x 8 cells of half the first sole's pitch;
 * when they are used up the oldest are forgotten. A print of a foot of 0.27 x 0.10 m takes about ten tiles.
 * tiles: rounded up to a multiple of 8, at most MILD_PRINT_TILES_MAX; 0: no prints, as above. */
#define MILD_PRINT_TILES_MAX 65536
size_t mild_ground_bytes_prints(const MildSole *const *soles, int feet, int tiles);
MildGround *mild_ground_init_prints(void *block, const MildSole *const *soles, int feet, int tiles);
/* Bytes of the block of an initialised ground. */
size_t mild_ground_size(const MildGround *ground);
/* [m] greatest depth the ground at (x, y) remembers, 0 where there is no print. Its surface is (1 - recovery) of it
 * below h0. */
double mild_ground_print_at(const MildGround *ground, double x, double y);

MildScratch *mild_scratch_create(const MildSole *const *soles, int feet, MildError *error);
void mild_scratch_destroy(MildScratch *scratch);

/* Pure: reads ground, writes only scratch and result. The soles are those the scratch was created with. */
void mild_ground_solve(const MildGround *ground, const MildTerrain *terrain, const MildContactInput *input,
                       MildScratch *scratch, MildContactResult *result);
/* Moves the memory to the end of the step just solved with this scratch (positions advanced by dt * V+). */
void mild_ground_advance(MildGround *ground, const MildTerrain *terrain, const MildContactInput *input,
                         const MildScratch *scratch, const MildContactResult *result);

typedef enum {
    MILD_ELEMENT_FREE = 0,      /* carries no normal force */
    MILD_ELEMENT_UNLOADING = 1, /* loaded on the unloading line: not deeper than it has been */
    MILD_ELEMENT_VIRGIN = 2     /* loaded and deeper at the end of the step than ever since it touched */
} MildElementState;

/* Per-element output of the last solve, for foot f; arrays of mild_sole_elements(). Made on demand inside the scratch: ask
 * after each solve; the arrays hold until the next one. Cost: one pass over the foot's elements. */
typedef struct {
    const double *depth;   /* [m] u at the start of the step, negative above the ground */
    const double *normal;  /* [N] vertical part of the element's force, mean over the step */
    const double *tangent_x, *tangent_y; /* [N] horizontal part, world */
    const double *point_x, *point_y, *point_z; /* [m] world */
    const double *flat;    /* [-] share of the element's area still flat after the step (eq 1): 1 untouched, 0 cone complete */
    const uint8_t *state;  /* MildElementState */
    const uint8_t *slip;   /* bool: loaded and sliding, friction at its bound; 0 sticks or carries nothing */
} MildElements;
MildElements mild_scratch_elements(const MildScratch *scratch, int foot);

/* Largest depth each element has reached since it touched [m]; array of mild_sole_elements(). */
const double *mild_ground_depth_max(const MildGround *ground, int foot);

MILD_API_END

#endif
