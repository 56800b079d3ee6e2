//! Which objects contain which: unknown names and cycles are found before anything is placed, and how much will be
//! placed is counted.

use std::collections::HashMap;

use super::CompileContext;
use crate::desc::{InstanceDesc, SceneDesc};
use crate::error::Result;

/// More instances than memory holds are rejected before they are made.
const MAX_PLACED: u64 = 1 << 24;

/// Objects are nested at most this deep.
const MAX_DEPTH: usize = 64;

/// What one placement of an object comes to.
#[derive(Clone, Copy)]
struct Extent {
    /// Groups and emitters placed, those of objects inside counted.
    placed: u64,
    /// Levels of objects, this one counted.
    depth: usize,
}

/// All objects of a scene, checked.
pub struct Nesting<'a> {
    extents: HashMap<&'a str, Extent>,
}

impl<'a> Nesting<'a> {
    /// Checks every object, used or not.
    pub fn new(files: &CompileContext, desc: &'a SceneDesc) -> Result<Self> {
        let mut nesting = Self { extents: HashMap::new() };
        let mut placed = 0u64;
        for (i, instance) in desc.instances.iter().enumerate() {
            let extent = nesting.visit_instance(files, desc, &format!("instances[{i}]"), instance, &mut Vec::new())?;
            placed = placed.saturating_add(extent.placed);
        }
        if placed > MAX_PLACED {
            return Err(
                files.error("instances", format!("with those inside of objects they are more than {MAX_PLACED}"))
            );
        }
        for name in desc.objects.keys() {
            nesting.visit(files, desc, name, &format!("objects.{name}"), &mut Vec::new())?;
        }
        Ok(nesting)
    }

    /// Whether neither the object nor those inside of it have any shape.
    pub fn is_empty(&self, name: &str) -> bool {
        self.extents.get(name).is_none_or(|extent| extent.placed == 0)
    }

    fn visit_instance(
        &mut self,
        files: &CompileContext,
        desc: &'a SceneDesc,
        path: &str,
        instance: &'a InstanceDesc,
        inside: &mut Vec<&'a str>,
    ) -> Result<Extent> {
        let place = format!("{path}.object");
        if !desc.objects.contains_key(&instance.object) {
            return Err(files.unknown(&place, "object", &instance.object, desc.objects.keys().map(String::as_str)));
        }
        self.visit(files, desc, &instance.object, &place, inside)
    }

    /// The extent of the object `name`; `inside` are the objects that lead here.
    fn visit(
        &mut self,
        files: &CompileContext,
        desc: &'a SceneDesc,
        name: &'a str,
        path: &str,
        inside: &mut Vec<&'a str>,
    ) -> Result<Extent> {
        if let Some(extent) = self.extents.get(name) {
            return Ok(*extent);
        }
        if let Some(start) = inside.iter().position(|other| *other == name) {
            let cycle = [&inside[start..], &[name]].concat().join(" > ");
            return Err(files.error(path, format!("objects contain each other in a cycle: {cycle}")));
        }
        inside.push(name);
        let mut extent = Extent { placed: 0, depth: 1 };
        if let Some(object) = desc.objects.get(name) {
            let emitters = object.shapes.iter().filter(|shape| shape.common().emission.is_some()).count();
            extent.placed = emitters as u64 + u64::from(emitters < object.shapes.len());
            for (i, instance) in object.instances.iter().enumerate() {
                let path = format!("objects.{name}.instances[{i}]");
                let inner = if inside.len() < MAX_DEPTH {
                    self.visit_instance(files, desc, &path, instance, inside)?
                } else {
                    Extent { placed: 0, depth: MAX_DEPTH }
                };
                extent.placed = extent.placed.saturating_add(inner.placed);
                extent.depth = extent.depth.max(inner.depth + 1);
                if extent.depth > MAX_DEPTH {
                    return Err(files.error(&path, format!("objects are nested more than {MAX_DEPTH} deep")));
                }
            }
        }
        inside.pop();
        self.extents.insert(name, extent);
        Ok(extent)
    }
}
