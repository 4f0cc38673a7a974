/* Grounds by name, as the command line says them. */
#ifndef MILD_GROUNDS_H
#define MILD_GROUNDS_H

#include "app/config.h"
#include "mild/ground.h"

/* The preset's material; an unknown name fails with the nearest known one. `rigid` is no material: it fails unless
 * *rigid is given, which it sets. */
MildStatus grounds_find(const char *name, MildMaterial *material, int *rigid, MildError *error);

/* Section [ground] bound to `material`: --ground.k_pen=500. */
ConfigSection grounds_section(MildMaterial *material);

/* "rubber foam60 ... sand_dense", for help texts; returns `text`. */
const char *grounds_names(char *text, size_t size);

/* Static sinkage [m] of a load [N] on `elements` equal elements of edge `pitch`. */
double grounds_sinkage(const MildMaterial *material, double pitch, int elements, double load);

#endif
