//! Transform directives.

use super::tokens::{Lexer, Position, TokenKind};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3};

/// A transform directive with its numbers: what it makes of the current transform.
#[derive(Clone, Copy, Debug)]
pub enum Change {
    /// Acts before the current transform.
    Concatenate(DAffine3),
    /// Takes the place of the current transform.
    Replace(DAffine3),
}

/// Reads the numbers of a transform directive; `None` if it is none.
pub fn read(lexer: &mut Lexer, at: Position, directive: &str) -> Result<Option<Change>> {
    Ok(Some(match directive {
        "Identity" => Change::Replace(DAffine3::IDENTITY),
        "Translate" => Change::Concatenate(DAffine3::from_translation(DVec3::from(numbers(lexer, at)?))),
        "Scale" => Change::Concatenate(DAffine3::from_scale(DVec3::from(numbers(lexer, at)?))),
        "Rotate" => {
            let [degrees, x, y, z] = numbers(lexer, at)?;
            let axis = DVec3::new(x, y, z).try_normalize();
            let axis = axis.ok_or_else(|| lexer.error(at, "Rotate: the axis has no direction"))?;
            Change::Concatenate(DAffine3::from_axis_angle(axis, degrees.to_radians()))
        }
        "LookAt" => Change::Concatenate(look_at(lexer, at)?),
        "Transform" | "ConcatTransform" => {
            let m: [f64; 16] = numbers(lexer, at)?;
            let map = affine(&m)
                .ok_or_else(|| lexer.error(at, format!("{directive}: the last row of the matrix must be 0 0 0 1")))?;
            if directive == "Transform" { Change::Replace(map) } else { Change::Concatenate(map) }
        }
        _ => return Ok(None),
    }))
}

/// A fixed number of numbers, in brackets or without.
fn numbers<const N: usize>(lexer: &mut Lexer, at: Position) -> Result<[f64; N]> {
    let open = lexer.peek()?.is_some_and(|token| token.kind == TokenKind::Open);
    if open {
        lexer.take()?;
    }
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        let token = lexer.take()?.filter(|token| token.kind == TokenKind::Word);
        let token = token.ok_or_else(|| lexer.error(at, format!("expected {N} numbers")))?;
        let text = lexer.text(&token);
        *number = match text.parse::<f64>() {
            Ok(number) if number.is_finite() => number,
            _ => return Err(lexer.error(token.at, format!("expected a finite number, not {text}"))),
        };
    }
    if open {
        let token = lexer.take()?;
        if token.is_none_or(|token| token.kind != TokenKind::Close) {
            return Err(lexer.error(at, format!("expected {N} numbers and ]")));
        }
    }
    Ok(numbers)
}

/// World to a camera at the first point that looks at the second, z forward.
fn look_at(lexer: &mut Lexer, at: Position) -> Result<DAffine3> {
    let n: [f64; 9] = numbers(lexer, at)?;
    let [from, to, up] = [0, 3, 6].map(|i| DVec3::new(n[i], n[i + 1], n[i + 2]));
    let forward =
        (to - from).try_normalize().ok_or_else(|| lexer.error(at, "LookAt: looks at the very point it stands on"))?;
    let right = up.normalize_or_zero().cross(forward);
    if right.length() < 1e-12 {
        return Err(lexer.error(at, "LookAt: the up vector is parallel to the view direction"));
    }
    let right = right.normalize();
    let world_from_camera =
        DAffine3 { matrix3: DMat3::from_cols(right, forward.cross(right), forward), translation: from };
    Ok(world_from_camera.inverse())
}

/// A matrix by columns; `None` if it is not affine.
fn affine(m: &[f64; 16]) -> Option<DAffine3> {
    let w = m[15];
    if m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || w == 0.0 {
        return None;
    }
    let column = |i: usize| DVec3::new(m[i], m[i + 1], m[i + 2]) / w;
    Some(DAffine3 { matrix3: DMat3::from_cols(column(0), column(4), column(8)), translation: column(12) })
}
