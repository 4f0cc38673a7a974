/* The policy as an ONNX graph, operator set 13, for one or many robots at once:
 *
 *   obs [batch, observation], frames_in [batch, held, observation]
 *     -> actions [batch, joints], frames_out (frames_in for the next step), estimates
 *
 * With export->in_double everything between is computed in double precision.
 *
 * Messages point into a Graph and to the policy's weights; nothing is copied before it is packed.
 * Names of ONNX's messages and operators are those of its schema and its operator list. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"
#include "deploy/export/export.h"
#include "onnx.pb-c.h"

#define IR_VERSION 7
#define OPERATOR_SET 13

enum {
    NODES_MAX = 128,
    TENSORS_MAX = 96,
    INPUTS_MAX = 4,
    RANK_MAX = 4,
    NAME_SIZE = 40,
    NAMES_MAX = 512,
    ENDS_MAX = 3 /* inputs or outputs of the graph */
};

/* A node, its attribute, and the arrays of pointers that they need. */
typedef struct {
    Onnx__NodeProto proto;
    Onnx__AttributeProto attribute, *attributes[1];
    int64_t integers[1];
    char *inputs[INPUTS_MAX], *outputs[1];
} Node;

typedef struct {
    Onnx__TensorProto proto;
    int64_t dims[2], integers[RANK_MAX];
    float number;
} Tensor;

/* An input or output of the graph: a tensor of floats [batch, ...]. */
typedef struct {
    Onnx__ValueInfoProto proto;
    Onnx__TypeProto type;
    Onnx__TypeProto__Tensor tensor;
    Onnx__TensorShapeProto shape;
    Onnx__TensorShapeProto__Dimension dim[3], *dims[3];
} End;

typedef struct {
    const Export *export;
    Node node[NODES_MAX];
    Tensor tensor[TENSORS_MAX];
    End input[ENDS_MAX], output[ENDS_MAX];
    int nodes, tensors, inputs, outputs, names;
    char name[NAMES_MAX][NAME_SIZE];
    Description description;
    /* what the messages' arrays point to */
    Onnx__NodeProto *node_list[NODES_MAX];
    Onnx__TensorProto *tensor_list[TENSORS_MAX];
    Onnx__ValueInfoProto *input_list[ENDS_MAX], *output_list[ENDS_MAX];
    Onnx__StringStringEntryProto text[DESCRIBE_MAX], *text_list[DESCRIBE_MAX];
} Graph;

static char *name_of(Graph *g, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(g->name[g->names], NAME_SIZE, format, arguments);
    va_end(arguments);
    return g->name[g->names++];
}

/* ---- tensors: names of constants ---- */

static Tensor *add_tensor(Graph *g, const char *name, int type) {
    Tensor *tensor = &g->tensor[g->tensors];
    g->tensor_list[g->tensors++] = &tensor->proto;
    onnx__tensor_proto__init(&tensor->proto);
    tensor->proto.name = name_of(g, "%s", name);
    tensor->proto.has_data_type = 1;
    tensor->proto.data_type = type;
    tensor->proto.dims = tensor->dims;
    tensor->proto.has_raw_data = 1;
    return tensor;
}

/* columns 0: one row of numbers. */
static char *add_weights(Graph *g, const char *name, const float *data, int rows, int columns) {
    Tensor *tensor = add_tensor(g, name, ONNX__TENSOR_PROTO__DATA_TYPE__FLOAT);
    tensor->dims[0] = rows;
    tensor->dims[1] = columns;
    tensor->proto.n_dims = columns > 0 ? 2 : 1;
    tensor->proto.raw_data.data = (uint8_t *)(uintptr_t)data; /* packing only reads it */
    tensor->proto.raw_data.len = sizeof *data * (size_t)rows * (size_t)(columns > 0 ? columns : 1);
    return tensor->proto.name;
}

static char *add_number(Graph *g, const char *name, double number) {
    Tensor *tensor = add_tensor(g, name, ONNX__TENSOR_PROTO__DATA_TYPE__FLOAT);
    tensor->number = (float)number;
    tensor->proto.raw_data.data = (uint8_t *)&tensor->number;
    tensor->proto.raw_data.len = sizeof tensor->number;
    return tensor->proto.name;
}

static char *add_integers(Graph *g, const char *name, const int64_t *integers, int count) {
    Tensor *tensor = add_tensor(g, name, ONNX__TENSOR_PROTO__DATA_TYPE__INT64);
    memcpy(tensor->integers, integers, (size_t)count * sizeof *integers);
    tensor->dims[0] = count;
    tensor->proto.n_dims = 1;
    tensor->proto.raw_data.data = (uint8_t *)tensor->integers;
    tensor->proto.raw_data.len = (size_t)count * sizeof *integers;
    return tensor->proto.name;
}

/* ---- nodes: each returns the name of its output ---- */

static Node *add_node(Graph *g, char *operation, char *output, int inputs, ...) {
    Node *node = &g->node[g->nodes];
    g->node_list[g->nodes++] = &node->proto;
    onnx__node_proto__init(&node->proto);
    va_list names;
    va_start(names, inputs);
    for (int i = 0; i < inputs; i++) {
        node->inputs[i] = va_arg(names, char *);
    }
    va_end(names);
    node->outputs[0] = output;
    node->proto.name = output;
    node->proto.op_type = operation;
    node->proto.input = node->inputs;
    node->proto.n_input = (size_t)inputs;
    node->proto.output = node->outputs;
    node->proto.n_output = 1;
    return node;
}

static Onnx__AttributeProto *add_attribute(Node *node, char *name, int type) {
    onnx__attribute_proto__init(&node->attribute);
    node->attribute.name = name;
    node->attribute.has_type = 1;
    node->attribute.type = (Onnx__AttributeProto__AttributeType)type;
    node->attributes[0] = &node->attribute;
    node->proto.attribute = node->attributes;
    node->proto.n_attribute = 1;
    return &node->attribute;
}

static void set_int(Node *node, char *name, int64_t value) {
    Onnx__AttributeProto *a = add_attribute(node, name, ONNX__ATTRIBUTE_PROTO__ATTRIBUTE_TYPE__INT);
    a->has_i = 1;
    a->i = value;
}

static void set_ints(Node *node, char *name, int64_t value) {
    Onnx__AttributeProto *a =
        add_attribute(node, name, ONNX__ATTRIBUTE_PROTO__ATTRIBUTE_TYPE__INTS);
    node->integers[0] = value;
    a->ints = node->integers;
    a->n_ints = 1;
}

static void add_cast(Graph *g, char *output, char *input, int type) {
    set_int(add_node(g, "Cast", output, 1, input), "to", type);
}

/* `name` as the graph computes: itself, or in double precision. Runtimes do so once for weights,
 * which stay 32-bit floats in the file. */
static char *widen(Graph *g, char *name) {
    if (!g->export->in_double) {
        return name;
    }
    char *wide = name_of(g, "%s_double", name);
    add_cast(g, wide, name, ONNX__TENSOR_PROTO__DATA_TYPE__DOUBLE);
    return wide;
}

/* Numbers from..to-1 along axis 1. */
static char *add_slice(Graph *g, char *output, char *input, int from, int to) {
    const int64_t ends[2] = {from, to}, axis = 1;
    char name[2][NAME_SIZE];
    snprintf(name[0], NAME_SIZE, "%s_from", output);
    snprintf(name[1], NAME_SIZE, "%s_to", output);
    char *first = add_integers(g, name[0], &ends[0], 1),
         *end = add_integers(g, name[1], &ends[1], 1);
    snprintf(name[0], NAME_SIZE, "%s_axis", output);
    add_node(g, "Slice", output, 4, input, first, end, add_integers(g, name[0], &axis, 1));
    return output;
}

/* ELU. ONNX Runtime has none in double precision: there max(x, exp(min(x, 0)) - 1), because
 * exp(x) - 1 is never below x. */
static char *add_elu(Graph *g, char *output, char *x) {
    if (!g->export->in_double) {
        add_node(g, "Elu", output, 1, x);
        return output;
    }
    char *negative = name_of(g, "%s_negative", output), *power = name_of(g, "%s_exp", output),
         *below = name_of(g, "%s_below", output);
    add_node(g, "Min", negative, 2, x, "zero_double");
    add_node(g, "Exp", power, 1, negative);
    add_node(g, "Sub", below, 2, power, "one_double");
    add_node(g, "Max", output, 2, x, below);
    return output;
}

/* Layers "NAME.0", "NAME.2", ... with the tensors' names of the policy's file. */
static char *add_mlp(Graph *g, const Mlp *mlp, const char *name, char *x, char *output) {
    const float *parameters = g->export->parameters;
    for (int l = 0; l < mlp->layers; l++) {
        const MlpLayer *layer = &mlp->layer[l];
        const int is_last = l == mlp->layers - 1;
        char text[NAME_SIZE];
        snprintf(text, sizeof text, "%s.%d.weight", name, 2 * l);
        char *weight = add_weights(g, text, parameters + layer->weight, layer->out, layer->in);
        snprintf(text, sizeof text, "%s.%d.bias", name, 2 * l);
        char *bias = add_weights(g, text, parameters + layer->bias, layer->out, 0);
        char *y = is_last ? output : name_of(g, "%s.%d", name, 2 * l);
        set_int(add_node(g, "Gemm", y, 3, x, widen(g, weight), widen(g, bias)), "transB", 1);
        x = is_last ? y : add_elu(g, name_of(g, "%s.%d", name, 2 * l + 1), y);
    }
    return output;
}

/* ---- the graph ---- */

/* frames_in -> the older part of the history [batch, means * observation], and frames_out.
 * obs: widened. */
static char *add_history(Graph *g, char *obs) {
    const int64_t width = g->export->network->def.observation, means = TASK_FRAMES - 1,
                  stride = g->export->task->history_stride, axis = 1;
    const int64_t apart[4] = {0, means, stride, width}, together[2] = {0, means * width};
    Node *mean;
    add_node(g, "Reshape", "blocks", 2, widen(g, "frames_in"),
             add_integers(g, "blocks_shape", apart, 4));
    mean = add_node(g, "ReduceMean", "means", 1, "blocks");
    set_ints(mean, "axes", 2);
    /* [batch, means, 1, width], because a node has one attribute: the reshape takes out the 1 */
    add_node(g, "Reshape", "older", 2, "means", add_integers(g, "older_shape", together, 2));
    add_slice(g, "kept", "frames_in", 1, (int)(means * stride));
    add_node(g, "Unsqueeze", "newest", 2, "obs", add_integers(g, "newest_axis", &axis, 1));
    set_int(add_node(g, "Concat", "frames_out", 2, "kept", "newest"), "axis", 1);
    set_int(add_node(g, "Concat", "history", 2, "older", obs), "axis", 1);
    return "history";
}

/* The modulation's input: estimates of the feet, and the clock at the end of the frame where it is
 * among them. */
static char *add_feet(Graph *g, char *obs) {
    const Network *network = g->export->network;
    const int first = network->def.feet_velocity_offset, end = network->def.observation;
    if (network->clock == 0) {
        return add_slice(g, "feet_velocities", "heads", first, first + network->feet);
    }
    add_slice(g, "feet", "heads", first, first + network->feet);
    add_slice(g, "clock", obs, end - network->clock, end);
    set_int(add_node(g, "Concat", "feet_clock", 2, "feet", "clock"), "axis", 1);
    return "feet_clock";
}

static void add_nodes(Graph *g) {
    const Network *network = g->export->network;
    const PolicyDef *def = &network->def;
    const int estimates = def->estimates, half = network->theta / 2;
    const double clip = g->export->task->action_clip;
    const int in_double = g->export->in_double;
    char *obs = widen(g, "obs"), *own = in_double ? "estimates_double" : "estimates",
         *mean = in_double ? "mean_double" : "mean";
    if (in_double) { /* of add_elu */
        widen(g, add_number(g, "zero", 0));
        widen(g, add_number(g, "one", 1));
    }
    add_mlp(g, &network->encoder, "encoder", add_history(g, obs), "heads");
    add_slice(g, own, "heads", 0, estimates);
    add_slice(g, "mu", "heads", estimates, estimates + def->latent);
    add_mlp(g, &network->modulation, "modulation", add_feet(g, obs), "theta");
    add_slice(g, "theta1", "theta", 0, half);
    add_slice(g, "theta2", "theta", half, 2 * half);
    add_node(g, "Mul", "scaled", 2, "theta1", "mu");
    add_node(g, "Add", "z", 2, "scaled", "theta2");
    set_int(add_node(g, "Concat", "actor_input", 3, obs, own, "z"), "axis", 1);
    add_mlp(g, &network->actor, "actor", "actor_input", mean);
    if (in_double) {
        add_cast(g, "estimates", own, ONNX__TENSOR_PROTO__DATA_TYPE__FLOAT);
        add_cast(g, "mean", mean, ONNX__TENSOR_PROTO__DATA_TYPE__FLOAT);
    }
    add_node(g, "Clip", "actions", 3, "mean", add_number(g, "clip_low", -clip),
             add_number(g, "clip_high", clip));
}

/* middle: of [batch, middle, width]; 0: [batch, width]. */
static Onnx__ValueInfoProto *make_end(End *end, char *name, int middle, int width) {
    const int sizes[3] = {0, middle > 0 ? middle : width, width}, rank = middle > 0 ? 3 : 2;
    onnx__value_info_proto__init(&end->proto);
    onnx__type_proto__init(&end->type);
    onnx__type_proto__tensor__init(&end->tensor);
    onnx__tensor_shape_proto__init(&end->shape);
    for (int i = 0; i < rank; i++) {
        Onnx__TensorShapeProto__Dimension *dim = end->dims[i] = &end->dim[i];
        onnx__tensor_shape_proto__dimension__init(dim);
        if (i == 0) {
            dim->value_case = ONNX__TENSOR_SHAPE_PROTO__DIMENSION__VALUE_DIM_PARAM;
            dim->dim_param = "batch";
        } else {
            dim->value_case = ONNX__TENSOR_SHAPE_PROTO__DIMENSION__VALUE_DIM_VALUE;
            dim->dim_value = sizes[i];
        }
    }
    end->shape.n_dim = (size_t)rank;
    end->shape.dim = end->dims;
    end->tensor.has_elem_type = 1;
    end->tensor.elem_type = ONNX__TENSOR_PROTO__DATA_TYPE__FLOAT;
    end->tensor.shape = &end->shape;
    end->type.value_case = ONNX__TYPE_PROTO__VALUE_TENSOR_TYPE;
    end->type.tensor_type = &end->tensor;
    end->proto.name = name;
    end->proto.type = &end->type;
    return &end->proto;
}

static void add_input(Graph *g, char *name, int middle, int width) {
    g->input_list[g->inputs] = make_end(&g->input[g->inputs], name, middle, width);
    g->inputs++;
}

static void add_output(Graph *g, char *name, int middle, int width) {
    g->output_list[g->outputs] = make_end(&g->output[g->outputs], name, middle, width);
    g->outputs++;
}

static void add_ends(Graph *g) {
    const PolicyDef *def = &g->export->network->def;
    const int held = (TASK_FRAMES - 1) * g->export->task->history_stride;
    add_input(g, "obs", 0, def->observation);
    add_input(g, "frames_in", held, def->observation);
    add_output(g, "actions", 0, def->actions);
    add_output(g, "frames_out", held, def->observation);
    add_output(g, "estimates", 0, def->estimates);
}

/* ---- the file ---- */

static void add_texts(Graph *g, Onnx__ModelProto *model) {
    Description *d = &g->description;
    for (int i = 0; i < d->count; i++) {
        Onnx__StringStringEntryProto *text = g->text_list[i] = &g->text[i];
        onnx__string_string_entry_proto__init(text);
        text->key = d->key[i];
        text->value = d->value[i];
    }
    model->metadata_props = g->text_list;
    model->n_metadata_props = (size_t)d->count;
}

static MildStatus pack(Graph *g, const char *path, MildError *error) {
    Onnx__GraphProto graph = ONNX__GRAPH_PROTO__INIT;
    Onnx__OperatorSetIdProto set = ONNX__OPERATOR_SET_ID_PROTO__INIT, *sets[] = {&set};
    Onnx__ModelProto model = ONNX__MODEL_PROTO__INIT;
    graph.name = "policy";
    graph.node = g->node_list;
    graph.n_node = (size_t)g->nodes;
    graph.initializer = g->tensor_list;
    graph.n_initializer = (size_t)g->tensors;
    graph.input = g->input_list;
    graph.n_input = (size_t)g->inputs;
    graph.output = g->output_list;
    graph.n_output = (size_t)g->outputs;
    set.domain = "";
    set.has_version = 1;
    set.version = OPERATOR_SET;
    model.has_ir_version = 1;
    model.ir_version = IR_VERSION;
    model.producer_name = "mild";
    model.producer_version = (char *)(uintptr_t)g->export->version; /* packing only reads it */
    model.opset_import = sets;
    model.n_opset_import = 1;
    model.graph = &graph;
    add_texts(g, &model);
    const size_t size = onnx__model_proto__get_packed_size(&model);
    uint8_t *bytes = malloc(size);
    if (!bytes) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    onnx__model_proto__pack(&model, bytes);
    MildStatus status = file_write(path, bytes, size, error);
    free(bytes);
    return status;
}

MildStatus export_onnx(const Export *export, const char *path, MildError *error) {
    Graph *g = calloc(1, sizeof *g);
    if (!g) {
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    g->export = export;
    MildStatus status = describe(export, &g->description, error);
    if (status == MILD_OK) {
        add_nodes(g);
        add_ends(g);
        status = pack(g, path, error);
    }
    free(g);
    return status;
}
