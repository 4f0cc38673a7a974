/* mild.Sole, mild.Map, mild.Terrain. */
#include "ground.h"

#include <algorithm>
#include <cmath>

#include <nanobind/stl/tuple.h>

extern "C" {
#include "identify/press.h"
}

/* A function of mild._again. */
static nb::object again(const char *name) {
    return nb::module_::import_("mild._again").attr(name);
}

/* ---- soles ---- */

std::vector<const MildSole *> soles_of(const nb::tuple &soles) {
    std::vector<const MildSole *> made;
    for (nb::handle sole : soles) {
        made.push_back(made_of<Sole>(sole, "soles").made);
    }
    if (made.empty() || made.size() > MILD_FEET_MAX) {
        raise(PyExc_ValueError, "soles: " + std::to_string(made.size()) +
                                    " of them, but one contact problem has 1 .. " +
                                    std::to_string(MILD_FEET_MAX) + " feet");
    }
    return made;
}

static void make_sole(Sole *sole, nb::handle outline, double pitch, double sole_z, int target) {
    const auto points = numbers_of(outline, "outline", 2);
    if (points.shape(1) != 2 || points.shape(0) > 1 << 16) {
        raise(PyExc_ValueError, "outline: it must have the shape (points, 2)");
    }
    const MildSoleDef def = {points.data(), (int)points.shape(0), pitch, sole_z, target};
    MildError error = {};
    MildSole *made = mild_sole_create(&def, &error);
    check(made ? MILD_OK : error.status, error);
    const nb::object copy = nb::cast(points).attr("tolist")();
    new (sole)
        Sole(made, nb::make_tuple(nb::type<Sole>(), nb::make_tuple(copy, pitch, sole_z, target)));
}

static Sole make_plate(double length, double width) {
    MildError error = {};
    if (!(length >= 0.0195 && length <= 1 && width >= 0.0195 && width <= 1)) {
        raise(PyExc_ValueError, "length, width: outside 0.0195 .. 1 m (one element to a metre)");
    }
    MildSole *made = press_plate_create(length, width, &error);
    check(made ? MILD_OK : error.status, error);
    return Sole(made, nb::make_tuple(again("plate"), nb::make_tuple(length, width)));
}

static Sole make_concentric(nb::handle self) {
    const Sole &sole = made_of<Sole>(self, "self");
    MildError error = {};
    MildSole *made = mild_sole_concentric(sole.made, &error);
    check(made ? MILD_OK : error.status, error);
    return Sole(made, nb::make_tuple(again("concentric"), nb::make_tuple(self)));
}

/* Numbers of a key of a shape, as many as `count`, into `to`. Bool: the key is there. */
static bool take_numbers(const nb::dict &shape, const std::string &name, const char *key,
                         size_t count, double *to) {
    if (!shape.contains(key)) {
        return false;
    }
    const std::string whole = name + "." + key;
    const auto numbers = numbers_of(shape[key], whole.c_str(), 1);
    if (numbers.size() != count) {
        raise(PyExc_ValueError, whole + ": " + std::to_string(numbers.size()) +
                                    " numbers, but it must have " + std::to_string(count));
    }
    std::copy_n(numbers.data(), count, to);
    return true;
}

/* Rows of three numbers under a key of a mesh. */
static std::vector<double> rows_of(const nb::dict &shape, const std::string &name,
                                   const char *key) {
    const std::string whole = name + "." + key;
    if (!shape.contains(key)) {
        raise(PyExc_ValueError, whole + " is missing");
    }
    const auto rows = numbers_of(shape[key], whole.c_str(), 2);
    if (rows.shape(1) != 3 || rows.shape(0) > 1 << 20) {
        raise(PyExc_ValueError, whole + ": it must have the shape (rows, 3)");
    }
    return std::vector<double>(rows.data(), rows.data() + rows.size());
}

/* A shape and what it points to. */
struct Shape {
    MildShape shape = {};
    std::vector<double> vertices;
    std::vector<int> triangles;
    Shape(nb::handle object, const std::string &name) {
        static const char *const types[] = {"box", "capsule", "sphere", "mesh"};
        static const size_t sizes[] = {3, 2, 1, 0};
        if (!nb::isinstance<nb::dict>(object)) {
            raise(PyExc_TypeError, name + ": a " + type_text(object) + ", but it must be a dict");
        }
        const nb::dict keys = nb::cast<nb::dict>(object);
        const std::string type = keys.contains("type") ? utf8(keys["type"], name.c_str()) : "";
        shape.type = (int)(std::find(types, types + 4, type) - types);
        if (shape.type == 4) {
            raise(PyExc_ValueError,
                  name + ".type: '" + type + "' is none of box capsule sphere mesh");
        }
        const bool mesh = shape.type == MILD_SHAPE_MESH;
        if (!mesh && !take_numbers(keys, name, "size", sizes[shape.type], shape.size)) {
            raise(PyExc_ValueError, name + ".size is missing");
        }
        take_numbers(keys, name, "pos", 3, shape.pos);
        take_numbers(keys, name, "quat", 4, shape.quat);
        if (mesh) {
            vertices = rows_of(keys, name, "vertices");
            for (const double corner : rows_of(keys, name, "triangles")) {
                const double bound = (double)(vertices.size() / 3);
                if (!(corner >= 0 && corner < bound) || corner != std::floor(corner)) {
                    raise(PyExc_ValueError, name + ".triangles: a corner is no vertex");
                }
                triangles.push_back((int)corner);
            }
        }
        for (const auto &[key, value] : keys) {
            const std::string word = utf8(key, name.c_str());
            const bool own = mesh ? word == "vertices" || word == "triangles" : word == "size";
            if (!own && word != "type" && word != "pos" && word != "quat") {
                raise(PyExc_ValueError, name + ": a " + type + " has no '" + word + "'");
            }
        }
    }
};

static Sole make_surface(nb::handle shapes, double pitch, double spacing) {
    std::vector<Shape> kept;
    std::vector<MildShape> all;
    if (!nb::isinstance<nb::list>(shapes) && !nb::isinstance<nb::tuple>(shapes)) {
        raise(PyExc_TypeError, "shapes: it must be a list of dicts");
    }
    for (nb::handle shape : shapes) {
        kept.emplace_back(shape, "shapes[" + std::to_string(kept.size()) + "]");
    }
    for (const Shape &own : kept) {
        all.push_back(own.shape);
        all.back().vertices = own.vertices.data();
        all.back().vertex_count = (int)(own.vertices.size() / 3);
        all.back().triangles = own.triangles.data();
        all.back().triangle_count = (int)(own.triangles.size() / 3);
    }
    const MildSurfaceDef def = {all.data(), (int)all.size(), pitch, spacing};
    MildError error = {};
    MildSole *made = mild_sole_surface(&def, &error);
    check(made ? MILD_OK : error.status, error);
    const nb::object copy = nb::module_::import_("copy").attr("deepcopy")(shapes);
    return Sole(made, nb::make_tuple(again("surface"), nb::make_tuple(copy, pitch, spacing)));
}

using Centres = nb::ndarray<nb::numpy, const double, nb::ndim<1>>;

static Centres centres(nb::handle self, const double *at) {
    return Centres(at, {(size_t)mild_sole_elements(made_of<Sole>(self, "self").made)}, self);
}

static void bind_sole(nb::module_ &module) {
    nb::class_<Sole>(
        module, "Sole",
        "Footprint of a foot as square elements.\n\n"
        "outline: (points, 2) [m] polygon in the foot frame. pitch [m]: edge of an "
        "element; it does not change the ground; 0: near 0.0195, such that the elements have the "
        "outline's area.\nsole_z [m]: plane of the sole in the foot "
        "frame, negative below the ankle.\n"
        "target_elements: number of elements wanted; 0: by the area.\n"
        "Raises ValueError when the outline crosses itself or encloses no area.")
        .def("__init__", make_sole, nb::arg("outline"), nb::arg("pitch") = 0.0,
             nb::arg("sole_z") = 0.0, nb::arg("target_elements") = 0)
        .def_static("plate", make_plate, nb::arg("length"), nb::arg("width"),
                    "A plate of length x width [m], of whole elements, centred (docs/python.md).")
        .def_static(
            "surface", make_surface, nb::arg("shapes"), nb::arg("pitch") = 0.0195,
            nb::arg("spacing") = 0.0,
            "A shell: the outer surface of a body beside the feet, or of a foot that is no plane: "
            "a shin, a trunk, a wheel.\n\n"
            "shapes: a list of dicts: type, 'box' (size: half edges), 'capsule' (size: radius, "
            "half length along z), 'sphere' (size: radius) or 'mesh' (vertices: (n, 3), "
            "triangles: (m, 3), counterclockwise from outside); pos [m] and quat (w x y z) in the "
            "body's frame.\npitch [m]: that of the feet. spacing [m] of the elements; 0: pitch.\n"
            "Raises ValueError, with the name of the key, where a number is out of range. A Batch "
            "does not take shells. docs/model.md, section 20, has the law.")
        .def("concentric", make_concentric,
             "The sole of one element in the middle, for the concentric models.")
        .def(
            "sinkage",
            [](const Sole &sole, nb::handle material, double load) {
                const MildMaterial numbers = material_of(material, "material");
                return mild_sole_sinkage(sole.made, &numbers, positive(load, "load"));
            },
            nb::arg("material"), nb::arg("load"),
            "Depth [m] at which the level sole, pressed slowly into virgin ground, carries `load` "
            "[N].")
        .def_prop_ro(
            "elements", [](const Sole &sole) { return mild_sole_elements(sole.made); },
            "Number of elements.")
        .def_prop_ro(
            "pitch", [](const Sole &sole) { return mild_sole_pitch(sole.made); },
            "Edge of an element [m].")
        .def_prop_ro(
            "width", [](const Sole &sole) { return mild_sole_width(sole.made); },
            "Shorter side of the outline [m]; bekker's b where plate_width is 0.")
        .def_prop_ro(
            "z", [](const Sole &sole) { return mild_sole_z(sole.made); },
            "Plane of the sole in the foot frame [m].")
        .def_prop_ro(
            "x",
            [](nb::handle self) {
                return centres(self, mild_sole_x(made_of<Sole>(self, "self").made));
            },
            "Centres of the elements in the foot frame: (elements,) float64 [m], read-only.")
        .def_prop_ro(
            "y",
            [](nb::handle self) {
                return centres(self, mild_sole_y(made_of<Sole>(self, "self").made));
            },
            "The same along y.")
        .def("__reduce__", [](const Sole &sole) { return sole.recipe; });
}

/* ---- maps ---- */

static void make_map(Map *map, const std::string &kind, nb::handle heights, nb::handle labels,
                     int patch_count, nb::kwargs fields) {
    MildMapDef def = mild_map_def_default();
    MildError error = {};
    fields["kind"] = kind;
    set_fields(mild_map_fields, mild_map_field_count, &def, fields, "Map");
    def.patch_count = patch_count;
    nb::ndarray<const double, nb::c_contig, nb::device::cpu> rows;
    nb::object labels_copy = nb::none();
    std::vector<unsigned char> squares;
    if (!heights.is_none()) {
        rows = numbers_of(heights, "heights", 2);
        def.heights = rows.data();
        def.height_rows = (int)std::min<size_t>(rows.shape(0), INT32_MAX);
        def.height_columns = (int)std::min<size_t>(rows.shape(1), INT32_MAX);
    }
    if (!labels.is_none()) {
        const auto numbers = numbers_of(labels, "labels", 2);
        for (size_t i = 0; i < numbers.size(); i++) {
            const double label = numbers.data()[i];
            if (!(label >= 0 && label <= 254 && label == std::floor(label))) {
                raise(PyExc_ValueError, "labels: they must be whole numbers of 0 .. 254");
            }
            squares.push_back((unsigned char)label);
        }
        labels_copy = nb::cast(numbers).attr("copy")();
        def.labels = squares.data();
        def.label_rows = (int)std::min<size_t>(numbers.shape(0), INT32_MAX);
        def.label_columns = (int)std::min<size_t>(numbers.shape(1), INT32_MAX);
    }
    MildMap *made = mild_map_create(&def, &error);
    check(made ? MILD_OK : error.status, error);
    nb::dict all;
    all.update(nb::borrow<nb::dict>(fields));
    all["heights"] = heights.is_none() ? nb::none() : nb::cast(rows).attr("copy")();
    all["labels"] = labels_copy;
    all["patch_count"] = patch_count;
    new (map) Map(made, nb::make_tuple(again("make_map"), nb::make_tuple(all)));
}

static void bind_map(nb::module_ &module) {
    nb::class_<Map>(
        module, "Map",
        "Shape of the ground and pattern of its materials; it never changes.\n\n"
        "kind: flat, slope, steps, waves, rough, blocks, image or mixed. heights: (rows, "
        "columns) [-]\nof kind image, row 0 has the largest y. patches: none, stripes, "
        "checker or image;\nlabels: (rows, columns) whole numbers of the latter. "
        "Further fields: cell, size,\namplitude, wavelength, slope, seed, patch_size, "
        "border (docs/task.md section 11).")
        .def("__init__", make_map, nb::arg("kind") = "flat", nb::kw_only(),
             nb::arg("heights") = nb::none(), nb::arg("labels") = nb::none(),
             nb::arg("patch_count") = 1, nb::arg("fields"))
        .def_prop_ro(
            "labels", [](const Map &map) { return mild_map_label_count(map.made); },
            "Number of labels: materials that the map needs.")
        .def_prop_ro(
            "level", [](const Map &map) { return mild_map_is_level(map.made) != 0; },
            "Whether the height is the same everywhere.")
        .def("__reduce__", [](const Map &map) { return map.recipe; });
}

/* ---- terrains ---- */

static double finite(double value, const char *name) {
    if (!std::isfinite(value)) {
        raise(PyExc_ValueError, std::string(name) + ": it must be finite");
    }
    return value;
}

std::vector<MildMaterial> materials_of(nb::handle object) {
    std::vector<MildMaterial> list;
    if (nb::isinstance<Material>(object) || nb::isinstance<nb::str>(object)) {
        list.push_back(material_of(object, "materials"));
        return list;
    }
    if (!nb::isinstance<nb::sequence>(object)) {
        raise(PyExc_TypeError, "materials: they must be a Material, a name, or a list of these");
    }
    for (nb::handle one : nb::borrow<nb::sequence>(object)) {
        list.push_back(material_of(one, "materials"));
    }
    return list;
}

static std::vector<MildMaterial> materials_of_terrain(nb::handle object) {
    std::vector<MildMaterial> list = materials_of(object);
    if (list.empty() || list.size() > MILD_MATERIALS_MAX) {
        raise(PyExc_ValueError, "materials: " + std::to_string(list.size()) +
                                    " of them, but a terrain has 1 .. " +
                                    std::to_string(MILD_MATERIALS_MAX));
    }
    return list;
}

const MildMap *map_of(nb::handle object) {
    return object.is_none() ? nullptr : made_of<Map>(object, "map").made;
}

static void set_map(Terrain &terrain, nb::object map) {
    MildError error = {};
    check(mild_terrain_set_map(&terrain.terrain, map_of(map), &error), error);
    terrain.map = map;
}

static Terrain make_terrain(nb::handle materials, nb::object map, double height, double x,
                            double y) {
    const std::vector<MildMaterial> list = materials_of_terrain(materials);
    Terrain terrain = {mild_terrain_uniform(&list[0]), nb::none()};
    MildTerrain &at = terrain.terrain;
    at.material_count = (int)list.size();
    for (size_t i = 0; i < MILD_MATERIALS_MAX; i++) {
        at.materials[i] = list[i < list.size() ? i : 0]; /* what an element may still remember */
    }
    at.height = finite(height, "height");
    at.map_x = finite(x, "map_x");
    at.map_y = finite(y, "map_y");
    set_map(terrain, map);
    return terrain;
}

Terrain terrain_of(nb::handle object) {
    if (nb::isinstance<Terrain>(object)) {
        return made_of<Terrain>(object, "terrain");
    }
    return make_terrain(object, nb::none(), 0, 0, 0);
}

static void add_patch(Terrain &terrain, double x_min, double x_max, double y_min, double y_max,
                      int material) {
    const MildPatch patch = {x_min, x_max, y_min, y_max, material};
    MildError error = {};
    check(mild_terrain_add_patch(&terrain.terrain, &patch, &error), error);
}

static nb::tuple slope_at(const Terrain &terrain, double x, double y) {
    double slope[2];
    mild_terrain_slope_at(&terrain.terrain, finite(x, "x"), finite(y, "y"), slope);
    return nb::make_tuple(slope[0], slope[1]);
}

static nb::list list_materials(const Terrain &terrain) {
    nb::list list;
    for (int i = 0; i < terrain.terrain.material_count; i++) {
        list.append(Material{terrain.terrain.materials[i]});
    }
    return list;
}

static nb::tuple keep_terrain(const Terrain &terrain) {
    const MildTerrain &at = terrain.terrain;
    nb::list patches;
    for (int i = 0; i < at.patch_count; i++) {
        const MildPatch &patch = at.patches[i];
        patches.append(
            nb::make_tuple(patch.x_min, patch.x_max, patch.y_min, patch.y_max, patch.material));
    }
    return nb::make_tuple(list_materials(terrain), terrain.map, at.height, at.map_x, at.map_y,
                          patches);
}

/* What keep_terrain made: materials, map, height, map_x, map_y, patches. */
using KeptPatch = std::tuple<double, double, double, double, int>;
using KeptTerrain =
    std::tuple<nb::object, nb::object, double, double, double, std::vector<KeptPatch>>;

static void restore_terrain(Terrain *terrain, const KeptTerrain &kept) {
    const auto &[materials, map, height, x, y, patches] = kept;
    Terrain made = make_terrain(materials, map, height, x, y);
    for (const auto &[x_min, x_max, y_min, y_max, material] : patches) {
        add_patch(made, x_min, x_max, y_min, y_max, material);
    }
    new (terrain) Terrain(made);
}

void bind_terrain(nb::module_ &module) {
    bind_sole(module);
    bind_map(module);
    nb::class_<Terrain>(module, "Terrain",
                        "Height and material under every point of the world.\n\n"
                        "materials: a Material, a preset's name, or up to 12 of these; a label of "
                        "the map is\nan index into them. height [m]: added to the map's. map_x, "
                        "map_y [m]: where the map's\norigin lies.")
        .def(
            "__init__",
            [](Terrain *terrain, nb::handle materials, nb::object map, double height, double x,
               double y) { new (terrain) Terrain(make_terrain(materials, map, height, x, y)); },
            nb::arg("materials") = "sand_loose", nb::kw_only(), nb::arg("map") = nb::none(),
            nb::arg("height") = 0.0, nb::arg("map_x") = 0.0, nb::arg("map_y") = 0.0)
        .def("add_patch", add_patch, nb::arg("x_min"), nb::arg("x_max"), nb::arg("y_min"),
             nb::arg("y_max"), nb::arg("material"),
             "A rectangle [m] of the material with this index. Raises ValueError when it is empty "
             "or\noverlaps an earlier one, or when there are 16 already.")
        .def_prop_ro("materials", list_materials, "Copies of the materials.")
        .def_prop_ro(
            "map", [](const Terrain &terrain) { return terrain.map; }, "The Map, or None.")
        .def_prop_rw(
            "height", [](const Terrain &terrain) { return terrain.terrain.height; },
            [](Terrain &terrain, double height) {
                terrain.terrain.height = finite(height, "height");
            },
            "Height of the surface [m], added to the map's.")
        .def(
            "height_at",
            [](const Terrain &terrain, double x, double y) {
                return mild_terrain_height_at(&terrain.terrain, finite(x, "x"), finite(y, "y"));
            },
            nb::arg("x"), nb::arg("y"), "Undisturbed surface [m] at the world point (x, y) [m].")
        .def("slope_at", slope_at, nb::arg("x"), nb::arg("y"),
             "Gradient of the surface [-] along x and y.")
        .def(
            "material_at",
            [](const Terrain &terrain, double x, double y) {
                return mild_terrain_material_at(&terrain.terrain, finite(x, "x"), finite(y, "y"));
            },
            nb::arg("x"), nb::arg("y"), "Index of the material at the world point (x, y) [m].")
        .def("__getstate__", keep_terrain)
        .def("__setstate__", restore_terrain);
}
