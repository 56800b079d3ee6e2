//! What is done with bytes that claim to be a file: they are read as one, and what comes out is looked at. Used by the
//! fuzz targets and by the test that replays their corpus.

use std::collections::HashSet;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use steradian::internal::assets;
use steradian::internal::assets::{GridChoice, MeshData};
use steradian::internal::bsdf::Measured;
use steradian::internal::config::{self, Trust};
use steradian::internal::geometry::{CurveBasis, CurveKind, Curves, Strands};
use steradian::internal::import::{self, ImportOptions};
use steradian::internal::math::{Vec3, vec3};
use steradian::internal::render::RenderProvenance;

/// The most grids of a volume file that are read, and the most bytes of their voxels: a cube of one value takes few
/// bytes of a file.
const MOST_GRIDS: usize = 4;
const MOST_VOXEL_BYTES: usize = 1 << 21;

/// Reads `data` as a file of `kind`, which is the name of a target, in `folder`, which only this caller writes to.
/// Malformed files are errors; anything else is a finding.
pub fn read(kind: &str, data: &[u8], folder: &Path) {
    let write = |name: &str, data: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, data).expect("the folder can be written");
        path
    };
    match kind {
        "scene_json" => {
            if let Ok(text) = std::str::from_utf8(data) {
                let _ = import::parse_scene(text, Path::new("scene.json"));
            }
        }
        "obj" => {
            // Behind a zero byte stands the MTL.
            let cut = data.iter().position(|&byte| byte == 0).unwrap_or(data.len());
            let (obj, mtl) = data.split_at(cut);
            write("m.mtl", mtl.get(1..).unwrap_or_default());
            if let Ok(meshes) = assets::read_obj(&write("m.obj", obj), true) {
                meshes.iter().for_each(|mesh| look_at(&mesh.mesh));
            }
        }
        "ply" => {
            if let Ok(mesh) = assets::read_ply(&write("m.ply", data)) {
                look_at(&mesh);
            }
        }
        "strands" => {
            if let Ok(strands) = assets::read_strands(&write("s.txt", data)) {
                let total: u64 = strands.counts.iter().map(|&count| u64::from(count)).sum();
                let strands = Strands { points: strands.points, counts: strands.counts };
                for basis in [CurveBasis::Linear, CurveBasis::Bezier, CurveBasis::BSpline, CurveBasis::CatmullRom] {
                    if let Ok(curves) = Curves::new(strands.clone(), basis, CurveKind::Round) {
                        assert!(curves.point_count() as u64 == total && curves.prim_count() > 0);
                    }
                }
            }
        }
        "image" => {
            for name in ["i.png", "i.tga"] {
                if let Ok(image) = assets::read_image(&write(name, data)) {
                    assert!(image.width > 0 && image.height > 0 && (1..=4).contains(&image.channels));
                }
            }
            let extension = if data.starts_with(b"P") { "pfm" } else { "hdr" };
            let _ = assets::read_rgb_image(&write(&format!("i.{extension}"), data));
        }
        "volume" => {
            let path = write("v.vol", data);
            let header = assets::read_vol_header(&path);
            if let Ok(volume) = assets::read_vol(&path) {
                let header = header.expect("the header was read");
                assert_eq!((header.resolution, header.channels), (volume.resolution, volume.channels));
                let voxels: usize = volume.resolution.iter().map(|&edge| edge as usize).product();
                assert_eq!(volume.values.len(), voxels * volume.channels as usize);
                assert_eq!(assets::vol_bytes(&volume).len(), data.len());
            }
            let _ = assets::read_raw_volume(&path, [2, 2, 2], 1);
        }
        "vdb" => {
            let path = write("v.vdb", data);
            let listed = assets::list_vdb(&path).unwrap_or_default();
            let names = listed.iter().take(MOST_GRIDS).map(|(name, _)| Some(name.as_str()));
            for name in names.chain([None]) {
                let choice = GridChoice { name, default: "density" };
                let Ok(grid) = assets::read_vdb_within(&path, choice, MOST_VOXEL_BYTES) else { continue };
                assert!(!listed.is_empty() && grid.world_from_voxels.is_finite());
                let voxels: usize = grid.voxels.resolution.iter().map(|&edge| edge as usize).product();
                assert_eq!(grid.voxels.values.len(), voxels * grid.voxels.channels as usize);
            }
        }
        "measured" => {
            if let Ok(data) = assets::read_measured(&write("m.bsdf", data)) {
                let measured = Measured::new(data);
                for wo in [Vec3::Z, vec3(0.6, 0.0, 0.8), vec3(-0.48, -0.64, -0.6)] {
                    assert!(measured.albedo(wo).to_array().iter().all(|c| !c.is_nan()));
                    for u in [[0.0, 0.0], [0.3, 0.8], [0.5, 0.5], [0.99, 0.999]] {
                        let Some(sample) = measured.sample(wo, 0.5, u) else { continue };
                        let eval = measured.eval(wo, sample.wi);
                        assert!(eval.pdf > 0.0 && eval.pdf == sample.pdf, "{eval:?} {sample:?}");
                        assert!(eval.value.to_array().iter().all(|c| c.is_finite() && *c >= 0.0), "{eval:?}");
                    }
                }
            }
        }
        "mitsuba_xml" => read_scene(&write("s.xml", data)),
        "pbrt" => read_scene(&write("s.pbrt", data)),
        "gltf" => {
            let name = if data.starts_with(b"glTF") { "s.glb" } else { "s.gltf" };
            read_scene(&write(name, data));
        }
        "recipe" => {
            let file = Path::new("a.exr");
            if let Some(recipe) =
                serde_json::from_slice(data).ok().and_then(|value| RenderProvenance::from_value(value, file).ok())
            {
                let value = recipe.to_value();
                let again = RenderProvenance::from_value(value.clone(), file).expect("what was taken is taken again");
                assert_eq!(again.to_value(), value);
                let settings = recipe.settings(1);
                assert!(settings.crop.fits(settings.film_size()) && settings.spp > 0 && settings.threads == 1);
            }
        }
        "config" => {
            let file = write("steradian.toml", data);
            let owner = file.metadata().expect("the file was written").uid();
            for trust in [Trust::Project, Trust::User] {
                let Ok(entries) = config::read(&file, trust, owner) else { continue };
                let entries = entries.expect("the file belongs to its owner");
                let keys: HashSet<&str> = entries.iter().map(|entry| entry.key.as_str()).collect();
                assert_eq!(keys.len(), entries.len());
                assert!(entries.is_sorted_by_key(|entry| entry.line));
                assert!(trust == Trust::User || keys.iter().all(|key| config::trust(key) != Some(Trust::User)));
            }
        }
        _ => panic!("no kind {kind}"),
    }
}

fn read_scene(path: &Path) {
    if let Ok(imported) = import::read_scene(path, &ImportOptions::default()) {
        let _ = imported.report.summary();
        imported.assets.meshes.values().for_each(look_at);
    }
}

/// Every buffer has the length that the reader requests.
fn look_at(mesh: &MeshData) {
    let count = mesh.positions.len();
    assert!(mesh.normals.as_ref().is_none_or(|normals| normals.len() == count));
    assert!(mesh.uvs.as_ref().is_none_or(|uvs| uvs.len() == count));
    let corners = if mesh.faces.is_empty() {
        3 * mesh.triangles.len()
    } else {
        mesh.faces.iter().map(|&size| size as usize).sum()
    };
    assert_eq!(mesh.face_corners().len(), corners);
}
