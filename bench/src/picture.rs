//! Pictures of meshes, so that a person sees what a count says: holes, flipped patches, cracks, and what became of them.
//!
//! Each triangle is drawn flat into a depth buffer, the outside in grey, the inside (seen through a hole, or of a flipped
//! patch) in orange; on request boundary edges are red and mesh edges thin lines. Several files stand side by side, seen by
//! one camera that the first of them decides. Same files and options give the same picture.
//!
//! Parallel projection; three by three samples a pixel. O(triangles + pixels covered), about 80 bytes a triangle with edges.

use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

use crate::mesh::{Point, Vector, cross, dot, minus, read, unit};

/// What to draw.
#[derive(Args)]
pub(crate) struct Options {
    /// STL files, side by side, and the PNG to write.
    #[arg(required = true, num_args = 2.., value_names = ["IN", "OUT.png"])]
    files: Vec<PathBuf>,
    /// Pixels of each panel.
    #[arg(long, value_name = "WxH", default_value = "800x600")]
    size: Size,
    /// Draw edges of only one triangle in red.
    #[arg(long)]
    boundary: bool,
    /// Draw the edges of all triangles.
    #[arg(long)]
    edges: bool,
    /// Where the eye is, in degrees: around z from the x axis, and above the horizon.
    #[arg(long, value_name = "AROUND,ABOVE", default_value = "-60,30", allow_hyphen_values = true)]
    eye: Numbers<2>,
    /// Look at the ball of this middle and radius only, instead of all of the first file.
    #[arg(long, value_name = "X,Y,Z,R", allow_hyphen_values = true)]
    at: Option<Numbers<4>>,
}

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Size(usize, usize);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
        match parts {
            Some((w, h)) if (16..=4096).contains(&w) && (16..=4096).contains(&h) => Ok(Self(w, h)),
            _ => Err("width and height, each from 16 to 4096, like 800x600".into()),
        }
    }
}

/// Numbers with commas between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Numbers<const N: usize>(pub(crate) [f64; N]);

impl<const N: usize> FromStr for Numbers<N> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f64>> = text.split(',').map(|x| x.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
        numbers.and_then(|n| n.try_into().ok()).map(Self).ok_or_else(|| format!("{N} numbers with commas between them"))
    }
}

impl Options {
    /// For a page: near by with all edges, a whole body without them.
    pub(crate) fn for_page(files: Vec<PathBuf>, eye: [f64; 2], at: Option<[f64; 4]>) -> Self {
        Self { files, size: Size(340, 300), boundary: true, edges: at.is_some(), eye: Numbers(eye), at: at.map(Numbers) }
    }

    /// Two panels to be looked at by themselves, with edges where only a part is drawn.
    pub(crate) fn large(files: Vec<PathBuf>, eye: [f64; 2], at: Option<Numbers<4>>) -> Self {
        Self { files, size: Size(900, 700), boundary: true, edges: at.is_some(), eye: Numbers(eye), at }
    }
}

/// Draws the files and writes the picture.
///
/// # Errors
/// When a file cannot be read as STL, or the picture cannot be written.
pub(crate) fn draw(options: &Options) -> Result<(), Box<dyn Error>> {
    let Some((out, inputs)) = options.files.split_last() else { return Err("no files".into()) };
    let meshes = inputs.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let Size(width, height) = options.size;
    let ball = options.at.map(|Numbers([x, y, z, r])| ([x, y, z], r));
    let camera = Camera::new(options.eye.0, &meshes[0], ball, options.size);
    let panels: Vec<Vec<[u8; 3]>> = meshes.iter().map(|mesh| panel(mesh, &camera, options)).collect();
    let whole = width * panels.len();
    let mut pixels = vec![[255; 3]; whole * height];
    for (p, panel) in panels.iter().enumerate() {
        for (y, row) in panel.chunks_exact(width).enumerate() {
            pixels[y * whole + p * width..][..width].copy_from_slice(row);
        }
    }
    fs::write(out, png(whole, height, &pixels)).map_err(|e| format!("{}: {e}", out.display()))?;
    Ok(())
}

/// Samples along a pixel's side.
const SAMPLES: usize = 3;

/// Turns the model's coordinates into samples to the right, samples down, and depth towards the eye in samples.
struct Camera {
    axes: [Vector; 3],
    middle: Vector,
    scale: f64,
    width: usize,
    height: usize,
    /// Only what is nearer to `middle` than this is drawn, if set.
    reach: Option<f64>,
}

impl Camera {
    fn new(eye: [f64; 2], mesh: &[[Point; 3]], ball: Option<(Vector, f64)>, Size(width, height): Size) -> Self {
        let [around, above] = eye.map(f64::to_radians);
        let towards = [above.cos() * around.cos(), above.cos() * around.sin(), above.sin()];
        let right = [-around.sin(), around.cos(), 0.0];
        let down = cross(right, towards).map(|x| x + 0.0);
        let axes = [right, down, towards];
        let (width, height) = (width * SAMPLES, height * SAMPLES);
        let mut camera = Self { axes, middle: [0.0; 3], scale: 1.0, width, height, reach: None };
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in mesh.as_flattened() {
            let q = axes.map(|axis| dot(axis, p.map(f64::from)));
            for k in 0..3 {
                lo[k] = lo[k].min(q[k]);
                hi[k] = hi[k].max(q[k]);
            }
        }
        let (size, middle) = match ball {
            Some((middle, radius)) => {
                camera.reach = Some(radius * 1.5);
                ([2.0 * radius; 2], middle)
            }
            None if mesh.is_empty() => ([1.0; 2], [0.0; 3]),
            None => {
                let m: Vector = std::array::from_fn(|k| (lo[k] + hi[k]) / 2.0);
                let back = std::array::from_fn(|k| (0..3).map(|i| axes[i][k] * m[i]).sum());
                ([hi[0] - lo[0], hi[1] - lo[1]], back)
            }
        };
        camera.middle = middle;
        camera.scale = 0.94 * (width as f64 / size[0].max(1e-30)).min(height as f64 / size[1].max(1e-30));
        camera
    }

    fn place(&self, p: Point) -> Vector {
        let q = minus(p.map(f64::from), self.middle);
        let [x, y, z] = self.axes.map(|axis| dot(axis, q) * self.scale);
        [x + self.width as f64 / 2.0, y + self.height as f64 / 2.0, z]
    }

    fn sees(&self, points: &[Point]) -> bool {
        let distance2 = |p: &Point| {
            let q = minus(p.map(f64::from), self.middle);
            dot(q, q)
        };
        self.reach.is_none_or(|reach| points.iter().any(|p| distance2(p) < reach * reach))
    }
}

const PAPER: [f64; 3] = [255.0; 3];
const OUTSIDE: [f64; 3] = [176.0, 190.0, 206.0];
const INSIDE: [f64; 3] = [240.0, 150.0, 50.0];
const BOUNDARY: [f64; 3] = [214.0, 10.0, 40.0];
const MESH_EDGE: [f64; 3] = [70.0, 80.0, 95.0];

/// Samples of one panel.
struct Canvas {
    width: usize,
    height: usize,
    depth: Vec<f64>,
    colour: Vec<[f64; 3]>,
}

impl Canvas {
    /// Fills a triangle where it is nearest.
    fn triangle(&mut self, q: [Vector; 3], colour: [f64; 3]) {
        let [a, b, c] = q;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area == 0.0 {
            return;
        }
        let span = |k: usize, most: usize| {
            let lo = a[k].min(b[k]).min(c[k]).floor().clamp(0.0, most as f64) as usize;
            let hi = (a[k].max(b[k]).max(c[k]).ceil() + 1.0).clamp(0.0, most as f64) as usize;
            lo..hi
        };
        for y in span(1, self.height) {
            for x in span(0, self.width) {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let share = |u: Vector, v: Vector| ((u[0] - p[0]) * (v[1] - p[1]) - (u[1] - p[1]) * (v[0] - p[0])) / area;
                let (wa, wb, wc) = (share(b, c), share(c, a), share(a, b));
                if wa >= 0.0 && wb >= 0.0 && wc >= 0.0 {
                    let z = wa * a[2] + wb * b[2] + wc * c[2];
                    let at = y * self.width + x;
                    if z > self.depth[at] {
                        self.depth[at] = z;
                        self.colour[at] = colour;
                    }
                }
            }
        }
    }

    /// A line of this radius in samples, where nothing lies more than `bias` samples in front of it.
    fn line(&mut self, [a, b]: [Vector; 2], radius: f64, bias: f64, opacity: f64, colour: [f64; 3]) {
        let steps = (2.0 * (b[0] - a[0]).abs().max((b[1] - a[1]).abs())).ceil().clamp(1.0, 1e6) as usize;
        // Each sample is coloured once a line, lest translucent ones add up.
        let mut last = Vec::new();
        for i in 0..=steps {
            let s = i as f64 / steps as f64;
            let p: Vector = std::array::from_fn(|k| a[k] + s * (b[k] - a[k]));
            let reach = |k: usize, most: usize| {
                let lo = (p[k] - radius).floor().clamp(0.0, most as f64) as usize;
                lo..(p[k] + radius).ceil().clamp(0.0, most as f64) as usize
            };
            let mut here = Vec::new();
            for y in reach(1, self.height) {
                for x in reach(0, self.width) {
                    let off = (x as f64 + 0.5 - p[0]).hypot(y as f64 + 0.5 - p[1]);
                    let at = y * self.width + x;
                    if off <= radius && p[2] + bias >= self.depth[at] {
                        here.push(at);
                        if !last.contains(&at) {
                            let under = self.colour[at];
                            self.colour[at] = std::array::from_fn(|k| under[k] + opacity * (colour[k] - under[k]));
                        }
                    }
                }
            }
            last = here;
        }
    }

    /// Means of the samples of each pixel.
    fn pixels(&self) -> Vec<[u8; 3]> {
        let (width, height) = (self.width / SAMPLES, self.height / SAMPLES);
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let samples = (0..SAMPLES * SAMPLES)
                    .map(|i| self.colour[(y * SAMPLES + i / SAMPLES) * self.width + x * SAMPLES + i % SAMPLES]);
                let sum = samples.fold([0.0; 3], |sum: [f64; 3], c| std::array::from_fn(|k| sum[k] + c[k]));
                pixels.push(sum.map(|x| (x / (SAMPLES * SAMPLES) as f64).round() as u8));
            }
        }
        pixels
    }
}

fn panel(mesh: &[[Point; 3]], camera: &Camera, options: &Options) -> Vec<[u8; 3]> {
    let samples = camera.width * camera.height;
    let mut canvas = Canvas {
        width: camera.width,
        height: camera.height,
        depth: vec![f64::NEG_INFINITY; samples],
        colour: vec![PAPER; samples],
    };
    // Light comes over the eye's left shoulder.
    let light = unit(std::array::from_fn(|k| 0.9 * camera.axes[2][k] - 0.35 * camera.axes[0][k] - 0.45 * camera.axes[1][k]));
    for t in mesh.iter().filter(|t| camera.sees(&t[..])) {
        let [a, b, c] = t.map(|p| p.map(f64::from));
        let normal = unit(cross(minus(b, a), minus(c, a)));
        let outside = dot(normal, camera.axes[2]) >= 0.0;
        let lit = dot(normal, light) * if outside { 1.0 } else { -1.0 };
        let (paint, ambient) = if outside { (OUTSIDE, 0.30) } else { (INSIDE, 0.45) };
        let shade = ambient + (1.0 - ambient) * lit.max(0.0);
        canvas.triangle(t.map(|p| camera.place(p)), paint.map(|x| (x * shade * 1.12).min(255.0)));
    }
    if options.edges || options.boundary {
        for (ends, uses) in edges(mesh).into_iter().filter(|(ends, _)| camera.sees(ends)) {
            let ends = ends.map(|p| camera.place(p));
            if options.boundary && uses == Uses::One {
                canvas.line(ends, 1.3 * SAMPLES as f64 / 2.0, 2.5 * SAMPLES as f64, 1.0, BOUNDARY);
            } else if options.edges {
                canvas.line(ends, 0.5 * SAMPLES as f64 / 2.0, 0.5 * SAMPLES as f64, 0.45, MESH_EDGE);
            }
        }
    }
    canvas.pixels()
}

/// How many triangles an edge has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Uses {
    /// Two or more.
    Several,
    One,
}

/// All edges by position, −0.0 being 0.0, those of one triangle last. O(n log n).
fn edges(mesh: &[[Point; 3]]) -> Vec<([Point; 2], Uses)> {
    let key = |p: Point| p.map(|x| (x + 0.0).to_bits());
    let mut all: Vec<[[u32; 3]; 2]> = Vec::with_capacity(mesh.len() * 3);
    for t in mesh {
        for k in 0..3 {
            let (a, b) = (key(t[k]), key(t[(k + 1) % 3]));
            if a != b {
                all.push([a.min(b), a.max(b)]);
            }
        }
    }
    all.sort_unstable();
    let mut edges: Vec<([Point; 2], Uses)> = all
        .chunk_by(|a, b| a == b)
        .map(|same| (same[0].map(|p| p.map(f32::from_bits)), if same.len() == 1 { Uses::One } else { Uses::Several }))
        .collect();
    edges.sort_by_key(|(_, uses)| *uses);
    edges
}

/// A PNG (ISO/IEC 15948) of 8-bit RGB; each row as differences from the pixel to the left, which suits flat shading.
fn png(width: usize, height: usize, pixels: &[[u8; 3]]) -> Vec<u8> {
    const FILTER_SUB: u8 = 1;
    let mut raw = Vec::with_capacity(height * (1 + 3 * width));
    for row in pixels.chunks_exact(width) {
        raw.push(FILTER_SUB);
        let mut left = [0u8; 3];
        for pixel in row {
            raw.extend((0..3).map(|k| pixel[k].wrapping_sub(left[k])));
            left = *pixel;
        }
    }
    let mut head = Vec::new();
    head.extend((width as u32).to_be_bytes());
    head.extend((height as u32).to_be_bytes());
    // Eight bits, red green blue, the only compression and filter methods, not interlaced.
    head.extend([8, 2, 0, 0, 0]);
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    chunk(&mut out, *b"IHDR", &head);
    chunk(&mut out, *b"IDAT", &miniz_oxide::deflate::compress_to_vec_zlib(&raw, 9));
    chunk(&mut out, *b"IEND", &[]);
    out
}

fn chunk(out: &mut Vec<u8>, kind: [u8; 4], data: &[u8]) {
    out.extend((data.len() as u32).to_be_bytes());
    let start = out.len();
    out.extend(kind);
    out.extend(data);
    let crc = crc32fast::hash(&out[start..]);
    out.extend(crc.to_be_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A face of the tetrahedron on the axes, and the three others.
    const FACES: [[Point; 3]; 4] = {
        let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        [[x, y, z], [o, y, x], [o, z, y], [o, x, z]]
    };

    fn options(boundary: bool) -> Options {
        let at = None;
        Options { files: Vec::new(), size: Size(64, 48), boundary, edges: false, eye: Numbers([45.0, 35.0]), at }
    }

    fn drawn(mesh: &[[Point; 3]], boundary: bool) -> Vec<[u8; 3]> {
        let options = options(boundary);
        panel(mesh, &Camera::new(options.eye.0, &FACES, None, options.size), &options)
    }

    #[test]
    fn the_outside_is_bluish_the_inside_orange_the_rest_white() {
        let middle = 26 * 64 + 32;
        let front = drawn(&FACES, false);
        let [r, _, b] = front[middle];
        assert!(r < b, "outside: {:?}", front[middle]);
        assert_eq!(front[0], [255; 3]);
        // Without the nearest face one looks into it.
        let [r, _, b] = drawn(&FACES[1..], false)[middle];
        assert!(r > b);
    }

    #[test]
    fn boundary_edges_are_those_of_one_triangle_and_red() {
        let ones = |mesh: &[[Point; 3]]| edges(mesh).iter().filter(|e| e.1 == Uses::One).count();
        assert_eq!((ones(&FACES), ones(&FACES[1..]), edges(&FACES).len()), (0, 3, 6));
        let red = |pixels: Vec<[u8; 3]>| pixels.iter().filter(|p| p[0] > 180 && p[1] < 60 && p[2] < 80).count();
        assert_eq!(red(drawn(&FACES, true)), 0);
        assert!(red(drawn(&FACES[1..], true)) > 50);
    }

    #[test]
    fn the_picture_unpacks_to_its_pixels() {
        let pixels: Vec<[u8; 3]> = (0..20u8).map(|i| [i, 250 - i, i * 9]).collect();
        let file = png(5, 4, &pixels);
        assert!(file.starts_with(b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x05\0\0\0\x04"));
        // After signature (8), header chunk (25) and the next chunk's length and kind (8).
        let raw = miniz_oxide::inflate::decompress_to_vec_zlib(&file[41..file.len() - 16]).unwrap();
        let mut found = Vec::new();
        for row in raw.chunks(1 + 15) {
            let mut sum = [0u8; 3];
            for pixel in row[1..].chunks(3) {
                sum = std::array::from_fn(|k| sum[k].wrapping_add(pixel[k]));
                found.push(sum);
            }
        }
        assert_eq!(found, pixels);
    }

    #[test]
    fn sizes_and_numbers_are_read_or_refused() {
        assert_eq!("800x600".parse(), Ok(Size(800, 600)));
        assert_eq!("-60, 30".parse(), Ok(Numbers([-60.0, 30.0])));
        for bad in ["800", "0x5", "axb", "9999x100"] {
            assert!(bad.parse::<Size>().is_err(), "{bad}");
        }
        assert!("1,2,nan".parse::<Numbers<3>>().is_err() && "1".parse::<Numbers<2>>().is_err());
    }
}
