/* libmild: soft ground for legged robots. Two-way, per-element forces between rigid feet and foam,
 * rubber, grass, sand.
 *
 * A step of an engine that owns M, J and the smooth forces:
 *     A = J M^-1 J^T,  v_free = J (nu + dt M^-1 (tau - b))          (6 rows per foot, twist at the
 * ankle, world axes) mild_ground_solve(...)    pure: wrench impulses and everything per element,
 * into the scratch tau += J^T wrench/dt, integrate mild_ground_advance(...)  moves the memory
 * (depth maxima, drift length), once per accepted step
 *
 * SI units, radians, z up. A foot's reference point is its ankle. Penetration u = h0 - z is
 * positive down; forces on the foot are positive up. Equations are the paper's, read as
 * docs/model.md says.
 *
 * Thread safety: constant objects (sole, terrain while nobody writes it) may be shared; a
 * MildGround and a MildScratch belong to one thread at a time; there is no global state. No
 * function prints, exits or allocates, but for those that say they return NULL when out of memory.
 * Pointers must not be NULL, but for `error` and where it is said; a number that is wrong in
 * another way is refused where a function can fail, and otherwise computed with. */
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
 * the same for all. A model is a row of this list and a file, src/ground/model_NAME.c; all else that
 * names models derives from the two. */
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

/* Their names as users write them, in the enum's order. */
extern const char *const mild_model_names[MILD_MODELS];
/* The model of that name into *model; false, and nothing written, when the name is unknown. */
int mild_model_find(const char *name, MildModel *model);
/* Of any model; constant. */
const MildModelInfo *mild_model_info(MildModel model);
/* Its `concentric`. */
int mild_model_is_concentric(MildModel model);

/* ---- material: the element law's parameters (paper Table III; ranges and presets: docs/model.md
 * section 10) ---- */

/* A plain struct: start from mild_material_default or a preset, change what differs,
 * mild_material_check it. */
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

/* Its fields with unit, range and meaning: [mild_material_field_count]. For config files, sliders,
 * random draws. */
extern const MildField mild_material_fields[];
extern const int mild_material_field_count;

/* sand_loose's numbers: a complete, valid default. */
MildMaterial mild_material_default(void);
/* A material by its name into *material; false, and nothing written, when the name is unknown. Of
 * mild: rubber foam60 foam45 foam28 foam25 grass sand_loose sand_dense. Of bekker: dry_sand
 * sandy_loam clay snow lunar_soil. (`rigid` is no material: it is the engine's own contact.) */
int mild_material_preset(const char *name, MildMaterial *material);
/* How many presets of mild there are. */
int mild_material_preset_count(void);
/* Name of the preset with that index, 0 .. count - 1. */
const char *mild_material_preset_name(int index);
/* Every range, and that the model is one with a material (not rigid). Fails with MILD_ERROR_RANGE,
 * naming the field. Nothing else checks materials: what is not checked is computed with. */
MildStatus mild_material_check(const MildMaterial *material, MildError *error);

/* ---- terrain: height and material under a point; small, copyable, may change between steps ----
 */
/* A rectangle of another material. */
typedef struct {
    double x_min, x_max, y_min, y_max; /* [m] world rectangle, half-open */
    int material;                      /* index into materials */
} MildPatch;

/* A plain struct: copy it, compare it, change its numbers between two steps. Elements on the ground
 * keep the index of the material that they touched down on (docs/model.md section 5). */
typedef struct {
    int material_count, patch_count;            /* in use of the arrays below */
    double height;                              /* [m] undisturbed surface h0; added to the map's */
    MildMaterial materials[MILD_MATERIALS_MAX]; /* [material_count], checked */
    MildPatch patches[MILD_PATCHES_MAX]; /* the first patch that holds the point wins, else the map,
                                            else material 0 */
    double map_x, map_y;                 /* [m] world point that lies on the map's origin */
    const MildMap *map; /* borrowed, shared; NULL: a level surface without a pattern */
} MildTerrain;

/* Two materials that blend near a border. */
typedef struct {
    int first, second; /* indices into materials; first: the nearer */
    double share;      /* [-] of the second, at most 1/2; 0 away from a border */
} MildBlend;

/* One material everywhere, surface at z = 0. */
MildTerrain mild_terrain_uniform(const MildMaterial *material);
/* Appends a patch; infinite edges make strips and half planes. Fails, with the terrain unchanged,
 * when it is full, the patch empty, NaN, overlapping an earlier one, or of an unknown material. */
MildStatus mild_terrain_add_patch(MildTerrain *terrain, const MildPatch *patch, MildError *error);
/* Lays the terrain on a map (NULL: none). Fails, and changes nothing, when the map has a label
 * without a material. */
MildStatus mild_terrain_set_map(MildTerrain *terrain, const MildMap *map, MildError *error);
/* Index of the material at the world's (x, y) [m]; at a border the nearer one. */
int mild_terrain_material_at(const MildTerrain *terrain, double x, double y);
/* Both materials there. */
MildBlend mild_terrain_blend_at(const MildTerrain *terrain, double x, double y);
/* [m] Undisturbed surface h0 at (x, y); O(1), any finite point. */
double mild_terrain_height_at(const MildTerrain *terrain, double x, double y);
/* [-] gradient of h0 at (x, y). */
void mild_terrain_slope_at(const MildTerrain *terrain, double x, double y, double slope[2]);

/* ---- sole: the footprint of one foot, rasterised from its outline (docs/model.md section 4) ----
 */

/* What a sole is made from. */
typedef struct {
    const double *outline; /* [points][2] [m] polygon in the foot frame, either orientation, no
                              self-crossing */
    int points;            /* of the outline, 3 .. 4096 */
    double pitch;          /* [m] element edge a; 0.0195 in the paper */
    double sole_z;         /* [m] sole plane in the foot frame (negative: below the ankle) */
    int target_elements;   /* 0, or the count wanted (77): the raster's offset is chosen to come
                              nearest, then exact by   dropping or adding the least covered border cells
                            */
} MildSoleDef;

/* A rasterised sole: constant once made, shared by any number of threads, scratches and grounds. */
typedef struct MildSole MildSole;
/* Copies what it needs of `def`. NULL, with the field's name in *error, when the outline has no
 * area, crosses itself or is not finite, when pitch or target are out of range or make more than
 * 65536 cells, or when out of memory. */
MildSole *mild_sole_create(const MildSoleDef *def, MildError *error);
/* May be NULL. Scratches and grounds made from it do not need it any more. */
void mild_sole_destroy(MildSole *sole);
/* Count of elements, at least 1. */
int mild_sole_elements(const MildSole *sole);
/* [m] Edge of an element; its area is the square. */
double mild_sole_pitch(const MildSole *sole);
/* x, y, z of element centres in the foot frame; arrays of mild_sole_elements() [m], owned by the
 * sole. */
const double *mild_sole_x(const MildSole *sole);
const double *mild_sole_y(const MildSole *sole);
double mild_sole_z(const MildSole *sole);
/* One element at the sole's centroid with the area of all its elements, for the concentric models:
 * it carries force, but no moment about its centre. A sole of its own, to be destroyed. NULL when
 * out of memory. */
MildSole *mild_sole_concentric(const MildSole *sole, MildError *error);

/* ---- element law, closed forms (eqs 1-5 of the paper as read in docs/model.md section 3) ---- */

/* What one element feels on virgin ground: F = force + damping w + c_d added_mass_per_depth w^2 +
 * added_mass dw/dt, w > 0 downward. */
typedef struct {
    double force;                /* F_g [N] quasistatic */
    double stiffness;            /* dF_g/du [N/m] */
    double damping;              /* [N s/m] hunt_crossley; 0 of all others */
    double added_mass;           /* m_a [kg] */
    double added_mass_per_depth; /* dm_a/du [kg/m] */
} MildElementLaw;
/* The law of one element of area pitch^2 at depth u >= 0 (virgin loading), firm bed included. */
MildElementLaw mild_element_law(const MildMaterial *material, double pitch, double depth);
/* [m] Depth at which the level sole carries `load` [N] at rest, going down slowly on virgin ground.
 */
double mild_sole_sinkage(const MildSole *sole, const MildMaterial *material, double load);
/* The material of a rival model that compares fairly with `mild`, a material of MILD_MODEL_MILD:
 * under `load` [N] (half the robot's weight) one level foot sinks as deep. Friction, drift,
 * recovery and bed are mild's where the rival has them. sole: the raster; the result is for that
 * raster, or for mild_sole_concentric of it when the model is concentric. Fails for rigid, for a
 * material of another model, and without a load. */
MildStatus mild_model_match(MildModel model, const MildMaterial *mild, const MildSole *sole,
                            double load, MildMaterial *rival, MildError *error);

/* Resistive force theory: coefficients [-] that zeta 1e6 N/m^3 times depth times area turn into
 * force [N]. In the plane (Li et al. 2013): beta [rad] slope of the plate, positive when its
 * leading face looks forward and down; gamma [rad] direction of motion below the horizontal, 0 ..
 * pi/2. alpha: resistance backward, upward; (0.007, 1) for a level plate straight down. */
void mild_resist_plane(double beta, double gamma, double alpha[2]);
/* The same in space (Agarwal et al. 2023, a level plate straight down scaled to 1): unit normal [3]
 * out of the plate into the ground, unit direction of motion, world; alpha [-]: force of the ground
 * on the plate. 0 for a face that trails. */
void mild_resist_space(const double normal[3], const double direction[3], double alpha[3]);

/* ---- one contact step (docs/model.md sections 6, 7) ---- */

/* Both give the same answer. */
typedef enum {
    MILD_SOLVER_NEWTON = 0,      /* convex minimisation in the feet's twists: the fast one */
    MILD_SOLVER_GAUSS_SEIDEL = 1 /* the paper's sweeps over the elements (Algorithm 1) */
} MildSolver;

/* What the engine knows before the step. Fixed size, no pointers. */
typedef struct {
    int feet;                          /* that of the scratch and the ground */
    double dt;                         /* [s] above 0 */
    double position[MILD_FEET_MAX][3]; /* [m] ankle, world */
    double rotation[MILD_FEET_MAX][9]; /* [-] foot -> world, row major, orthonormal */
    double velocity[MILD_FEET_MAX]
                   [6]; /* [m/s, rad/s] twist at the ankle (linear, angular), world axes, now */
    double
        inverse_inertia[6 * MILD_FEET_MAX * 6 * MILD_FEET_MAX]; /* [1/kg, ...] A = J M^-1 J^T, row
                                                                   major with stride 6*feet,
                                                                   symmetric PSD, may be singular */
    double free_velocity[6 * MILD_FEET_MAX]; /* [m/s, rad/s] V^ = J (nu + dt M^-1 (tau - b)): twists
                                                without ground */
    MildSolver solver;                       /* which of the two */
    double tolerance;   /* [-] of the residual; 0 = default, 1e-9 (sweeps 1e-10) */
    int max_iterations; /* 0 = default; the hard bound of work */
} MildContactInput;

/* The ground on one foot, mean over the step (docs/model.md section 9). Zero for a foot in the air.
 */
typedef struct {
    double force[3];    /* [N] on the foot, world */
    double torque[3];   /* [N m] about the ankle, world, p x F */
    double zmp_axis[3]; /* [m] from the ankle: point of the central axis nearest the ankle, F x
                           tau/|F|^2 */
    double zmp_sole[2]; /* [m] from the ankle, world axes, on the plane through the sole centre */
    double
        pressure_center[3]; /* [m] world: sum of p f over sum of f, f the elements' normal forces; 0
                               without load. For a level sole it is the ankle plus zmp_sole */
    double area;            /* [m^2] sum of loaded elements */
    double depth_max, depth_mean; /* [m] over the loaded elements */
    int contacts;                 /* loaded elements */
} MildFootResult;

/* What a step does to the feet. Fixed size, no pointers. */
typedef struct {
    MildFootResult foot[MILD_FEET_MAX]; /* [feet] */
    double velocity[6 * MILD_FEET_MAX]; /* [m/s, rad/s] twists at the ankles after the step, V+ = V^
                                           + A W */
    double residual;                    /* [-] relative, in the metric of kinetic energy, at exit */
    int iterations;                     /* Newton steps or sweeps done */
    int converged; /* bool; 0 whenever a pose or a result is not finite, a material's number NaN, or
                      dt not positive */
} MildContactResult;

/* ---- memory and working arrays (docs/model.md section 5) ---- */

/* What the feet's elements remember (greatest depth, drift): one pointer-free block of
 * mild_ground_bytes() bytes. Copy it with memcpy to save, restore, send or branch a simulation. */
typedef struct MildGround MildGround;
/* Working arrays of one thread: serves any number of grounds with the same soles, one after the
 * other. */
typedef struct MildScratch MildScratch;

/* Bytes of the state block, a multiple of 64. soles: [feet], feet 1 .. MILD_FEET_MAX. */
size_t mild_ground_bytes(const MildSole *const *soles, int feet);
/* Initialise a block of that size that the caller owns (aligned to 8); returns it as a MildGround,
 * nothing touched yet. */
MildGround *mild_ground_init(void *block, const MildSole *const *soles, int feet);
/* Forget everything: the feet were moved. */
void mild_ground_reset(MildGround *ground);

/* The same for ground that remembers prints: pressed ground keeps its depth after lift-off, and a
 * later element finds it (docs/model.md section 5). Prints live in the block, in `tiles` squares of
 * 8 x 8 cells of half the first sole's pitch; when they are used up the oldest are forgotten. A
 * print of a foot of 0.27 x 0.10 m takes about ten tiles. tiles: rounded up to a multiple of 8, at
 * most MILD_PRINT_TILES_MAX; 0: no prints, as above. */
#define MILD_PRINT_TILES_MAX 65536
size_t mild_ground_bytes_prints(const MildSole *const *soles, int feet, int tiles);
/* Initialise a block of that size, as mild_ground_init does. */
MildGround *mild_ground_init_prints(void *block, const MildSole *const *soles, int feet, int tiles);
/* [B] of the block of an initialised ground. */
size_t mild_ground_size(const MildGround *ground);
/* [m] greatest depth the ground at (x, y) remembers, 0 where there is no print. Its surface is (1 -
 * recovery) of it below h0. */
double mild_ground_print_at(const MildGround *ground, double x, double y);

/* NULL when feet is not 1 .. MILD_FEET_MAX or out of memory. soles: [feet], copied. */
MildScratch *mild_scratch_create(const MildSole *const *soles, int feet, MildError *error);
/* May be NULL. */
void mild_scratch_destroy(MildScratch *scratch);

/* Pure: reads ground, writes only scratch and result; may be called any number of times before
 * mild_ground_advance. The soles of ground and scratch are the same. It always comes back, within
 * max_iterations: look at result->converged. Impulses by eqs 4, 5, 13 and 14, twists by eq 9. */
void mild_ground_solve(const MildGround *ground, const MildTerrain *terrain,
                       const MildContactInput *input, MildScratch *scratch,
                       MildContactResult *result);
/* Moves the memory to the end of the step just solved with this scratch, input and result:
 * positions advanced by dt * V+. Once per step that the engine keeps. */
void mild_ground_advance(MildGround *ground, const MildTerrain *terrain,
                         const MildContactInput *input, const MildScratch *scratch,
                         const MildContactResult *result);

/* What an element did in the last step. */
typedef enum {
    MILD_ELEMENT_FREE = 0,      /* carries no normal force */
    MILD_ELEMENT_UNLOADING = 1, /* loaded on the unloading line: not deeper than it has been */
    MILD_ELEMENT_VIRGIN =
        2 /* loaded and deeper at the end of the step than ever since it touched */
} MildElementState;

/* Per-element output of the last solve for one foot; arrays of mild_sole_elements(). */
typedef struct {
    const double *depth;  /* [m] u at the start of the step, negative above the ground */
    const double *normal; /* [N] vertical part of the element's force, mean over the step */
    const double *tangent_x, *tangent_y;       /* [N] horizontal part, world */
    const double *point_x, *point_y, *point_z; /* [m] world */
    const double *flat;   /* [-] share of the element's area still flat after the step (eq 1): 1
                             untouched, 0 cone complete */
    const uint8_t *state; /* MildElementState */
    const uint8_t
        *slip; /* bool: loaded and sliding, friction at its bound; 0 sticks or carries nothing */
} MildElements;
/* Made on demand inside the scratch, for foot 0 .. feet - 1: ask after each solve; the arrays hold
 * until the next one. Cost: one pass over the foot's elements. */
MildElements mild_scratch_elements(const MildScratch *scratch, int foot);

/* [m] Greatest depth that each element has reached since it touched, 0 untouched; array of
 * mild_sole_elements(), inside the ground's block. */
const double *mild_ground_depth_max(const MildGround *ground, int foot);

MILD_API_END

#endif
