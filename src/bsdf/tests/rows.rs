//! Many queries at once against each of them alone.

use super::*;
use crate::math::Rng;
use crate::math::rows::BATCH;

fn bsdfs() -> Vec<Bsdf> {
    let single = |bsdf: Bsdf| match bsdf {
        Bsdf::Conductor(bsdf) => Bsdf::Conductor(bsdf.single_scattering()),
        Bsdf::Dielectric(bsdf) => Bsdf::Dielectric(bsdf.single_scattering()),
        other => other,
    };
    let rough = ALPHAS.into_iter().flat_map(|alpha| {
        let made = [
            gold(alpha),
            glass(alpha),
            separable_gold(alpha),
            separable_glass(alpha),
            beckmann_gold(alpha),
            beckmann_glass(alpha),
        ];
        made.into_iter().chain([single(gold(alpha)), single(glass(alpha))])
    });
    rough.chain([gold([0.0; 2]), glass([0.0; 2])]).chain(plastics()).chain(principled()).chain(hair()).collect()
}

fn principled() -> impl Iterator<Item = Bsdf> {
    let with = |metallic, roughness, model, multiscatter| PrincipledParameters {
        base_color: Rgb::new(0.2, 0.5, 0.9),
        metallic,
        roughness,
        model,
        multiscatter,
        ..PrincipledParameters::default()
    };
    let models = [(PrincipledModel::Burley, true), (PrincipledModel::Burley, false), (PrincipledModel::Mitsuba, false)];
    let basic = models.into_iter().flat_map(move |(model, multiscatter)| {
        [(0.0, 0.0), (0.0, 0.5), (0.3, 0.2), (1.0, 1.0)]
            .map(|(metallic, roughness)| with(metallic, roughness, model, multiscatter))
    });
    let coated = PrincipledParameters { clearcoat: 0.7, sheen: 0.2, ..with(0.2, 0.4, PrincipledModel::Burley, true) };
    basic.chain([coated]).map(|parameters| Bsdf::Principled(Principled::new(&parameters)))
}

fn hair() -> impl Iterator<Item = Bsdf> {
    let roughness = [[0.3, 0.3], [0.02, 0.05], [1.0, 0.25]];
    roughness.into_iter().map(|roughness| Bsdf::Hair(Hair::new(Rgb::new(0.2, 0.6, 1.5), 1.55, roughness, 0.035)))
}

fn plastics() -> impl Iterator<Item = Bsdf> {
    let coated = |alpha, nonlinear| Plastic {
        nonlinear,
        tint: Rgb::new(0.9, 0.5, 1.0),
        ..Plastic::new(Rgb::new(0.2, 0.5, 0.9), 1.5, alpha)
    };
    let ggx = [[0.0; 2], [0.1; 2], [0.7; 2], [0.1, 0.5]]
        .into_iter()
        .flat_map(move |alpha| [coated(alpha, false), coated(alpha, true)]);
    let separable = [0.0, 0.2].map(|alpha| lossy_plastic(SeparableGgx::new([alpha; 2]), true)).map(Bsdf::SeparableGgx);
    ggx.map(Bsdf::Plastic).chain(separable)
}

/// The same material with other colours.
fn recolored(bsdf: &Bsdf, random: &mut Rng) -> Bsdf {
    fn recolor<D: Copy>(plastic: &Plastic<D>, random: &mut Rng) -> Plastic<D> {
        let [diffuse, tint] = std::array::from_fn(|_| Rgb::from(std::array::from_fn(|_| random.unit_f32())));
        Plastic { diffuse, tint, ..*plastic }
    }
    match bsdf {
        Bsdf::Plastic(plastic) => Bsdf::Plastic(recolor(plastic, random)),
        Bsdf::SeparableGgx(SingleScatteringBsdf::Plastic(plastic)) => {
            Bsdf::SeparableGgx(SingleScatteringBsdf::Plastic(recolor(plastic, random)))
        }
        Bsdf::Principled(principled) => {
            let model = if principled.is_mitsuba() { PrincipledModel::Mitsuba } else { PrincipledModel::Burley };
            Bsdf::Principled(Principled::new(&PrincipledParameters {
                base_color: Rgb::from(std::array::from_fn(|_| random.unit_f32())),
                metallic: random.unit_f32(),
                roughness: random.unit_f32(),
                ior: 1.0 + random.unit_f32(),
                model,
                ..PrincipledParameters::default()
            }))
        }
        Bsdf::Hair(hair) => {
            Bsdf::Hair(hair.with_absorption(Rgb::from(std::array::from_fn(|_| 3.0 * random.unit_f32()))))
        }
        other => other.clone(),
    }
}

#[test]
fn queries_in_rows_have_the_bits_of_single_ones() {
    let varying: Vec<Bsdf> = bsdfs().into_iter().filter(Bsdf::can_vary).collect();
    assert!(varying.len() >= 21);
    for (bsdf, varies) in
        bsdfs().into_iter().map(|bsdf| (bsdf, false)).chain(varying.into_iter().map(|bsdf| (bsdf, true)))
    {
        check_rows(&bsdf, varies);
    }
}

fn check_rows(first: &Bsdf, varies: bool) {
    let mut random = Rng::new(31);
    let (mut queries, mut evals, mut samples) =
        (BsdfQueryRows::default(), BsdfEvalRows::default(), BsdfSampleRows::default());
    for count in [1, 15, 16, 100, BATCH] {
        let bsdfs: Vec<Bsdf> =
            (0..count).map(|i| if varies && i > 0 { recolored(first, &mut random) } else { first.clone() }).collect();
        for (i, bsdf) in bsdfs.iter().enumerate() {
            // Some in the surface, where nothing is scattered.
            let mut direction = || if random.below(20) == 0 { Vec3::X } else { random.direction().as_vec3() };
            let (wo, wi) = (direction(), direction());
            queries.wo.set(i, wo);
            queries.wi.set(i, wi);
            (queries.u_lobe[i], [queries.u[i], queries.v[i]]) = (random.unit_f32(), random.pair());
            queries.set_parameters(i, bsdf);
        }
        first.eval_rows(&queries, varies, count, &mut evals);
        first.sample_rows(&queries, varies, count, &mut samples);
        for (i, bsdf) in bsdfs.iter().enumerate() {
            let (wo, wi) = (queries.wo.get(i), queries.wi.get(i));
            let eval = bsdf.eval(wo, wi);
            let context = format!("{bsdf:?} {wo} {wi} of {count}");
            assert_eq!((evals.value.get(i), evals.pdf[i]), (eval.value, eval.pdf), "{context}");
            let sample = bsdf.sample(wo, queries.u_lobe[i], [queries.u[i], queries.v[i]]);
            assert_eq!(samples.is_valid[i] != 0, sample.is_some(), "{context}");
            let Some(sample) = sample else { continue };
            let flags = (samples.is_delta[i] != 0, samples.is_transmission[i] != 0);
            assert_eq!(flags, (sample.is_delta, sample.is_transmission), "{context}");
            assert_eq!((samples.wi.get(i), samples.weight.get(i)), (sample.wi, sample.weight), "{context}");
            assert_eq!((samples.pdf[i], samples.eta[i]), (sample.pdf, sample.eta), "{context}");
        }
    }
}
