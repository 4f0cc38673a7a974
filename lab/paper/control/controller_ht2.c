/* The rival "HT-2" (Radosavovic et al. 2024, Learning Humanoid Locomotion over Challenging
 * Terrain): a causal transformer over the last frames of the episode and the actions before them.
 * Trained by lab/paper/rivals/train_ht2.py, whose files it reads.
 *
 * Token j of a context, oldest first, is made from the frame o_j without its last action, from that
 * action a_j, and from its place p_j: x_j = W_o o_j + b_o + W_a a_j + p_j. Where the episode begins
 * there is no action before, and the mask token m takes the place of W_a a_j. Each layer:
 *
 *     x += out(attention(norm1(x))),   x += down(gelu(up(norm2(x))))
 *
 * The action is that of the newest token: action(norm(x)). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lab/lists.h"
#include "learn/product.h"
#include "paper/control/weights.h"

enum { HT2_LAYERS_MAX = 16 };
#define HT2_NORM_LEAST 1e-5F /* added to the variance */

/* Layer normalisation. */
typedef struct {
    const float *weight, *bias; /* [width] */
} Norm;

typedef struct {
    Norm norm1, norm2;
    Linear qkv; /* width -> queries, keys, values */
    Linear out, up, down;
} Layer;

/* Of one context. */
typedef struct {
    float *x;      /* [context][width] */
    float *normed; /* [context][width] */
    float *qkv;    /* [context][3 width] */
    float *mixed;  /* [context][width] */
    float *wide;   /* [context][mlp] */
    float *score;  /* [context] */
} Scratch;

typedef struct {
    Weights *weights;
    int observation, joints; /* of a frame */
    int width, heads, layers, context;
    int mlp;                      /* width between up and down */
    Linear embed;                 /* frame without its last action */
    const float *embed_action;    /* [width][joints] */
    const float *mask, *position; /* [width], [context][width] */
    Layer layer[HT2_LAYERS_MAX];
    Norm norm;
    Linear action;
    Pool *pool; /* may be NULL */
    float *block;
    Scratch *scratch; /* [threads] */
    float *frames;    /* [rows_max][context][observation] of the present episode, oldest first */
    int *seen;        /* [rows_max] frames of the episode, at most context + 1 */
} Ht2;

/* One call of act. */
typedef struct {
    Ht2 *ht2;
    TaskEnv *const *envs;
    float *actions;
} Call;

/* ---- layers ---- */

static void normalise(const Norm *norm, int rows, int width, const float *x, float *y) {
    for (int r = 0; r < rows; r++) {
        const float *in = x + (long)r * width;
        float *out = y + (long)r * width;
        float mean = 0, square = 0;
        for (int i = 0; i < width; i++) {
            mean += in[i];
        }
        mean /= (float)width;
        for (int i = 0; i < width; i++) {
            square += (in[i] - mean) * (in[i] - mean);
        }
        const float scale = 1 / sqrtf(square / (float)width + HT2_NORM_LEAST);
        for (int i = 0; i < width; i++) {
            out[i] = (in[i] - mean) * scale * norm->weight[i] + norm->bias[i];
        }
    }
}

static float dot(const float *a, const float *b, int count) {
    float sum = 0;
    for (int i = 0; i < count; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Head h of token t, which sees the tokens up to itself. */
static void attend(const Ht2 *ht2, const Scratch *s, int t, int h) {
    const int width = ht2->width, each = width / ht2->heads;
    const float *query = s->qkv + (long)t * 3 * width + h * each;
    const float scale = 1 / sqrtf((float)each);
    float *out = s->mixed + (long)t * width + h * each;
    float most = -INFINITY, total = 0;
    for (int k = 0; k <= t; k++) {
        const float *key = s->qkv + (long)k * 3 * width + width + h * each;
        s->score[k] = scale * dot(query, key, each);
        most = fmaxf(most, s->score[k]);
    }
    for (int k = 0; k <= t; k++) {
        s->score[k] = expf(s->score[k] - most);
        total += s->score[k];
    }
    memset(out, 0, (size_t)each * sizeof *out);
    for (int k = 0; k <= t; k++) {
        const float *value = s->qkv + (long)k * 3 * width + 2 * width + h * each;
        for (int i = 0; i < each; i++) {
            out[i] += s->score[k] / total * value[i];
        }
    }
}

static void gelu(float *x, int count) {
    for (int i = 0; i < count; i++) {
        x[i] = 0.5F * x[i] * (1 + erff(x[i] * 0.70710678F));
    }
}

static void add(const float *from, int count, float *to) {
    for (int i = 0; i < count; i++) {
        to[i] += from[i];
    }
}

/* Changes the tokens from `first` on. */
static void apply_layer(const Ht2 *ht2, const Layer *layer, const Scratch *s, int tokens,
                        int first) {
    const int width = ht2->width, rows = tokens - first;
    float *x = s->x + (long)first * width, *mixed = s->mixed + (long)first * width;
    normalise(&layer->norm1, tokens, width, s->x, s->normed);
    linear_apply(&layer->qkv, tokens, s->normed, s->qkv);
    for (int t = first; t < tokens; t++) {
        for (int h = 0; h < ht2->heads; h++) {
            attend(ht2, s, t, h);
        }
    }
    linear_apply(&layer->out, rows, mixed, s->normed);
    add(s->normed, rows * width, x);
    normalise(&layer->norm2, rows, width, x, s->normed);
    linear_apply(&layer->up, rows, s->normed, s->wide);
    gelu(s->wide, rows * ht2->mlp);
    linear_apply(&layer->down, rows, s->wide, s->normed);
    add(s->normed, rows * width, x);
}

/* ---- a policy step ---- */

/* Where the last action is in a frame (task/observe.h); what else is in it follows. */
static int action_place(const Ht2 *ht2) {
    return 9 + 2 * ht2->joints;
}

/* Token j of `tokens`, whose context begins with the episode or not. */
static void embed(const Ht2 *ht2, const Scratch *s, const float *frames, int j, int begins) {
    const int width = ht2->width, joints = ht2->joints, place = action_place(ht2);
    const float *frame = frames + (long)j * ht2->observation, *action = frame + place;
    const size_t behind = (size_t)(ht2->observation - place - joints);
    float *x = s->x + (long)j * width, *rest = s->wide;
    memcpy(rest, frame, (size_t)place * sizeof *rest);
    memcpy(rest + place, action + joints, behind * sizeof *rest);
    linear_apply(&ht2->embed, 1, rest, x);
    for (int i = 0; i < width; i++) {
        x[i] += ht2->position[(long)j * width + i];
        x[i] += begins && j == 0 ? ht2->mask[i]
                                 : dot(ht2->embed_action + (long)i * joints, action, joints);
    }
}

static void infer(const Ht2 *ht2, const Scratch *s, const float *frames, int tokens, int begins,
                  float *action) {
    const int newest = tokens - 1;
    for (int j = 0; j < tokens; j++) {
        embed(ht2, s, frames, j, begins);
    }
    for (int l = 0; l < ht2->layers; l++) {
        apply_layer(ht2, &ht2->layer[l], s, tokens, l + 1 < ht2->layers ? 0 : newest);
    }
    normalise(&ht2->norm, 1, ht2->width, s->x + (long)newest * ht2->width, s->normed);
    linear_apply(&ht2->action, 1, s->normed, action);
}

/* Appends the newest frame of the environment to the context of the row. Returns its tokens. */
static int remember(const Ht2 *ht2, int row, TaskEnv *env, float *frames) {
    const size_t bytes = (size_t)ht2->observation * sizeof *frames;
    int *seen = &ht2->seen[row];
    if (env->step == env->step_first) {
        *seen = 0;
    }
    if (*seen >= ht2->context) {
        memmove(frames, frames + ht2->observation, (size_t)(ht2->context - 1) * bytes);
        *seen = ht2->context;
    }
    const int place = *seen < ht2->context ? *seen : ht2->context - 1;
    memcpy(frames + (long)place * ht2->observation,
           task_env_history(env) + (TASK_FRAMES - 1) * ht2->observation, bytes);
    (*seen)++;
    return place + 1;
}

static void act_piece(void *context, int row, int thread) {
    const Call *call = context;
    const Ht2 *ht2 = call->ht2;
    float *frames = ht2->frames + (long)row * ht2->context * ht2->observation;
    const int tokens = remember(ht2, row, call->envs[row], frames);
    const int entered = product_enter(0);
    infer(ht2, &ht2->scratch[thread], frames, tokens, ht2->seen[row] <= ht2->context,
          call->actions + (long)row * ht2->joints);
    product_leave(entered);
}

static void ht2_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Call call = {self, envs, actions};
    if (call.ht2->pool) {
        pool_run(call.ht2->pool, rows, act_piece, &call);
        return;
    }
    for (int row = 0; row < rows; row++) {
        act_piece(&call, row, 0);
    }
}

/* ---- creation ---- */

static void ht2_destroy(void *self) {
    Ht2 *ht2 = self;
    weights_destroy(ht2->weights);
    free(ht2->block);
    free(ht2->scratch);
    free(ht2->frames);
    free(ht2->seen);
    free(ht2);
}

static Norm take_norm(Ht2 *ht2, const char *name) {
    char weight[64], bias[64];
    snprintf(weight, sizeof weight, "%s.weight", name);
    snprintf(bias, sizeof bias, "%s.bias", name);
    return (Norm){weights_take(ht2->weights, weight, ht2->width, 0),
                  weights_take(ht2->weights, bias, ht2->width, 0)};
}

static void take_layer(Ht2 *ht2, int index) {
    Layer *layer = &ht2->layer[index];
    char name[6][32];
    static const char *const parts[6] = {"norm1", "norm2", "qkv", "out", "up", "down"};
    for (int i = 0; i < 6; i++) {
        snprintf(name[i], sizeof name[i], "layers.%d.%s", index, parts[i]);
    }
    layer->norm1 = take_norm(ht2, name[0]);
    layer->norm2 = take_norm(ht2, name[1]);
    layer->qkv = weights_take_linear(ht2->weights, name[2], ht2->width, 3 * ht2->width);
    layer->out = weights_take_linear(ht2->weights, name[3], ht2->width, ht2->width);
    layer->up = weights_take_linear(ht2->weights, name[4], ht2->width, ht2->mlp);
    layer->down = weights_take_linear(ht2->weights, name[5], ht2->mlp, ht2->width);
}

static MildStatus take_all(Ht2 *ht2, const char *path, MildError *error) {
    Weights *weights = ht2->weights;
    ht2->heads = weights_number(weights, "heads");
    ht2->layers = weights_number(weights, "layers");
    ht2->context = weights_length(weights, "position", 0);
    ht2->width = weights_length(weights, "position", 1);
    ht2->mlp = weights_length(weights, "layers.0.up.weight", 0);
    if (weights_status(weights, error) != MILD_OK) {
        return error->status;
    }
    if (ht2->layers > HT2_LAYERS_MAX || ht2->width % ht2->heads != 0) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "%s: its metadata name %d layers, at most %d are read, and %d heads, "
                         "which must divide the width %d",
                         path, ht2->layers, HT2_LAYERS_MAX, ht2->heads, ht2->width);
    }
    const int rest = ht2->observation - ht2->joints;
    ht2->embed = weights_take_linear(weights, "embed_observation", rest, ht2->width);
    ht2->embed_action = weights_take(weights, "embed_action.weight", ht2->width, ht2->joints);
    ht2->mask = weights_take(weights, "mask", ht2->width, 0);
    ht2->position = weights_take(weights, "position", ht2->context, ht2->width);
    for (int l = 0; l < ht2->layers; l++) {
        take_layer(ht2, l);
    }
    ht2->norm = take_norm(ht2, "norm");
    ht2->action = weights_take_linear(weights, "action", ht2->width, ht2->joints);
    return weights_status(weights, error);
}

static MildStatus make_memory(Ht2 *ht2, int rows_max, MildError *error) {
    const int threads = ht2->pool ? pool_threads(ht2->pool) : 1;
    const size_t context = (size_t)ht2->context, width = (size_t)ht2->width;
    const size_t widest = (size_t)(ht2->mlp > ht2->observation ? ht2->mlp : ht2->observation);
    const size_t each = context * (6 * width + widest + 1);
    ht2->block = calloc(each * (size_t)threads, sizeof *ht2->block);
    ht2->scratch = calloc((size_t)threads, sizeof *ht2->scratch);
    ht2->frames = calloc((size_t)rows_max * context * (size_t)ht2->observation, sizeof(float));
    ht2->seen = calloc((size_t)rows_max, sizeof *ht2->seen);
    if (!ht2->block || !ht2->scratch || !ht2->frames || !ht2->seen) {
        return mild_fail(error, MILD_ERROR_MEMORY, "ht2: out of memory for %d rows", rows_max);
    }
    for (int t = 0; t < threads; t++) {
        Scratch *s = &ht2->scratch[t];
        s->x = ht2->block + each * (size_t)t;
        s->normed = s->x + context * width;
        s->mixed = s->normed + context * width;
        s->qkv = s->mixed + context * width;
        s->wide = s->qkv + 3 * context * width;
        s->score = s->wide + context * widest;
    }
    return MILD_OK;
}

MildStatus controller_make_ht2(const ControllerDef *def, Controller *controller, MildError *error) {
    MildError cause = {0};
    Ht2 *ht2 = calloc(1, sizeof *ht2);
    if (!ht2) {
        return mild_fail(error, MILD_ERROR_MEMORY, "ht2: out of memory");
    }
    ht2->observation = task_shape(def->task, def->robot).observation;
    ht2->joints = robot_actions(def->robot);
    ht2->pool = def->pool;
    ht2->weights = weights_read(def->policy, "mild ht2", "lab/paper/rivals/train_ht2.py",
                                robot_name(def->robot), &cause);
    if (!ht2->weights || take_all(ht2, def->policy, &cause) != MILD_OK ||
        make_memory(ht2, def->rows_max, &cause) != MILD_OK) {
        ht2_destroy(ht2);
        return mild_fail(error, cause.status, "%s", cause.text);
    }
    *controller = (Controller){.self = ht2, .name = "ht2", .act = ht2_act, .destroy = ht2_destroy};
    return MILD_OK;
}
