/* What passes between the networks of a policy, to look at and to replace. */
#ifndef LEARN_INSIDE_H
#define LEARN_INSIDE_H

/* Outputs, for each row; NULL: not wanted. */
typedef struct {
    float *latent;    /* [rows][latent] z = mu */
    float *theta;     /* [rows][policy_theta] theta1, then theta2 */
    float *modulated; /* [rows][latent] z~, as the actor gets it */
    float *estimates; /* [rows][estimates] of the encoder */
} PolicyInside;

/* What the actor gets in the place of the networks' own numbers. */
typedef struct {
    const float *latent;    /* [latent] z; NULL: mu */
    const float *estimates; /* [estimates], for the actor alone; NULL: the encoder's */
    const float *theta;     /* [policy_theta]; NULL: that of the modulation */
} PolicyInstead;

#endif
