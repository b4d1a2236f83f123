"""What a repair returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._suture import ORIGINS

if TYPE_CHECKING:
    import pyvista
    import trimesh


@dataclass(frozen=True, eq=False)
class Repaired:
    """A mesh, where each of its faces comes from, and the report."""

    vertices: NDArray[np.float32]
    """Positions, n rows of x, y and z."""

    faces: NDArray[np.uint32]
    """The vertices of each face, m rows of three."""

    origin: NDArray[np.uint8]
    """By face, the kind of its origin: its place in ``suture.ORIGINS``."""

    origin_face: NDArray[np.int64]
    """By face, the face of the input that it is, or is a part of; -1 for a new one."""

    report: dict[str, Any]
    """What was found and done, and the verdict on this mesh (``core/REPORT.md`` describes it). If the vertices had to be rounded to single
    precision, ``rounding`` says how many moved, and how far."""

    @property
    def good(self) -> bool:
        """The mesh passes every check of the profile: closed, manifold, oriented, free of self-intersection."""
        return self.report["verdict"]["good"]

    @property
    def outcome(self) -> str:
        """``clean``, ``repaired``, ``needs_review`` (good, but changed so much that a person must look) or ``not_good``."""
        return self.report["outcome"]

    @property
    def origin_names(self) -> NDArray[np.str_]:
        """By face, the kind of its origin in words: ``input``, ``flipped``, ``moved``, ``part``, or the repair that made it."""
        return np.array(ORIGINS)[self.origin]

    def to_trimesh(self) -> trimesh.Trimesh:
        """The mesh as trimesh has it, with ``origin`` and ``origin_face`` as attributes of faces."""
        import trimesh

        attributes = {"origin": self.origin, "origin_face": self.origin_face}
        return trimesh.Trimesh(self.vertices, self.faces, face_attributes=attributes, process=False)

    def to_pyvista(self) -> pyvista.PolyData:
        """The mesh as pyvista has it, with ``origin`` and ``origin_face`` as data of cells."""
        import pyvista

        mesh = pyvista.PolyData.from_regular_faces(self.vertices, self.faces.astype(np.int64))
        mesh.cell_data["origin"] = self.origin
        mesh.cell_data["origin_face"] = self.origin_face
        return mesh


def from_trimesh(mesh: trimesh.Trimesh) -> tuple[NDArray[Any], NDArray[Any]]:
    """Vertices and faces of a trimesh."""
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def from_pyvista(mesh: pyvista.PolyData) -> tuple[NDArray[Any], NDArray[Any]]:
    """Vertices and faces of a pyvista surface; faces of more than three corners are divided."""
    if not mesh.is_all_triangles:
        mesh = mesh.triangulate()
    return np.asarray(mesh.points), np.asarray(mesh.regular_faces)
