//! Makes the textures of `scenes/`, and a ring with uv that wears two of them.
//!
//! `cargo xtask make_textures` overwrites them, byte for byte the same.

use std::f32::consts::{PI, TAU};
use std::fmt::Write;
use std::fs;

use glam::{Vec2 as V2, Vec3 as V, vec2, vec3};
use image::{GrayImage, Luma, Rgb, RgbImage, Rgba, RgbaImage};

use crate::{Outcome, root};

pub fn run() -> Outcome {
    let scenes = root().join("scenes");
    let textures = scenes.join("textures");
    fs::create_dir_all(&textures)?;
    picture(512, 256, globe).save(textures.join("globe.png"))?;
    picture(256, 256, |uv| bricks(uv).color).save(textures.join("bricks.png"))?;
    normals(256, 256, 0.04, |uv| bricks(uv).height).save(textures.join("bricks_normal.png"))?;
    picture(256, 256, floor).save(textures.join("floor.png"))?;
    picture(256, 256, glaze).save(textures.join("glaze.png"))?;
    heights(256, 256, hammered).save(textures.join("hammered_height.png"))?;
    cut_out(&picture(128, 128, |uv| leaf(uv).color), |uv| leaf(uv).height).save(textures.join("leaf.png"))?;
    picture(256, 64, |uv| rope(uv).color).save(textures.join("rope.png"))?;
    normals(256, 64, 0.1, |uv| rope(uv).height).save(textures.join("rope_normal.png"))?;
    cut_out(&picture(128, 128, |uv| blossom(uv).color), |uv| blossom(uv).height).save(textures.join("blossom.png"))?;
    normals(256, 256, 0.02, waves).save(textures.join("waves_normal.png"))?;
    fs::write(scenes.join("meshes/ring.obj"), ring(72, 20))?;
    fs::write(
        scenes.join("meshes/ring.mtl"),
        "newmtl rope\nKd 1 1 1\nmap_Kd ../textures/rope.png\nnorm ../textures/rope_normal.png\n",
    )?;
    Ok(())
}

/// A surface with colour and relief.
struct NormalPerturbation {
    /// Linear colour.
    color: V,
    /// From 0 to 1.
    height: f32,
}

/// The uv of a pixel's middle; rows run from the top, v from the bottom.
fn uv_of(x: u32, y: u32, width: u32, height: u32) -> V2 {
    vec2((x as f32 + 0.5) / width as f32, 1.0 - (y as f32 + 0.5) / height as f32)
}

/// A picture of linear colours, encoded as sRGB.
fn picture(width: u32, height: u32, color: impl Fn(V2) -> V) -> RgbImage {
    let encode = |x: f32| {
        let x = x.clamp(0.0, 1.0);
        let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
        // Sixty-four steps are enough here, and pack better.
        ((encoded * 63.0).round() * (255.0 / 63.0)).round() as u8
    };
    RgbImage::from_fn(width, height, |x, y| Rgb(color(uv_of(x, y, width, height)).to_array().map(encode)))
}

fn heights(width: u32, height: u32, of: impl Fn(V2) -> f32) -> GrayImage {
    GrayImage::from_fn(width, height, |x, y| {
        Luma([(of(uv_of(x, y, width, height)).clamp(0.0, 1.0) * 255.0).round() as u8])
    })
}

/// A picture with an alpha from 0 to 1.
fn cut_out(picture: &RgbImage, alpha: impl Fn(V2) -> f32) -> RgbaImage {
    let (width, height) = picture.dimensions();
    RgbaImage::from_fn(width, height, |x, y| {
        let Rgb([r, g, b]) = *picture.get_pixel(x, y);
        Rgba([r, g, b, (alpha(uv_of(x, y, width, height)).clamp(0.0, 1.0) * 255.0).round() as u8])
    })
}

/// The normals of a field of heights that repeats; `scale` is a height of 1 over the width of the picture.
fn normals(width: u32, height: u32, scale: f32, of: impl Fn(V2) -> f32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let uv = uv_of(x, y, width, height);
        let (du, dv) = (vec2(0.5 / width as f32, 0.0), vec2(0.0, 0.5 / height as f32));
        let slope_u = (of(uv + du) - of(uv - du)) / (2.0 * du.x);
        let slope_v = (of(uv + dv) - of(uv - dv)) / (2.0 * dv.y) * width as f32 / height as f32;
        let n = vec3(-scale * slope_u, -scale * slope_v, 1.0).normalize();
        Rgb((n * 127.5 + 127.5).to_array().map(|c| c.round() as u8))
    })
}

fn hash(x: i32, y: i32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b9) ^ (y as u32).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    ((h ^ (h >> 16)) >> 8) as f32 / 16_777_216.0
}

/// Smooth noise from 0 to 1 that repeats after `period` cells.
fn noise(p: V2, period: [i32; 2]) -> f32 {
    let (x, y) = (p.x.floor(), p.y.floor());
    let at = |i: i32, j: i32| hash((x as i32 + i).rem_euclid(period[0]), (y as i32 + j).rem_euclid(period[1]));
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (s, t) = (smooth(p.x - x), smooth(p.y - y));
    (at(0, 0) * (1.0 - s) + at(1, 0) * s) * (1.0 - t) + (at(0, 1) * (1.0 - s) + at(1, 1) * s) * t
}

/// Noise of several sizes from 0 to 1, for uv that repeat.
fn layers(uv: V2, cells: [i32; 2], count: u32) -> f32 {
    let mut sum = 0.0;
    for i in 0..count {
        let period = cells.map(|c| c << i);
        sum += noise(uv * vec2(period[0] as f32, period[1] as f32), period) * 0.5f32.powi(i as i32 + 1);
    }
    sum / (1.0 - 0.5f32.powi(count as i32))
}

/// An invented planet in latitude and longitude, with a line every 30 degrees.
fn globe(uv: V2) -> V {
    let latitude = PI * (uv.y - 0.5);
    let land = layers(uv, [6, 3], 5) + 0.12 * (3.0 * latitude).cos();
    let ice = (latitude.abs() - 1.15 + 0.4 * layers(uv, [8, 4], 3)).max(0.0);
    let lines = (uv.x * 12.0).fract().min(1.0 - (uv.x * 12.0).fract()) * latitude.cos() * 12.0 / 6.0;
    let circles = ((uv.y * 6.0).fract()).min(1.0 - (uv.y * 6.0).fract()) * 2.0;
    let color = if land > 0.56 {
        vec3(0.16, 0.28, 0.07).lerp(vec3(0.45, 0.33, 0.16), ((land - 0.56) * 6.0).min(1.0))
    } else {
        vec3(0.03, 0.11, 0.32).lerp(vec3(0.05, 0.30, 0.42), (land * 1.8).powi(4).min(1.0))
    };
    let color = if ice > 0.2 { V::splat(0.85) } else { color };
    if lines.min(circles) < 0.06 { color * 0.55 } else { color }
}

/// A brick wall, four courses high and two bricks wide.
fn bricks(uv: V2) -> NormalPerturbation {
    let row = (uv.y * 4.0).floor();
    let column = uv.x * 2.0 + 0.5 * row.rem_euclid(2.0);
    let (x, y) = (column.rem_euclid(1.0), (uv.y * 4.0).rem_euclid(1.0));
    // Distance to the joint, in quarters of the picture.
    let edge = (x.min(1.0 - x) * 2.0).min(y.min(1.0 - y)) - 0.05;
    let rough = layers(uv, [16, 16], 3);
    let tone = hash(column.floor().rem_euclid(2.0) as i32, row.rem_euclid(4.0) as i32 + 7);
    let brick = vec3(0.42, 0.13, 0.08).lerp(vec3(0.55, 0.25, 0.14), tone) * (0.7 + 0.5 * rough);
    let mortar = vec3(0.45, 0.43, 0.40) * (0.8 + 0.3 * rough);
    let rise = (edge / 0.08).clamp(0.0, 1.0);
    let rise = rise * rise * (3.0 - 2.0 * rise);
    NormalPerturbation {
        color: if edge > 0.0 { brick } else { mortar },
        height: rise * (0.8 + 0.2 * rough) + 0.1 * (1.0 - rise) * rough,
    }
}

/// Square tiles in two tones with joints.
fn floor(uv: V2) -> V {
    let cell = uv * 2.0;
    let (x, y) = (cell.x.fract(), cell.y.fract());
    let veins = (layers(uv, [4, 4], 5) - 0.5).abs();
    if x.min(1.0 - x).min(y.min(1.0 - y)) < 0.012 {
        return V::splat(0.08);
    }
    let light = (cell.x.floor() + cell.y.floor()).rem_euclid(2.0) < 1.0;
    let base = if light { vec3(0.62, 0.58, 0.50) } else { vec3(0.20, 0.24, 0.24) };
    base * (0.72 + 0.35 * (1.0 - (-12.0 * veins).exp()))
}

/// A vase: v runs from its foot to its rim.
fn glaze(uv: V2) -> V {
    let clay = vec3(0.60, 0.32, 0.18) * (0.85 + 0.3 * layers(uv, [8, 8], 4));
    let dark = vec3(0.05, 0.04, 0.05);
    let drip = 0.62 + 0.06 * (TAU * 8.0 * uv.x).sin() + 0.03 * (TAU * 13.0 * uv.x).sin();
    if uv.y > drip {
        return vec3(0.05, 0.20, 0.30).lerp(vec3(0.15, 0.42, 0.45), layers(uv, [6, 12], 3));
    }
    // A key pattern: the steps of a spiral in each of sixteen cells.
    let (x, y) = ((uv.x * 16.0).fract(), (uv.y - 0.40) / 0.12);
    let is_key = (0.0..1.0).contains(&y) && {
        let (i, j) = ((x * 6.0) as usize, (y * 6.0) as usize);
        [b"######", b"#    #", b"# ## #", b"# #  #", b"# ####", b"#     "][5 - j][i] == b'#'
    };
    let is_line = [0.36, 0.56, 0.12].iter().any(|line| (uv.y - line).abs() < 0.008);
    if is_key || is_line { dark } else { clay }
}

/// Round dents of a hammer.
fn hammered(uv: V2) -> f32 {
    let n = 12;
    let p = uv * n as f32;
    let mut height: f32 = 1.0;
    for i in -1..=1 {
        for j in -1..=1 {
            let (x, y) = (p.x.floor() as i32 + i, p.y.floor() as i32 + j);
            let (a, b) = (x.rem_euclid(n), y.rem_euclid(n));
            let middle = vec2(x as f32 + 0.2 + 0.6 * hash(a, b), y as f32 + 0.2 + 0.6 * hash(a + 50, b));
            let d = (p - middle).length() / (0.75 + 0.3 * hash(a, b + 50));
            height = height.min(0.15 + 0.85 * d * d);
        }
    }
    height
}

/// A leaf on its stalk; its height is 1 inside and falls to 0 over a few pixels outside.
fn leaf(uv: V2) -> NormalPerturbation {
    let (x, y) = ((uv.x - 0.5).abs(), (uv.y - 0.14) / 0.82);
    let teeth = 1.0 + 0.06 * (TAU * 9.0 * y).sin();
    let width = if (0.0..1.0).contains(&y) { 0.34 * (PI * y.powf(0.75)).sin() * teeth } else { 0.0 };
    let stalk = if uv.y < 0.2 { 0.016 } else { 0.0 };
    let veins = ((y - 1.4 * x) * 9.0).rem_euclid(1.0);
    let is_vein = x < 0.011 || veins.min(1.0 - veins) < 0.07;
    let tone = 0.8 + 0.4 * layers(uv, [8, 8], 3);
    let color = if is_vein { vec3(0.30, 0.40, 0.10) } else { vec3(0.10, 0.28, 0.04) } * tone;
    NormalPerturbation { color, height: ((width.max(stalk) - x) * 64.0).clamp(0.0, 1.0) }
}

/// Five blossoms of five petals; their height is 1 inside and falls to 0 over a few pixels outside.
fn blossom(uv: V2) -> NormalPerturbation {
    let mut out = NormalPerturbation { color: vec3(0.75, 0.50, 0.55), height: 0.0 };
    for (i, middle) in [vec2(0.27, 0.30), vec2(0.72, 0.26), vec2(0.50, 0.52), vec2(0.26, 0.74), vec2(0.74, 0.73)]
        .into_iter()
        .enumerate()
    {
        let p = uv - middle;
        let angle = p.y.atan2(p.x) + i as f32;
        let distance = p.length() / 0.235;
        let edge = 0.62 + 0.38 * (2.5 * angle).cos().abs().sqrt();
        if distance < edge + 0.07 {
            let heart = (1.0 - distance / 0.32).clamp(0.0, 1.0);
            let shade = 0.85 + 0.15 * (2.5 * angle).cos().abs();
            out.color = (vec3(0.80, 0.60, 0.64).lerp(vec3(0.62, 0.16, 0.25), heart)) * shade;
            out.height = ((edge - distance) * 15.0 + 0.5).clamp(out.height, 1.0);
        }
    }
    out
}

/// Ripples of a wind along u: sines that repeat, of lengths from a half to a fortieth of the picture.
fn waves(uv: V2) -> f32 {
    let mut height = 0.0;
    for i in 0..56 {
        let (a, b) = (hash(i, 901), hash(i, 902));
        let count = (2.0 * 20f32.powf(i as f32 / 55.0)).round();
        let turned = TAU * 0.33 * (a - 0.5);
        let (m, n) = ((count * turned.cos()).round(), (count * turned.sin()).round());
        height += (TAU * (m * uv.x + n * uv.y + b)).sin() / count.powf(1.3);
    }
    height
}

/// Three twisted strands.
fn rope(uv: V2) -> NormalPerturbation {
    let across = (uv.y * 3.0 + uv.x * 12.0).fract() - 0.5;
    let height = (1.0 - (2.0 * across).powi(2)).max(0.0).sqrt();
    let fibres = 0.5 + 0.5 * (TAU * (uv.x * 36.0 - uv.y * 12.0)).sin();
    let tone = vec3(0.55, 0.40, 0.20) * (0.45 + 0.55 * height) * (0.85 + 0.15 * fibres);
    NormalPerturbation { color: tone, height: 0.92 * height + 0.08 * fibres * height }
}

/// A ring about +y with uv and normals: u once around, v once around the tube.
fn ring(around: usize, tube: usize) -> String {
    let mut text = String::from("mtllib ring.mtl\nusemtl rope\n");
    for i in 0..=around {
        for j in 0..=tube {
            let (u, v) = (i as f32 / around as f32, j as f32 / tube as f32);
            let (outward, angle) = (vec3((TAU * u).sin(), 0.0, (TAU * u).cos()), TAU * v);
            let n = outward * -angle.cos() + V::Y * angle.sin();
            let p = outward * 0.42 + n * 0.13 + V::Y * 0.13;
            let _ = writeln!(
                text,
                "v {:.4} {:.4} {:.4}\nvt {u:.4} {v:.4}\nvn {:.3} {:.3} {:.3}",
                p.x, p.y, p.z, n.x, n.y, n.z
            );
        }
    }
    let index = |i: usize, j: usize| i * (tube + 1) + j + 1;
    for i in 0..around {
        for j in 0..tube {
            let corners = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
            let _ = writeln!(text, "f {}", corners.map(|c| format!("{c}/{c}/{c}")).join(" "));
        }
    }
    text
}
