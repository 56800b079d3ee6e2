//! What is measured: sweeps, each over one thing that a scene or a picture may have more of.

use serde::{Deserialize, Serialize};

use super::quantity::Quantity;
use crate::accel::AccelKind;
use crate::desc::{LayerKind, MAX_SIDE};
use steradian::{Error, Result};

/// Options of the benchmark.
#[derive(Clone, Debug)]
pub struct ScaleOptions {
    /// The command, for the report.
    pub command: String,
    /// Names of sweeps; all if empty.
    pub sweeps: Vec<String>,
    /// Smaller scenes and pictures.
    pub quick: bool,
    /// Repeats, all cases in turn.
    pub repeats: usize,
    /// Width and height of pictures, where they are not what grows.
    pub size: [u32; 2],
    /// Samples per pixel, where they are not what grows.
    pub spp: u32,
    /// Threads, where they are not what grows.
    pub threads: usize,
    /// The most triangles.
    pub triangles: usize,
    /// The most lamps.
    pub lights: usize,
    /// The most instances.
    pub instances: usize,
    /// What finds hits.
    pub accel: AccelKind,
}

/// What a scene consists of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "scene", rename_all = "snake_case")]
pub enum Subject {
    /// A closed room with two boxes.
    Room,
    /// A bumpy sphere, all triangles different, on a floor under a sky.
    Sphere {
        /// Triangles of it.
        triangles: usize,
    },
    /// Small emissive triangles above a floor.
    Lamps {
        /// How many.
        count: usize,
    },
    /// A heap of spheres, which are instances of one.
    Instances {
        /// How many.
        count: usize,
        /// Triangles of the one.
        triangles: usize,
    },
}

/// A scene and how it is rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// The scene.
    #[serde(flatten)]
    pub subject: Subject,
    /// Width and height of the picture.
    pub size: [u32; 2],
    /// Samples per pixel.
    pub spp: u32,
    /// Largest number of segments of a path; none ends before it by chance.
    pub depth: u32,
    /// What is stored beside the colour.
    pub layers: Vec<LayerKind>,
    /// Threads of the build and of the render.
    pub threads: usize,
    /// The accelerator's name.
    pub accel: String,
}

/// Cases that differ in one thing.
#[derive(Clone, Debug)]
pub(super) struct Sweep {
    pub name: &'static str,
    /// What is on the axis.
    pub axis: &'static str,
    /// What is rendered.
    pub what: String,
    /// Columns of the table.
    pub columns: &'static [Quantity],
    /// Of them those that a power law is fitted to.
    pub fitted: &'static [Quantity],
    /// The place on the axis, a label where a number is not enough, and the case.
    pub cases: Vec<(f64, Option<String>, Case)>,
}

/// All sweeps with what they are over.
pub const SWEEPS: [(&str, &str); 8] = [
    ("resolution", "pixels of the picture"),
    ("spp", "samples per pixel"),
    ("triangles", "triangles of a mesh"),
    ("instances", "instances of an object"),
    ("lights", "emissive triangles"),
    ("depth", "segments of a path"),
    ("layers", "layers of the picture"),
    ("threads", "threads"),
];

/// Triangles of the sphere that instances place.
const INSTANCED: [usize; 2] = [2_000, 20_000];

/// Depth, where that is not what grows.
const DEPTH: u32 = 8;

/// The sweeps requested.
///
/// # Errors
/// [`Error::Usage`] for a name that none has.
pub(super) fn sweeps(options: &ScaleOptions) -> Result<Vec<Sweep>> {
    if let Some(name) = options.sweeps.iter().find(|name| SWEEPS.iter().all(|(known, _)| known != name)) {
        let known: Vec<&str> = SWEEPS.iter().map(|(known, _)| *known).collect();
        return Err(Error::Usage(format!("unknown sweep \"{name}\"; use one of {}", known.join(", "))));
    }
    let selected = |name: &str| options.sweeps.is_empty() || options.sweeps.iter().any(|sweep| sweep == name);
    Ok(SWEEPS.iter().filter(|(name, _)| selected(name)).map(|(name, axis)| sweep(name, axis, options)).collect())
}

fn sweep(name: &'static str, axis: &'static str, options: &ScaleOptions) -> Sweep {
    let base = Case {
        subject: Subject::Room,
        size: options.size,
        spp: options.spp,
        depth: DEPTH,
        layers: Vec::new(),
        threads: options.threads,
        accel: options.accel.to_string(),
    };
    let planner = Planner { name, axis, options, base };
    planner.sweep_of_scenes().unwrap_or_else(|| planner.sweep_of_settings())
}

/// Sets of layers with their names and numbers of channels.
fn layer_sets() -> [(&'static str, u8, Vec<LayerKind>); 6] {
    [
        ("color", 4, vec![]),
        ("color, Z", 5, vec![LayerKind::Z]),
        ("color, Z, N", 8, vec![LayerKind::Z, LayerKind::N]),
        ("color, Z, N, P", 11, vec![LayerKind::Z, LayerKind::N, LayerKind::P]),
        ("color, Z, N, P, albedo", 14, vec![LayerKind::Z, LayerKind::N, LayerKind::P, LayerKind::Albedo]),
        (
            "all (variance and samples too)",
            18,
            vec![LayerKind::Z, LayerKind::N, LayerKind::P, LayerKind::Albedo, LayerKind::Variance, LayerKind::Samples],
        ),
    ]
}

fn plain(n: usize, case: Case) -> (f64, Option<String>, Case) {
    (n as f64, None, case)
}

/// Plans a sweep; `base` is the case of which one quantity grows.
struct Planner<'a> {
    name: &'static str,
    axis: &'static str,
    options: &'a ScaleOptions,
    base: Case,
}

impl Planner<'_> {
    fn sweep(
        &self,
        what: String,
        columns: &'static [Quantity],
        fitted: &'static [Quantity],
        cases: Vec<(f64, Option<String>, Case)>,
    ) -> Sweep {
        Sweep { name: self.name, axis: self.axis, what, columns, fitted, cases }
    }

    fn with(&self, subject: Subject) -> Case {
        Case { subject, ..self.base.clone() }
    }

    fn picture(&self) -> String {
        let [width, height] = self.options.size;
        format!("{width}x{height}, {} spp", self.options.spp)
    }

    /// A sweep over the size of the scene; `None` for another.
    fn sweep_of_scenes(&self) -> Option<Sweep> {
        use Quantity as Q;
        let (options, picture) = (self.options, self.picture());
        Some(match self.name {
            "triangles" => self.sweep(
                format!("A bumpy sphere on a floor under a sky, {picture}"),
                &[
                    Q::Load,
                    Q::Build,
                    Q::FirstPixel,
                    Q::Sample,
                    Q::Rate,
                    Q::MeshPerTriangle,
                    Q::AccelPerTriangle,
                    Q::PeakPerTriangle,
                    Q::Peak,
                ],
                &[Q::Load, Q::Build, Q::FirstPixel, Q::Sample, Q::Accel, Q::Peak],
                counts(1_000, options.triangles)
                    .into_iter()
                    .map(|n| plain(n, self.with(Subject::Sphere { triangles: n })))
                    .collect(),
            ),
            "instances" => {
                let triangles = INSTANCED[usize::from(!options.quick)];
                self.sweep(
                    format!("A heap of instances of a sphere of {triangles} triangles, {picture}"),
                    &[Q::Load, Q::Build, Q::FirstPixel, Q::Sample, Q::Rate, Q::AccelPerInstance, Q::Peak],
                    &[Q::Build, Q::FirstPixel, Q::Sample, Q::Peak],
                    counts(1, options.instances)
                        .into_iter()
                        .map(|n| plain(n, self.with(Subject::Instances { count: n, triangles })))
                        .collect(),
                )
            }
            "lights" => self.sweep(
                format!("Emissive triangles above a floor, {picture}"),
                &[Q::Load, Q::Build, Q::FirstPixel, Q::Sample, Q::Rate, Q::Peak],
                &[Q::Load, Q::FirstPixel, Q::Sample, Q::Peak],
                counts(1, options.lights)
                    .into_iter()
                    .map(|n| plain(n, self.with(Subject::Lamps { count: n })))
                    .collect(),
            ),
            _ => return None,
        })
    }

    /// A sweep over settings of the render.
    fn sweep_of_settings(&self) -> Sweep {
        use Quantity as Q;
        let (options, picture) = (self.options, self.picture());
        match self.name {
            "resolution" => self.sweep_of_resolutions(),
            "spp" => {
                let counts = [1, 4, 16, 64, 256].map(|spp| if options.quick { spp.min(64) } else { spp });
                let mut counts = counts.to_vec();
                counts.dedup();
                let size = options.size.map(|side| side.div_ceil(4));
                self.sweep(
                    format!("The room, {}x{}", size[0], size[1]),
                    &[Q::Render, Q::Sample, Q::Rate, Q::Peak],
                    &[Q::Render, Q::Sample],
                    counts
                        .into_iter()
                        .map(|spp| plain(spp as usize, Case { size, spp, ..self.base.clone() }))
                        .collect(),
                )
            }
            "depth" => self.sweep(
                format!("The room, {picture}; no path ends by chance"),
                &[Q::Render, Q::Sample, Q::Rate, Q::RaysPerSample],
                &[Q::Sample, Q::RaysPerSample],
                [1, 2, 4, 8, 16, 32]
                    .into_iter()
                    .map(|depth| plain(depth as usize, Case { depth, ..self.base.clone() }))
                    .collect(),
            ),
            "layers" => {
                let sets = layer_sets();
                self.sweep(
                    format!("The room, {picture}; by channels"),
                    &[Q::Sample, Q::FilmPerPixel, Q::RenderPerPixel, Q::Peak],
                    &[Q::Sample, Q::FilmPerPixel],
                    sets.into_iter()
                        .map(|(name, channels, layers)| {
                            (f64::from(channels), Some(name.to_owned()), Case { layers, ..self.base.clone() })
                        })
                        .collect(),
                )
            }
            _ => self.sweep_of_threads(),
        }
    }

    fn sweep_of_resolutions(&self) -> Sweep {
        use Quantity as Q;
        let sizes =
            [1, 2, 4, 8, 16].map(|factor| self.options.size.map(|side| (side * factor).div_ceil(4).min(MAX_SIDE)));
        let case =
            |size: [u32; 2]| plain(size[0] as usize * size[1] as usize, Case { size, spp: 1, ..self.base.clone() });
        self.sweep(
            "The room, 1 spp".to_owned(),
            &[Q::Render, Q::Sample, Q::Rate, Q::FilmPerPixel, Q::RenderPerPixel, Q::Peak],
            &[Q::Render, Q::Sample, Q::Peak],
            sizes.into_iter().map(case).collect(),
        )
    }

    fn sweep_of_threads(&self) -> Sweep {
        use Quantity as Q;
        let options = self.options;
        let triangles = if options.quick { 10_000 } else { 1_000_000 }.min(options.triangles);
        let spp = 4 * options.spp;
        let case = |threads| plain(threads, Case { threads, spp, ..self.with(Subject::Sphere { triangles }) });
        self.sweep(
            format!("A bumpy sphere of {triangles} triangles, {}x{}, {spp} spp", options.size[0], options.size[1]),
            &[Q::Build, Q::Render, Q::Sample, Q::Rate],
            &[Q::Build, Q::Render, Q::Sample],
            doubled(options.threads).into_iter().map(case).collect(),
        )
    }
}

/// From `first` by factors of ten up to `last`, and `last` itself.
fn counts(first: usize, last: usize) -> Vec<usize> {
    let mut counts: Vec<usize> =
        std::iter::successors(Some(first), |n| n.checked_mul(10)).take_while(|n| *n < last).collect();
    counts.push(last);
    counts
}

/// 1, 2, 4 and so on up to `last`, and `last` itself.
fn doubled(last: usize) -> Vec<usize> {
    let mut counts: Vec<usize> =
        std::iter::successors(Some(1), |n: &usize| n.checked_mul(2)).take_while(|n| *n < last).collect();
    counts.push(last);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_end_with_the_last() {
        assert_eq!(counts(1_000, 20_000_000), [1_000, 10_000, 100_000, 1_000_000, 10_000_000, 20_000_000]);
        assert_eq!(
            (counts(1, 1), counts(1, 100), doubled(1), doubled(6)),
            (vec![1], vec![1, 10, 100], vec![1], vec![1, 2, 4, 6])
        );
    }
}
