"""Repairs triangle meshes for 3D printing.

``repair(vertices, faces)`` repairs a mesh in memory, ``repair_file(input, output)`` a file of any size. The other functions do one thing each.
"""

from ._errors import (
    ChangedError,
    EnvironmentFailedError,
    RefusedError,
    ShortageError,
    StarvedError,
    SutureError,
    UnreadableError,
)
from ._files import inspect_file, repair_file
from ._meshes import (
    Intersections,
    Loop,
    certificate,
    fill_loops,
    find_defects,
    find_loops,
    find_self_intersections,
    inspect,
    orient,
    repair,
    union,
    wrap,
)
from ._profile import PROFILES, built_in_profile
from ._result import Repaired, from_pyvista, from_trimesh
from ._suture import ORIGINS, __version__

__all__ = [
    "ORIGINS",
    "PROFILES",
    "ChangedError",
    "EnvironmentFailedError",
    "Intersections",
    "Loop",
    "RefusedError",
    "Repaired",
    "ShortageError",
    "StarvedError",
    "SutureError",
    "UnreadableError",
    "__version__",
    "built_in_profile",
    "certificate",
    "fill_loops",
    "find_defects",
    "find_loops",
    "find_self_intersections",
    "from_pyvista",
    "from_trimesh",
    "inspect",
    "inspect_file",
    "orient",
    "repair",
    "repair_file",
    "union",
    "wrap",
]
