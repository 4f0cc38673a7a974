"""What pickle calls to make objects again."""
from ._ground import Map, Sole


def plate(length, width):
    return Sole.plate(length, width)


def surface(shapes, pitch, spacing):
    return Sole.surface(shapes, pitch, spacing)


def concentric(sole):
    return sole.concentric()


def make_map(fields):
    return Map(**fields)
