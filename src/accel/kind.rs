//! Which accelerators can be chosen, under which names, with which options.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::bvh::{Bvh, BvhOptions};
use super::hybrid::{is_resting_mesh, is_traced_in_packets};
use super::kdtree::{KdTree, KdTreeOptions};
use super::octree::Octree;
use super::tree::TwoLevel;
use super::{
    Accelerator, EmbreeAccel, EmbreeOptions, EmbreeQuality, HybridAccel, HybridOptions, LinearAccel, PacketBvh,
};
use crate::error::Result;
use crate::geometry::Geometry;
use crate::id::ShapeId;

/// Up to this number of analytic shapes, packets beside Embree are mostly faster (`docs/accelerators.md`).
const FEW_BESIDE_EMBREE: usize = 16;

/// With so many triangles, the build of the BVH takes three times as long as Embree's and 1.8 times the memory
/// (`docs/accelerators.md`). Analytic shapes count as well.
const MAX_PRIMS: usize = 2_000_000;

/// An accelerator with its options. Its name, also when serialized, is `KIND` or `KIND:OPTION+OPTION`;
/// [`AccelKind::CHOICES`] lists both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum AccelKind {
    /// [`Packets`](Self::Packets) for scenes of few primitives at rest, [`Hybrid`](Self::Hybrid) or
    /// [`Bvh`](Self::Bvh) for meshes at rest, `Hybrid` where few analytic shapes stand among others, else Embree.
    #[default]
    Auto,
    /// Embree.
    Embree(EmbreeOptions),
    /// The bounding volume hierarchy of this crate.
    Bvh(BvhOptions),
    /// A bounding volume hierarchy for packets of rays.
    Packets,
    /// Embree or the bounding volume hierarchy of this crate, and one for packets of rays over analytic shapes of the
    /// world.
    Hybrid(HybridOptions),
    /// A kd-tree.
    KdTree(KdTreeOptions),
    /// An octree.
    Octree,
    /// Every primitive for every ray: the oracle.
    Linear,
}

impl AccelKind {
    /// Embree with default options.
    pub const EMBREE: Self =
        Self::Embree(EmbreeOptions { quality: EmbreeQuality::Medium, robust: true, compact: false });

    /// Embree with packets for analytic shapes.
    pub const HYBRID: Self = Self::Hybrid(HybridOptions { bvh: false });

    /// The BVH with packets for analytic shapes, floors and walls.
    pub const HYBRID_BVH: Self = Self::Hybrid(HybridOptions { bvh: true });

    /// Every structure with default options, with the name users choose it by.
    pub const ALL: [(Self, &'static str); 7] = [
        (Self::EMBREE, "embree"),
        (Self::Bvh(BvhOptions { binary: false }), "bvh"),
        (Self::KdTree(KdTreeOptions { median: false }), "kdtree"),
        (Self::Octree, "octree"),
        (Self::Linear, "linear"),
        (Self::Packets, "packets"),
        (Self::HYBRID, "hybrid"),
    ];

    /// Every kind and every option, with what it is.
    pub const CHOICES: &'static [(&'static str, &'static str)] = &[
        (
            "auto",
            "packets for at most 40 primitives beside spheres and cylinders, at rest, without holes; without \
             instances and up to 2 million primitives, hybrid:bvh for meshes at rest beside spheres, cylinders, disks \
             and quads; hybrid for at most 16 of these beside others; else embree",
        ),
        ("embree", "Embree: fastest to build, for any scene; build quality medium, robust"),
        ("embree:low", "built faster, traced slower"),
        ("embree:high", "spatial splits: built slower, traced faster"),
        ("embree:fast", "not robust: rays may slip through edges; for comparisons"),
        ("embree:compact", "less memory, traced slower"),
        ("packets", "bounding volume hierarchy traversed by up to 16 rays at once: fastest for few primitives"),
        ("hybrid", "embree, with packets for spheres, cylinders, disks and quads that have no holes"),
        (
            "hybrid:bvh",
            "bvh in place of embree, and packets for floors and walls too, but not for more than 512 shapes (64 beside \
             floors and walls)",
        ),
        ("bvh", "bounding volume hierarchy: binned surface area heuristic, eight boxes a node, SIMD"),
        ("bvh:binary", "two boxes a node, no SIMD"),
        ("kdtree", "kd-tree: surface area heuristic with a bonus for empty space"),
        ("kdtree:median", "split in the middle of the longest axis, as in textbooks"),
        ("octree", "octree"),
        ("linear", "every primitive for every ray: the oracle, slow"),
    ];
}

impl fmt::Display for AccelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, options): (_, Vec<&str>) = match self {
            Self::Embree(o) => {
                let quality = match o.quality {
                    EmbreeQuality::Low => Some("low"),
                    EmbreeQuality::Medium => None,
                    EmbreeQuality::High => Some("high"),
                };
                let flags = [(!o.robust).then_some("fast"), o.compact.then_some("compact")];
                ("embree", quality.into_iter().chain(flags.into_iter().flatten()).collect())
            }
            Self::Auto => ("auto", Vec::new()),
            Self::Packets => ("packets", Vec::new()),
            Self::Hybrid(o) => ("hybrid", o.bvh.then_some("bvh").into_iter().collect()),
            Self::Bvh(o) => {
                let flags = [o.binary.then_some("binary")];
                ("bvh", flags.into_iter().flatten().collect())
            }
            Self::KdTree(o) => ("kdtree", o.median.then_some("median").into_iter().collect()),
            Self::Octree => ("octree", Vec::new()),
            Self::Linear => ("linear", Vec::new()),
        };
        f.write_str(kind)?;
        if !options.is_empty() {
            write!(f, ":{}", options.join("+"))?;
        }
        Ok(())
    }
}

/// Why a name is none of an accelerator.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown accelerator \"{name}\"; use one of {}, with options such as embree:high or embree:low+compact",
    kinds()
)]
pub struct UnknownAccel {
    name: String,
}

fn kinds() -> String {
    format!("auto, {}", AccelKind::ALL.map(|(_, name)| name).join(", "))
}

impl FromStr for AccelKind {
    type Err = UnknownAccel;

    fn from_str(name: &str) -> std::result::Result<Self, UnknownAccel> {
        let unknown = || UnknownAccel { name: name.to_owned() };
        let (kind, options) = name.split_once(':').unwrap_or((name, ""));
        let mut all = Self::ALL.into_iter().chain([(Self::Auto, "auto")]);
        let mut accel = all.find(|(_, n)| *n == kind).ok_or_else(unknown)?.0;
        for option in options.split('+').filter(|_| name.contains(':')) {
            match (&mut accel, option) {
                (Self::Embree(o), "low") => o.quality = EmbreeQuality::Low,
                (Self::Embree(o), "high") => o.quality = EmbreeQuality::High,
                (Self::Embree(o), "fast") => o.robust = false,
                (Self::Embree(o), "compact") => o.compact = true,
                (Self::Bvh(o), "binary") => o.binary = true,
                (Self::Hybrid(o), "bvh") => o.bvh = true,
                (Self::KdTree(o), "median") => o.median = true,
                _ => return Err(unknown()),
            }
        }
        Ok(accel)
    }
}

impl From<AccelKind> for String {
    fn from(kind: AccelKind) -> Self {
        kind.to_string()
    }
}

impl TryFrom<String> for AccelKind {
    type Error = UnknownAccel;

    fn try_from(name: String) -> std::result::Result<Self, UnknownAccel> {
        name.parse()
    }
}

/// Builds an accelerator of the given kind over `geometry` with `threads` threads (0: all).
///
/// # Errors
/// If Embree reports an error, such as a lack of memory.
pub fn build(kind: AccelKind, geometry: &Geometry, threads: usize) -> Result<Box<dyn Accelerator + '_>> {
    Ok(match kind {
        AccelKind::Auto => build(fastest(geometry), geometry, threads)?,
        AccelKind::Embree(options) => Box::new(EmbreeAccel::with_options(geometry, threads, options)?),
        AccelKind::Packets => Box::new(PacketBvh::new(geometry, threads)),
        AccelKind::Hybrid(options) => Box::new(HybridAccel::new(geometry, threads, options)?),
        AccelKind::Bvh(options) => Box::new(TwoLevel::<Bvh>::new(geometry, &options, threads)),
        AccelKind::KdTree(options) => Box::new(TwoLevel::<KdTree>::new(geometry, &options, threads)),
        AccelKind::Octree => Box::new(TwoLevel::<Octree>::new(geometry, &(), threads)),
        AccelKind::Linear => Box::new(LinearAccel::new(geometry)),
    })
}

/// The accelerator that is mostly fastest for `geometry` (`docs/accelerators.md`).
fn fastest(geometry: &Geometry) -> AccelKind {
    if PacketBvh::suits(geometry) {
        return AccelKind::Packets;
    }
    let (in_packets, others): (Vec<ShapeId>, Vec<ShapeId>) =
        geometry.world.iter().partition(|&&id| is_traced_in_packets(geometry, id));
    let in_packets = in_packets.len();
    let triangles: usize = others.iter().map(|&id| geometry.shape(id).prim_count()).sum();
    let bvh = Bvh::is_vectorized()
        && geometry.instances.is_empty()
        && others.iter().all(|&id| is_resting_mesh(geometry.shape(id)))
        && triangles > 0
        && triangles + in_packets <= MAX_PRIMS;
    if bvh || (1..=FEW_BESIDE_EMBREE).contains(&in_packets) {
        AccelKind::Hybrid(HybridOptions { bvh })
    } else {
        AccelKind::EMBREE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_kinds_are_one_to_one() {
        for (name, _) in AccelKind::CHOICES {
            assert_eq!(name.parse::<AccelKind>().unwrap().to_string(), *name);
        }
        for (kind, name) in AccelKind::ALL {
            assert_eq!((kind.to_string().as_str(), name.parse().as_ref()), (name, Ok(&kind)));
        }
        assert_eq!("embree:compact+low".parse::<AccelKind>().unwrap().to_string(), "embree:low+compact");
        assert_eq!(AccelKind::default(), AccelKind::Auto);
    }

    #[test]
    fn other_names_are_refused_with_those_there_are() {
        for name in ["", "embre", "embree:", "embree:hi", "bvh:median", "auto:high", "linear:fast", "octree:"] {
            let error = name.parse::<AccelKind>().unwrap_err().to_string();
            assert!(error.contains("auto, embree, bvh, kdtree, octree, linear, packets, hybrid"), "{error}");
        }
    }
}
