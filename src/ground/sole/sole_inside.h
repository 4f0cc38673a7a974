/* What the files of this wing call of each other. */
#ifndef MILD_GROUND_SOLE_SOLE_INSIDE_H
#define MILD_GROUND_SOLE_SOLE_INSIDE_H

#include "mild/ground.h"

/* ---- elements of a shell while it is being made ---- */

typedef struct {
    double at[3];     /* [m] */
    double normal[3]; /* [-] outward */
    double area;      /* [m^2] */
    int64_t key;      /* shape; within sole_mesh.c the cell */
} Sample;

typedef struct {
    Sample *list;
    int count;
    int room;          /* of the list */
    int most;          /* of count */
    MildStatus status; /* MILD_ERROR_RANGE: more than `most`; MILD_ERROR_MEMORY: no room. The first
                          of these ends the sampling */
} Samples;

/* Adds nothing once status is not MILD_OK. */
void samples_add(Samples *samples, const Sample *sample);

/* ---- sole_mesh.c: meshes as parts of a shell ---- */

/* Adds elements of a mesh, in its own frame. */
void mesh_sample(const MildShape *mesh, double pitch, Samples *samples);
/* Bool: the surface has no border. *volume: that it encloses [m^3], negative where the triangles
 * face inward. */
int mesh_closed(const MildShape *mesh, double *volume);
/* Bool: a point in the mesh's frame lies inside a closed mesh. */
int mesh_contains(const MildShape *mesh, const double point[3]);

#endif
