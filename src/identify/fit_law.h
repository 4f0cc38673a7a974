/* How the force in the rows of a record follows from a model's parameters.
 *
 * The force on a level plate of n elements that goes down at the speed w into virgin ground is
 *     F(u, w) = n (F_g(u) + d F_e(u) w + c_d m_a'(u) w^2 + m_a(u) dw/dt)
 * (eqs 4 and 5; F_e, d: hunt_crossley alone). Some parameters act in a combination only: of the
 * developing cone k_pen, sigma_cone/cos(alpha), u_f = R tan(alpha)/nu and the drag's
 * c_g c_d phi rho nu; of bekker exponent and k_c/b + k_phi.
 *
 * On its way up from the greatest depth a, where the force was F_a, it is
 *     F(u) = F_a max(1 - (a - u)/e, 0),   e = max(recovery a, 0.1 mm)
 * F_a is that of the rows themselves, by least squares, so that recovery alone is asked of them.
 *
 * Under the pressure p the ground of bekker resists a slip j by the shear stress
 *     s(j) = (cohesion + p mu) (1 - exp(-j/shear_length))
 * and a ring that turns by an angle by the mean of s over it, weighted by the radius, which is its
 * torque over that of a stress of 1. A plate that slides where slip costs support: below. Pure
 * functions: thread safe. */
#ifndef LAB_FIT_LAW_H
#define LAB_FIT_LAW_H

#include "identify/fit_record.h"
#include "mild/ground.h"

enum { FIT_PARAMETERS_MAX = MILD_MODEL_FIELDS };

/* What the data determine where they do not determine a parameter by itself. */
typedef struct {
    const char *name;
    const char *unit;
    const char *carrier; /* the parameter that follows from it when all others are known */
    double low, high;    /* range that those of the parameters allow */
    int last;            /* bool: `set` needs the others to be set */
    double (*get)(const MildMaterial *material);
    void (*set)(MildMaterial *material, double value); /* sets the carrier */
} FitCombination;

/* The combination that a parameter carries, or NULL. */
const FitCombination *fit_combination(const char *carrier);

/* The parameters of a model that such rows can sense, in the order of its fields. Returns their
 * count; 0 for rigid, for FIT_SHEAR of a model without a law of shear, and for FIT_DRAG of one
 * under which slip costs no support. */
int fit_parameters(MildModel model, FitKind kind, const MildField *fields[FIT_PARAMETERS_MAX]);
enum { FIT_PROBES = 2 };
/* The default material, with numbers for which everything has an effect in one probe or the other:
 * in the second the friction of a plate that slides is bounded by mu. */
MildMaterial fit_probe(int number);
/* Bool: the force depends on it only through speed or acceleration. */
int fit_is_rate(MildModel model, const MildField *field);
/* Bool: a number that is never fitted: bed_depth or slip_growth, which may be held, or bekker's
 * plate_width, which is the plate's. */
int fit_is_geometry(MildModel model, const char *name);
/* Range in which a parameter is fitted or held: the material's. Ground that creates no energy has
 * c_d >= 1/2 and c_g >= 0. */
void fit_range(const MildField *field, double *low, double *high);
/* A number of the field as a fit counts it: 0 of slip_length, by which slip costs nothing, is its
 * longest. */
double fit_counted(const MildField *field, double number);
/* [N/m^(n+2)] k_c/b + k_phi of bekker under a plate of that width [m]; 0 of other models. Where it
 * is below 0, a fit's forces are. */
double fit_modulus(const MildMaterial *material, double width);
/* The number of a material. */
double *fit_number(MildMaterial *material, const MildField *field);

/* [N], of FIT_SHEAR [N/m^2]: the force in every row on its plate: force[count]. plates: those that
 * the rows name. The material's `passive` and plate_width are ignored. */
void fit_forces(FitKind kind, const FitPlate *plates, const MildMaterial *material,
                const FitPoint *points, int count, double *force);

/* ---- a plate that slides, on ground where slip costs support ---- */

/* For mild and mild_merged.
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

/* Bool: slip costs support under the model. */
int fit_drag_is_modelled(MildModel model);

/* Bool: a row is of the same record as the one before it. */
int fit_drag_is_next(const FitPoint *row);

/* ---- the rows of a fit of such a plate, from those of its record ---- */

/* The rows of a fit, rows[2 * count], from those that fit_sliding found on a plate. curve: the
 * force that a press of the ground has. Returns their number; 0 where nothing pushes up. */
int fit_slide_rows(const FitPlate *plate, const MildMaterial *curve, const FitPoint *slide,
                   int count, FitPoint *rows);

/* The ground that a fit of FIT_DRAG starts from: the press's numbers where the press determines
 * them, else `known`'s. press: NULL: none was fitted. */
MildMaterial fit_slide_base(const MildMaterial *known, const MildMaterial *press);

#endif
