"""The package as its users have it: installed, with numpy. Run by ``python -m unittest discover python/tests``."""

import os
import signal
import struct
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import suture

QUADS = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def box(low=(0, 0, 0), high=(1, 1, 1)):
    """Eight vertices and twelve faces, seen from outside counter-clockwise; the last two are those of high x."""
    bits = np.array([[n & 1, n >> 1 & 1, n >> 2] for n in range(8)], dtype=np.float32)
    vertices = np.asarray(low, np.float32) + bits * (np.asarray(high, np.float32) - np.asarray(low, np.float32))
    faces = [face for a, b, c, d in QUADS for face in ([a, b, c], [a, c, d])]
    return vertices, np.array(faces, dtype=np.uint32)


def together(*meshes):
    """Several meshes as one."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [faces + start for (_, faces), start in zip(meshes, starts)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces).astype(np.uint32)


def sheet(side):
    """A wavy square of 2 side² faces with a hole in the middle."""
    x, y = np.meshgrid(np.arange(side + 1), np.arange(side + 1), indexing="ij")
    vertices = np.stack([x, y, np.sin(x * 0.3) + np.cos(y * 0.2)], axis=-1).reshape(-1, 3).astype(np.float32)
    a = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    b, c, d = a + side + 1, a + side + 2, a + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.uint32)
    hole = (a == side // 2 * (side + 1) + side // 2).nonzero()[0]
    return vertices, np.delete(faces, hole, axis=0)


def tangle(count):
    """Triangles that cross each other everywhere: work for a while."""
    numbers = np.random.default_rng(7)
    vertices = (numbers.random((count, 1, 3)) * 20 + numbers.random((count, 3, 3)) * 3).reshape(-1, 3)
    return vertices.astype(np.float32), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)


def write_stl(path, vertices, faces):
    """A binary STL."""
    records = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["corners"] = vertices[faces]
    path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + records.tobytes())


def read_stl(path):
    """The corners of a binary STL's triangles."""
    records = np.frombuffer(path.read_bytes()[84:], dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    return records["corners"]


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]].astype(np.float64) for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


class Repair(unittest.TestCase):
    def test_a_hole_is_closed_and_every_face_has_an_origin(self):
        vertices, faces = box()
        faces[3] = faces[3][[0, 2, 1]]
        repaired = suture.repair(vertices, faces[:-1])
        self.assertTrue(repaired.good)
        self.assertEqual(repaired.outcome, "repaired")
        self.assertAlmostEqual(volume(repaired.vertices, repaired.faces), 1.0)
        names = ["input"] * 3 + ["flipped"] + ["input"] * 7 + ["fill"]
        self.assertEqual(repaired.origin_names.tolist(), names)
        self.assertEqual(repaired.origin_face.tolist(), [*range(11), -1])
        self.assertEqual((repaired.vertices.dtype, repaired.faces.dtype), (np.float32, np.uint32))

    def test_a_good_mesh_comes_back_as_it_was(self):
        vertices, faces = box()
        repaired = suture.repair(vertices, faces)
        self.assertEqual(repaired.outcome, "clean")
        np.testing.assert_array_equal(repaired.vertices, vertices)
        np.testing.assert_array_equal(repaired.faces, faces)

    def test_the_mesh_of_a_file_becomes_what_the_file_becomes(self):
        for vertices, faces in [together(box(), box((0.5, 0.5, 0.5), (2, 2, 2))), sheet(30)]:
            with tempfile.TemporaryDirectory() as folder:
                path, output = Path(folder, "in.stl"), Path(folder, "out.stl")
                write_stl(path, vertices, faces)
                of_file = suture.repair_file(path, output)
                written = read_stl(output)
            repaired = suture.repair(vertices, faces)
            np.testing.assert_array_equal(repaired.vertices[repaired.faces], written)
            for same in ["outcome", "before", "after", "verdict", "edit", "tolerances"]:
                self.assertEqual(repaired.report[same], of_file[same])
            self.assertEqual(repaired.report["input"]["format"], "memory")

    def test_the_result_does_not_depend_on_threads_or_memory(self):
        mesh = together(box(), box((0.5, 0.5, 0.5), (2, 2, 2)))
        one, two = suture.repair(*mesh, threads=1), suture.repair(*mesh, threads=2, memory="300MiB")
        np.testing.assert_array_equal(one.vertices, two.vertices)
        np.testing.assert_array_equal(one.faces, two.faces)
        self.assertEqual(two.report["limits"]["memory_bytes"], 300 * 2**20)

    def test_settings_decide(self):
        vertices, faces = box()
        left = suture.repair(vertices, faces[:-1], profile={"fill_holes": False, "guarantee": "off"})
        self.assertEqual((left.good, len(left.faces)), (False, 11))
        self.assertFalse(suture.repair(vertices, faces[:-1], profile="cautious").good)
        self.assertEqual(suture.built_in_profile("cautious")["guarantee"], "strict")
        for name in suture.PROFILES:
            self.assertEqual(suture.built_in_profile(name)["name"], name)
        untouched = suture.repair(vertices, faces[:-1], profile="inspect-only")
        self.assertEqual((untouched.good, len(untouched.faces)), (False, 11))


class Arrays(unittest.TestCase):
    def test_arrays_that_fit_are_not_copied(self):
        from suture._arrays import as_faces, as_vertices

        vertices, faces = box()
        self.assertTrue(np.shares_memory(as_vertices(vertices)[0], vertices))
        self.assertTrue(np.shares_memory(as_faces(faces, 8), faces))

    def test_any_layout_and_any_numbers_will_do(self):
        vertices, faces = box()
        want = suture.inspect(vertices, faces)["before"]
        layouts = [
            (vertices.tolist(), faces.tolist()),
            (np.asfortranarray(vertices), np.asfortranarray(faces)),
            (np.repeat(vertices, 2, axis=0)[::2], faces.astype(np.int64)),
            (vertices.astype(">f4"), faces.astype(">i2")),
            (vertices.astype(np.int8), faces.astype(np.uint8)),
            (vertices.astype(np.float16), faces),
        ]
        for given in layouts:
            self.assertEqual(suture.inspect(*given)["before"], want)
        vertices.setflags(write=False)
        self.assertEqual(suture.inspect(vertices, faces)["before"], want)

    def test_the_report_says_how_far_doubles_were_rounded(self):
        vertices, faces = box()
        exact = suture.repair(vertices.astype(np.float64), faces).report["rounding"]
        self.assertEqual(exact, {"dtype": "float64", "moved": 0, "max_move": 0.0})
        doubles = vertices.astype(np.float64)
        # At (1, 1, 1) single precision has no place for a billionth more.
        doubles[7] += 1e-9
        rounding = suture.repair(doubles, faces).report["rounding"]
        self.assertEqual(rounding["moved"], 1)
        self.assertAlmostEqual(rounding["max_move"], 3**0.5 * 1e-9, delta=1e-15)
        self.assertNotIn("rounding", suture.repair(vertices, faces).report)
        with self.assertRaisesRegex(suture.RefusedError, "single precision"):
            suture.repair(doubles * 1e39, faces)

    def test_what_is_no_mesh_is_refused_with_a_reason(self):
        vertices, faces = box()
        wrong = [
            (vertices[:, :2], faces, "of shape"),
            (vertices, faces[:, :2], "of shape"),
            (vertices, faces.astype(float), "whole numbers"),
            (vertices.astype(complex), faces, "numbers, not"),
            (vertices, faces.astype(np.int64) - 1, "face 0 refers to vertices"),
            (vertices, faces + 1, "refers to vertex 8"),
            (vertices, faces.astype(np.int64) + 2**32, "there are 8 vertices"),
        ]
        for *mesh, words in wrong:
            with self.assertRaisesRegex(ValueError, words):
                suture.inspect(*mesh)
        with self.assertRaisesRegex(suture.UnreadableError, "no faces"):
            suture.repair([], [])

    def test_numbers_that_are_none_are_a_defect(self):
        vertices, faces = box()
        odd = together((vertices, faces), (np.full((3, 3), np.nan, np.float32), np.array([[0, 1, 2]])))
        self.assertEqual(suture.inspect(*odd)["before"]["nonfinite"], 1)
        self.assertEqual(len(suture.repair(*odd).faces), 12)


class Operations(unittest.TestCase):
    def test_loops_are_found_and_one_is_closed(self):
        vertices, faces = box()
        tube = vertices, faces[4:]
        found = suture.find_loops(*tube)
        self.assertEqual([sorted(loop.vertices.tolist()) for loop in found], [[0, 1, 2, 3], [4, 5, 6, 7]])
        self.assertEqual({loop.facts["class"] for loop in found}, {"simple"})
        filled = suture.fill_loops(*tube, only=5, shape="flat")
        self.assertEqual(filled.origin_names.tolist(), ["input"] * 8 + ["fill"] * 2)
        self.assertTrue((filled.vertices[filled.faces[8:]][..., 2] == 1).all())
        self.assertEqual(len(suture.fill_loops(*tube).faces), 12)
        self.assertEqual(suture.find_defects(*tube)["boundary_loops"], 2)
        with self.assertRaisesRegex(ValueError, "no vertex 8"):
            suture.fill_loops(*tube, only=8)
        with self.assertRaisesRegex(ValueError, "flat"):
            suture.fill_loops(*tube, shape="round")

    def test_bodies_that_cross_become_one(self):
        crossing = together(box(), box((0.5, 0.5, 0.5), (2, 2, 2)))
        found = suture.find_self_intersections(*crossing)
        self.assertEqual(len(found.pairs), found.counts["crossing_pairs"])
        self.assertTrue((found.pairs[:, 0] < 12).all() and (found.pairs[:, 1] >= 12).all() and not found.overlap.any())
        united = suture.union(*crossing)
        self.assertEqual(len(suture.find_self_intersections(united.vertices, united.faces).pairs), 0)
        self.assertAlmostEqual(volume(united.vertices, united.faces), 1 + 1.5**3 - 0.5**3, places=5)
        self.assertTrue((united.origin_face >= 0).all())

    def test_faces_are_turned(self):
        vertices, faces = box()
        oriented = suture.orient(vertices, faces[:, ::-1])
        self.assertEqual(set(oriented.origin_names), {"flipped"})
        self.assertAlmostEqual(volume(oriented.vertices, oriented.faces), 1.0)

    def test_what_is_open_is_wrapped(self):
        vertices, faces = box()
        wrapped = suture.wrap(vertices, faces[:-2])
        self.assertTrue(wrapped.good)
        self.assertEqual(set(wrapped.origin_names), {"wrap"})
        self.assertEqual(len(suture.wrap(vertices, faces[:-2], max_share=0.0).faces), 10)

    def test_a_certificate_has_every_rule(self):
        vertices, faces = box()
        self.assertTrue(suture.certificate(vertices, faces)["printable"])
        self.assertFalse(suture.certificate(vertices, faces[:-1])["printable"])


class Files(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.input, self.output = Path(self.folder.name, "in.stl"), Path(self.folder.name, "out.stl")
        vertices, faces = box()
        write_stl(self.input, vertices, faces[:-1])

    def test_a_file_is_repaired_into_another_and_nothing_is_overwritten(self):
        before = self.input.read_bytes()
        self.assertEqual(suture.inspect_file(self.input)["outcome"], "not_good")
        report = suture.repair_file(self.input, str(self.output), memory="256MiB")
        self.assertEqual((report["outcome"], report["output"]["path"]), ("repaired", str(self.output)))
        self.assertEqual(len(read_stl(self.output)), 12)
        for taken in [self.output, self.input]:
            with self.assertRaises(FileExistsError):
                suture.repair_file(self.input, taken)
        with self.assertRaisesRegex(FileExistsError, "never overwritten"):
            suture.repair_file(self.input, self.input, replace=True)
        suture.repair_file(self.output, Path(self.folder.name, "again.stl"))
        other = Path(self.folder.name, "other.ply")
        self.assertEqual(suture.repair_file(self.input, other)["output"]["format"], "ply")
        self.assertTrue(other.read_bytes().startswith(b"ply\n"))
        package = Path(self.folder.name, "other.3mf")
        self.assertEqual(suture.repair_file(self.input, package)["output"]["format"], "3mf")
        self.assertEqual(suture.inspect_file(package)["outcome"], "clean")
        report = suture.repair_file(self.input, Path(self.folder.name, "none.stl"), profile="inspect-only")
        self.assertEqual((report["outcome"], report["output"]), ("not_good", None))
        suture.repair_file(self.input, self.output, replace=True, profile="cautious")
        self.assertEqual(len(read_stl(self.output)), 11)
        self.assertEqual(self.input.read_bytes(), before)
        self.assertEqual(sorted(os.listdir(self.folder.name)), ["again.stl", "in.stl", "other.3mf", "other.ply", "out.stl"])

    def test_errors_have_classes_that_python_knows(self):
        picture = Path(self.folder.name, "picture.stl")
        picture.write_bytes(b"\x89PNG\r\n\x1a\n" + b"7" * 200)
        with self.assertRaisesRegex(suture.UnreadableError, "PNG") as caught:
            suture.repair_file(picture, self.output)
        self.assertIsInstance(caught.exception, ValueError)
        with self.assertRaises(OSError):
            suture.inspect_file(Path(self.folder.name, "none.stl"))
        with self.assertRaises(MemoryError) as starved:
            suture.repair(*sheet(200), memory=100)
        self.assertIsInstance(starved.exception, suture.StarvedError)
        for profile, words in [("scanned", "no profile is called"), ({"weld": 1}, "unknown field"), ({"weld_relative": -1.0}, "weld_relative")]:
            with self.assertRaisesRegex(ValueError, words):
                suture.repair(*box(), profile=profile)
        with self.assertRaisesRegex(ValueError, "512MiB"):
            suture.repair(*box(), memory="much")
        self.assertEqual(sorted(os.listdir(self.folder.name)), ["in.stl", "picture.stl"])


class Watched(unittest.TestCase):
    def test_ctrl_c_ends_the_work(self):
        mesh = tangle(120_000)
        for work in [suture.find_self_intersections, suture.repair]:
            begun = time.monotonic()
            threading.Timer(0.3, os.kill, [os.getpid(), signal.SIGINT]).start()
            with self.assertRaises(KeyboardInterrupt):
                work(*mesh)
            self.assertLess(time.monotonic() - begun, 3)

    def test_other_threads_run_meanwhile(self):
        counted, stop = [0], threading.Event()

        def count():
            while not stop.wait(0.001):
                counted[0] += 1

        thread = threading.Thread(target=count)
        thread.start()
        before = counted[0]
        suture.find_self_intersections(*tangle(20_000))
        after = counted[0]
        stop.set()
        thread.join()
        self.assertGreater(after - before, 3)

    def test_progress_is_told_and_can_end_the_work(self):
        told = []
        suture.repair(*tangle(3_000), profile={"guarantee": "off"}, progress=lambda *stands: told.append(stands))
        self.assertTrue(told and all(isinstance(stage, str) and 0 <= done <= total for stage, done, total in told), told)

        def fail(*_):
            raise LookupError("enough")

        with self.assertRaisesRegex(LookupError, "enough"):
            suture.repair(*tangle(30_000), progress=fail)


class Arguments(unittest.TestCase):
    """Found by a stranger who gave what nobody had thought of."""

    def test_arrays_at_odd_addresses_are_converted(self):
        vertices, faces = (np.asarray(part) for part in tangle(300))
        vertices, faces = vertices.astype(np.float32), faces.astype(np.uint32)
        odd = [np.frombuffer(b"." + part.tobytes(), np.uint8)[1:].view(part.dtype).reshape(-1, 3) for part in (vertices, faces)]
        self.assertFalse(odd[0].flags.aligned or odd[1].flags.aligned)
        self.assertTrue((suture.repair(*odd).faces == suture.repair(vertices, faces).faces).all())

    def test_what_no_precision_holds_is_refused(self):
        vertices, faces = tangle(300)
        wide = np.asarray(vertices, np.longdouble)
        wide[0, 0] = np.longdouble("1e4000")
        with self.assertRaises(suture.RefusedError):
            suture.repair(wide, faces)
        large = np.array([[2**53 + 1, 0, 0], [0, 2**53, 0], [0, 0, 2**53]], np.int64)
        self.assertEqual(suture.inspect(large, [[0, 1, 2]])["rounding"]["moved"], 1)

    def test_what_means_nothing_is_a_value_error(self):
        mesh = tangle(300)
        for bad in [{"memory": -1}, {"memory": 2**64}, {"memory": "99999999999TB"}, {"memory": 1e9}, {"threads": -1}, {"threads": 2**64}]:
            with self.assertRaises(ValueError, msg=str(bad)):
                suture.inspect(*mesh, **bad)
        for bad in [{"max_edges": -1}, {"max_edges": 2**32}, {"only": -1}, {"only": 0.5}]:
            with self.assertRaises(ValueError, msg=str(bad)):
                suture.fill_loops(*mesh, **bad)
        suture.inspect(*mesh, memory=np.int64(2**30), threads=np.int64(2), profile={"max_gap_mm": np.float32(1)})

    def test_results_are_told_apart_by_identity(self):
        fixed = suture.repair(*tangle(300))
        self.assertTrue(fixed == fixed and fixed in [fixed] and fixed != suture.repair(*tangle(300)))

    def test_more_threads_than_help_are_not_started(self):
        begun = time.monotonic()
        suture.repair(*tangle(2_000), threads=2**63)
        self.assertLess(time.monotonic() - begun, 30)

    def test_the_certificate_is_of_the_mesh_that_is_returned(self):
        fixed = suture.repair([[0, 0, -0.0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2]])
        self.assertEqual(fixed.report["certificate"]["blake3"], suture.certificate(fixed.vertices, fixed.faces)["blake3"])


class Others(unittest.TestCase):
    def test_trimesh_and_back(self):
        try:
            import trimesh
        except ImportError:
            self.skipTest("trimesh is not installed")
        mesh = trimesh.creation.box()
        mesh.update_faces(np.arange(len(mesh.faces)) > 0)
        fixed = suture.repair(*suture.from_trimesh(mesh)).to_trimesh()
        self.assertTrue(fixed.is_watertight and not mesh.is_watertight)
        self.assertEqual(fixed.face_attributes["origin_face"].tolist(), [*range(11), -1])

    def test_pyvista_and_back(self):
        try:
            import pyvista
        except ImportError:
            self.skipTest("pyvista is not installed")
        mesh = pyvista.Box().extract_surface(algorithm=None).extract_cells(range(5)).extract_surface(algorithm=None)
        fixed = suture.repair(*suture.from_pyvista(mesh)).to_pyvista()
        self.assertTrue(fixed.is_manifold and fixed.n_cells == 12)
        self.assertEqual(sorted(fixed.cell_data["origin_face"])[:2], [-1, -1])


if __name__ == "__main__":
    unittest.main()
