/* Steps on a map: in a file of its own, since it takes long to compile. */
#define CONTACT_MAP 1
#include "ground/batch/host.inc"

HostRobot host_robot_map(const BatchShape *shape) {
    return host_kind(shape);
}
