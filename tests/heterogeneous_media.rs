//! Media that differ from place to place, against homogeneous ones and quadratures; distances chosen for lights.

use serde_json::{Value, json};
use steradian::ErrorKind;
use steradian::internal::assets::{VolumeData, vol_bytes};

use crate::bad_input::assert_error;
use crate::participating_media::{self, assert_means, foggy, hg, integral, runs};
use crate::util::folder::{Folder, good_scene, set};
use crate::util::render::{Estimate, assert_blocks_agree, merge, probe, render};

/// A ball of a medium whose box is around it.
fn ball(medium: &Value) -> Value {
    let mut scene = participating_media::ball(medium);
    scene["media"]["cloud"]["volume"]["bounds"] = json!([[-1, -1, -1], [1, 1, 1]]);
    scene
}

fn noise(seed: u32) -> Value {
    json!({ "type": "noise", "resolution": [20, 17, 24], "frequency": [2, 3, 2], "seed": seed, "base": 0.4 })
}

#[test]
fn a_white_furnace_shows_no_cloud() {
    let colors = json!({ "type": "grid", "resolution": [1, 2, 1], "channels": 3, "values": [1, 0.5, 0, 0.2, 1, 3] });
    let mix = json!({
        "type": "mix", "weights": [3, 1],
        "phases": [{ "type": "henyey_greenstein", "g": 0.7 }, { "type": "rayleigh" }]
    });
    for (scattering, phase, volume) in [
        (json!(4), json!({ "type": "henyey_greenstein", "g": 0.5 }), json!({ "density": noise(1) })),
        (json!([0.5, 2, 9]), mix, json!({ "density": noise(2) })),
        (json!([3, 2, 4]), json!({ "type": "isotropic" }), json!({ "density": noise(3), "scattering": colors })),
        (
            json!(5),
            json!({ "type": "isotropic" }),
            json!({ "density": noise(4), "albedo": {
            "type": "grid", "resolution": [1, 1, 1], "values": [1] } }),
        ),
    ] {
        for strategy in ["mis", "light", "bsdf"] {
            let mut scene = ball(&json!({ "scattering": scattering, "phase": phase, "volume": volume }));
            scene["integrator"]["strategy"] = json!(strategy);
            assert_means(&render(&scene), [1.0; 3], &format!("{scattering} {volume} {strategy}"));
        }
        let mut scene = ball(&json!({ "scattering": scattering, "phase": phase, "volume": volume }));
        scene["materials"]["cloud"]["ior"] = json!(1.4);
        assert_means(&render(&scene), [1.0; 3], &format!("{scattering} {volume} in glass"));
    }
}

/// Numbers of voxels along z.
const DENSITY: [f64; 6] = [0.2, 1.5, 0.0, 0.7, 3.0, 0.4];
const EMISSION: [f64; 3] = [0.0, 2.0, 1.0];
const THICKNESS: f64 = 1.5;
const ABSORPTION: [f64; 3] = [0.2, 0.7, 1.5];
const SCATTERING: [f64; 3] = [0.9, 0.3, 0.1];

/// Between the middles of voxels along the unit interval, and beyond them; with empty ones outside or not.
fn interpolated(values: &[f64], x: f64, has_border: bool) -> f64 {
    let at = |i: f64| {
        let outside = i < 0.0 || i >= values.len() as f64;
        if outside && has_border { 0.0 } else { values[i.clamp(0.0, values.len() as f64 - 1.0) as usize] }
    };
    let place = x * values.len() as f64 - 0.5;
    let below = place.floor();
    at(below) + (place - below) * (at(below + 1.0) - at(below))
}

/// A slab between z = 0 and z = 1.5, whose density differs along z, before a white sky.
fn slab(medium: Value, border: &str) -> Value {
    let mut scene = probe(
        [0.1, 0.2, 4.0],
        [0.1, 0.2, 3.0],
        json!({
            "integrator": { "type": "path", "max_depth": 1 },
            "media": { "m": medium },
            "materials": { "m": { "type": "dielectric", "ior": 1, "medium": "m" } },
            "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
        }),
    );
    let grid = |values: &[f64]| json!({ "type": "grid", "resolution": [1, 1, values.len()], "values": values });
    scene["media"]["m"]["volume"] = json!({
        "density": grid(&DENSITY), "emission": grid(&EMISSION),
        // From -20 to 20, then moved: the transform comes after the bounds.
        "bounds": [[-20, 20, -0.75], [20, -20, 0.75]], "transform": { "translate": [0, 0, 0.75] }
    });
    scene["media"]["m"]["volume"]["density"]["border"] = json!(border);
    scene["shapes"] = json!([{
        "type": "cube", "material": "m", "transform": [{ "scale": [30, 30, 3] }, { "translate": [0, 0, 0.75] }]
    }]);
    scene
}

#[test]
fn what_passes_straight_is_the_quadrature() {
    for border in ["clamp", "zero"] {
        // With empty voxels around, the density falls from the middle of the box along x and y, too.
        let across = if border == "zero" { (1.0 - 0.1 / 40.0) * (1.0 - 0.2 / 40.0) } else { 1.0 };
        let depth = across * THICKNESS * integral(|x| interpolated(&DENSITY, x, border == "zero"));
        for scattering in [[0.0; 3], SCATTERING] {
            let mut scene = slab(json!({ "absorption": ABSORPTION, "scattering": scattering }), border);
            let expected = [0, 1, 2].map(|c| (-(ABSORPTION[c] + scattering[c]) * depth).exp());
            assert_means(&render(&scene), expected, border);
            scene["integrator"] = json!({ "type": "whitted", "max_depth": 8 });
            assert_means(&render(&scene), expected, "whitted");
        }
    }
}

#[test]
fn what_a_cloud_emits_is_the_quadrature() {
    for (absorption, scattering) in [(ABSORPTION, [0.0; 3]), (ABSORPTION, SCATTERING), ([0.0; 3], [0.0; 3])] {
        let medium = json!({ "absorption": absorption, "scattering": scattering, "emission": [0.5, 2, 1] });
        let mut scene = slab(medium, "clamp");
        scene["lights"] = json!([]);
        let expected = [0, 1, 2].map(|c| {
            // The camera looks along -z, from the face at z = 1.5. The optical depth by steps, in front of each.
            let (n, extinction) = (20_000, absorption[c] + scattering[c]);
            let (mut depth, mut sum) = (0.0, 0.0);
            for i in (0..n).rev() {
                let x = (f64::from(i) + 0.5) / f64::from(n);
                let step = interpolated(&DENSITY, x, false) * THICKNESS / f64::from(n);
                let emission = [0.5, 2.0, 1.0][c] * interpolated(&EMISSION, x, false);
                sum += emission * step * (-(depth + 0.5 * extinction * step)).exp();
                depth += extinction * step;
            }
            sum
        });
        for (channel, expected) in expected.into_iter().enumerate() {
            let found = Estimate::of(&render(&scene), channel);
            let bound = 5.5 * found.error + 1e-4 * expected;
            assert!((found.mean - expected).abs() < bound, "{absorption:?} {channel}: {found:?} {expected}");
        }
    }
}

/// What black bodies radiate by Planck's law, through the approximation of the CIE 1931 observer by Wyman, Sloan and
/// Shirley ("Simple Analytic Approximations to the CIE XYZ Color Matching Functions"), scaled as Blender's: linear
/// Rec.709 of luminance 1 times Stefan and Boltzmann's power.
fn blackbody(kelvin: f64) -> [f64; 3] {
    let lobe = |x: f64, middle: f64, [below, above]: [f64; 2]| {
        let t = (x - middle) * if x < middle { below } else { above };
        (-0.5 * t * t).exp()
    };
    let mut xyz = [0.0; 3];
    for nanometres in 360..=830 {
        let x = f64::from(nanometres);
        let radiance = x.powi(-5) / (1.438_776_877e7 / (x * kelvin)).exp_m1();
        xyz[0] += radiance
            * (1.056 * lobe(x, 599.8, [0.0264, 0.0323]) + 0.362 * lobe(x, 442.0, [0.0624, 0.0374])
                - 0.065 * lobe(x, 501.1, [0.0490, 0.0382]));
        xyz[1] += radiance * (0.821 * lobe(x, 568.8, [0.0213, 0.0247]) + 0.286 * lobe(x, 530.9, [0.0613, 0.0322]));
        xyz[2] += radiance * (1.217 * lobe(x, 437.0, [0.0845, 0.0278]) + 0.681 * lobe(x, 459.0, [0.0385, 0.0725]));
    }
    let [x, y, z] = xyz.map(|c| c / xyz[1] * 5.670_374_419e-14 * kelvin.powi(4) / std::f64::consts::PI);
    [
        3.240_48 * x - 1.537_15 * y - 0.498_54 * z,
        -0.969_26 * x + 1.876 * y + 0.041_56 * z,
        0.055_65 * x - 0.204_04 * y + 1.057_31 * z,
    ]
}

#[test]
fn what_fire_emits_is_plancks() {
    // From 1,000 to 4,000 K along z.
    let kelvin = [1.0, 2.5, 4.0];
    let mut scene = slab(json!({ "emission": [0.5, 2, 1] }), "clamp");
    scene["lights"] = json!([]);
    let volume = &mut scene["media"]["m"]["volume"];
    volume["temperature"] = json!({ "type": "grid", "resolution": [1, 1, 3], "values": kelvin });
    volume["temperature_scale"] = json!(1000);
    let image = render(&scene);
    let expected = |channel: usize| {
        THICKNESS
            * [0.5, 2.0, 1.0][channel]
            * integral(|x| {
                interpolated(&DENSITY, x, false)
                    * interpolated(&EMISSION, x, false)
                    * blackbody(1000.0 * interpolated(&kelvin, x, false))[channel]
            })
    };
    for channel in 0..3 {
        let (found, expected) = (Estimate::of(&image, channel), expected(channel));
        // The approximation of the observer is within 1 %.
        let bound = 5.5 * found.error + 0.015 * expected;
        assert!((found.mean - expected).abs() < bound, "{channel}: {found:?} {expected}");
    }
}

#[test]
fn a_constant_grid_is_a_homogeneous_medium() {
    let mut scene = foggy(10);
    scene["media"]["smoke"] = json!({ "scattering": [4, 3, 2], "absorption": [0.1, 0.5, 1], "emission": [0, 0, 0.2] });
    let homogeneous = runs(&scene);
    // Half the coefficients times 2; extinction divided by an albedo; factors on the albedo's parts.
    let grid = |values: Value, channels: u32| {
        let resolution = [1; 3];
        json!({ "type": "grid", "resolution": resolution, "channels": channels, "values": values })
    };
    for (medium, volume) in [
        (
            json!({ "scattering": [2, 1.5, 1], "absorption": [0.05, 0.25, 0.5], "emission": [0, 0, 0.1] }),
            json!({ "density": grid(json!([2]), 1) }),
        ),
        (
            json!({ "scattering": [4.1, 3.5, 3], "emission": [0, 0, 0.2] }),
            json!({ "albedo": grid(json!([4.0 / 4.1, 3.0 / 3.5, 2.0 / 3.0]), 3) }),
        ),
        (
            json!({ "scattering": 1, "absorption": 1, "emission": [0, 0, 1] }),
            json!({
                "scattering": grid(json!([4, 3, 2]), 3), "absorption": grid(json!([0.1, 0.5, 1]), 3),
                "emission": grid(json!([0.2]), 1)
            }),
        ),
    ] {
        let mut scene = scene.clone();
        scene["media"]["smoke"] = medium;
        scene["media"]["smoke"]["volume"] = volume;
        scene["media"]["smoke"]["volume"]["bounds"] = json!([[-9, -9, -9], [9, 9, 9]]);
        assert_blocks_agree(&runs(&scene), &homogeneous, &scene["media"]["smoke"].to_string());
    }
}

#[test]
fn light_and_phase_sampling_agree_within_a_cloud() {
    let mut scene = foggy(6);
    scene["lights"] = json!([]);
    let mut of = |strategy: &str, spp: u32| {
        scene["integrator"]["strategy"] = json!(strategy);
        scene["sampler"]["spp"] = json!(spp);
        runs(&scene)
    };
    let light = of("light", 16);
    assert_blocks_agree(&of("mis", 16), &light, "mis");
    assert_blocks_agree(&of("bsdf", 128), &light, "bsdf");
}

#[test]
fn fog_around_a_spot_is_the_quadrature() {
    // The camera in fog looks along -z past a spot 0.8 to the side and 2 ahead, which shines across its way.
    let (side, ahead, cutoff) = (0.8f64, 2.0f64, 50f64.to_radians());
    let axis = [-1.0f64, 0.0, 0.4];
    let scene = probe(
        [0.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
        json!({
            "integrator": { "type": "path", "max_depth": 2 },
            "media": { "fog": {
                "absorption": ABSORPTION, "scattering": SCATTERING, "phase": { "type": "henyey_greenstein", "g": 0.5 }
            } },
            "medium": "fog",
            "lights": [{
                "type": "spot", "position": [side, 0, -ahead], "look_at": [side + axis[0], 0, -ahead + axis[2]],
                "intensity": [2, 2, 2], "cutoff_angle_degrees": 50, "beam_angle_degrees": 0
            }]
        }),
    );
    let expected = [0, 1, 2].map(|c| {
        let extinction = ABSORPTION[c] + SCATTERING[c];
        // t = x / (1 - x).
        integral(|x| {
            if x >= 1.0 {
                return 0.0;
            }
            let t = x / (1.0 - x);
            let toward = [-side, ahead - t];
            let r = toward[0].hypot(toward[1]);
            let cos = (toward[0] * axis[0] + toward[1] * axis[2]) / (r * axis[0].hypot(axis[2]));
            let falloff = ((cutoff - cos.acos()) / cutoff).max(0.0);
            let light = 2.0 * falloff / (r * r) * (-extinction * (r + t)).exp();
            SCATTERING[c] * hg(0.5, (ahead - t) / r) * light / (1.0 - x).powi(2)
        })
    });
    for strategy in ["mis", "light", "bsdf"] {
        let mut scene = scene.clone();
        scene["integrator"]["strategy"] = json!(strategy);
        assert_means(&render(&scene), expected, strategy);
    }
}

#[test]
fn fog_around_an_emitter_is_the_quadrature() {
    // A quad 0.8 above the camera's way, which shines down on it.
    let (height, ahead, half) = (0.8f64, 2.0f64, 0.5f64);
    let scene = probe(
        [0.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
        json!({
            "integrator": { "type": "path", "max_depth": 2 },
            "media": { "fog": {
                "absorption": ABSORPTION, "scattering": SCATTERING, "phase": { "type": "henyey_greenstein", "g": 0.5 }
            } },
            "medium": "fog",
            "shapes": [{
                "type": "quad", "origin": [-half, height, -ahead - half], "edge_u": [2.0 * half, 0, 0],
                "edge_v": [0, 0, 2.0 * half], "emission": { "radiance": [5, 5, 5] }
            }]
        }),
    );
    let n = 40;
    let expected = [0, 1, 2].map(|c| {
        let extinction = ABSORPTION[c] + SCATTERING[c];
        let way = |t: f64| {
            let mut sum = 0.0;
            for i in 0..n * n {
                let middle = |i: i32| half * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0);
                let (x, z) = (middle(i % n), t - ahead + middle(i / n));
                let r = (x * x + height * height + z * z).sqrt();
                let area = (2.0 * half / f64::from(n)).powi(2);
                sum += area * height / r.powi(3) * hg(0.5, -z / r) * (-extinction * r).exp();
            }
            5.0 * SCATTERING[c] * sum * (-extinction * t).exp()
        };
        let steps = 2_000;
        let step = 12.0 / f64::from(steps);
        (0..steps).map(|i| way((f64::from(i) + 0.5) * step) * step).sum::<f64>()
    });
    for strategy in ["mis", "light", "bsdf"] {
        let mut scene = scene.clone();
        scene["integrator"]["strategy"] = json!(strategy);
        let image = render(&scene);
        for (channel, expected) in expected.into_iter().enumerate() {
            let found = Estimate::of(&image, channel);
            // The sums are exact to 1e-4.
            let bound = 5.5 * found.error + 3e-4 * expected;
            assert!((found.mean - expected).abs() < bound, "{strategy} {channel}: {found:?} {expected}");
        }
    }
}

#[test]
fn a_file_is_its_values() {
    let folder = Folder::new();
    let values: Vec<f32> = (0..24u8).map(|i| f32::from(i % 7)).collect();
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    folder.write("a.raw", &bytes);
    let data = VolumeData::new([4, 3, 2], 1, values.clone()).unwrap();
    folder.write("a.vol", vol_bytes(&data));
    let media = |grid: Value| {
        let mut scene = good_scene();
        set(&mut scene, "media.smoke", json!({ "scattering": 1, "volume": { "density": grid } }));
        set(&mut scene, "medium", json!("smoke"));
        folder.compile(&scene).unwrap().media
    };
    let inline = media(json!({ "type": "grid", "resolution": [4, 3, 2], "values": values }));
    assert!(inline == media(json!({ "type": "grid", "file": "a.raw", "resolution": [4, 3, 2] })));
    assert!(inline == media(json!({ "type": "grid", "file": "a.vol" })));
    assert!(inline == media(json!({ "type": "grid", "file": "a.vol", "resolution": [4, 3, 2], "channels": 1 })));
}

#[test]
fn volumes_that_make_no_sense() {
    let at = "media.fog.volume.density";
    let grid = |resolution: Value, values: Value| json!({ "type": "grid", "resolution": resolution, "values": values });
    let flat = json!({ "bounds": [[0, 0, 0], [1, 0, 1]] });
    let squashed = json!({ "transform": { "scale": [1, 1, 0] } });
    let both =
        json!({ "albedo": grid(json!([1, 1, 1]), json!([1])), "scattering": grid(json!([1, 1, 1]), json!([1])) });
    let bright = json!({ "albedo": grid(json!([1, 1, 1]), json!([1.5])) });
    let phases = json!({ "type": "mix", "phases": [{ "type": "rayleigh" }], "weights": [1, 2] });
    let negative = json!({ "type": "mix", "phases": [{ "type": "rayleigh" }], "weights": [-1] });
    let hot = json!({ "emission": 1, "volume": {
        "temperature": grid(json!([1, 1, 1]), json!([60_000])), "temperature_scale": 2 } });
    let lobe = json!({ "type": "rayleigh" });
    let many = json!({ "type": "mix", "phases": [lobe, lobe, lobe, lobe, lobe], "weights": [1, 1, 1, 1, 1] });
    let folder = Folder::new();
    let faults = [
        (at, grid(json!([1, 1, 2]), json!([1])), at, "2 values"),
        (at, grid(json!([0, 1, 1]), json!([])), at, "from 1 to 16384"),
        (at, grid(json!([4_000_000_000u32, 4_000_000_000u32, 2]), json!([1])), at, "from 1 to 16384"),
        (at, grid(json!([1, 1, 1]), json!([-1])), at, "-1"),
        (at, grid(json!([2, 1, 1]), json!([0, 1e30])), at, "voxel [1, 0, 0]"),
        (at, json!({ "type": "grid", "values": [1] }), at, "resolution"),
        (at, json!({ "type": "grid", "resolution": [1, 1, 1] }), at, "either `file` or `values`"),
        (at, json!({ "type": "grid", "resolution": [1, 1, 1], "channels": 3, "values": [1, 1, 1] }), at, "one number"),
        (
            at,
            json!({ "type": "noise", "resolution": [100_000, 100_000, 100_000] }),
            "media.fog.volume.density.resolution",
            "at most",
        ),
        (at, json!({ "type": "noise", "frequency": [0, 1, 1] }), "media.fog.volume.density.frequency[0]", "0"),
        (at, json!({ "type": "noise", "octaves": 99 }), "media.fog.volume.density.octaves", "99"),
        (
            "media.fog.volume.temperature",
            grid(json!([1, 1, 1]), json!([500])),
            "media.fog.volume.temperature",
            "emission",
        ),
        ("media.fog.volume.temperature_scale", json!(2), "media.fog.volume.temperature_scale", "not given"),
        ("media.fog.volume.temperature_scale", json!(0), "media.fog.volume.temperature_scale", "above 0"),
        ("media.fog", hot, "media.fog.volume.temperature", "from 0 to 5e4"),
        ("media.fog.volume", flat, "media.fog.volume.bounds", "flat"),
        ("media.fog.volume", squashed, "media.fog.volume.bounds", "flat"),
        ("media.fog.volume", both, "media.fog.volume.albedo", "together"),
        ("media.fog.volume", bright, "media.fog.volume.albedo", "from 0 to 1"),
        ("media.fog.phase", phases, "media.fog.phase.weights", "each of `phases`"),
        ("media.fog.phase", negative, "media.fog.phase.weights", "-1"),
        ("media.fog.phase", many, "media.fog.phase", "from 1 to 4"),
    ];
    for (path, value, place, word) in faults {
        let mut scene = good_scene();
        set(&mut scene, "media.fog", json!({ "scattering": 1, "volume": {} }));
        set(&mut scene, "medium", json!("fog"));
        folder.compile(&scene).unwrap();
        set(&mut scene, path, value);
        assert_error(&folder, &scene, ErrorKind::Scene, &[&format!("{place}: "), word]);
    }
}

#[test]
fn damaged_volume_files() {
    let folder = Folder::new();
    let data = VolumeData::new([2, 2, 2], 1, vec![1.0, 0.5, 0.25, 0.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
    let good = vol_bytes(&data);
    let scene = |file: &str, more: Value| {
        let mut scene = good_scene();
        let mut grid = json!({ "type": "grid", "file": file });
        merge(&mut grid, more);
        set(&mut scene, "media.smoke", json!({ "scattering": 1, "volume": { "density": grid } }));
        set(&mut scene, "medium", json!("smoke"));
        scene
    };
    let write = |name: &str, bytes: &[u8]| drop(folder.write(name, bytes));
    let place = "media.smoke.volume.density";
    write("short.vol", &good[..good.len() - 1]);
    assert_error(&folder, &scene("short.vol", json!({})), ErrorKind::Scene, &[place, "short.vol", "bytes"]);
    let with = |value: f32| {
        let mut bytes = good.clone();
        let end = bytes.len();
        bytes[end - 4..].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    for value in [f32::NAN, f32::INFINITY, -1.0] {
        write("bad.vol", &with(value));
        let expected = [place, "bad.vol", "voxel [1, 1, 1]"];
        assert_error(&folder, &scene("bad.vol", json!({})), ErrorKind::Scene, &expected);
    }
    let mut huge = good.clone();
    huge[8..20].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f].repeat(3));
    write("huge.vol", &huge);
    assert_error(&folder, &scene("huge.vol", json!({})), ErrorKind::Scene, &[place, "huge.vol", "16384"]);
    write("good.vol", &good);
    folder.compile(&scene("good.vol", json!({}))).unwrap();
    let other = scene("good.vol", json!({ "resolution": [2, 2, 3] }));
    assert_error(&folder, &other, ErrorKind::Scene, &[place, "the scene others"]);
    write("a.raw", &[0; 31]);
    let raw = scene("a.raw", json!({ "resolution": [2, 2, 2] }));
    assert_error(&folder, &raw, ErrorKind::Scene, &[place, "32 bytes", "31"]);
    assert_error(&folder, &scene("gone.vol", json!({})), ErrorKind::AssetMissing, &["gone.vol"]);
    // What is not used is not read.
    let mut unused = scene("gone.vol", json!({}));
    unused.as_object_mut().unwrap().remove("medium");
    folder.compile(&unused).unwrap();
}

#[test]
fn grids_far_away_and_tiny_ones_are_where_they_should_be() {
    // A furnace within a cloud, and what passes straight, do not depend on where and how large everything is.
    for (offset, scale) in [([0.0; 3], 1e-9), ([5e7, 0.0, -5e7], 1.0), ([0.0; 3], 1e12)] {
        let at = |x: [f64; 3]| [0, 1, 2].map(|i| offset[i] + x[i] * scale);
        let mut scene = probe(
            at([0.1, 0.2, 4.0]),
            at([0.1, 0.2, 3.0]),
            json!({
                "integrator": { "type": "path", "max_depth": 1 },
                "media": { "m": { "absorption": 1.0 / scale } },
                "materials": { "m": { "type": "dielectric", "ior": 1, "medium": "m" } },
                "lights": [{ "type": "environment", "radiance": [1, 1, 1] }]
            }),
        );
        scene["media"]["m"]["volume"] = json!({
            "density": { "type": "grid", "resolution": [1, 1, DENSITY.len()], "values": DENSITY },
            "bounds": [at([-1.0, -1.0, 0.0]), at([1.0, 1.0, 1.5])]
        });
        scene["shapes"] = json!([{
            "type": "cube", "material": "m", "transform": [{ "scale": scale }, { "translate": at([0.0, 0.0, 0.75]) }]
        }]);
        let expected = (-THICKNESS * integral(|x| interpolated(&DENSITY, x, false))).exp();
        assert_means(&render(&scene), [expected; 3], &format!("{offset:?} {scale}"));
    }
}
