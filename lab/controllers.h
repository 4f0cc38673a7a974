/* Controllers of the lab, as CONTROLLER_LIST of src/control/controller.h has the others. */
#ifndef LAB_CONTROLLERS_H
#define LAB_CONTROLLERS_H

#include "control/controller.h"

#define LAB_CONTROLLERS(X)                                                                         \
    X(clock, CONTROLLER_FOLLOWS,                                                                   \
      "a network that sees one frame, at 40 Hz (Singh et al. 2024), of --policy")                  \
    X(ht2, CONTROLLER_FOLLOWS, "a transformer (Radosavovic et al. 2024), of --policy")             \
    X(passivity, CONTROLLER_FOLLOWS | CONTROLLER_OWN_GAINS,                                        \
      "a biped that knows its true state: a DCM plan and whole-body impedances command torques")

LAB_CONTROLLERS(CONTROLLER_MAKE)

#endif
