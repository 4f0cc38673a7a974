#!/usr/bin/env python3
"""Prints two or more `mild eval --json` files as one table: compare.py NAME=FILE NAME=FILE ..."""
import json
import sys

COLUMNS = [  # key, heading, format
    ("success", "success", "{:.0f}"),
    ("velocity", "measured [m/s]", "{:.2f}"),
    ("cot", "cost of transport", "{:.2f}"),
    ("torque_max", "max torque [N m]", "{:.0f}"),
    ("clearance", "clearance [m]", "{:.3f}"),
    ("penetration", "sinkage [m]", "{:.3f}"),
]


def cell(row, key, form):
    value = row[key]
    if value is None or value != value or (key in ("velocity", "cot") and row.get("measured") == 0):
        return "-"
    text = form.format(value)
    return f"{text} of {row['trials']}" if key == "success" else text


def main(arguments):
    if len(arguments) < 2 or not all("=" in argument for argument in arguments):
        sys.exit(__doc__)
    tables = {}
    for argument in arguments:
        name, path = argument.split("=", 1)
        with open(path, encoding="utf-8") as file:
            tables[name] = {(row["ground"], row["speed"]): row for row in json.load(file)["rows"]}
    lines = [["ground", "speed [m/s]", "policy"] + [heading for _, heading, _ in COLUMNS]]
    for case in next(iter(tables.values())):
        for name, rows in tables.items():
            if case in rows:
                cells = [cell(rows[case], key, form) for key, _, form in COLUMNS]
                lines.append([case[0], f"{case[1]:.2f}", name] + cells)
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    for line in lines:
        texts = [f"{text:<{width}}" if i in (0, 2) else f"{text:>{width}}" for i, (text, width) in enumerate(zip(line, widths))]
        print("  ".join(texts).rstrip())


if __name__ == "__main__":
    main(sys.argv[1:])
