//! What is compared, and what is to be known about each: how it is called, its licence, how far it goes.

use serde::{Deserialize, Serialize};

/// A program with its settings, in the order in which they take their turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Side {
    /// `cp`.
    Cp,
    /// `cp`, and the copy synced.
    CpSynced,
    /// `suture repair`.
    Suture,
    /// `suture repair --no-self-intersections`.
    SutureNoSi,
    /// `suture inspect`.
    Inspect,
    /// `suture inspect --no-self-intersections`: topology alone.
    InspectNoSi,
    PymeshlabPlain,
    PymeshlabPlainSi,
    PymeshlabCompetent,
    PymeshlabCompetentSi,
    Meshlib,
    /// Self-collision of a loaded mesh.
    MeshlibDetect,
    Pymeshfix,
    Admesh,
    Trimesh,
    Manifold3d,
    /// `suture repair --guarantee off`.
    SutureOff,
    /// As competent, and self-intersecting faces are replaced.
    PymeshlabSolid,
    /// MeshLib's own repairs, self-intersections included.
    MeshlibSolid,
    /// All parts united.
    Manifold3dUnion,
    /// `suture.repair` of the Python package, from arrays and back.
    SutureArrays,
    PymeshlabArrays,
    MeshlibArrays,
    PymeshfixArrays,
    TrimeshArrays,
    /// `suture convert`.
    Convert,
    /// Libraries that read and write files of formats.
    TrimeshFormats,
    Lib3mf,
    PymeshlabFormats,
    MeshlibFormats,
    /// The Rust crate, called by a process of this program.
    Tobj,
}

/// Whose program it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Program {
    Copy,
    /// With these arguments after the task.
    Suture,
    /// Suture's task `convert`.
    Convert,
    /// This program, with this task.
    Itself {
        task: &'static str,
    },
    /// A script of `pipelines/` that needs a Python package.
    Python {
        script: &'static str,
        package: &'static str,
    },
    Admesh,
}

/// Facts about a side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facts {
    pub(crate) name: &'static str,
    pub(crate) program: Program,
    /// Given to the program.
    pub(crate) flag: Option<&'static str>,
    /// The largest mesh it is measured on unless told otherwise: beyond, it takes many minutes or more memory than is there.
    pub(crate) most_triangles: u64,
    /// It writes an output.
    pub(crate) writes: bool,
    /// Its output is judged.
    pub(crate) judged: bool,
    /// Its nature, for the published page.
    pub(crate) about: &'static str,
}

const COPY: Facts = Facts {
    name: "cp",
    program: Program::Copy,
    flag: None,
    most_triangles: u64::MAX,
    writes: true,
    judged: false,
    about: "`cp`, left in the page cache",
};

const SUTURE: Facts = Facts {
    name: "suture",
    program: Program::Suture,
    judged: true,
    about: "`suture repair`, with its search for self-intersections before and after",
    ..COPY
};

const PLAIN: Facts = Facts {
    name: "pymeshlab-plain",
    program: Program::Python { script: "plain.py", package: "pymeshlab" },
    most_triangles: 12_000_000,
    about: "pymeshlab, the usual filters with their defaults",
    ..SUTURE
};

const COMPETENT: Facts = Facts {
    name: "pymeshlab-competent",
    program: Program::Python { script: "competent.py", package: "pymeshlab" },
    about: "pymeshlab as someone who knows it well would use it",
    ..PLAIN
};

const CP_SYNCED: Facts = Facts { name: "cp-synced", about: "`cp IN OUT && sync OUT`", ..COPY };

const SUTURE_NO_SI: Facts = Facts {
    name: "suture-no-si",
    flag: Some(NO_SI),
    about: "`suture repair --no-self-intersections`: topology alone is looked at",
    ..SUTURE
};

const INSPECT: Facts =
    Facts { name: "inspect", writes: false, judged: false, about: "`suture inspect`, which writes nothing", ..SUTURE };

const INSPECT_NO_SI: Facts =
    Facts { name: "inspect-no-si", flag: Some(NO_SI), about: "`suture inspect --no-self-intersections`", ..INSPECT };

const PYMESHLAB_PLAIN_SI: Facts = Facts {
    name: "pymeshlab-plain-si",
    flag: PYMESHLAB_SI,
    about: "the same, and its selection of self-intersecting faces once, on the result",
    ..PLAIN
};

const PYMESHLAB_COMPETENT_SI: Facts = Facts {
    name: "pymeshlab-competent-si",
    flag: PYMESHLAB_SI,
    about: "the same, and its selection of self-intersecting faces once, on the result",
    ..COMPETENT
};

const MESHLIB: Facts = Facts {
    name: "meshlib",
    program: Program::Python { script: "meshlib_repair.py", package: "meshlib" },
    about: "MeshLib: load, find self-collisions, fill holes, save",
    ..PLAIN
};

const MESHLIB_DETECT: Facts = Facts {
    name: "meshlib-detect",
    program: Program::Python { script: "meshlib_detect.py", package: "meshlib" },
    writes: false,
    judged: false,
    about: "MeshLib: load and `findSelfCollidingTriangles`, which is also timed by itself",
    ..PLAIN
};

const PYMESHFIX: Facts = Facts {
    name: "pymeshfix",
    program: Program::Python { script: "meshfix.py", package: "pymeshfix" },
    most_triangles: 1_100_000,
    about: "MeshFix: fill all boundaries, clean; keeps the largest body and removes what crosses itself",
    ..PLAIN
};

const ADMESH: Facts = Facts {
    name: "admesh",
    program: Program::Admesh,
    most_triangles: 1_100_000,
    about: "the command line, all its checks",
    ..PLAIN
};

const TRIMESH: Facts = Facts {
    name: "trimesh",
    program: Program::Python { script: "trimesh_repair.py", package: "trimesh" },
    most_triangles: 110_000,
    about: "`trimesh.repair`",
    ..PLAIN
};

const MANIFOLD3D: Facts = Facts {
    name: "manifold3d",
    program: Program::Python { script: "manifold_repair.py", package: "manifold3d" },
    about: "merge vertices, make a manifold; refuses what is not nearly one",
    ..PLAIN
};

const SUTURE_OFF: Facts = Facts {
    name: "suture-off",
    flag: Some("--guarantee=off"),
    about: "`suture repair --guarantee off`: nothing is wrapped",
    ..SUTURE
};

const PYMESHLAB_SOLID: Facts = Facts {
    name: "pymeshlab-solid",
    flag: Some("--resolve"),
    about: "pymeshlab-competent, and then up to three rounds of deleting self-intersecting faces and closing what that opens",
    ..COMPETENT
};

const MESHLIB_SOLID: Facts = Facts {
    name: "meshlib-solid",
    program: Program::Python { script: "meshlib_solid.py", package: "meshlib" },
    about: "MeshLib: unite close vertices, multiple edges, degenerate faces, holes, self-intersections cut and filled, holes",
    ..PLAIN
};

const MANIFOLD3D_UNION: Facts =
    Facts { name: "manifold3d-union", flag: Some("--union"), about: "the same, and all parts united", ..MANIFOLD3D };

/// The Python package of this repository, by the name that it has where packages are listed.
pub(super) const SUTURE_PACKAGE: &str = "suture-mesh";

const SUTURE_ARRAYS: Facts = Facts {
    name: "suture-arrays",
    program: Program::Python { script: "arrays.py", package: SUTURE_PACKAGE },
    flag: Some("--suture"),
    about: "`suture.repair(vertices, faces)` of the Python package, built from this repository",
    ..SUTURE
};

const PYMESHLAB_ARRAYS: Facts = Facts {
    name: "pymeshlab-arrays",
    program: Program::Python { script: "arrays.py", package: "pymeshlab" },
    flag: Some("--pymeshlab"),
    about: "as pymeshlab-competent, from arrays and back",
    ..PLAIN
};

const MESHLIB_ARRAYS: Facts = Facts {
    name: "meshlib-arrays",
    program: Program::Python { script: "arrays.py", package: "meshlib" },
    flag: Some("--meshlib"),
    about: "as meshlib, from arrays and back",
    ..PLAIN
};

const PYMESHFIX_ARRAYS: Facts = Facts {
    name: "pymeshfix-arrays",
    program: Program::Python { script: "arrays.py", package: "pymeshfix" },
    flag: Some("--pymeshfix"),
    about: "as pymeshfix, from arrays and back",
    ..PYMESHFIX
};

const TRIMESH_ARRAYS: Facts = Facts {
    name: "trimesh-arrays",
    program: Program::Python { script: "arrays.py", package: "trimesh" },
    flag: Some("--trimesh"),
    most_triangles: 1_100_000,
    about: "as trimesh, from arrays and back",
    ..TRIMESH
};

const CONVERT: Facts = Facts {
    name: "convert",
    program: Program::Convert,
    judged: false,
    about: "`suture convert`, which reads the file that it wrote back and compares all corners",
    ..SUTURE
};

const TRIMESH_FORMATS: Facts = Facts {
    name: "trimesh-formats",
    program: Program::Python { script: "formats.py", package: "trimesh" },
    flag: Some("--trimesh"),
    judged: false,
    about: "`trimesh.load` without processing; of an STL with it, and `export`",
    ..PLAIN
};

const LIB3MF: Facts = Facts {
    name: "lib3mf",
    program: Program::Python { script: "formats.py", package: "lib3mf" },
    flag: Some("--lib3mf"),
    about: "the 3MF Consortium's library, its readers and its writer of 3MF",
    ..TRIMESH_FORMATS
};

const PYMESHLAB_FORMATS: Facts = Facts {
    name: "pymeshlab-formats",
    program: Program::Python { script: "formats.py", package: "pymeshlab" },
    flag: Some("--pymeshlab"),
    about: "pymeshlab: `load_new_mesh` and `save_current_mesh`, without normals of vertices",
    ..TRIMESH_FORMATS
};

const MESHLIB_FORMATS: Facts = Facts {
    name: "meshlib-formats",
    program: Program::Python { script: "formats.py", package: "meshlib" },
    flag: Some("--meshlib"),
    about: "MeshLib: `loadMesh` and `saveMesh`",
    ..TRIMESH_FORMATS
};

const TOBJ: Facts = Facts {
    name: "tobj",
    program: Program::Itself { task: "load-obj" },
    flag: None,
    writes: false,
    about: "the Rust crate: `load_obj` with `triangulate`, in a process of `suture-bench`",
    ..TRIMESH_FORMATS
};

/// tobj and its version, as `Cargo.lock` has it.
pub(super) const TOBJ_VERSION: &str = "tobj 4.0.5";

/// Arguments of pymeshlab's scripts and of suture.
const PYMESHLAB_SI: Option<&str> = Some("--self-intersections");
pub(super) const NO_SI: &str = "--no-self-intersections";

impl Side {
    pub(crate) const ALL: [Self; 31] = [
        Self::Cp,
        Self::CpSynced,
        Self::Suture,
        Self::SutureNoSi,
        Self::Inspect,
        Self::InspectNoSi,
        Self::PymeshlabPlain,
        Self::PymeshlabPlainSi,
        Self::PymeshlabCompetent,
        Self::PymeshlabCompetentSi,
        Self::Meshlib,
        Self::MeshlibDetect,
        Self::Pymeshfix,
        Self::Admesh,
        Self::Trimesh,
        Self::Manifold3d,
        Self::SutureOff,
        Self::PymeshlabSolid,
        Self::MeshlibSolid,
        Self::Manifold3dUnion,
        Self::SutureArrays,
        Self::PymeshlabArrays,
        Self::MeshlibArrays,
        Self::PymeshfixArrays,
        Self::TrimeshArrays,
        Self::Convert,
        Self::TrimeshFormats,
        Self::Lib3mf,
        Self::PymeshlabFormats,
        Self::MeshlibFormats,
        Self::Tobj,
    ];

    /// Those that are asked for a solid from any file, each with the settings that get it furthest.
    pub(crate) const SOLID: [Self; 6] =
        [Self::Suture, Self::SutureOff, Self::PymeshlabSolid, Self::MeshlibSolid, Self::Pymeshfix, Self::Manifold3dUnion];

    /// Measured only where solids are asked for: what comes out matters there, and not how fast.
    pub(crate) fn is_for_solids_alone(self) -> bool {
        matches!(self, Self::SutureOff | Self::PymeshlabSolid | Self::MeshlibSolid | Self::Manifold3dUnion)
    }

    /// Sides that are given arrays instead of a file. They are measured only where they are asked for by name.
    pub(crate) const ARRAYS: [Self; 5] =
        [Self::SutureArrays, Self::PymeshlabArrays, Self::MeshlibArrays, Self::PymeshfixArrays, Self::TrimeshArrays];

    /// Its time is that of its work on arrays, and not that of its process.
    pub(crate) fn is_of_arrays(self) -> bool {
        Self::ARRAYS.contains(&self)
    }

    /// Those that read and write formats: Suture first.
    pub(crate) const FORMATS: [Self; 7] = [
        Self::InspectNoSi,
        Self::Convert,
        Self::TrimeshFormats,
        Self::Lib3mf,
        Self::PymeshlabFormats,
        Self::MeshlibFormats,
        Self::Tobj,
    ];

    /// Measured only where formats are read and written.
    pub(crate) fn is_of_formats(self) -> bool {
        Self::FORMATS.contains(&self) && self != Self::InspectNoSi
    }

    /// Measured wherever files are repaired or inspected, unless it is left out by name.
    pub(crate) fn repairs_files(self) -> bool {
        !self.is_for_solids_alone() && !self.is_of_arrays() && !self.is_of_formats()
    }

    /// Facts about it.
    pub(crate) fn facts(self) -> Facts {
        match self {
            Self::Cp => COPY,
            Self::CpSynced => CP_SYNCED,
            Self::Suture => SUTURE,
            Self::SutureNoSi => SUTURE_NO_SI,
            Self::Inspect => INSPECT,
            Self::InspectNoSi => INSPECT_NO_SI,
            Self::PymeshlabPlain => PLAIN,
            Self::PymeshlabPlainSi => PYMESHLAB_PLAIN_SI,
            Self::PymeshlabCompetent => COMPETENT,
            Self::PymeshlabCompetentSi => PYMESHLAB_COMPETENT_SI,
            Self::Meshlib => MESHLIB,
            Self::MeshlibDetect => MESHLIB_DETECT,
            Self::Pymeshfix => PYMESHFIX,
            Self::Admesh => ADMESH,
            Self::Trimesh => TRIMESH,
            Self::Manifold3d => MANIFOLD3D,
            Self::SutureOff => SUTURE_OFF,
            Self::PymeshlabSolid => PYMESHLAB_SOLID,
            Self::MeshlibSolid => MESHLIB_SOLID,
            Self::Manifold3dUnion => MANIFOLD3D_UNION,
            Self::SutureArrays => SUTURE_ARRAYS,
            Self::PymeshlabArrays => PYMESHLAB_ARRAYS,
            Self::MeshlibArrays => MESHLIB_ARRAYS,
            Self::PymeshfixArrays => PYMESHFIX_ARRAYS,
            Self::TrimeshArrays => TRIMESH_ARRAYS,
            Self::Convert => CONVERT,
            Self::TrimeshFormats => TRIMESH_FORMATS,
            Self::Lib3mf => LIB3MF,
            Self::PymeshlabFormats => PYMESHLAB_FORMATS,
            Self::MeshlibFormats => MESHLIB_FORMATS,
            Self::Tobj => TOBJ,
        }
    }

    pub(crate) fn is_suture(self) -> bool {
        matches!(self.facts().program, Program::Suture | Program::Convert)
    }

    /// Its output is on the disk before its time ends.
    pub(super) fn synced(self) -> bool {
        self != Self::Cp && self.facts().writes
    }

    /// Exit code 1 is an answer: done, but the mesh is not good.
    pub(crate) fn may_exit_1(self) -> bool {
        self.is_suture()
    }
}

/// Licences of the peers. Each runs as a process of its own, and is installed by the command (tobj is built into this program); no part of
/// any is in Suture.
pub(crate) const LICENCES: [(&str, &str); 8] = [
    ("pymeshlab", "GPL-3.0"),
    ("meshlib", "free for non-commercial use only"),
    ("pymeshfix", "GPL-3.0"),
    ("admesh", "GPL-2.0 or later"),
    ("trimesh", "MIT"),
    ("manifold3d", "Apache-2.0"),
    ("lib3mf", "BSD-2-Clause"),
    ("tobj", "MIT"),
];

impl std::fmt::Display for Side {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(self.facts().name)
    }
}

impl std::str::FromStr for Side {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|side| side.facts().name == name);
        found.ok_or_else(|| format!("the peers are {}", Self::ALL.map(|side| side.facts().name).join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_reads_back_and_is_the_one_in_raw_runs() {
        for side in Side::ALL {
            let name = side.facts().name;
            assert_eq!(name.parse::<Side>(), Ok(side));
            assert_eq!(serde_json::to_string(&side).unwrap(), format!("\"{name}\""));
        }
        assert!("nothing".parse::<Side>().unwrap_err().contains("pymeshfix"));
    }
}
