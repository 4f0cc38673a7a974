"""Parameters of a ground from a measured press, in the form of a scikit-learn estimator."""
import collections.abc
import math
import os

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
    nought = np.zeros_like(columns[0])
    rows = _ground._loading(np.column_stack([*columns, nought, nought]))
    return rows[:, [1, 3, 4]], rows[:, 2].copy()


class GroundFit:
    """Fits a ground model to forces on a level plate that is pressed straight down (docs/model.md section 12).

    plate: (length, width) [m] or a Sole; a list of these for records with plates of their own, and then fit, predict and
    score take as many arrays X and y, in a list. model: its name. hold: {parameter: number} that is known. fill: a Material
    or preset that gives what the data do not determine; None: such parameters get no value.

    After fit(X, y): parameters_ {name: number, NaN where the data do not determine it}, intervals_ {name: (low, high)} of 95 %,
    states_ {name: held, filled, fitted, limit, open, tied or no_effect}, combinations_ {name: (number, low, high)} of tied
    parameters, material_ the Material whose curve was fitted, residual_ [N] root mean square, drag_residual_ [N] of
    drags, n_features_in_."""

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

    def fit(self, X, y, drags=()):
        """X: (n, 1 .. 3) depth [m], speed [m/s] down, acceleration [m/s^2] of loading rows, see `loading`; what is left
        out is 0. y: (n,) force [N] up on the plate. Raises ValueError when they are not finite, too few, or do not match.

        drags: plates that slide, of mild and mild_merged, which determine slip_length, grip and mu, and one that sinks as it slides
        regain_length: a list of (plate, table), table (n, 4) of slip [m], depth [m], force up [N] and force along on the plate [N]
        (against the slip; NaN where it was not measured). Rows before the slip, with the slip of the first, say what the plate
        carried."""
        soles = self._soles()
        tables = self._records("X", X)
        columns = [_column("y", part) for part in (y if self._several() else [y])]
        if [len(table) for table in tables] != [len(column) for column in columns]:
            lengths = ", ".join(str(len(column)) for column in columns)
            raise ValueError(f"y: {lengths} numbers for {', '.join(str(len(table)) for table in tables)} rows of X")
        if not isinstance(self.hold, (collections.abc.Mapping, type(None))):
            raise TypeError(f"hold: a {type(self.hold).__name__}, but it must be a dict of numbers")
        found = _ground._fit(soles, _rows(tables, columns), self.model, dict(self.hold or {}), self.fill, self._drags(drags))
        values = found["parameters"]
        self.parameters_ = {name: value["value"] for name, value in values.items()}
        self.intervals_ = {name: (value["low"], value["high"]) for name, value in values.items()}
        self.states_ = {name: value["state"] for name, value in values.items()}
        self.units_ = {name: value["unit"] for name, value in {**values, **found["combinations"]}.items()}
        self.combinations_ = {name: (value["value"], value["low"], value["high"])
                              for name, value in found["combinations"].items()}
        self.material_, self.residual_ = found["curve"], found["residual"]
        self.drag_residual_ = found["drag_residual"]
        self.n_features_in_ = tables[0].shape[1]
        return self

    def predict(self, X):
        """Forces [N] of the fitted curve: (n,), or a list of these. X as for fit. Raises RuntimeError before fit."""
        if not hasattr(self, "material_"):
            raise RuntimeError("GroundFit.predict: nothing is fitted; call fit(X, y) first")
        soles, tables = self._soles(), self._records("X", X)
        forces = _ground._fit_forces(soles, self.material_, _rows(tables, [np.zeros(len(table)) for table in tables]))
        return np.split(forces, np.cumsum([len(table) for table in tables])[:-1]) if self._several() else forces

    def save(self, path):
        """Writes the ground as a soil's file (docs/soil.md), with residual and intervals as remarks. Raises RuntimeError before fit, ValueError
        where a number is not determined: `fill` gives what these data, or any press, leave open."""
        if not hasattr(self, "material_"):
            raise RuntimeError("GroundFit.save: nothing is fitted; call fit(X, y) first")
        open_ = [name for name, number in self.parameters_.items() if math.isnan(number)]
        if open_ or self.fill is None:
            raise ValueError(f"GroundFit.save: {', '.join(open_) or 'friction and what else no press determines'}: not known; give it by hold or fill")
        known = {name: number for name, number in self.parameters_.items() if self.states_[name] in ("held", "fitted")}
        notes = dict.fromkeys(known, "held")
        for name in known:
            if self.states_[name] == "fitted":
                low, high = self.intervals_[name]
                notes[name] = f"95 %: {low:.5g} .. {high:.5g} {self.units_[name].strip('-')}".strip()
        fill = self.fill if isinstance(self.fill, (str, os.PathLike)) else "fill"
        _ground.Material(self.fill, **{**{k: v for k, v in (self.hold or {}).items() if k == "bed_depth"}, **known}).save(
            path, head=f"mild.GroundFit, residual {self.residual_:.4g} N (root mean square)\nall without a remark: of {fill}", notes=notes)

    def score(self, X, y):
        """Coefficient of determination R^2 of predict(X) against y, in scikit-learn's convention: where all of y are the same, 1 if
        they are predicted exactly, else 0; NaN for a single row."""
        predicted = self.predict(X)
        if self._several():
            y, predicted = np.concatenate([_column("y", part) for part in y]), np.concatenate(predicted)
        y = _column("y", y)
        missed, spread = y - predicted, y - y.mean()
        if len(y) < 2:
            return math.nan
        if np.ptp(y) == 0:
            return float(not missed.any())
        return 1 - float(missed @ missed) / float(spread @ spread)

    def _several(self):
        """Whether each record has a plate of its own."""
        return isinstance(self.plate, (list, tuple)) and any(
            isinstance(part, (list, tuple, np.ndarray, _ground.Sole)) for part in self.plate)

    def _soles(self):
        """The plates in the elements of the model."""
        return [_sole(plate, self.model) for plate in (self.plate if self._several() else [self.plate])]

    def _drags(self, drags):
        """Soles and tables."""
        if not all(isinstance(drag, (list, tuple)) and len(drag) == 2 for drag in drags):
            raise TypeError("drags: it must be a list of (plate, table)")
        return [(_sole(plate, self.model), np.ascontiguousarray(_numbers("drags", table))) for plate, table in drags]

    def _records(self, name, X):
        """A table for each plate."""
        tables = [_table(part) for part in (X if self._several() else [X])]
        if self._several() and len(tables) != len(self.plate):
            raise ValueError(f"{name}: {len(tables)} records for {len(self.plate)} plates")
        return tables

    def __repr__(self):
        params = ", ".join(f"{name}={value!r}" for name, value in self.get_params().items())
        return f"GroundFit({params})"

    def __sklearn_tags__(self):
        from sklearn.utils import Tags, TargetTags, RegressorTags  # only scikit-learn asks for it

        return Tags(estimator_type="regressor", target_tags=TargetTags(required=True), regressor_tags=RegressorTags())


def _sole(plate, model):
    if isinstance(plate, _ground.Sole):
        sole = plate
    else:
        try:
            length, width = (float(side) for side in plate)
        except (TypeError, ValueError):
            raise TypeError("plate: it must be (length, width) in metres or a Sole, or a list of these") from None
        sole = _ground.Sole.plate(length, width)
    concentric = model in ("con_cone", "con_spring") and sole.elements > 1
    return sole.concentric() if concentric else sole


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


def _rows(tables, columns):
    """What the module takes: time, depth, force, speed, acceleration, number of the plate."""
    parts = []
    for plate, (X, y) in enumerate(zip(tables, columns)):
        motion = np.zeros((len(X), 3))
        motion[:, : X.shape[1]] = X
        parts.append(np.column_stack(
            [np.full(len(X), math.nan), motion[:, 0], y, motion[:, 1], motion[:, 2], np.full(len(X), plate)]))
    return np.concatenate(parts)
