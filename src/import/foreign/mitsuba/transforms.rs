//! `<transform>`: its steps act in the order written.

use roxmltree::Node;

use super::values::{self, Fault};
use crate::error::{Error, Result};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::suggestion::did_you_mean;

const STEPS: [&str; 5] = ["translate", "rotate", "scale", "lookat", "matrix"];

/// Reads an attribute.
type Read<'a> = &'a mut dyn FnMut(Node, &str) -> Result<Option<String>>;

/// Makes an error at an element.
type Fail<'a> = &'a dyn Fn(Node, String) -> Error;

/// The map of a `<transform>`.
pub fn compose(node: Node, read: Read, fail: Fail) -> Result<DAffine3> {
    let mut map = DAffine3::IDENTITY;
    for child in node.children().filter(Node::is_element) {
        map = step(child, read, fail)? * map;
    }
    Ok(map)
}

fn step(node: Node, read: Read, fail: Fail) -> Result<DAffine3> {
    let at = |message: Fault| fail(node, message);
    Ok(match node.tag_name().name() {
        "translate" => DAffine3::from_translation(vector(node, 0.0, read, fail)?.into()),
        "scale" => {
            let [x, y, z] = vector(node, 1.0, read, fail)?;
            DAffine3 { matrix3: DMat3::from_diagonal([x, y, z].into()), translation: DVec3::ZERO }
        }
        "rotate" => {
            let angle = read(node, "angle")?.ok_or_else(|| at("<rotate> needs the attribute \"angle\"".into()))?;
            let axis = vector(node, 0.0, read, fail)?;
            values::rotation(axis.into(), values::number(&angle).map_err(at)?).map_err(at)?
        }
        "lookat" | "lookAt" => {
            let mut point = |name: &str| {
                read(node, name)?.map(|text| values::vector(&text).map(DVec3::from).map_err(at)).transpose()
            };
            let needed = |point: Option<DVec3>, name: &str| {
                point.ok_or_else(|| at(format!("<lookat> needs the attribute \"{name}\"")))
            };
            let (origin, target, up) =
                (needed(point("origin")?, "origin")?, needed(point("target")?, "target")?, point("up")?);
            values::look_at(origin, target, up).map_err(at)?
        }
        "matrix" => {
            let text = read(node, "value")?.ok_or_else(|| at("<matrix> needs the attribute \"value\"".into()))?;
            values::matrix(&text).map_err(at)?
        }
        other => {
            let hint = did_you_mean(other, STEPS, ["<", ">"]);
            return Err(at(format!("unknown step <{other}> of a transform{hint}")));
        }
    })
}

/// `value`, or `x`, `y` and `z`, where `other` replaces those that are not given.
pub fn vector(node: Node, other: f64, read: Read, fail: Fail) -> Result<[f64; 3]> {
    let at = |message: Fault| fail(node, message);
    if let Some(text) = read(node, "value")? {
        return values::vector(&text).map_err(at);
    }
    let mut vector = [other; 3];
    for (value, name) in vector.iter_mut().zip(["x", "y", "z"]) {
        if let Some(text) = read(node, name)? {
            *value = values::number(&text).map_err(at)?;
        }
    }
    Ok(vector)
}
