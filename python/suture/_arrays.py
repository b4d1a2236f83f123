"""What callers give, as the arrays that the engine reads."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import RefusedError

_UNITS = {"": 1, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12}
_UNITS |= {"KIB": 2**10, "MIB": 2**20, "GIB": 2**30, "TIB": 2**40}


def memory_bytes(memory: int | str | None) -> int | None:
    """``512 * 2**20`` and ``"512MiB"`` are the same."""
    if memory is None or isinstance(memory, int):
        return memory
    found = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([a-zA-Z]*)\s*", memory)
    if found is None or found[2].upper() not in _UNITS:
        raise ValueError(f"memory is a number of bytes, or a text like '512MiB', not {memory!r}")
    return int(float(found[1]) * _UNITS[found[2].upper()])


def as_vertices(vertices: ArrayLike) -> tuple[NDArray[np.float32], dict[str, Any] | None]:
    """The vertices in single precision, and how far rounding moved them: ``None`` if they were in single precision.

    An array of float32 in rows of three, one after the other, is not copied.
    """
    given = np.asarray(vertices)
    if given.size == 0 and given.ndim < 2:
        given = given.reshape(0, 3)
    if given.ndim != 2 or given.shape[1] != 3:
        raise ValueError(f"vertices are an array of n rows of x, y and z, not of shape {given.shape}")
    if given.dtype.kind not in "fiu":
        raise ValueError(f"vertices are numbers, not {given.dtype}")
    if given.dtype == np.float32:
        return np.ascontiguousarray(given), None
    with np.errstate(over="ignore"):
        rounded = np.ascontiguousarray(given, dtype=np.float32)
    wide = given.astype(np.float64, copy=False)
    finite = np.isfinite(wide)
    if (finite & ~np.isfinite(rounded)).any():
        raise RefusedError("a coordinate is larger than single precision can hold (3.4e38): scale the mesh down")
    with np.errstate(invalid="ignore"):
        moved = np.where(finite, np.abs(wide - rounded), 0.0)
    return rounded, {
        "dtype": str(given.dtype),
        "moved": int((moved > 0).any(axis=1).sum()),
        "max_move": float(np.sqrt((moved**2).sum(axis=1)).max(initial=0.0)),
    }


def as_faces(faces: ArrayLike, vertices: int) -> NDArray[np.uint32]:
    """The faces as numbers of 32 bits. An array of uint32 in rows of three, one after the other, is not copied."""
    given = np.asarray(faces)
    if given.size == 0 and given.ndim < 2:
        given = given.reshape(0, 3).astype(np.uint32)
    if given.ndim != 2 or given.shape[1] != 3:
        raise ValueError(f"faces are an array of m rows of three vertices, not of shape {given.shape}")
    if given.dtype.kind not in "iu":
        raise ValueError(f"faces are whole numbers, not {given.dtype}")
    if given.dtype == np.uint32:
        return np.ascontiguousarray(given)
    # In 32 bits, a number that is too large would become another one.
    if given.size and (given.min() < 0 or given.max() >= vertices):
        face = int(np.argmax(((given < 0) | (given >= vertices)).any(axis=1)))
        raise ValueError(f"face {face} refers to vertices {given[face].tolist()}, and there are {vertices} vertices")
    return np.ascontiguousarray(given, dtype=np.uint32)
