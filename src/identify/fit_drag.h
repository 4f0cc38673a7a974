/* A plate that slides, on ground where slip costs support (mild, mild_merged).
 *
 * Ground that carries F_v(u) without slip carries, after the slip s and the fresh penetration a,
 *     F = q F_v(u),   dq/ds = -q^2/slip_length,   dq/da = (1 - q)/regain_length
 * with both lengths times 1 + slip_growth u/slip_length (slip_growth is not fitted), and holds the
 * plate back by
 *     H = min(mu, max(0.1, (3 + sqrt 8) grip (1 - q)/(2 - q))) F + side(u)
 * (docs/model.md section 22; without grip by mu F). The shape of F_v is that of the fitted press.
 * Its size is each record's own, by least squares, because a bed differs from the next by more than
 * slip_length should feel. A row of F counts by 1/F, because the scatter of grains is as the root
 * of the force (lab/grains/README.md). Pure functions: thread safe. */
#ifndef LAB_FIT_DRAG_H
#define LAB_FIT_DRAG_H

#include "identify/fit_record.h"

/* Bool: slip costs support under the model. */
int fit_drag_is_modelled(MildModel model);

/* Bool: a row is of the same record as the one before it. */
int fit_drag_is_next(const FitPoint *row);
/* What the rows of one record should have. */
void fit_drag_forces(const FitPlate *plate, const MildMaterial *material, const FitPoint *points,
                     int count, double *force);

#endif
