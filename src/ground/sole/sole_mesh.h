/* Meshes as parts of a shell. */
#ifndef MILD_GROUND_SOLE_MESH_H
#define MILD_GROUND_SOLE_MESH_H

#include "ground/sole/samples.h"

/* Adds elements of a mesh, in its own frame. */
void mesh_sample(const MildShape *mesh, double pitch, Samples *samples);
/* Bool: the surface has no border. *volume: that it encloses [m^3], negative where the triangles
 * face inward. */
int mesh_closed(const MildShape *mesh, double *volume);
/* Bool: a point in the mesh's frame lies inside a closed mesh. */
int mesh_contains(const MildShape *mesh, const double point[3]);

#endif
