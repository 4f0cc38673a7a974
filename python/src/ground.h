/* The classes of the module mild._ground that its files share. */
#ifndef MILD_PYTHON_GROUND_H
#define MILD_PYTHON_GROUND_H

#include <memory>

#include "arrays.h"
#include "mild/batch.h"
#include "mild/ground.h"

/* A Python object that holds what one of the library's create functions made. */
template <typename T, void (*destroy)(T *)> struct Owned {
    T *made = nullptr;
    nb::object recipe; /* what __reduce__ returns: (callable, arguments) */
    Owned(T *made, nb::object recipe) : made(made), recipe(std::move(recipe)) {
    }
    Owned(Owned &&other) noexcept : made(other.made), recipe(std::move(other.recipe)) {
        other.made = nullptr;
    }
    Owned(const Owned &) = delete;
    ~Owned() {
        destroy(made);
    }
};

struct Material {
    MildMaterial numbers;
};

using Sole = Owned<MildSole, mild_sole_destroy>;
using Map = Owned<MildMap, mild_map_destroy>;

struct Terrain {
    MildTerrain terrain;
    nb::object map; /* keeps terrain.map */
};

struct Ground;

/* A material from a Material, the name of a preset, or a soil's file. */
MildMaterial material_of(nb::handle object, const char *name);
/* The numbers of an argument as an array of doubles in C order; a list is converted. dimensions:
 * -1: any number */
nb::ndarray<const double, nb::c_contig, nb::device::cpu>
numbers_of(nb::handle object, const char *name, int dimensions);
/* Sets the fields of a struct from keyword arguments. kind: of the object, for messages. */
void set_fields(const MildField *fields, int count, void *def, const nb::kwargs &values,
                const char *kind);
/* The map of a Map; NULL for None. */
const MildMap *map_of(nb::handle object);
/* Those of a Material or a name, or of a list of these; any number. */
std::vector<MildMaterial> materials_of(nb::handle object);
/* A terrain or the material of a uniform one. */
Terrain terrain_of(nb::handle object);
/* Soles of a tuple, which keeps them. */
std::vector<const MildSole *> soles_of(const nb::tuple &soles);
double positive(double value, const char *name);
/* The ground in the block of a Ground, for mild_batch_load. */
MildGround *block_of(nb::handle ground);
/* What an argument holds. Raises TypeError for another type, and for an object that was made by
 * __new__ alone. */
template <typename T> T &made_of(nb::handle object, const char *name) {
    if (!nb::isinstance<T>(object) || !nb::inst_ready(object)) {
        raise(PyExc_TypeError, std::string(name) + ": a " + type_text(object) +
                                   (nb::isinstance<T>(object) ? " that was never made" : "") +
                                   ", but it must be a " +
                                   utf8(nb::type_name(nb::type<T>()), "type"));
    }
    return *nb::inst_ptr<T>(object);
}

/* mild.Batch, as its methods (batch.cpp) and XLA's calls (xla.cpp) see it. */
struct Batch {
    MildBatch *batch = nullptr;
    int robots = 0;
    int feet = 0;
    int device = ON_CPU;
    int materials = 1;
    int labels = 1;
    bool has_map = false;
    std::vector<int> elements; /* of each sole */
    std::atomic<bool> busy{false};
    int64_t number = 0; /* of XLA's calls; 0: none yet */

    Batch() = default;
    Batch(const Batch &) = delete;
    ~Batch();
};

/* The number by which XLA's calls find the batch, until it is freed. */
int64_t xla_number(Batch &batch);
void xla_forget(Batch &batch);

void bind_material(nb::module_ &module);
void bind_terrain(nb::module_ &module);
void bind_ground(nb::module_ &module);
void bind_press(nb::module_ &module);
void bind_fit(nb::module_ &module);
void bind_batch(nb::module_ &module);
void bind_xla(nb::module_ &module);

#endif
