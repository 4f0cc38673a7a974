/* The artificial athlete, by which sports surfaces are sold: a mass falls on a spring whose foot
 * stands on the ground. */
#ifndef LAB_ATHLETE_H
#define LAB_ATHLETE_H

#include "mild/ground.h"

#define ATHLETE_MASS 20.0        /* m [kg] */
#define ATHLETE_FOOT 0.070       /* [m] diameter of the flat foot */
#define ATHLETE_GRAVITY 9.81     /* g [m/s^2] */
#define ATHLETE_REFERENCE 1500.0 /* [N] to which EN 14809 refers the deformation */

/* The two devices differ in fall and spring. */
typedef struct {
    double fall;   /* h [m] */
    double spring; /* k [N/m] */
} AthleteDevice;
extern const AthleteDevice athlete_shock;  /* EN 14808; FIFA and ASTM F3189 have the same drop */
extern const AthleteDevice athlete_deform; /* EN 14809 */

typedef struct {
    double reduction;   /* [-] EN 14808, force reduction: 1 - peak/(peak on concrete) */
    double returned;    /* [-] of that drop: greatest speed up by the greatest down, squared */
    double deformation; /* [m] EN 14809, vertical deformation: greatest depth 1500 N/peak */
    double concrete;    /* [N] peak of EN 14808 on concrete */
} Athlete;

/* Drops both devices once on level, undisturbed ground, as deep as they go: without firm bed. */
MildStatus athlete_drop(const MildMaterial *material, Athlete *result, MildError *error);

#endif
