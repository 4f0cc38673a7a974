/* Arguments of the Python modules: arrays are taken as they are, without a copy, from NumPy or over
 * DLPack, or refused with one line that names the argument. */
#ifndef MILD_PYTHON_ARRAYS_H
#define MILD_PYTHON_ARRAYS_H

#include <atomic>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "mild/error.h"

namespace nb = nanobind;

/* Raises what *error says: MemoryError, OSError, or ValueError. */
[[noreturn]] inline void raise(const MildError &error) {
    PyObject *type = error.status == MILD_ERROR_MEMORY ? PyExc_MemoryError
                     : error.status == MILD_ERROR_IO   ? PyExc_OSError
                                                       : PyExc_ValueError;
    PyErr_SetString(type, error.text);
    throw nb::python_error();
}

inline void check(MildStatus status, const MildError &error) {
    if (status != MILD_OK) {
        raise(error);
    }
}

/* A cudaStream_t, which Python has as a number. */
inline MildStream stream_of(uintptr_t number) {
    return (MildStream)number;
}

[[noreturn]] inline void raise(PyObject *type, const std::string &text) {
    PyErr_SetString(type, text.c_str());
    throw nb::python_error();
}

/* The text of any object, in UTF-8. Raises ValueError where there is none. */
inline std::string utf8(nb::handle object, const char *name) {
    const nb::str text(object);
    Py_ssize_t size = 0;
    const char *bytes = PyUnicode_AsUTF8AndSize(text.ptr(), &size);
    if (!bytes) {
        PyErr_Clear();
        raise(PyExc_ValueError, std::string(name) + ": its text is not Unicode");
    }
    if (std::string(bytes).size() != (size_t)size) {
        raise(PyExc_ValueError, std::string(name) + ": its text has a null character");
    }
    return bytes;
}

/* Name of an object's type, for messages. */
inline std::string type_text(nb::handle object) {
    return utf8(nb::type_name(object.type()), "type");
}

/* Where arrays must lie: the CPU, or a CUDA device by its number. */
constexpr int ON_CPU = -1;

/* What is asked of an array. */
struct Wanted {
    const char *name; /* of the argument */
    nb::dlpack::dtype dtype;
    std::vector<int64_t> shape;
    int device = ON_CPU;
    bool write = false;
};

inline std::string text_of(const std::vector<int64_t> &shape) {
    std::string text = "(";
    for (size_t i = 0; i < shape.size(); i++) {
        text += (i ? ", " : "") + std::to_string(shape[i]);
    }
    return text + (shape.size() == 1 ? ",)" : ")");
}

inline std::string text_of(nb::dlpack::dtype type) {
    static const char *const names[] = {"int",    "uint",    "float", "opaque",
                                        "bfloat", "complex", "bool"};
    const std::string name = type.code < 7 ? names[type.code] : "code " + std::to_string(type.code);
    return type.code == 6 ? name : name + std::to_string(type.bits);
}

inline std::string device_text(int type, int number) {
    const bool cpu = type == nb::device::cpu::value || type == nb::device::cuda_host::value;
    const bool cuda = type == nb::device::cuda::value || type == nb::device::cuda_managed::value;
    return cpu    ? "the CPU"
           : cuda ? "cuda:" + std::to_string(number)
                  : "a device of type " + std::to_string(type);
}

/* A boolean is a byte of 0 or 1. */
inline bool same_dtype(nb::dlpack::dtype got, nb::dlpack::dtype wanted) {
    const nb::dlpack::dtype boolean = nb::dtype<bool>();
    return got == wanted || (wanted == nb::dtype<uint8_t>() && got == boolean);
}

/* An array that is kept while C uses it. */
struct Array {
    nb::ndarray<> writable;
    nb::ndarray<nb::ro> readable;
    void *data = nullptr; /* NULL: no array */
    size_t bytes = 0;
    const char *name = nullptr; /* of the argument */
    bool write = false;
};

template <typename Any> void check_array(const Any &array, const Wanted &wanted) {
    std::vector<int64_t> shape, strides;
    for (size_t i = 0; i < array.ndim(); i++) {
        shape.push_back((int64_t)array.shape(i));
        strides.push_back(array.stride(i));
    }
    const std::string name = wanted.name;
    if (!same_dtype(array.dtype(), wanted.dtype)) {
        raise(PyExc_TypeError, name + ": dtype " + text_of(array.dtype()) + ", but it must be " +
                                   text_of(wanted.dtype));
    }
    if (shape != wanted.shape) {
        raise(PyExc_ValueError,
              name + ": shape " + text_of(shape) + ", but it must be " + text_of(wanted.shape));
    }
    const int type = wanted.device < 0 ? nb::device::cpu::value : nb::device::cuda::value;
    const int number = wanted.device < 0 ? 0 : wanted.device;
    if (device_text(array.device_type(), array.device_id()) != device_text(type, number)) {
        raise(PyExc_ValueError, name + ": it is on " +
                                    device_text(array.device_type(), array.device_id()) +
                                    ", but it must be on " + device_text(type, number));
    }
    int64_t step = 1;
    for (size_t i = shape.size(); i-- > 0; step *= shape[i]) {
        if (shape[i] > 1 && strides[i] != step) {
            raise(PyExc_ValueError, name + ": strides " + text_of(strides) +
                                        ", but it must be contiguous in C order");
        }
    }
    if ((uintptr_t)array.data() % (wanted.dtype.bits / 8) != 0) {
        raise(PyExc_ValueError, name + ": its memory is not aligned to its numbers");
    }
}

/* The array of an argument. */
inline Array take_array(nb::handle object, const Wanted &wanted) {
    Array array;
    array.name = wanted.name;
    array.write = wanted.write;
    if (wanted.write && nb::try_cast<nb::ndarray<>>(object, array.writable, false)) {
        check_array(array.writable, wanted);
        array.data = array.writable.data();
        array.bytes = array.writable.nbytes();
        return array;
    }
    if (!nb::try_cast<nb::ndarray<nb::ro>>(object, array.readable, false)) {
        raise(PyExc_TypeError, std::string(wanted.name) + ": a " + type_text(object) +
                                   ", but it must be an array (NumPy, or with __dlpack__)");
    }
    check_array(array.readable, wanted);
    if (wanted.write) {
        raise(PyExc_ValueError, std::string(wanted.name) + ": it is read-only");
    }
    array.data = const_cast<void *>(static_cast<const void *>(array.readable.data()));
    array.bytes = array.readable.nbytes();
    return array;
}

/* The same, where None stands for no array. */
inline Array take_optional(nb::handle object, const Wanted &wanted) {
    return object.is_none() ? Array() : take_array(object, wanted);
}

template <typename T> T *pointer(const Array &array) {
    return static_cast<T *>(array.data);
}

/* Raises ValueError when both have a byte in common, and one of them is written. */
inline void check_apart(const Array &one, const Array &other) {
    const uintptr_t a = (uintptr_t)one.data, b = (uintptr_t)other.data;
    if ((one.write || other.write) && one.bytes && other.bytes && a < b + other.bytes &&
        b < a + one.bytes) {
        raise(PyExc_ValueError, std::string(one.name) + ", " + other.name +
                                    ": they share memory; give " +
                                    (other.write ? other.name : one.name) + " an array of its own");
    }
}

/* Of every two of them. */
inline void check_apart(const std::vector<const Array *> &arrays) {
    for (size_t i = 0; i < arrays.size(); i++) {
        for (size_t k = 0; k < i; k++) {
            check_apart(*arrays[k], *arrays[i]);
        }
    }
}

/* One thread at a time: raises RuntimeError when another is inside. */
class Entered {
  public:
    Entered(std::atomic<bool> &busy, const char *name) : busy(busy) {
        if (busy.exchange(true)) {
            raise(PyExc_RuntimeError,
                  std::string(name) + ": another thread is inside; use one object per thread");
        }
    }
    ~Entered() {
        busy = false;
    }
    Entered(const Entered &) = delete;
    Entered &operator=(const Entered &) = delete;

  private:
    std::atomic<bool> &busy;
};

/* Rows of doubles as a NumPy array that owns them. */
inline nb::object array_of(std::vector<double> numbers, std::vector<size_t> shape) {
    auto *kept = new std::vector<double>(std::move(numbers));
    nb::capsule owner(kept, [](void *p) noexcept { delete (std::vector<double> *)p; });
    return nb::cast(
        nb::ndarray<nb::numpy, double>(kept->data(), shape.size(), shape.data(), owner));
}

#endif
