"""What callers give, as the arrays that the engine reads."""

from __future__ import annotations

import operator
import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import RefusedError

_UNITS = {"": 1, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12}
_UNITS |= {"KIB": 2**10, "MIB": 2**20, "GIB": 2**30, "TIB": 2**40}


def whole_number(value: Any, what: str, bits: int) -> int:
    """The value as a whole number from 0 up of so many bits; ``what`` says in an error whose it is."""
    try:
        number = operator.index(value)
    except TypeError:
        raise ValueError(f"{what} is a whole number, not {value!r}") from None
    if not 0 <= number < 2**bits:
        raise ValueError(f"{what} is a whole number from 0 to 2**{bits} - 1, not {number}")
    return number


def limits(memory: int | str | None, threads: int | None) -> tuple[int | None, int | None]:
    """What the engine may spend: bytes and threads; ``None`` is its own choice."""
    return memory_bytes(memory), None if threads is None else whole_number(threads, "threads", 64)


def memory_bytes(memory: int | str | None) -> int | None:
    """``512 * 2**20`` and ``"512MiB"`` are the same."""
    if memory is None:
        return None
    if not isinstance(memory, str):
        return whole_number(memory, "memory in bytes", 64)
    found = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([a-zA-Z]*)\s*", memory)
    if found is None or found[2].upper() not in _UNITS:
        raise ValueError(f"memory is a number of bytes, or a text like '512MiB', not {memory!r}")
    return whole_number(int(float(found[1]) * _UNITS[found[2].upper()]), "memory in bytes", 64)


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
        return _as_rows(given, np.float32), None
    with np.errstate(over="ignore"):
        rounded = _as_rows(given, np.float32)
    # Whole numbers of 64 bits have more digits than float64.
    wide = given if given.dtype.kind == "f" else given.astype(np.longdouble)
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
        return _as_rows(given, np.uint32)
    # In 32 bits, a number that is too large would become another one.
    if given.size and (given.min() < 0 or given.max() >= vertices):
        face = int(np.argmax(((given < 0) | (given >= vertices)).any(axis=1)))
        raise ValueError(f"face {face} refers to vertices {given[face].tolist()}, and there are {vertices} vertices")
    return _as_rows(given, np.uint32)


def _as_rows(given: NDArray[Any], dtype: Any) -> NDArray[Any]:
    """Of this type, row by row, at addresses that the processor likes; not copied if it is already."""
    return np.require(given, dtype, ["C", "A"])
