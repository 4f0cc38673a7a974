"""Parameters of a ground from a measured press, in the form of a scikit-learn estimator."""
import collections.abc
import math

import numpy as np

from . import _ground


def loading(time, depth, force, speed=None):
    """The loading part of one record as (X, y) for GroundFit: rows deeper than all before them.

    time [s], depth [m], force [N] and, if it was measured, speed [m/s] down: each (n,). Returns X (m, 3) of depth, speed
    and acceleration [m/s^2], the latter two from the times by local polynomials, and y (m,) of forces. Raises ValueError
    for arrays of different lengths."""
    columns = [_column(name, values) for name, values in (("time", time), ("depth", depth), ("force", force))]
    columns.append(np.full_like(columns[1], np.nan) if speed is None else _column("speed", speed))
    if len({len(column) for column in columns}) != 1:
        raise ValueError("time, depth, force, speed: they have different lengths")
    rows = _ground._loading(np.column_stack([*columns, np.zeros_like(columns[0])]))
    return rows[:, [1, 3, 4]], rows[:, 2].copy()


class GroundFit:
    """Fits a ground model to forces on a level plate that is pressed straight down (docs/model.md section 12).

    plate: (length, width) [m] or a Sole. model: its name. hold: {parameter: number} that is known. fill: a Material or
    preset that gives what the data do not tell; None: such parameters get no value.

    After fit(X, y): parameters_ {name: number, NaN where the data do not tell it}, intervals_ {name: (low, high)} of 95 %,
    states_ {name: held, filled, fitted, limit, open, tied or no_effect}, combinations_ {name: (number, low, high)} of tied
    parameters, material_ the Material whose curve was fitted, residual_ [N] root mean square, n_features_in_."""

    _estimator_type = "regressor"

    def __init__(self, plate=(0.2, 0.1), model="mild", hold=None, fill=None):
        self.plate = plate
        self.model = model
        self.hold = hold
        self.fill = fill

    def get_params(self, deep=True):
        """The arguments of the constructor."""
        return {"plate": self.plate, "model": self.model, "hold": self.hold, "fill": self.fill}

    def set_params(self, **params):
        """Sets arguments of the constructor; raises ValueError for a name that is none."""
        for name, value in params.items():
            if name not in self.get_params():
                raise ValueError(f"set_params: GroundFit has no parameter '{name}'")
            setattr(self, name, value)
        return self

    def fit(self, X, y):
        """X: (n, 1 .. 3) depth [m], speed [m/s] down, acceleration [m/s^2] of loading rows, see `loading`; what is left
        out is 0. y: (n,) force [N] up on the plate. Raises ValueError when they are not finite, too few, or do not match."""
        X, y = _table(X), _column("y", y)
        if len(X) != len(y):
            raise ValueError(f"y: {len(y)} numbers for {len(X)} rows of X")
        if not isinstance(self.hold, (collections.abc.Mapping, type(None))):
            raise TypeError(f"hold: a {type(self.hold).__name__}, but it must be a dict of numbers")
        sole, width = self._plate()
        found = _ground._fit(sole, width, _rows(X, y), self.model, dict(self.hold or {}), self.fill)
        values = found["parameters"]
        self.parameters_ = {name: value["value"] for name, value in values.items()}
        self.intervals_ = {name: (value["low"], value["high"]) for name, value in values.items()}
        self.states_ = {name: value["state"] for name, value in values.items()}
        self.units_ = {name: value["unit"] for name, value in {**values, **found["combinations"]}.items()}
        self.combinations_ = {name: (value["value"], value["low"], value["high"])
                              for name, value in found["combinations"].items()}
        self.material_, self.residual_ = found["curve"], found["residual"]
        self.n_features_in_ = X.shape[1]
        return self

    def predict(self, X):
        """Forces [N] of the fitted curve: (n,). X as for fit. Raises RuntimeError before fit."""
        if not hasattr(self, "material_"):
            raise RuntimeError("GroundFit.predict: nothing is fitted; call fit(X, y) first")
        X = _table(X)
        return _ground._fit_forces(self._plate()[0], self.material_, _rows(X, np.zeros(len(X))))

    def score(self, X, y):
        """Coefficient of determination R^2 of predict(X) against y, in scikit-learn's convention: where all of y are the same, 1 if
        they are predicted exactly, else 0; NaN for a single row."""
        y = _column("y", y)
        missed, spread = y - self.predict(X), y - y.mean()
        if len(y) < 2:
            return math.nan
        if np.ptp(y) == 0:
            return float(not missed.any())
        return 1 - float(missed @ missed) / float(spread @ spread)

    def _plate(self):
        """The plate in the elements of the model, and its smaller side [m]."""
        plate = self.plate
        if isinstance(plate, _ground.Sole):
            sole, width = plate, min(np.ptp(plate.x), np.ptp(plate.y)) + plate.pitch
        else:
            try:
                length, width = (float(side) for side in plate)
            except (TypeError, ValueError):
                raise TypeError("plate: it must be (length, width) in metres or a Sole") from None
            sole, width = _ground.Sole.plate(length, width), min(length, width)
        concentric = self.model in ("con_cone", "con_spring") and sole.elements > 1
        return (sole.concentric() if concentric else sole), float(width)

    def __repr__(self):
        params = ", ".join(f"{name}={value!r}" for name, value in self.get_params().items())
        return f"GroundFit({params})"

    def __sklearn_tags__(self):
        from sklearn.utils import Tags, TargetTags, RegressorTags  # only scikit-learn asks for it

        return Tags(estimator_type="regressor", target_tags=TargetTags(required=True), regressor_tags=RegressorTags())


def _numbers(name, values):
    try:
        array = np.asarray(values)
        if array.dtype.kind in "biuf":
            return array.astype(np.float64)
    except ValueError:  # rows of different lengths
        pass
    raise TypeError(f"{name}: not an array of numbers")


def _column(name, values):
    column = _numbers(name, values)
    if column.ndim != 1:
        raise ValueError(f"{name}: {column.ndim} dimensions, but it must have one")
    return column


def _table(X):
    X = _numbers("X", X)
    if X.ndim != 2 or not 1 <= X.shape[1] <= 3:
        raise ValueError(f"X: shape {X.shape}, but it must be (n, 1), (n, 2) or (n, 3): depth, speed, acceleration")
    return X


def _rows(X, y):
    """What the module takes: time, depth, force, speed, acceleration."""
    motion = np.zeros((len(X), 3))
    motion[:, : X.shape[1]] = X
    return np.column_stack([np.full(len(X), math.nan), motion[:, 0], y, motion[:, 1], motion[:, 2]])
