//! Named groups of lights.

use crate::id::{LightGroupId, LightId};

/// Light groups by name: the contribution of each to the picture can be stored as an AOV.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightGroups {
    names: Vec<String>,
    /// By light, [`NO_GROUP`] for those in none; empty if there are no groups at all.
    of_light: Vec<u32>,
}

/// The entry of a light in no group.
const NO_GROUP: u32 = u32::MAX;

impl LightGroups {
    /// What the lights in no group are called together; a group of this name is theirs.
    pub const OF_THE_REST: &str = "default";

    /// Groups by [`LightGroupId`], and the group of each light.
    pub fn new(names: Vec<String>, of_light: impl ExactSizeIterator<Item = Option<LightGroupId>>) -> Self {
        let of_light =
            if names.is_empty() { Vec::new() } else { of_light.map(|id| id.map_or(NO_GROUP, |id| id.0)).collect() };
        Self { names, of_light }
    }

    /// Names, by [`LightGroupId`].
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The group of a light, if it is in one.
    #[inline]
    pub fn of(&self, light: LightId) -> Option<LightGroupId> {
        self.of_light.get(light.index()).copied().filter(|&id| id != NO_GROUP).map(LightGroupId)
    }
}
