"""What someone who knows pymeshlab well writes to have any broken print file repaired unattended.

Close vertices are merged with a tolerance relative to the model; folded faces and T-vertices are removed; then rounds of
non-manifold repair and hole closing (any hole size, no self-intersecting patches) until the surface is closed and two-manifold,
at most three; borders that do not quite meet are snapped in the first. At last the faces are oriented coherently and, where the
enclosed volume is negative, all turned round. With --resolve there are up to three more rounds before that, in which self-intersecting
faces are selected and deleted, and what that opens is repaired and closed as before; a file that is closed, two-manifold and free of
self-intersection as it comes is only oriented. A filter that refuses the mesh is named on standard error and skipped. With
--self-intersections the result's self-intersecting faces are selected before it is saved, which is how pymeshlab finds them.
"""

import sys

import pymeshlab
from shared import run

MERGE_WITHIN_DIAGONAL = 1e-5
SNAP_WITHIN_EDGE = 0.05
LARGEST_HOLE_EDGES = 10_000
ROUNDS = 3


class Repair:
    def __init__(self, meshes, stages):
        self.meshes, self.stages = meshes, stages

    def apply(self, name, **settings):
        try:
            self.meshes.apply_filter(name, **settings)
        except pymeshlab.PyMeshLabException as refusal:
            print(f"{name} skipped: {refusal}", file=sys.stderr)

    def weld(self):
        diagonal = self.meshes.current_mesh().bounding_box().diagonal()
        self.apply("meshing_remove_duplicate_vertices")
        self.apply("meshing_remove_duplicate_faces")
        self.apply("meshing_merge_close_vertices", threshold=pymeshlab.PureValue(MERGE_WITHIN_DIAGONAL * diagonal))
        self.apply("meshing_remove_duplicate_faces")

    def drop_bad_faces(self):
        self.apply("meshing_remove_null_faces")
        self.apply("meshing_remove_folded_faces")
        self.apply("meshing_remove_t_vertices", method="Edge Collapse", threshold=40)

    def make_manifold(self):
        self.apply("meshing_repair_non_manifold_edges", method="Remove Faces")
        self.apply("meshing_repair_non_manifold_vertices", vertdispratio=0.01)

    def close(self):
        self.apply("meshing_remove_duplicate_faces")
        self.apply("meshing_remove_null_faces")
        self.apply(
            "meshing_close_holes", maxholesize=LARGEST_HOLE_EDGES, newfaceselected=False, selfintersection=True
        )

    def is_done(self):
        measures = self.meshes.get_topological_measures()
        return measures["boundary_edges"] == 0 and measures["is_mesh_two_manifold"]

    def is_sound(self):
        self.apply("meshing_remove_duplicate_vertices")
        return self.is_done() and self.self_intersecting() == 0

    def orient(self):
        self.apply("meshing_re_orient_faces_coherently")
        if self.meshes.current_mesh().face_number() and self.meshes.get_geometric_measures().get("mesh_volume", 1) < 0:
            self.apply("meshing_invert_face_orientation", forceflip=True)

    def resolve(self):
        """Replaces the faces that cross others; is there still something to be done?"""
        if self.self_intersecting() == 0:
            return False
        self.apply("meshing_remove_selected_faces")
        self.apply("meshing_remove_unreferenced_vertices")
        for _ in range(ROUNDS):
            self.make_manifold()
            self.close()
            if self.is_done():
                break
        return True

    def self_intersecting(self):
        self.apply("compute_selection_by_self_intersections_per_face")
        return self.meshes.current_mesh().selected_face_number()


    def complete(self, resolve=False):
        if not (resolve and self.is_sound()):
            self.make_solid(resolve)
        self.orient()
        self.stages.end("orient")

    def make_solid(self, resolve):
        self.weld()
        self.stages.end("weld")
        self.drop_bad_faces()
        self.stages.end("bad faces")
        for attempt in range(ROUNDS):
            self.make_manifold()
            if attempt == 0:
                self.apply("meshing_snap_mismatched_borders", edgedistratio=SNAP_WITHIN_EDGE)
            self.close()
            if self.is_done():
                break
        self.stages.end("rounds of closing")
        if resolve:
            for _ in range(ROUNDS):
                if not self.resolve():
                    break
            self.stages.end("rounds of resolving")


def repair(source, target, stages, self_intersections, resolve):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(source)
    stages.end("load")
    work = Repair(meshes, stages)
    work.complete(resolve)
    if self_intersections:
        stages.facts["self-intersecting"] = work.self_intersecting()
        stages.end("self-intersections")
    work.meshes.save_current_mesh(target, binary=True)
    stages.end("save")


if __name__ == "__main__":
    run(repair, "self-intersections", "resolve")
