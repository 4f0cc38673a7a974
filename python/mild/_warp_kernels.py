"""What mild.Batch needs of a step of MuJoCo Warp, as kernels over all worlds; warp.py launches them. With J of the feet (rows:
linear, angular velocity of each; a round foot transmits no moment, and where all are round there are no angular rows), the
integrator's metric N (M - h dF/dv of implicitfast, M + h damping of Euler) and the force f = passive - bias + actuator + applied:

    N += D e e^T, f += s D a_ref e            joint limits that pushed at the last acceleration (row s e, weight D, reference a_ref)
    V = J v, A = J N^-1 J^T, V_free = V + h J N^-1 f
    mild.Batch.step, then qfrc_applied += J^T wrench

Joint limits are so solved beside the ground, exactly where dF/dv = 0, nearly with dampers; other contacts are solved after it."""
import warp as wp
from mujoco import mjtConstraint

LIMIT = wp.constant(int(mjtConstraint.mjCNSTR_LIMIT_JOINT))
LOW, FLOOR = wp.constant(1), wp.constant(2)  # kinds of Newton's shapes; 0: any other


@wp.kernel(enable_backward=False)
def approach(body: wp.array[int], root: wp.array[int], center: wp.array[wp.vec3], axes: wp.array[wp.mat33], moves: wp.array2d[int],
             radius: wp.array[float], size: int, xpos: wp.array2d[wp.vec3], xmat: wp.array2d[wp.mat33], com: wp.array2d[wp.vec3],
             cdof: wp.array2d[wp.spatial_vector], passive: wp.array2d[float], bias: wp.array2d[float], actuator: wp.array2d[float],
             applied: wp.array2d[float],
             place: wp.array2d[wp.vec3], turn: wp.array2d[wp.mat33], jacobian: wp.array3d[float]):
    """Poses of the soles, and J^T, `size` columns a foot, with f in its last column. A foot with a radius is round: its sole is a disc
    that stays level below its center."""
    w, f, i = wp.tid()
    at = xpos[w, body[f]] + xmat[w, body[f]] * center[f] - wp.vec3(0.0, 0.0, radius[f])
    if i == 0:
        place[w, f] = at
        if radius[f] == 0.0:
            turn[w, f] = xmat[w, body[f]] * axes[f]
    linear, angular = wp.vec3(), wp.vec3()
    if moves[f, i] == 1:  # motions are about the robot's center of mass
        angular = wp.spatial_top(cdof[w, i])
        linear = wp.spatial_bottom(cdof[w, i]) + wp.cross(angular, at - com[w, root[body[f]]])
    for k in range(3):
        jacobian[w, i, size * f + k] = linear[k]
        if size == 6:
            jacobian[w, i, size * f + 3 + k] = wp.where(radius[f] == 0.0, angular[k], 0.0)
    if f == 0:
        jacobian[w, i, jacobian.shape[2] - 1] = passive[w, i] - bias[w, i] + actuator[w, i] + applied[w, i]


@wp.kernel(enable_backward=False)
def add_damping(timestep: float, diagonal: wp.array[int], damping: wp.array2d[float], metric: wp.array2d[float]):
    w, i = wp.tid()
    metric[w, diagonal[i]] += timestep * damping[w % damping.shape[0], i]


@wp.kernel(enable_backward=False)
def add_limits(diagonal: wp.array[int], dof_of: wp.array[int], qpos_of: wp.array[int], limits: wp.array2d[wp.vec2], qpos: wp.array2d[float],
               qacc: wp.array2d[float], equalities: wp.array[int], frictions: wp.array[int], count: wp.array[int], kind: wp.array2d[int],
               joint: wp.array2d[int], weight: wp.array2d[float], reference: wp.array2d[float],
               metric: wp.array2d[float], jacobian: wp.array3d[float]):
    w = wp.tid()
    first = equalities[w] + frictions[w]
    for row in range(first, wp.min(first + count[w], kind.shape[1])):
        if kind[w, row] == LIMIT:
            at = joint[w, row]
            range_of = limits[w % limits.shape[0], at]
            side = wp.where(2.0 * qpos[w, qpos_of[at]] < range_of[0] + range_of[1], 1.0, -1.0)  # 1: at the lower end
            if side * qacc[w, dof_of[at]] < reference[w, row]:
                metric[w, diagonal[dof_of[at]]] += weight[w, row]
                jacobian[w, dof_of[at], jacobian.shape[2] - 1] += side * weight[w, row] * reference[w, row]


def contact_kernel(dofs, feet, size):
    """size: rows of J that a foot has, 3 (round) or 6. In A, V and V_free a foot always has six; those of moments stay zero."""
    rows = feet * size
    columns, area = rows + 1, dofs * dofs
    blocks, block = (1, rows) if size == 6 else (feet, size)

    @wp.kernel(enable_backward=False, module="unique")
    def contact(timestep: float, dense: wp.array[int], metric: wp.array2d[float], jacobian: wp.array3d[float], qvel: wp.array2d[float],
                mobility: wp.array3d[float], twist: wp.array2d[float], free: wp.array2d[float]):
        """With N = L L^T and B = L^-1 [J^T, f], B^T B holds A and, in its last row, J N^-1 f."""
        w = wp.tid()
        index = wp.tile_load(dense, shape=(area,), storage="shared")
        factor = wp.tile_reshape(wp.tile_load_indexed(metric[w], index, shape=(area,), storage="shared"), (dofs, dofs))
        wp.tile_cholesky_inplace(factor)
        right = wp.tile_load(jacobian[w], shape=(dofs, columns), storage="shared")
        now = wp.tile_matmul(wp.tile_load(qvel, shape=(1, dofs), offset=(w, 0), storage="shared"), right)
        half = wp.tile_lower_solve(factor, right)
        product = wp.tile_matmul(wp.tile_transpose(half), half)
        for f in range(blocks):
            velocity = wp.tile_view(now, offset=(0, f * block), shape=(1, block))
            change = timestep * wp.tile_view(product, offset=(rows, f * block), shape=(1, block))
            wp.tile_store(twist, velocity, offset=(w, 6 * f))
            wp.tile_store(free, velocity + change, offset=(w, 6 * f))
            for g in range(blocks):
                part = wp.tile_view(product, offset=(f * block, g * block), shape=(block, block))
                wp.tile_store(mobility[w], part, offset=(6 * f, 6 * g))

    return contact


@wp.kernel(enable_backward=False)
def apply(size: int, jacobian: wp.array3d[float], wrench: wp.array3d[float], force: wp.array2d[float]):
    """A wrench has six numbers a foot, J `size` rows."""
    w, i = wp.tid()
    total = float(0.0)
    for row in range(jacobian.shape[2] - 1):
        total += jacobian[w, i, row] * wrench[w, row // size, row % size]
    force[w, i] += total


@wp.kernel(enable_backward=False)
def forget(which: wp.array[wp.uint8], wrench: wp.array3d[float], foot: wp.array3d[float]):
    w, f, k = wp.tid()
    if which[w] != wp.uint8(0):
        wrench[w, f, k] = 0.0
        foot[w, f, k] = 0.0


@wp.kernel(enable_backward=False)
def leave_contacts(count: wp.array[int], kinds: wp.array[int], first: wp.array[int], second: wp.array[int]):
    """Newton's contacts of what is low with the floor get a shape that is none, which its solver passes over."""
    i = wp.tid()
    if i < count[0]:
        a, b = first[i], second[i]
        if a >= 0 and b >= 0 and kinds[a] + kinds[b] == LOW + FLOOR and kinds[a] != 0 and kinds[b] != 0:
            first[i] = -1
