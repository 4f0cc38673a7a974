/* mild.Material, and what turns Python's arguments into numbers. */
#include "ground.h"

#include <cmath>

extern "C" {
#include "ground/soil/soil.h"
}

double positive(double value, const char *name) {
    if (!(value > 0 && std::isfinite(value))) {
        raise(PyExc_ValueError, std::string(name) + " = " + std::to_string(value) +
                                    ", but it must be a number above 0");
    }
    return value;
}

nb::ndarray<const double, nb::c_contig, nb::device::cpu>
numbers_of(nb::handle object, const char *name, int dimensions) {
    nb::object array;
    try {
        const nb::module_ numpy = nb::module_::import_("numpy");
        array = numpy.attr("asarray")(object);
        const std::string kind = nb::cast<std::string>(array.attr("dtype").attr("kind"));
        if (std::string("biuf").find(kind) == std::string::npos) {
            raise(PyExc_TypeError, std::string(name) + ": not an array of numbers");
        }
        array = numpy.attr("ascontiguousarray")(array, "f8");
    } catch (nb::python_error &error) {
        if (error.matches(PyExc_MemoryError)) {
            throw;
        }
        raise(PyExc_TypeError, std::string(name) + ": not an array of numbers");
    }
    nb::ndarray<const double, nb::c_contig, nb::device::cpu> numbers;
    if (!nb::try_cast(array, numbers, false)) {
        raise(PyExc_TypeError, std::string(name) + ": not an array of numbers");
    }
    if (dimensions >= 0 && (int)numbers.ndim() != dimensions) {
        raise(PyExc_ValueError, std::string(name) + ": " + std::to_string(numbers.ndim()) +
                                    " dimensions, but it must have " + std::to_string(dimensions));
    }
    return numbers;
}

void set_fields(const MildField *fields, int count, void *def, const nb::kwargs &values,
                const char *kind) {
    MildError error = {};
    for (auto [key, value] : values) {
        const char *nearest = nullptr;
        const std::string name = utf8(key, kind);
        const MildField *field = mild_field_find(fields, count, name.c_str(), &nearest);
        if (!field) {
            raise(PyExc_TypeError, std::string(kind) + ": there is no '" + name +
                                       "'; nearest is '" + (nearest ? nearest : "") + "'");
        }
        const std::string text = utf8(value, field->name);
        check(mild_field_parse(field, def, text.c_str(), kind, &error), error);
    }
}

MildMaterial material_of(nb::handle object, const char *name) {
    if (nb::isinstance<Material>(object)) {
        return made_of<Material>(object, name).numbers;
    }
    MildMaterial material = mild_material_default();
    const nb::object text = nb::hasattr(object, "__fspath__")
                                ? nb::module_::import_("os").attr("fspath")(object)
                                : nb::borrow(object);
    if (!nb::isinstance<nb::str>(text)) {
        raise(PyExc_TypeError,
              std::string(name) + ": a " + type_text(object) +
                  ", but it must be a Material, the name of a preset, or of a soil's file");
    }
    MildError error = {};
    check(soil_find(utf8(text, name).c_str(), &material, &error), error);
    return material;
}

static void check_numbers(const MildMaterial &numbers) {
    MildError error = {};
    check(mild_material_check(&numbers, &error), error);
}

static double *number_at(MildMaterial &numbers, const MildField *field) {
    return reinterpret_cast<double *>(reinterpret_cast<char *>(&numbers) + field->offset);
}

static void set_number(Material &material, const MildField *field, double value) {
    MildMaterial changed = material.numbers;
    *number_at(changed, field) = value;
    check_numbers(changed);
    material.numbers = changed;
}

static void set_model(Material &material, const std::string &name) {
    MildMaterial changed = material.numbers;
    MildModel model;
    if (!mild_model_find(name.c_str(), &model)) {
        raise(PyExc_ValueError, "model: there is none named '" + name +
                                    "'; mild.models() lists "
                                    "them");
    }
    changed.model = (int)model;
    check_numbers(changed);
    material.numbers = changed;
}

static void bind_fields(nb::class_<Material> &type) {
    for (int i = 0; i < mild_material_field_count; i++) {
        const MildField *field = &mild_material_fields[i];
        if (field->type != MILD_FIELD_DOUBLE) {
            continue; /* passive and model, by hand */
        }
        type.def_prop_rw(
            field->name,
            [field](Material &material) { return *number_at(material.numbers, field); },
            [field](Material &material, double value) { set_number(material, field, value); },
            field->help);
    }
    type.def_prop_rw(
        "passive", [](Material &material) { return material.numbers.passive != 0; },
        [](Material &material, bool value) { material.numbers.passive = value; },
        "Clamp c_g and c_d, so that the ground creates no energy.");
    type.def_prop_rw(
        "model", [](Material &material) { return mild_model_names[material.numbers.model]; },
        set_model, "Name of the ground model; one of mild.models() but rigid.");
}

static std::string print(const Material &material) {
    std::string text = "Material(";
    const MildMaterial usual = mild_material_default();
    char number[64], before[64];
    for (int i = 0; i < mild_material_field_count; i++) {
        const MildField *field = &mild_material_fields[i];
        mild_field_print(field, &material.numbers, number, sizeof number);
        mild_field_print(field, &usual, before, sizeof before);
        if (std::string(number) != before) {
            const bool word = field->type == MILD_FIELD_NAME || field->type == MILD_FIELD_BOOL;
            text += (text.back() == '(' ? "" : ", ") + std::string(field->name) + "=" +
                    (word ? "'" : "") + number + (word ? "'" : "");
        }
    }
    return text + ")";
}

static nb::dict all_fields(const Material &material) {
    nb::dict fields;
    char text[64];
    for (int i = 0; i < mild_material_field_count; i++) {
        mild_field_print(&mild_material_fields[i], &material.numbers, text, sizeof text);
        fields[mild_material_fields[i].name] = text;
    }
    return fields;
}

static void make(Material *material, nb::object preset, const nb::kwargs &fields) {
    MildMaterial numbers = material_of(preset, "preset");
    set_fields(mild_material_fields, mild_material_field_count, &numbers, fields, "Material");
    check_numbers(numbers);
    new (material) Material{numbers};
}

static Material match(const Material &material, const std::string &model, const Sole &sole,
                      double load) {
    MildModel wanted;
    MildError error = {};
    Material rival = material;
    if (!mild_model_find(model.c_str(), &wanted)) {
        raise(PyExc_ValueError, "model: there is none named '" + model + "'");
    }
    check(mild_model_match(wanted, &material.numbers, sole.made, load, &rival.numbers, &error),
          error);
    return rival;
}

/* Lines of remarks at the top and one above each field of `notes`. */
static void save(const Material &material, nb::handle path, nb::handle head, nb::handle notes) {
    const std::string name = utf8(nb::module_::import_("os").attr("fspath")(path), "path"),
                      top = head.is_none() ? "" : utf8(head, "head");
    std::vector<std::string> texts((size_t)mild_material_field_count);
    std::vector<const char *> lines((size_t)mild_material_field_count, nullptr);
    if (!notes.is_none()) {
        for (auto [key, value] : nb::cast<nb::dict>(notes)) {
            const std::string field = utf8(key, "notes");
            const MildField *found = mild_field_find(
                mild_material_fields, mild_material_field_count, field.c_str(), nullptr);
            if (!found) {
                raise(PyExc_ValueError, "notes: there is no field '" + field + "'");
            }
            const size_t i = (size_t)(found - mild_material_fields);
            texts[i] = utf8(value, "notes");
            lines[i] = texts[i].c_str();
        }
    }
    const SoilNotes said = {top.c_str(), lines.data()};
    MildError error = {};
    check(soil_write(&material.numbers, &said, name.c_str(), &error), error);
}

static bool equal(const Material &a, nb::object b) {
    return nb::isinstance<Material>(b) &&
           all_fields(a).equal(all_fields(made_of<Material>(b, "other")));
}

void bind_material(nb::module_ &module) {
    nb::class_<Material> type(
        module, "Material",
        "Parameters of the element law (docs/model.md section 10): Material(preset, **fields).\n\n"
        "preset: a name of mild.presets(), a soil's file (docs/soil.md), or a Material to start\n"
        "from. Fields are those below. `model` says which law reads the numbers and changes\n"
        "none of them; a preset has those of mild. match() makes the numbers of another model.\n"
        "Raises ValueError for a number outside its range, TypeError for a name that is none.");
    bind_fields(type);
    type.def("__init__", make, nb::arg("preset") = "sand_loose", nb::arg("fields"))
        .def("match", match, nb::arg("model"), nb::arg("sole"), nb::arg("load"),
             "The material of another model under which a level sole sinks to the same depth at\n"
             "`load` [N]; half a robot's weight is a good one. For a concentric model the result\n"
             "belongs to sole.concentric().")
        .def("save", save, nb::arg("path"), nb::arg("head").none() = nb::none(),
             nb::arg("notes").none() = nb::none(),
             "Writes a soil's file (docs/soil.md), which Material(path), `--ground path` and the\n"
             "plugin read; its name ends in .ini. head: text for remarks at the top. notes:\n"
             "{field: text} for a remark above a field. Completely or not at all.")
        .def("as_dict", all_fields, "All fields as text that Material(**fields) reads.")
        .def("__repr__", print)
        .def("__eq__", equal, nb::arg("other").none())
        .def("__getstate__", all_fields)
        .def("__setstate__", [](Material *material, const nb::dict &fields) {
            MildMaterial numbers = mild_material_default();
            set_fields(mild_material_fields, mild_material_field_count, &numbers,
                       nb::cast<nb::kwargs>(fields), "Material");
            check_numbers(numbers);
            new (material) Material{numbers};
        });
    type.attr("__hash__") = nb::none();
    module.def(
        "presets",
        [] {
            std::vector<std::string> names;
            for (int i = 0; i < mild_material_preset_count(); i++) {
                names.push_back(mild_material_preset_name(i));
            }
            for (int model = 0; model < MILD_MODEL_RIGID; model++) {
                const MildModelInfo *info = mild_model_info((MildModel)model);
                for (int i = 0; model && i < MILD_MODEL_PRESETS && info->presets[i]; i++) {
                    names.push_back(info->presets[i]);
                }
            }
            return names;
        },
        "Names of the presets of all ground models.");
    module.def(
        "models",
        [] { return std::vector<std::string>(mild_model_names, mild_model_names + MILD_MODELS); },
        "Names of the ground models; rigid, the last, has no material.");
}
