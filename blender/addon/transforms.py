"""Matrices of Blender as steps of transforms."""

import math


def rows(matrix):
    """A 4x4 matrix as a list of its rows, with the last row that Steradian expects."""
    return [list(row) for row in matrix][:3] + [[0.0, 0.0, 0.0, 1.0]]


def step(matrix):
    """A transform that applies a matrix."""
    return {"matrix": rows(matrix)}


def rigid(matrix):
    """A transform that turns and moves as a matrix does, without its scale."""
    axis, angle = matrix.to_quaternion().to_axis_angle()
    return [{"rotate": {"axis": list(axis), "degrees": math.degrees(angle)}}, {"translate": list(matrix.translation)}]
