#!/usr/bin/env python3
"""Holds JSON files to a schema of docs/schema: schema.py SCHEMA.json FILE...; a line for each that does not fit, and exit 1.
Knows the part of JSON Schema 2020-12 that the schemas use, and refuses a schema with anything else."""
import json
import re
import sys

REMARKS = {"$schema", "$defs", "title", "description"}
TYPES = {"object": dict, "array": list, "string": str, "number": (int, float), "integer": int, "boolean": bool,
         "null": type(None)}


def fits(value, schema, root):
    return next(faults(value, schema, root, ""), None) is None


def names_of(names):
    return [names] if isinstance(names, str) else names


def is_a(value, name):
    return isinstance(value, TYPES[name]) and isinstance(value, bool) == (name == "boolean")


def faults(value, schema, root, where):
    """Yields what is wrong with a value."""
    checks = {
        "$ref": lambda ref: faults(value, resolve(root, ref), root, where),
        "type": lambda names: () if any(is_a(value, name) for name in names_of(names)) else [f"{where}: no {' or '.join(names_of(names))}"],
        "minimum": lambda least: () if value is None or value >= least else [f"{where}: below {least}"],
        "pattern": lambda form: () if re.search(form, value) else [f"{where}: not of the form {form}"],
        "minItems": lambda least: () if len(value) >= least else [f"{where}: fewer than {least} items"],
        "required": lambda names: [f"{where}: no {name}" for name in names if name not in value],
        "items": lambda item: (f for i, v in enumerate(value) for f in faults(v, item, root, f"{where}[{i}]")),
        "properties": lambda known: (f for k, v in value.items() if k in known for f in faults(v, known[k], root, f"{where}.{k}")),
        "additionalProperties": lambda other: (f for k, v in value.items() if k not in schema.get("properties", ())
                                               for f in more(v, other, root, f"{where}.{k}")),
        "oneOf": lambda forms: () if sum(fits(value, form, root) for form in forms) == 1 else [f"{where}: not one of {forms}"],
    }
    unknown = set(schema) - set(checks) - REMARKS
    if unknown:
        sys.exit(f"schema.py does not know {sorted(unknown)} at {where or 'the top'}")
    if "type" in schema and list(checks["type"](schema["type"])):
        yield from checks["type"](schema["type"])
        return  # the other checks are for values of the type
    for name, check in checks.items():
        if name in schema and name != "type":
            yield from check(schema[name])


def more(value, schema, root, where):
    """A property that is not listed: false forbids it."""
    if schema is False:
        return [f"{where}: not in the schema"]
    return faults(value, schema, root, where)


def resolve(root, ref):
    for name in ref.removeprefix("#/").split("/"):
        root = root[name]
    return root


def main(schema_path, *paths):
    with open(schema_path, encoding="utf-8") as file:
        schema = json.load(file)
    found = 0
    for path in paths:
        with open(path, encoding="utf-8") as file:
            for fault in faults(json.load(file), schema, schema, ""):
                print(f"{path}{fault}")
                found += 1
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
