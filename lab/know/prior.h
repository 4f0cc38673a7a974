/* The grounds that a walk is asked about (docs/identify.md): a preset of mild whose stiffness,
 * friction and slip length are drawn anew, each by itself and evenly in its logarithm. */
#ifndef KNOW_PRIOR_H
#define KNOW_PRIOR_H

#include "base/random.h"
#include "mild/ground.h"

/* What is drawn: member of PriorGround, unit, lowest and highest value. */
#define PRIOR_LIST(X)                                                                              \
    X(k_pen, "N/m", 100, 2000)                                                                     \
    X(sigma_cone, "N/m^3", 5e4, 3e5)                                                               \
    X(mu, "-", 0.2, 1.3)                                                                           \
    X(slip_length, "m", 1e-3, 1)

/* [m] Half of the weight may sink a sole so deep; a softer ground is drawn again. */
#define PRIOR_SINKAGE 0.06
/* [m] From this slip length on the ground has no slip law, because slip then costs nothing. */
#define PRIOR_NO_SLIP 0.1

typedef enum {
    PRIOR_WIDE,    /* all of PRIOR_LIST, under any preset of mild */
    PRIOR_PAPER,   /* that of lab/paper/latents.py: k_pen and sigma_cone alone, under three */
    PRIOR_PRESETS, /* a preset of mild as it is */
    PRIORS
} Prior;

/* What is asked. */
typedef struct {
    double sinkage; /* [m] of a level sole under half of the robot's weight */
    double k_pen, sigma_cone, mu, slip_length;
    int preset; /* that lends the rest, see mild_material_preset_name */
} PriorGround;

/* load: [N] on the sole. */
PriorGround prior_draw(Prior prior, Random *r, const MildSole *sole, double load,
                       MildMaterial *material);
/* The same of a material of mild. */
PriorGround prior_ground(const MildMaterial *material, const MildSole *sole, double load);

#endif
