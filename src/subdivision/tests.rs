//! Limit surfaces against closed forms, finite differences and each other.

use std::collections::HashMap;

use super::*;
use crate::math::Vec3;

fn cage(positions: &[[f64; 3]], faces: &[&[u32]]) -> Cage {
    Cage {
        sizes: faces.iter().map(|face| face.len() as u32).collect(),
        points: faces.concat(),
        vertices: faces.concat(),
        positions: vec![positions.iter().map(|&p| DVec3::from(p)).collect()],
        ..Cage::default()
    }
}

const CUBE_FACES: [&[u32]; 6] =
    [&[0, 2, 3, 1], &[4, 5, 7, 6], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 4, 6, 2], &[1, 3, 7, 5]];

fn cube() -> Cage {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    cage(&(0..8).map(corner).collect::<Vec<_>>(), &CUBE_FACES)
}

fn octahedron() -> Cage {
    let positions = [[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
    let faces: [&[u32]; 8] =
        [&[0, 2, 4], &[2, 1, 4], &[1, 3, 4], &[3, 0, 4], &[2, 0, 5], &[1, 2, 5], &[3, 1, 5], &[0, 3, 5]];
    cage(&positions, &faces)
}

/// An open surface of a triangle, a pentagon and quadrilaterals, out of plane, with a vertex of valence 3 and one of 5.
fn open_cage() -> Cage {
    let mut positions: Vec<[f64; 3]> = Vec::new();
    for y in 0..5 {
        for x in 0..5 {
            let (x, y) = (f64::from(x), f64::from(y));
            positions.push([x, y, (0.9 * x).sin() + 0.4 * (1.3 * y).cos() + 0.1 * x * y]);
        }
    }
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for y in 0..4u32 {
        for x in 0..4u32 {
            let i = 5 * y + x;
            match (x, y) {
                (1, 1) => faces.extend([vec![i, i + 1, i + 6], vec![i, i + 6, i + 5]]),
                (2, 2) => faces.push(vec![i, i + 1, i + 2, i + 6, i + 5]),
                (3, 2) => faces.push(vec![i + 1, i + 6, i + 5]),
                _ => faces.push(vec![i, i + 1, i + 6, i + 5]),
            }
        }
    }
    cage(&positions, &faces.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

fn triangulated(cage: &Cage) -> Cage {
    let (mut triangles, mut rest) = (Vec::new(), cage.points.as_slice());
    for &size in &cage.sizes {
        let (face, others) = rest.split_at(size as usize);
        triangles.extend((2..face.len()).flat_map(|i| [face[0], face[i - 1], face[i]]));
        rest = others;
    }
    Cage { sizes: vec![3; triangles.len() / 3], points: triangles.clone(), vertices: triangles, ..cage.clone() }
}

fn how(scheme: Scheme, levels: u32) -> Refinement<'static> {
    Refinement { scheme, uv_rule: UvRule::SmoothInside, levels, is_too_long: None, max_triangles: u64::MAX }
}

fn distance(refined: &Refined, p: [f64; 3]) -> f32 {
    let p = DVec3::from(p).as_vec3();
    refined.positions[0].iter().map(|&q| (Vec3::from(q) - p).length()).fold(f32::INFINITY, f32::min)
}

#[track_caller]
fn assert_has(refined: &Refined, p: [f64; 3]) {
    let distance = distance(refined, p);
    assert!(distance < 1e-6, "{p:?}: {distance}");
}

/// Edges by their points, with how often triangles have them in each direction.
fn edge_uses(refined: &Refined) -> HashMap<[u32; 2], [u32; 2]> {
    let mut uses: HashMap<[u32; 2], [u32; 2]> = HashMap::new();
    for triangle in &refined.triangles {
        let points = triangle.map(|vertex| refined.points[vertex as usize]);
        for i in 0..3 {
            let (a, b) = (points[i], points[(i + 1) % 3]);
            uses.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
        }
    }
    uses
}

/// Vertices minus edges plus faces; every edge has a triangle on each side, but those of borders.
#[track_caller]
fn euler_characteristic(refined: &Refined, borders: bool) -> i64 {
    let uses = edge_uses(refined);
    for (edge, uses) in &uses {
        assert!(*uses == [1, 1] || borders && (*uses == [1, 0] || *uses == [0, 1]), "{edge:?}: {uses:?}");
    }
    let mut points = refined.points.clone();
    points.sort_unstable();
    points.dedup();
    points.len() as i64 - uses.len() as i64 + refined.triangles.len() as i64
}

#[test]
fn a_cube_has_the_limit_of_its_masks() {
    for levels in [1, 2, 4] {
        let refined = refine(cube(), &how(Scheme::CatmullClark, levels));
        assert_eq!(refined.triangles.len() as u64, triangle_count(Scheme::CatmullClark, 24, 6, levels));
        // (9 v + 4 sum of e + sum of f) / 24 of a corner with three neighbours, whose sum is v, and -v across faces.
        assert_has(&refined, [0.5; 3]);
        // Of the first level's points: (16 * 1 + 4 * 4 * 3/4 + 4 * 5/9) / 36.
        assert_has(&refined, [272.0 / 324.0, 0.0, 0.0]);
        assert_eq!(euler_characteristic(&refined, false), 2);
        for (p, n) in refined.positions[0].iter().zip(&refined.normals[0]) {
            let (p, n) = (Vec3::from(*p), Vec3::from(*n));
            assert!(p.normalize().dot(n) > 0.93 && (n.length() - 1.0).abs() < 1e-6, "{p} {n}");
        }
    }
}

#[test]
fn an_octahedron_has_the_limit_of_its_masks() {
    for (scheme, beta) in [(Scheme::Loop, (0.625 - 0.375f64.powi(2)) / 4.0), (Scheme::LoopWarren, 3.0 / 32.0)] {
        for levels in [0, 1, 3] {
            let refined = refine(octahedron(), &how(scheme, levels));
            assert_eq!(refined.triangles.len(), 8 << (2 * levels));
            assert_has(&refined, [0.0, 1.0 - 4.0 / (4.0 + 3.0 / (8.0 * beta)), 0.0]);
            assert_eq!(euler_characteristic(&refined, false), 2);
        }
    }
}

#[test]
fn borders_are_curves_or_corners() {
    let square = cage(&[[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]], &[&[0, 1, 2, 3]]);
    let smooth = refine(square.clone(), &how(Scheme::CatmullClark, 3));
    assert_has(&smooth, [2.0 / 3.0, 2.0 / 3.0, 0.0]);
    let sharp = refine(Cage { sharp_border_corners: true, ..square }, &how(Scheme::CatmullClark, 3));
    assert_has(&sharp, [1.0, 1.0, 0.0]);
    for refined in [smooth, sharp] {
        assert_eq!(euler_characteristic(&refined, true), 1);
        assert!(refined.normals[0].iter().all(|n| n[2] > 1.0 - 1e-6), "{:?}", refined.normals[0]);
    }
}

#[test]
fn creases_that_stay_sharp_are_straight_and_have_two_normals() {
    let mut sharp = cube();
    let top = [[1, 3], [3, 7], [5, 7], [1, 5]];
    sharp.creases.extend(top.map(|edge| (edge, SHARP)));
    sharp.corners.extend([1, 3, 5, 7].map(|point| (point, SHARP)));
    let refined = refine(sharp, &how(Scheme::CatmullClark, 3));
    assert_has(&refined, [1.0; 3]);
    for i in 0..8 {
        let along = f64::from(i) / 4.0 - 1.0;
        assert_has(&refined, [1.0, along, 1.0]);
    }
    let at_edge = |p: &[f32; 3]| (p[0] - 1.0).abs() < 1e-6 && (p[2] - 1.0).abs() < 1e-6 && p[1].abs() < 0.9;
    let normals: Vec<Vec3> = refined.positions[0]
        .iter()
        .zip(&refined.normals[0])
        .filter(|(p, _)| at_edge(p))
        .map(|(_, n)| Vec3::from(*n))
        .collect();
    assert_eq!(normals.len(), 14);
    assert_eq!(normals.iter().filter(|n| (n.x - 1.0).abs() < 1e-6).count(), 7, "{normals:?}");
    assert_eq!(euler_characteristic(&refined, false), 2);
}

#[test]
fn a_semi_sharp_crease_is_between_smooth_and_sharp() {
    let corner = |sharpness: f32| {
        let mut cage = cube();
        cage.corners.extend((0..8).map(|point| (point, sharpness)));
        distance(&refine(cage, &how(Scheme::CatmullClark, 5)), [1.0; 3])
    };
    let distances = [0.0, 0.3, 1.0, 1.5, 3.0, 10.0].map(corner);
    assert!(distances.windows(2).all(|pair| pair[1] < pair[0]), "{distances:?}");
    assert!(distances[0] > 0.86 && distances[5] == 0.0);
}

/// The mean square and the largest angle between limit normals and the mean of the facets around the vertex.
fn facet_errors(refined: &Refined) -> [f32; 2] {
    let mut sums: HashMap<u32, Vec3> = HashMap::new();
    for triangle in &refined.triangles {
        let [a, b, c] = triangle.map(|vertex| Vec3::from(refined.positions[0][vertex as usize]));
        let n = (b - a).cross(c - a);
        triangle.iter().for_each(|&v| *sums.entry(refined.smooth[v as usize]).or_default() += n);
    }
    let angle = |(n, smooth): (&[f32; 3], &u32)| Vec3::from(*n).angle_between(sums[smooth]);
    let angles: Vec<f32> = refined.normals[0].iter().zip(&refined.smooth).map(angle).collect();
    let square = angles.iter().map(|angle| angle * angle).sum::<f32>() / angles.len() as f32;
    [square, angles.into_iter().fold(0.0, f32::max)]
}

/// The open cage with a crease from border to border.
fn creased_cage() -> Cage {
    let mut cage = open_cage();
    cage.creases.extend([[2, 7], [7, 12], [12, 17], [17, 22]].map(|edge| (edge, SHARP)));
    cage
}

#[test]
fn normals_agree_with_finite_differences() {
    let sharp = Cage { sharp_border_corners: true, ..creased_cage() };
    for cage in [cube(), creased_cage(), sharp] {
        let quads = [3, 5].map(|levels| facet_errors(&refine(cage.clone(), &how(Scheme::CatmullClark, levels))));
        let triangles = [3, 5].map(|levels| facet_errors(&refine(triangulated(&cage), &how(Scheme::Loop, levels))));
        for [coarse, fine] in [quads, triangles] {
            // The planes of facets approach with the length of edges, more slowly at irregular vertices.
            assert!(fine[0] < 0.1 * coarse[0] && fine[1] < 0.06 && fine[1] < coarse[1], "{coarse:?} {fine:?}");
        }
    }
}

#[test]
fn faces_refined_by_their_edges_join_without_cracks() {
    let is_too_long = |a: DVec3, b: DVec3| (a - b).length() > 0.02 + 0.35 * (0.5 * (a + b) - DVec3::ONE).length();
    for (cage, borders, characteristic) in [(cube(), false, 2), (creased_cage(), true, 1)] {
        for scheme in [Scheme::CatmullClark, Scheme::Loop] {
            let cage = if scheme == Scheme::Loop { triangulated(&cage) } else { cage.clone() };
            let adaptive = Refinement { is_too_long: Some(&is_too_long), ..how(scheme, 7) };
            let refined = refine(cage.clone(), &adaptive);
            assert_eq!(euler_characteristic(&refined, borders), characteristic);
            // Its vertices are those of uniform refinement.
            let all = refine(cage.clone(), &how(scheme, 7));
            assert!(refined.triangles.len() * 4 < all.triangles.len());
            let grid = |p: &[f32; 3]| p.map(|x| (f64::from(x) * 1e4).round() as i64);
            let mut known: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
            all.positions[0].iter().enumerate().for_each(|(i, p)| known.entry(grid(p)).or_default().push(i));
            let mut turned = 0;
            for (p, n) in refined.positions[0].iter().zip(&refined.normals[0]) {
                let [x, y, z] = grid(p);
                let cells = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
                let near: Vec<usize> = cells
                    .flat_map(|[i, j, k]| known.get(&[x + i, y + j, z + k]).into_iter().flatten().copied())
                    .filter(|&i| (Vec3::from(all.positions[0][i]) - Vec3::from(*p)).length() < 2e-6)
                    .collect();
                assert!(!near.is_empty(), "{scheme:?}: {p:?}");
                let is_same = |&i: &usize| Vec3::from(all.normals[0][i]).dot(Vec3::from(*n)) > 1.0 - 1e-5;
                turned += usize::from(!near.iter().any(is_same));
            }
            // Where the crease ends at borders, normals are means of faces.
            assert!(turned <= 4, "{turned}");
            let most = refined.triangles.len() / 2;
            let few = refine(cage, &Refinement { max_triangles: most as u64, ..adaptive });
            assert!(few.is_cut_short && !refined.is_cut_short);
            // Triangles for the vertices of finer neighbours are not counted before.
            assert!(few.triangles.len() < most + most / 4, "{} {most}", few.triangles.len());
        }
    }
}

#[test]
fn uv_are_linear_or_smooth_inside_of_charts() {
    let mut grid = cage(
        &(0..9).map(|i| [f64::from(i % 3), f64::from(i / 3), 0.0]).collect::<Vec<_>>(),
        &[&[0, 1, 4, 3], &[1, 2, 5, 4], &[3, 4, 7, 6], &[4, 5, 8, 7]],
    );
    let mut uvs = grid.positions[0].clone();
    uvs[4] = DVec3::new(1.5, 1.0, 0.0);
    grid.uvs = Some(uvs);
    grid.linear = vec![(0..9).map(|i| DVec3::splat(f64::from(i))).collect()];
    let linear = refine(grid.clone(), &Refinement { uv_rule: UvRule::Linear, ..how(Scheme::CatmullClark, 2) });
    let smooth = refine(grid, &how(Scheme::CatmullClark, 2));
    let find = |refined: &Refined, uv: [f32; 2]| refined.uvs.as_ref().unwrap().iter().position(|&known| known == uv);
    for refined in [&linear, &smooth] {
        for i in 0..9 {
            let border = i as f32 / 4.0;
            assert!(find(refined, [border, 0.0]).is_some() && find(refined, [2.0, border]).is_some());
        }
        // A quarter along the edge from vertex 0 to vertex 1.
        let at = find(refined, [0.25, 0.0]).unwrap();
        assert_eq!(refined.linear[0][at], [0.25; 3]);
    }
    assert!(find(&linear, [1.5, 1.0]).is_some() && find(&smooth, [1.5, 1.0]).is_none());
    assert!(find(&linear, [1.25, 0.5]).is_some(), "the middle of the edge from [1, 0] to [1.5, 1]");
}

#[test]
fn charts_and_deformation_share_the_surface() {
    let mut once = cube();
    once.positions.push(once.positions[0].iter().map(|p| *p * DVec3::new(1.0, 2.0, 3.0)).collect());
    // Every face its own chart.
    once.vertices = (0..24).collect();
    once.uvs =
        Some((0..24).map(|i| DVec3::new(f64::from(i % 4 / 2), f64::from(i / 4 + (i + 1) % 4 / 2), 0.0)).collect());
    let both = refine(once.clone(), &how(Scheme::CatmullClark, 2));
    assert_eq!((both.triangles.len(), both.positions.len()), (192, 2));
    assert_eq!(euler_characteristic(&both, false), 2);
    assert!(both.positions[0].len() > refine(cube(), &how(Scheme::CatmullClark, 2)).positions[0].len());
    for (p, q) in both.positions[0].iter().zip(&both.positions[1]) {
        let stretched = Vec3::from(*p) * Vec3::new(1.0, 2.0, 3.0);
        assert!((stretched - Vec3::from(*q)).length() < 1e-6);
    }
    let mut faces = vec![0; 6];
    both.faces.iter().for_each(|&face| faces[face as usize] += 1);
    assert_eq!(faces, [32; 6]);
}

#[test]
fn what_is_no_surface_becomes_sharp() {
    let positions: Vec<[f64; 3]> =
        vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [2., 1., 0.], [2., -1., 0.]];
    for (faces, irregular) in [
        // Three faces at an edge; two that are wound differently; two that meet in a point.
        (vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]], 1),
        (vec![[0, 1, 2], [0, 1, 3]], 1),
        (vec![[0, 1, 2], [1, 5, 6]], 0),
    ] {
        let faces: Vec<&[u32]> = faces.iter().map(<[u32; 3]>::as_slice).collect();
        for scheme in [Scheme::CatmullClark, Scheme::Loop] {
            let refined = refine(cage(&positions, &faces), &how(scheme, 2));
            assert_eq!(refined.irregular_edges, irregular);
            assert!(refined.positions[0].as_flattened().iter().all(|x| x.is_finite()));
            if irregular == 0 {
                assert_has(&refined, [1.0, 0.0, 0.0]);
            }
        }
    }
}

#[test]
fn counts_do_not_overflow() {
    assert_eq!(triangle_count(Scheme::CatmullClark, 24, 6, 0), 48);
    assert_eq!(triangle_count(Scheme::Loop, 24, 8, 2), 128);
    assert_eq!(triangle_count(Scheme::Loop, 3 << 40, 1 << 40, 40), u64::MAX);
}
