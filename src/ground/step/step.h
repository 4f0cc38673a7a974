/* The stages of a contact step, in order, and what they call of each other:
 *
 *     mild_ground_solve       prepare.c   the elements that may touch, and the law of each
 *      (solve.c)              newton.c    the equations of the step; or sweep.c
 *                             pass.c      impulses at a trial velocity, for newton.c
 *                             energy.c    solves again where friction has created energy
 *     mild_ground_advance     advance.c   what the ground remembers
 *     mild_scratch_elements   elements.c  what each element did
 */
#ifndef MILD_GROUND_STEP_H
#define MILD_GROUND_STEP_H

#include "ground/step/scratch.h"

/* ---- prepare.c: the elements that may touch, and the law of each ---- */

/* Lists the elements and sets the law of every slot for this step. Returns how many elements may
 * touch. */
int contact_prepare(const MildGround *ground, const MildTerrain *terrain,
                    const MildContactInput *input, MildScratch *scratch);

/* ---- locate.c: where the elements of a foot are, which may touch, and their slots ---- */

/* Sets origin, arms and `uneven` from the pose. */
void foot_set_pose(FootScratch *foot, const MildTerrain *terrain, const double *position,
                   const double *R);
/* Computes the depth of every element of a plane sole after foot_set_pose. Where the ground differs
 * from place to place, also its world position, and on uneven ground the gradient under it.
 * imprints: bool, the ground keeps imprints. */
void foot_locate(FootScratch *foot, const MildTerrain *terrain, int imprints);
/* Depth of every element of a foot on uneven ground, and the gradient under it. */
void foot_surface(FootScratch *foot, const MildTerrain *terrain);
/* Sets `least` for the motion of foot f. steepest: upper bound [-] on the gradient of the
 * ground. */
void foot_set_least(FootScratch *foot, const MildContactInput *input, double steepest, int f);
/* Bool: no element can touch in this step, seen from the bounding box. Sets reach and away. After
 * foot_set_pose and foot_set_least. */
int foot_is_away(FootScratch *foot, const MildTerrain *terrain, double steepest);
/* Lists the elements that may touch in this step, in ascending order. The common cases, all
 * elements or none, are found without a branch per element. */
void foot_list(FootScratch *foot);

/* Copies the listed elements into consecutive slots. */
void slots_gather(const FootScratch *foot, const Memory *memory);

/* Sets slope and depth of the slots on uneven ground. before: bool, it was uneven in the last step
 * too. height: of the terrain [m].
 *
 * A step replaces the ground under an element by its tangent plane. Where the ground rises above
 * this plane, the element would be deeper after the step without having been pressed down, and
 * would gain energy. So an element that stays in the ground starts at its depth below the last
 * step's plane when that is smaller. */
void slots_uneven(const FootScratch *foot, int32_t before, const Memory *memory, double height,
                  const Motion *now);
/* Clears the slopes when a foot has left uneven ground. On level ground nothing writes them. */
void slots_level(const FootScratch *foot);

/* Multiplies what a slot's law makes of forces and masses. */
void slot_scale(Slots *s, int i, double share);

/* Sets the greatest depth of unloaded elements to that of the imprint under them. Below h0, within
 * an imprint, it is at least the depth whose unloading line reaches zero at the element, so that
 * moving sideways in an imprint never loads the element. Elastic ground beside an imprint has no
 * such depth: there the element gets no law. R: rotation of the foot. */
void slots_imprints(const FootScratch *foot, const Imprints *imprints, const Memory *memory,
                    const double *R);

/* ---- mixture.c: materials of the slots. Near a smooth border a slot has the law of two ---- */

/* What a material gives a slot. Where path costs support it adds no resistance. pitch: [m] edge of
 * an element. width: [m] shorter side of the sole. sides: width, but 0 for a shell. */
SlotLaw material_law(const MildMaterial *material, double pitch, double width, double sides);
/* Derives the laws of the terrain's materials. Laws of materials whose bytes have not changed are
 * kept. */
void foot_laws(FootScratch *foot, const MildTerrain *terrain);
/* What a material or a mixture of two gives element e of a foot. derived: [MILD_MATERIALS_MAX] */
SlotLaw mixture_law(const FootScratch *foot, const DerivedLaw *derived, int32_t mixture, int e);
/* Gives each slot the law of the material that its element touched down on, so that a foot that
 * slides across a border keeps its law. An element in the air takes the material under it. */
void slots_materials(const FootScratch *foot, const MildTerrain *terrain, const Memory *memory);
/* Gives the padding a law without force at any depth. */
void slots_pad(const FootScratch *foot);

/* ---- shell.c: shells (docs/model.md, section 20): elements with a height, normal and area ---- */

/* foot_locate and foot_list of a shell: lists the elements near the ground that face down, too.
 * steepest: as for foot_is_away. */
void shell_list(FootScratch *foot, const MildTerrain *terrain, double steepest);
/* Gives the slots their elements, material and ground, as foot_slots does for a plane sole. now:
 * motion at the start of the step. Imprints take the elements for level squares. */
void shell_slots(FootScratch *foot, const MildGround *ground, int f, const MildTerrain *terrain,
                 const Memory *memory, const Motion *now, double dt);
/* The rotation that imprints take for that of a shell. */
extern const double shell_level[9];

/* [N s m] Sum of the heights times the normal impulses. *area: [m^2] of the loaded elements. */
double shell_loaded(const FootScratch *foot, double *area);

/* What the rim leaves of the load of each slot of a shell, into `lean`, and the ground ahead of
 * it, into `ahead`. On ground with LAW_HEAP. */
void shell_lean(const FootScratch *foot, const Motion *now);

/* Moments of the entries of -dI/dv of a shell's slots, by 1, x, y, z, x^2, xy, y^2, yz, z^2, zx. */
typedef double ShellMoments[3][3][10];
/* The hessian as in pass.c with p = sum over four factors (1, x, y, height). H: [36]. */
void shell_hessian(const FootScratch *foot, const ShellMoments M, double *H);

/* ---- frame.c: feet that press in a frame of their own (law/frame.h) ---- */

/* Arms, twists, inverse inertia and wrenches of such a foot are in its frame until the results are
 * written. */

/* Sets the frame of a foot by the ground under the point (0, 0, z) of its sole, and its levers. R:
 * [9] rotation of the foot. */
void foot_frame(FootScratch *foot, const MildTerrain *terrain, const double *R);
/* Twists or wrenches, two vectors, of the world in the frame of a foot, and back. The two may be
 * the same. */
void twist_of_world(const FootScratch *foot, const double *world, double *own);
void twist_to_world(const FootScratch *foot, const double *own, double *world);
/* The input in the frames of the listed feet, but for the poses: `input` itself where none has a
 * frame, else of the scratch. */
const MildContactInput *input_of_world(MildScratch *scratch, const MildContactInput *input);

/* ---- pass.c: impulses of all elements at trial twists of the feet, and their derivatives ---- */

/* Computes the impulse of every slot at the twists V, its derivatives, and the wrenches of the
 * feet. twist: [6 listed] of the listed feet, in their order. */
void contact_pass(MildScratch *scratch, double dt, const double *twist);
/* The same with the friction bounds fixed at slot.bound. The impulses are then minus the gradient
 * of a convex function of V. */
void contact_pass_held(MildScratch *scratch, double dt, const double *twist);
/* Computes the hessians of the feet from the derivatives of the last pass. */
void contact_hessian(MildScratch *scratch);

/* sums[k]: of the lanes of lanes[k], in their order. */
void lanes_sum(const Lanes *lanes, int count, double *sums);

/* ---- newton.c and sweep.c: V+ = V_free + A W(V+) (docs/model.md, section 7) ---- */

/* The solvers leave the impulses in the slots and the wrenches in the scratch, and set velocity,
 * residual, iterations and converged of the result. */

/* Newton's method on the feet's twists. */
void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result);
/* The paper's Algorithm 1: sweeps over the elements. With MILD_SOLVER_EXPLICIT to the letter: the
 * normal impulses are those of the depths and speeds before the step, friction alone is swept, and
 * drift resistance follows; there is no memory. */
void sweep_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result);

/* ---- energy.c: friction must not create energy (docs/model.md, section 17) ---- */

#define ENERGY_ROUNDS 2 /* a step is solved again at most this often */

/* At the start of a step: clears the reversal velocities (Element.turn_x, turn_y). */
void energy_begin(MildScratch *scratch);
/* Bool: friction created energy in the step just solved, and the step must be solved again. Sets
 * the reversal velocity of the elements whose friction did so, or with `all` of every element. */
int energy_created(MildScratch *scratch, const MildContactInput *input,
                   const MildContactResult *result, int all);

#endif
