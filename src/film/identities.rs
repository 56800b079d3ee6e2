//! What things in a picture are called: for layers that pick objects, materials and assets.

use std::borrow::Cow;
use std::num::NonZeroU32;

use serde::{Deserialize, Serialize};

use super::ShapeKey;

/// No number.
const NONE: u32 = u32::MAX;

/// What the shapes of a scene are called, by [`ShapeKey`]. A few numbers for each shape and instance; names that are
/// made of another one and a number are put together when they are requested. Things with the same name count as one.
///
/// - The object of a shape is the instance that places it, or the shape itself. An instance within another is named
///   after both, `outer/inner`.
/// - Its asset is the object that the outermost instance places, else the file that the shape comes from, else the
///   shape.
///
/// A medium is its own object, material and asset. What else has no name is called after its kind, its file or its
/// object, with the place in its list: `sphere_3`, `bunny_0`, `tree_17`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identities {
    names: Vec<Box<str>>,
    /// By shape.
    shapes: Vec<ShapeIdentity>,
    placements: Vec<Placement>,
    /// By instance of the geometry: its placement. None for those of shapes that move by themselves.
    placement_of: Vec<Option<PlacementId>>,
    /// By medium: its name, if it has one.
    media: Vec<Option<NameId>>,
}

/// A name of the table, or one with a number behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    name: NameId,
    /// [`NONE`] without.
    number: u32,
}

/// A name of the table, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NameId(NonZeroU32);

/// A placement of an object, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlacementId(NonZeroU32);

/// What a shape is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShapeIdentity {
    /// Its own name.
    pub label: Label,
    /// Its material's.
    pub material: NameId,
    /// That of the file it comes from, if any.
    pub asset: Option<NameId>,
    /// The placement that it belongs to although it stands in the world.
    pub placement: Option<PlacementId>,
}

/// What an instance is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Placement {
    label: Label,
    /// Around it; none in the world.
    parent: Option<PlacementId>,
    /// The object that the outermost placement has.
    asset: NameId,
}

impl Label {
    /// A name alone.
    pub fn plain(name: NameId) -> Self {
        Self { name, number: NONE }
    }

    /// A name and a number, joined by an underscore.
    pub fn numbered(name: NameId, number: u32) -> Self {
        Self { name, number }
    }
}

impl Identities {
    /// Adds a name to the table; who calls sees to it that none is there twice.
    pub fn add_name(&mut self, name: &str) -> NameId {
        self.names.push(name.into());
        NameId(last_of(self.names.len()))
    }

    /// Adds the next shape of the geometry.
    pub fn add_shape(&mut self, shape: ShapeIdentity) {
        self.shapes.push(shape);
    }

    /// Adds a placement of the object named `asset`, within another or in the world.
    pub fn add_placement(&mut self, label: Label, parent: Option<PlacementId>, asset: NameId) -> PlacementId {
        let asset = parent.and_then(|parent| self.get(parent)).map_or(asset, |parent| parent.asset);
        self.placements.push(Placement { label, parent, asset });
        PlacementId(last_of(self.placements.len()))
    }

    /// Adds the next instance of the geometry; one without a placement is called after its shape.
    pub fn add_instance(&mut self, placement: Option<PlacementId>) {
        self.placement_of.push(placement);
    }

    /// Adds the next medium, called as the scene names it, if it does.
    pub fn add_medium(&mut self, name: Option<NameId>) {
        self.media.push(name);
    }

    /// What the object is called that a shape belongs to; empty for a key that does not exist.
    pub fn object(&self, key: ShapeKey) -> Cow<'_, str> {
        match (self.placement(key), self.shape(key)) {
            (Some(placement), _) => self.placement_name(placement),
            (None, Some(shape)) => self.label(shape.label),
            (None, None) => Cow::Borrowed(self.medium(key)),
        }
    }

    /// What a shape's material is called; empty for a key that does not exist.
    pub fn material(&self, key: ShapeKey) -> &str {
        self.shape(key).map_or_else(|| self.medium(key), |shape| self.name(shape.material))
    }

    /// What the asset is called that a shape belongs to; empty for a key that does not exist.
    pub fn asset(&self, key: ShapeKey) -> Cow<'_, str> {
        match (self.placement(key), self.shape(key)) {
            (Some(placement), _) => Cow::Borrowed(self.name(placement.asset)),
            (None, Some(ShapeIdentity { asset: Some(asset), .. })) => Cow::Borrowed(self.name(*asset)),
            (None, Some(shape)) => self.label(shape.label),
            (None, None) => Cow::Borrowed(self.medium(key)),
        }
    }

    /// Whether every placement comes after the one around it, as those of scenes do: none is around itself.
    pub fn is_ordered(&self) -> bool {
        let comes_before =
            |(i, placement): (usize, &Placement)| placement.parent.is_none_or(|parent| parent.0.get() as usize <= i);
        self.placements.iter().enumerate().all(comes_before)
    }

    /// Number of shapes.
    pub fn shapes(&self) -> u32 {
        self.shapes.len() as u32
    }

    /// Number of instances.
    pub fn instances(&self) -> u32 {
        self.placement_of.len() as u32
    }

    /// Number of media.
    pub fn media(&self) -> u32 {
        self.media.len() as u32
    }

    /// Bytes of the tables.
    pub fn memory_bytes(&self) -> usize {
        let names: usize = self.names.iter().map(|name| size_of_val(name) + name.len()).sum();
        let placements = size_of_val(&self.placements[..]) + size_of_val(&self.placement_of[..]);
        names + size_of_val(&self.shapes[..]) + placements + size_of_val(&self.media[..])
    }

    fn shape(&self, key: ShapeKey) -> Option<&ShapeIdentity> {
        self.shapes.get(key.shape as usize).filter(|_| key.instance != ShapeKey::MEDIUM)
    }

    /// What a medium is called; empty for any other key.
    fn medium(&self, key: ShapeKey) -> &str {
        let name = self.media.get(key.shape as usize).filter(|_| key.instance == ShapeKey::MEDIUM);
        name.copied().flatten().map_or("", |name| self.name(name))
    }

    fn placement(&self, key: ShapeKey) -> Option<&Placement> {
        let of_instance = self.placement_of.get(key.instance as usize).copied().flatten();
        self.get(of_instance.or_else(|| self.shape(key)?.placement)?)
    }

    fn get(&self, placement: PlacementId) -> Option<&Placement> {
        self.placements.get(placement.0.get() as usize - 1)
    }

    fn name(&self, name: NameId) -> &str {
        self.names.get(name.0.get() as usize - 1).map_or("", |name| name)
    }

    fn label(&self, label: Label) -> Cow<'_, str> {
        let name = self.name(label.name);
        if label.number == NONE { Cow::Borrowed(name) } else { Cow::Owned(format!("{name}_{}", label.number)) }
    }

    fn placement_name(&self, placement: &Placement) -> Cow<'_, str> {
        let own = self.label(placement.label);
        match placement.parent.and_then(|parent| self.get(parent)) {
            None => own,
            Some(parent) => Cow::Owned(format!("{}/{own}", self.placement_name(parent))),
        }
    }
}

/// The largest id of `count` things, counted from 1.
fn last_of(count: usize) -> NonZeroU32 {
    NonZeroU32::new(count as u32).unwrap_or(NonZeroU32::MIN)
}
