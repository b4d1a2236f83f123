//! Pictures of meshes, without a graphics card and without the mesh in memory: so that a person sees what a count says.
//!
//! Every triangle goes through a depth buffer as it lies in the mapped file. The outside is grey, the inside (seen through a hole, or of a
//! flipped patch) orange, edges of only one triangle red. Of two meshes, before and after, what the other one lacks has a colour: violet
//! what goes, green what is new; and unless it is told, the camera stands where most of that is seen. One camera for both. The same files
//! and options give the same picture, whatever the threads.
//!
//! Parallel projection, [`SAMPLES`]² samples a pixel. O(triangles + samples covered); 8 bytes a sample, and within [`Options::memory`] 2 bytes a
//! triangle of the other mesh to tell changes and 60 a triangle to tell boundary edges, each left out where it does not fit.

mod camera;
mod canvas;
mod coarse;
pub(crate) mod command;
pub(crate) mod confined;
mod edges;
mod known;
mod mix;
mod parts;
pub(crate) mod strokes;

use std::io;
use std::path::Path;

use suture_core::read::MeshFile;
use suture_core::record::{self, Point, Record};
use suture_core::{Access, Limits, Quiet};

pub(crate) use camera::Eye;
use camera::{Bounds, Camera};
use canvas::Canvas;
use known::Known;
use strokes::{Mark, Stroke};

/// Samples along the side of a pixel.
const SAMPLES: usize = 3;
/// Of the small pictures by which the camera chooses where to stand.
const SMALL: (usize, usize) = (160, 120);
/// Beyond so many triangles, it stands where it usually does.
const MOST_TO_CHOOSE: usize = 20_000_000;

/// How to draw.
#[derive(Clone, Debug)]
pub(crate) struct Options {
    /// Pixels of each panel: width and height.
    pub size: (usize, usize),
    /// `None`: where most changes are seen.
    pub eye: Option<Eye>,
    /// Seen from the side opposite to that.
    pub behind: bool,
    pub threads: usize,
    /// Bytes for what is optional.
    pub memory: u64,
}

/// A picture, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[u8; 3]>,
    /// One triangle in so many was drawn.
    pub one_in: usize,
}

impl Picture {
    /// As PNG.
    ///
    /// # Errors
    /// When it cannot be encoded, which is not to be expected.
    pub(crate) fn png(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// Opens a mesh to draw it, for a process that does nothing else meanwhile.
///
/// # Errors
/// A line for people.
pub(crate) fn open(path: &Path, limits: &Limits) -> Result<MeshFile, String> {
    let mut limits = limits.clone();
    // SAFETY: this process does nothing else. If someone truncates the file, SIGBUS ends it; a change is found out by `check_unchanged`.
    limits.access = unsafe { Access::mapped() };
    MeshFile::open(path, &std::env::temp_dir(), &limits, &Quiet).map_err(|error| error.to_string())
}

/// Draws one mesh, or two side by side, before and after a repair. `None` where no triangle is finite.
pub(crate) fn draw(meshes: &[&[Record]], options: &Options) -> Option<Picture> {
    let threads = options.threads.max(1);
    let known: Vec<Option<Known>> = match meshes {
        [before, after] => [after, before].map(|other| Known::of(other, threads, options.memory / 4)).into(),
        _ => meshes.iter().map(|_| None).collect(),
    };
    let panels: Vec<Panel<'_>> = meshes
        .iter()
        .zip(&known)
        .enumerate()
        .map(|(i, (records, others))| Panel { records, others: others.as_ref(), is_after: i > 0, strokes: &[] })
        .collect();
    let eye = options.eye.unwrap_or_else(|| choose(&panels, threads));
    side_by_side(&panels, eye, options)
}

/// Draws curves, and beside them a mesh with the curves that it does not hide. `None` where nothing is finite.
pub(crate) fn draw_curves(strokes: &[Stroke], mesh: &[Record], options: &Options) -> Option<Picture> {
    // Triangles without an area: the camera sees where they are, and the canvas draws nothing of them.
    let chords = strokes.iter().flat_map(|stroke| stroke.points.windows(2));
    let chords: Vec<Record> = chords.map(|ends| record::encode([ends[0], ends[1], ends[1]], 0)).collect();
    let panels = [chords.as_slice(), mesh].map(|records| Panel { records, others: None, is_after: false, strokes });
    side_by_side(&panels, options.eye.unwrap_or(Eye::USUAL), options)
}

/// Panels from left to right, all seen by one camera.
fn side_by_side(panels: &[Panel<'_>], eye: Eye, options: &Options) -> Option<Picture> {
    let eye = if options.behind { eye.opposite() } else { eye };
    let (width, height) = options.size;
    let meshes: Vec<&[Record]> = panels.iter().map(|panel| panel.records).collect();
    let camera = Camera::fitted(eye, &meshes, options.threads.max(1), width * SAMPLES, height * SAMPLES)?;
    let mut picture =
        Picture { width: width * panels.len(), height, pixels: vec![[255; 3]; width * panels.len() * height], one_in: 1 };
    for (i, panel) in panels.iter().enumerate() {
        let (pixels, one_in) = panel.draw(camera.clone(), options);
        picture.one_in = picture.one_in.max(one_in);
        for (row, pixels) in picture.pixels.chunks_exact_mut(width * panels.len()).zip(pixels.chunks_exact(width)) {
            row[i * width..][..width].copy_from_slice(pixels);
        }
    }
    Some(picture)
}

/// Where most of what changed is seen; the first of several.
fn choose(panels: &[Panel<'_>], threads: usize) -> Eye {
    let is_large = panels.iter().map(|panel| panel.records.len()).sum::<usize>() > MOST_TO_CHOOSE;
    if is_large || panels.iter().all(|panel| panel.others.is_none()) {
        return Eye::USUAL;
    }
    let as_it_is = |p: &Point| p.map(f64::from);
    let bounds = panels.iter().filter_map(|panel| Bounds::of(panel.records, threads, as_it_is)).reduce(Bounds::and);
    let Some(bounds) = bounds else { return Eye::USUAL };
    let seen = |eye: Eye| {
        let camera = Camera::new(eye, &bounds, SMALL.0, SMALL.1);
        panels.iter().map(|panel| panel.changes_seen(&camera, threads)).sum::<usize>()
    };
    let mut best = (0, Eye::USUAL);
    for eye in Eye::all() {
        let seen = seen(eye);
        if seen > best.0 {
            best = (seen, eye);
        }
    }
    best.1
}

const PAPER: [f64; 3] = [255.0; 3];
const OUTSIDE: [f64; 3] = [176.0, 190.0, 206.0];
const INSIDE: [f64; 3] = [240.0, 150.0, 50.0];
const GOES: [f64; 3] = [178.0, 132.0, 214.0];
const NEW: [f64; 3] = [92.0, 184.0, 112.0];
const BOUNDARY: [f64; 3] = [214.0, 10.0, 40.0];
const CURVE: [f64; 3] = [52.0, 66.0, 92.0];

fn paint_of(mark: Mark) -> [f64; 3] {
    match mark {
        Mark::Bounds => CURVE,
        Mark::Added => NEW,
        Mark::Left => BOUNDARY,
    }
}

/// A mesh to be drawn.
struct Panel<'a> {
    records: &'a [Record],
    /// The triangles of the other one.
    others: Option<&'a Known>,
    is_after: bool,
    /// Lines that are drawn besides.
    strokes: &'a [Stroke],
}

impl Panel<'_> {
    fn is_changed(&self, triangle: u32) -> bool {
        self.others.is_some_and(|others| !others.has(&self.records[triangle as usize]))
    }

    fn changes_seen(&self, camera: &Camera, threads: usize) -> usize {
        let (canvas, _) = Canvas::of(camera.clone(), self.records, threads);
        (0..camera.width * camera.height).filter(|at| canvas.at(*at).is_some_and(|t| self.is_changed(t))).count()
    }

    /// Its pixels, and of how many triangles one was drawn.
    fn draw(&self, camera: Camera, options: &Options) -> (Vec<[u8; 3]>, usize) {
        let (canvas, one_in) = Canvas::of(camera, self.records, options.threads.max(1));
        let mut last = (None, PAPER);
        let mut samples: Vec<[u8; 3]> = (0..canvas.camera.width * canvas.camera.height)
            .map(|at| {
                let triangle = canvas.at(at);
                if triangle != last.0 {
                    last = (triangle, triangle.map_or(PAPER, |t| self.colour(&canvas.camera, t)));
                }
                last.1.map(|x| x as u8)
            })
            .collect();
        for ends in edges::boundary(self.records, options.threads.max(1), options.memory / 2) {
            line(&canvas, ends, BOUNDARY, &mut samples);
        }
        for stroke in self.strokes {
            for ends in stroke.points.windows(2) {
                line(&canvas, [ends[0], ends[1]], paint_of(stroke.mark), &mut samples);
            }
        }
        (pixels(&samples, canvas.camera.width), one_in)
    }

    fn colour(&self, camera: &Camera, triangle: u32) -> [f64; 3] {
        let (lit, is_outside) = camera.shade(record::corners(&self.records[triangle as usize]));
        let (paint, ambient) = match (is_outside, self.is_changed(triangle)) {
            (false, _) => (INSIDE, 0.45),
            (true, true) if self.is_after => (NEW, 0.4),
            (true, true) => (GOES, 0.4),
            (true, false) => (OUTSIDE, 0.3),
        };
        paint.map(|x| (x * (ambient + (1.0 - ambient) * lit) * 1.12).min(255.0))
    }
}

fn line(canvas: &Canvas, ends: [Point; 2], paint: [f64; 3], samples: &mut [[u8; 3]]) {
    let samples_of_line = SAMPLES as f64;
    canvas.line(ends, 0.65 * samples_of_line, 2.5 * samples_of_line, &mut |at| samples[at] = paint.map(|x| x as u8));
}

/// Means of the samples of each pixel, of rows of so many samples.
fn pixels(samples: &[[u8; 3]], width: usize) -> Vec<[u8; 3]> {
    let mut pixels = Vec::with_capacity(samples.len() / (SAMPLES * SAMPLES));
    for rows in samples.chunks_exact(width * SAMPLES) {
        for x in (0..width).step_by(SAMPLES) {
            let of_pixel = (0..SAMPLES * SAMPLES).map(|i| rows[i / SAMPLES * width + x + i % SAMPLES]);
            let sum = of_pixel.fold([0_u32; 3], |sum, c| std::array::from_fn(|k| sum[k] + u32::from(c[k])));
            pixels.push(sum.map(|x| ((x as f64 / (SAMPLES * SAMPLES) as f64).round()) as u8));
        }
    }
    pixels
}

#[cfg(test)]
mod tests;
