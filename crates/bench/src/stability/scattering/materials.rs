//! BSDFs of every kind, and directions to look at them from.

use crate::bsdf::{
    Beckmann, Bsdf, Coat, Coated, Conductor, Dielectric, DiffuseTransmission, Eon, Glossy, Lambert, Mirror, Phong,
    Plastic, Principled, PrincipledParameters, SeparableGgx, SingleScatteringBsdf, ThinDielectric,
};
use crate::color::Rgb;
use crate::math::{Vec3, sin_cos_turns, vec3};

/// A BSDF with its name.
#[derive(Clone, Debug)]
pub struct Material {
    pub name: String,
    pub bsdf: Bsdf,
    /// Index of refraction of the inside over that of the outside.
    pub ior: f32,
}

impl Material {
    fn new(name: impl Into<String>, bsdf: Bsdf) -> Self {
        Self { name: name.into(), bsdf, ior: 1.0 }
    }
}

/// Alphas from sharp to fully rough, one of them anisotropic.
pub const ALPHAS: [[f32; 2]; 5] = [[0.05; 2], [0.125; 2], [0.3, 0.15], [0.5; 2], [1.0; 2]];

/// Coats: smooth, rough, anisotropic.
const COATS: [[f32; 2]; 3] = [[0.0; 2], [0.3; 2], [0.1, 0.4]];

const COLOR: Rgb = Rgb { r: 0.8, g: 0.4, b: 0.1 };
const TINT: Rgb = Rgb { r: 0.9, g: 0.5, b: 0.0 };

/// A direction by its cosine and azimuth in turns; negative cosines look at the inside.
pub fn direction(cos: f32, turns: f32) -> Vec3 {
    let sin = ((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt();
    let (y, x) = sin_cos_turns(turns);
    vec3(sin * x, sin * y, cos)
}

pub fn gold(alpha: [f32; 2]) -> Bsdf {
    Bsdf::Conductor(Conductor::new(Rgb::new(0.18, 0.42, 1.37), Rgb::new(3.42, 2.35, 1.77), alpha, Rgb::WHITE))
}

/// A metal that reflects all.
pub fn white_metal(alpha: [f32; 2]) -> Conductor {
    Conductor::new(Rgb::BLACK, Rgb::WHITE, alpha, Rgb::WHITE)
}

pub fn glass(ior: f32, alpha: [f32; 2]) -> Material {
    Material { ior, ..Material::new(format!("glass {ior} {alpha:?}"), Bsdf::Dielectric(Dielectric::new(ior, alpha))) }
}

fn coated(ior: f32, alpha: [f32; 2], tint: Rgb, base: Bsdf) -> Bsdf {
    Bsdf::Coated(Coated::new(Coat::new(ior, alpha), tint, base).into())
}

fn principled(parameters: &PrincipledParameters) -> Bsdf {
    Bsdf::Principled(Principled::new(parameters))
}

/// Opaque bases of every kind for a coat; the last is smooth.
fn bases(color: Rgb) -> Vec<Material> {
    let coat =
        PrincipledParameters { base_color: color, clearcoat: 1.0, sheen: 0.5, ..PrincipledParameters::default() };
    let half = color * 0.5;
    vec![
        Material::new("lambert", Bsdf::Lambert(Lambert { albedo: color })),
        Material::new("eon", Bsdf::Eon(Eon { albedo: color, roughness: 0.8 })),
        Material::new("glossy", Bsdf::Glossy(Glossy::new(half, half, half, 0.2))),
        Material::new("metal", Bsdf::Conductor(white_metal([0.4; 2]).with_surface([0.4; 2], color))),
        Material::new("plastic", Bsdf::Plastic(Plastic::new(color, 1.5, [0.0; 2]))),
        Material::new("principled", principled(&coat)),
        Material::new("coated", coated(1.3, [0.1; 2], color, Bsdf::Lambert(Lambert { albedo: color }))),
        Material::new("mirror", Bsdf::Mirror(Mirror { reflectance: color })),
    ]
}

/// Coats over every base; each with one coat of its own, over a diffuse base and a mirror with all.
pub fn coats(color: Rgb, tint: Rgb) -> Vec<Material> {
    let mut list = Vec::new();
    for (i, base) in bases(color).into_iter().enumerate() {
        let all = ["lambert", "mirror"].contains(&base.name.as_str());
        for (k, alpha) in COATS.into_iter().enumerate().filter(|(k, _)| all || i % COATS.len() == *k) {
            list.push(Material::new(
                format!("coat {alpha:?} over {}", base.name),
                coated(1.5 + 0.1 * k as f32, alpha, tint, base.bsdf.clone()),
            ));
        }
    }
    list
}

/// Principled materials: inner points of the space of parameters, coloured.
fn blends() -> Vec<Material> {
    let plain = PrincipledParameters { base_color: COLOR, ..PrincipledParameters::default() };
    let cloth = PrincipledParameters { sheen: 0.5, clearcoat: 0.6, clearcoat_gloss: 0.3, ..plain };
    let list = [
        ("plain", plain),
        ("coated cloth", cloth),
        ("half metal", PrincipledParameters { metallic: 0.5, anisotropic: 0.7, specular_tint: 1.0, ..cloth }),
        ("flat", PrincipledParameters { subsurface: 0.8, roughness: 0.9, ..cloth }),
        ("half glass", PrincipledParameters { transmission: 0.5, roughness: 0.4, ..cloth }),
        ("glass", PrincipledParameters { transmission: 1.0, ..plain }),
        ("sheet", PrincipledParameters { thin: true, transmission: 0.5, diffuse_transmission: 0.3, ..cloth }),
        ("all", PrincipledParameters { metallic: 0.3, transmission: 0.4, anisotropic: 0.5, subsurface: 0.5, ..cloth }),
    ];
    let material = |(name, p): (&str, PrincipledParameters)| {
        let ior = if p.transmission > 0.0 && !p.thin { p.ior } else { 1.0 };
        Material { ior, ..Material::new(format!("principled {name}"), principled(&p)) }
    };
    list.into_iter().map(material).collect()
}

/// Metal and glass of other distributions of facets, which lose what is scattered several times.
pub fn single_scattering() -> Vec<Material> {
    let (eta, k) = (Rgb::new(0.18, 0.42, 1.37), Rgb::new(3.42, 2.35, 1.77));
    let gold = || Conductor::new(eta, k, [0.0; 2], Rgb::WHITE);
    let of = |alpha: [f32; 2]| {
        let metal = gold().with_facets(Beckmann::new(alpha), Rgb::WHITE);
        let separable = gold().with_facets(SeparableGgx::new(alpha), Rgb::WHITE);
        let glass = Dielectric::with_facets(1.5, alpha, Beckmann::new);
        [
            Material::new(format!("Beckmann gold {alpha:?}"), Bsdf::Beckmann(SingleScatteringBsdf::Conductor(metal))),
            Material::new(
                format!("separable gold {alpha:?}"),
                Bsdf::SeparableGgx(SingleScatteringBsdf::Conductor(separable)),
            ),
            Material {
                ior: 1.5,
                ..Material::new(
                    format!("Beckmann glass {alpha:?}"),
                    Bsdf::Beckmann(SingleScatteringBsdf::Dielectric(glass)),
                )
            },
        ]
    };
    [[0.125; 2], [0.3, 0.15], [0.5; 2]].into_iter().flat_map(of).collect()
}

/// Coloured materials of every kind that has a density.
pub fn rough() -> Vec<Material> {
    let eon = |roughness| Bsdf::Eon(Eon { albedo: COLOR, roughness });
    let torrance =
        |alpha| Bsdf::Glossy(Glossy::new(Rgb::new(0.4, 0.2, 0.1), Rgb::new(0.3, 0.18, 0.06), Rgb::splat(0.6), alpha));
    let phong = |exponent| Bsdf::Glossy(Glossy::phong(Rgb::new(0.6, 0.3, 0.2), Rgb::splat(0.4), exponent));
    let cosine = |exponent| Bsdf::Phong(Phong::new(Rgb::new(0.6, 0.3, 0.2), Rgb::splat(0.4), exponent));
    let leaf = DiffuseTransmission::new(Rgb::new(0.3, 0.5, 0.1), Rgb::new(0.6, 0.5, 0.2));
    let plastic = |alpha| Bsdf::Plastic(Plastic::new(Rgb::new(0.1, 0.2, 0.7), 1.5, alpha));
    let mut list = vec![
        Material::new("lambert", Bsdf::Lambert(Lambert { albedo: COLOR })),
        Material::new("eon 0.05", eon(0.05)),
        Material::new("eon 0.5", eon(0.5)),
        Material::new("eon 1", eon(1.0)),
        Material::new("leaf", Bsdf::DiffuseTransmission(leaf)),
        Material::new("cook-torrance 0.1", torrance(0.1)),
        Material::new("cook-torrance 0.6", torrance(0.6)),
        Material::new("phong 40", phong(40.0)),
        Material::new("phong 0", phong(0.0)),
        Material::new("cosine lobe 0", cosine(0.0)),
        Material::new("cosine lobe 40", cosine(40.0)),
        Material::new("plastic, smooth", plastic([0.0; 2])),
        Material::new("metal, once", Bsdf::Conductor(white_metal([0.5; 2]).single_scattering())),
        Material {
            ior: 1.5,
            ..Material::new("glass, once", Bsdf::Dielectric(Dielectric::new(1.5, [0.5; 2]).single_scattering()))
        },
    ];
    for alpha in ALPHAS {
        list.push(Material::new(format!("gold {alpha:?}"), gold(alpha)));
        list.push(Material::new(format!("plastic {alpha:?}"), plastic(alpha)));
        list.push(glass(1.5, alpha));
        list.push(glass(0.8, alpha));
    }
    list.extend(coats(COLOR, TINT).into_iter().filter(|material| !material.bsdf.flags().is_delta()));
    list.extend(blends());
    list
}

/// What scatters into single directions only.
pub fn smooth() -> Vec<Material> {
    vec![
        Material::new("mirror", Bsdf::Mirror(Mirror { reflectance: COLOR })),
        Material::new("gold, smooth", gold([0.0; 2])),
        glass(1.5, [0.0; 2]),
        Material::new("pane", Bsdf::ThinDielectric(ThinDielectric::new(1.5))),
    ]
}

/// White materials of every kind, which absorb nothing of their own accord.
pub fn white() -> Vec<Material> {
    let glossy = |alpha| Bsdf::Glossy(Glossy::new(Rgb::splat(0.4), Rgb::splat(0.3), Rgb::splat(0.6), alpha));
    let leaf = DiffuseTransmission::new(Rgb::splat(0.4), Rgb::splat(0.6));
    let mut list = vec![
        Material::new("lambert", Bsdf::Lambert(Lambert { albedo: Rgb::WHITE })),
        Material::new("leaf", Bsdf::DiffuseTransmission(leaf)),
        Material::new("mirror", Bsdf::Mirror(Mirror { reflectance: Rgb::WHITE })),
        Material::new("pane", Bsdf::ThinDielectric(ThinDielectric::new(1.5))),
    ];
    list.extend(
        [0.01, 0.3, 0.7, 1.0].map(|roughness| {
            Material::new(format!("eon {roughness}"), Bsdf::Eon(Eon { albedo: Rgb::WHITE, roughness }))
        }),
    );
    list.extend([0.05, 0.3, 1.0].map(|alpha| Material::new(format!("glossy {alpha}"), glossy(alpha))));
    for alpha in ALPHAS.into_iter().chain([[0.0; 2], [1e-3; 2], [0.02, 0.08], [1.0, 0.3]]) {
        list.push(Material::new(format!("metal {alpha:?}"), Bsdf::Conductor(white_metal(alpha))));
        list.push(Material::new(format!("gold {alpha:?}"), gold(alpha)));
        list.push(Material::new(format!("plastic {alpha:?}"), Bsdf::Plastic(Plastic::new(Rgb::WHITE, 1.5, alpha))));
        list.extend([1.1, 1.5, 2.4, 0.7].map(|ior| glass(ior, alpha)));
    }
    list.extend(coats(Rgb::WHITE, Rgb::WHITE));
    for (roughness, anisotropic) in [(0.4, 0.9), (0.7, 0.5), (0.7, 1.0), (1.0, 0.7), (1.0, 1.0)] {
        let parameters =
            PrincipledParameters { base_color: Rgb::WHITE, roughness, anisotropic, ..PrincipledParameters::default() };
        list.push(Material::new(format!("principled {roughness} stretched {anisotropic}"), principled(&parameters)));
    }
    list.extend((0..2048).step_by(97).map(corner));
    list
}

/// A corner of the unit cube of ten parameters of the principled model, for a white base; from bit 10 on: a thin sheet,
/// half diffuse transmission.
pub fn corner(bits: u32) -> Material {
    let parameters = PrincipledParameters::white_corner(bits);
    // Glass has an index of at least 1.05.
    let ior = if parameters.thin { 1.0 } else { parameters.ior.max(1.05) };
    Material { ior, ..Material::new(format!("principled corner {bits:011b}"), principled(&parameters)) }
}

/// A material seen from a direction.
#[derive(Clone, Debug)]
pub struct View {
    pub material: Material,
    pub wo: Vec3,
}

impl View {
    pub fn name(&self) -> String {
        format!("{} from {:.3}", self.material.name, self.wo.z)
    }
}

/// Every material from ahead, at 45 degrees, grazing and from behind; those that let light pass at the same angles from
/// inside.
pub fn views(materials: Vec<Material>) -> Vec<View> {
    const OUTSIDE: [f32; 4] = [1.0, std::f32::consts::FRAC_1_SQRT_2, 0.05, 0.001];
    const BEHIND: [f32; 1] = [-0.6];
    let mut list = Vec::new();
    for material in materials {
        let inside = OUTSIDE.map(|cos| -cos);
        let beyond = if material.bsdf.flags().transmits() { &inside[..] } else { &BEHIND[..] };
        list.extend(
            OUTSIDE.iter().chain(beyond).map(|&cos| View { material: material.clone(), wo: direction(cos, 0.1) }),
        );
    }
    list
}
