//! All lights of a scene, and the sampling of one of them.

use super::queue::SampleGroup;
use super::tree::{LightSampleContext, LightTree, LightTreeScratch};
use super::{Environment, EnvironmentMap, Light, LightQueries, MisCompensation};
use crate::geometry::Geometry;
use crate::id::LightId;
use crate::math::Aabb;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::rows::{BATCH, soa, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::sampling::AliasTable;

/// A light chosen by [`LightSet::choose`].
#[derive(Clone, Copy, Debug)]
pub struct LightChoice {
    /// The light.
    pub id: LightId,
    /// Probability of the choice.
    pub pmf: f32,
}

soa! {
    /// As [`LightChoice`]; without a choice, the probability is 0.
    pub struct LightChoiceRows {
        /// The light.
        light: u32,
        /// Probability of the choice.
        pmf: f32,
    }
}

impl LightChoiceRows {
    #[inline(always)]
    fn set(&mut self, lane: usize, choice: Option<LightChoice>) {
        (self.light[lane], self.pmf[lane]) = choice.map_or((0, 0.0), |choice| (choice.id.0, choice.pmf));
    }
}

/// How a light is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSelection {
    /// In proportion to its power.
    Power,
    /// In proportion to an estimate of its irradiance at the shading point, by a light tree; lights at infinity by
    /// their power.
    Tree,
}

/// All lights of a scene and the probability with which each is chosen.
///
/// Two or more lights that are not at infinity are chosen by a light tree over their positions and emission directions,
/// all others in proportion to their power. What a light at infinity gives to a scene depends on the scene's size more
/// than on what the camera sees; so if there are both lights at infinity and others, either kind has at least a quarter
/// of the choices. Where power decides, a twentieth of the choices of a kind is spread evenly, so that no light of
/// positive power starves beside a strong one.
///
/// With [compensation](MisCompensation::On) an environment counts with the power that its lowered density leaves.
#[derive(Clone, Debug, Default)]
pub struct LightSet {
    lights: Vec<Light>,
    sample_groups: Vec<SampleGroup>,
    /// Lights that are not at infinity, if a tree chooses among them.
    tree: Option<Box<LightTree>>,
    /// Without MIS compensation.
    plain: LightDistribution,
    /// With it, if that makes a difference.
    mis_compensated: Option<LightDistribution>,
    at_infinity: Vec<LightId>,
    environment_map: Option<LightId>,
}

/// How lights are chosen.
#[derive(Clone, Debug, Default)]
struct LightDistribution {
    /// All lights, or (beside a tree) those at infinity.
    table: Option<AliasTable>,
    /// Probability of choosing by the tree.
    tree_share: f32,
}

/// At least this many lights that are not at infinity are sampled by a tree.
const TREE_FROM: usize = 2;

/// Least share of the choices for lights at infinity, and for all others, if both exist.
const LEAST_SHARE: f64 = 0.25;

/// Share of the choices that is independent of power.
const EVEN_SHARE: f64 = 0.05;

impl LightSet {
    /// All lights of a scene; [`LightId`]s count in the order given.
    pub fn new(lights: Vec<Light>, geometry: &Geometry) -> Self {
        let near = lights.iter().filter(|light| !light.is_at_infinity()).count();
        let selection = if near >= TREE_FROM { LightSelection::Tree } else { LightSelection::Power };
        Self::with_selection(lights, geometry, selection)
    }

    /// [`Self::new`] with a given selection: noise and time differ, the picture does not.
    pub fn with_selection(lights: Vec<Light>, geometry: &Geometry, selection: LightSelection) -> Self {
        let bounds = geometry.bounds();
        let radius = if bounds.is_empty() { 1.0 } else { 0.5 * bounds.size().as_dvec3().length() };
        let powers = |compensation: MisCompensation| -> Vec<f64> {
            let power = |light: &Light| {
                Some(light.sampled_power(radius, compensation)).filter(|p| *p > 0.0 && p.is_finite()).unwrap_or(0.0)
            };
            lights.iter().map(power).collect()
        };
        let far: Vec<bool> = lights.iter().map(Light::is_at_infinity).collect();
        let plain = probabilities(&powers(MisCompensation::Off), &far);
        let has_environment = lights.iter().any(|light| matches!(light, Light::Environment(_)));
        let mis_compensated = has_environment.then(|| probabilities(&powers(MisCompensation::On), &far));
        let at_infinity = (0..lights.len()).filter(|&i| lights[i].is_visible_at_infinity()).map(LightId::new).collect();
        let is_map = |light: &Light| matches!(light, Light::Environment(Environment::Map(_)));
        let environment_map = lights.iter().position(is_map).map(LightId::new);
        let tree = match selection {
            LightSelection::Power => None,
            LightSelection::Tree => {
                let of = |i: usize| if plain[i] > 0.0 { lights[i].bounds(geometry) } else { None };
                LightTree::new(&(0..lights.len()).map(of).collect::<Vec<_>>())
            }
        };
        let distribution = |mut probabilities: Vec<f64>| {
            let mut tree_share = 0.0;
            if tree.is_some() {
                tree_share =
                    probabilities.iter().zip(&far).filter(|(_, far)| !**far).map(|(p, _)| p).sum::<f64>().min(1.0)
                        as f32;
                probabilities.iter_mut().zip(&far).filter(|(_, far)| !**far).for_each(|(p, _)| *p = 0.0);
            }
            LightDistribution { table: AliasTable::new(&probabilities), tree_share }
        };
        let (plain, mis_compensated) = (distribution(plain), mis_compensated.map(distribution));
        let is_map = |i: usize| environment_map.is_some_and(|map| map.index() == i);
        let sample_groups = (0..lights.len()).map(|i| SampleGroup::of(&lights[i], is_map(i))).collect();
        Self { lights, sample_groups, tree: tree.map(Box::new), plain, mis_compensated, at_infinity, environment_map }
    }

    /// All lights, by [`LightId`].
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// The light with this id.
    #[inline]
    pub fn get(&self, id: LightId) -> &Light {
        &self.lights[id.index()]
    }

    /// With which lights this one is sampled for many vertices at once; none if there is no such light.
    #[inline(always)]
    pub(super) fn sample_group(&self, id: LightId) -> SampleGroup {
        self.sample_groups.get(id.index()).copied().unwrap_or(SampleGroup::None)
    }

    /// Whether a light that shines from a place may be within these bounds.
    pub fn is_any_within(&self, geometry: &Geometry, bounds: &Aabb) -> bool {
        self.lights.iter().filter_map(|light| light.bounds(geometry)).any(|light| light.bounds.overlaps(bounds))
    }

    /// Whether there are no lights at all.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Whether any light shines.
    pub fn shines(&self) -> bool {
        self.plain.table.is_some() || self.tree.is_some()
    }

    /// How a light is chosen.
    pub fn selection(&self) -> LightSelection {
        if self.tree.is_some() { LightSelection::Tree } else { LightSelection::Power }
    }

    #[inline]
    fn distribution(&self, compensation: MisCompensation) -> &LightDistribution {
        match &self.mis_compensated {
            Some(distribution) if compensation == MisCompensation::On => distribution,
            _ => &self.plain,
        }
    }

    /// A light for `from`, `u` in the unit square (the second number adds digits to the first, for many lights); `None`
    /// if none shines there, as far as the choice has looked.
    #[inline]
    pub fn choose(&self, from: &LightSampleContext, u: [f32; 2], compensation: MisCompensation) -> Option<LightChoice> {
        let distribution = self.distribution(compensation);
        if let Some(tree) = &self.tree {
            return distribution.choose_by_tree(tree, from, u);
        }
        let table = distribution.table.as_ref()?;
        let index = table.index(u[0]);
        Some(LightChoice { id: LightId::new(index), pmf: table.pmf(index) })
    }

    /// [`choose`](Self::choose) for many vertices at once: sets the lights of those that are wanted, and the
    /// probabilities of the choices, 0 where there is none. Other lanes may be set too.
    pub fn choose_rows(
        &self,
        queries: &LightQueries,
        is_wanted: impl Fn(usize) -> bool,
        compensation: MisCompensation,
        scratch: &mut LightTreeScratch,
        choices: &mut LightChoiceRows,
    ) {
        let distribution = self.distribution(compensation);
        match (&self.tree, &distribution.table) {
            (None, None) => choices.pmf = [0.0; BATCH],
            (None, Some(table)) => vectorize!(choose_from_table(table, queries, choices)),
            (Some(tree), _) => {
                tree.choose_rows(queries, is_wanted, distribution.tree_share, scratch, choices);
                if distribution.tree_share < 1.0 {
                    distribution.choose_at_infinity(queries, choices);
                }
            }
        }
    }

    /// Probability with which [`choose`](Self::choose) takes this light for `from`.
    #[inline]
    pub fn pmf(&self, id: LightId, from: &LightSampleContext, compensation: MisCompensation) -> f32 {
        match &self.tree {
            Some(tree) if !self.get(id).is_at_infinity() => {
                tree.pmf(from, id.0) * self.distribution(compensation).tree_share
            }
            _ => self.pmf_by_power(id, compensation),
        }
    }

    /// Probability with which [`choose`](Self::choose) takes this light, whatever it is for, where power decides: of
    /// any light without a tree, and of lights at infinity.
    #[inline]
    pub fn pmf_by_power(&self, id: LightId, compensation: MisCompensation) -> f32 {
        let distribution = self.distribution(compensation);
        let by_power = distribution.table.as_ref().map_or(0.0, |table| table.pmf(id.index()));
        if self.tree.is_some() { by_power * (1.0 - distribution.tree_share) } else { by_power }
    }

    /// The first image around the scene.
    #[inline]
    pub fn environment_map(&self) -> Option<(LightId, &EnvironmentMap)> {
        let id = self.environment_map?;
        match self.get(id) {
            Light::Environment(Environment::Map(map)) => Some((id, map)),
            _ => None,
        }
    }

    /// The lights that rays leaving the scene can see: environments, and directional lights with an angle.
    #[inline]
    pub fn at_infinity(&self) -> &[LightId] {
        &self.at_infinity
    }
}

impl LightDistribution {
    fn choose_by_tree(&self, tree: &LightTree, from: &LightSampleContext, u: [f32; 2]) -> Option<LightChoice> {
        let (u, share) = (with_digits(u), f64::from(self.tree_share));
        if u < share {
            let chosen = tree.choose(from, u / share)?;
            return Some(LightChoice { id: LightId(chosen.light), pmf: chosen.pmf * self.tree_share });
        }
        self.sample_infinity(u)
    }

    /// The choices beside a tree whose numbers are not below its share.
    fn choose_at_infinity(&self, queries: &LightQueries, choices: &mut LightChoiceRows) {
        for lane in 0..queries.count.min(BATCH) {
            let [u, _, _, digits] = queries.u.of(lane);
            let u = with_digits([u, digits]);
            if u >= f64::from(self.tree_share) {
                choices.set(lane, self.sample_infinity(u));
            }
        }
    }

    /// A light at infinity beside a tree, for a number that is not below its share.
    fn sample_infinity(&self, u: f64) -> Option<LightChoice> {
        let (table, share) = (self.table.as_ref()?, f64::from(self.tree_share));
        let chosen = table.sample(((u - share) / (1.0 - share)).clamp(0.0, f64::from(ONE_MINUS_EPSILON)) as f32);
        Some(LightChoice { id: LightId::new(chosen.index), pmf: table.pmf(chosen.index) * (1.0 - self.tree_share) })
    }
}

#[inline(always)]
fn choose_from_table(table: &AliasTable, queries: &LightQueries, choices: &mut LightChoiceRows) {
    for i in 0..whole_vectors(queries.count) {
        let index = table.index(queries.u.of(i)[0]);
        (choices.light[i], choices.pmf[i]) = (index as u32, table.pmf(index));
    }
}

/// A number in `[0, 1)` of two, the second of which adds digits to the first.
#[inline(always)]
pub(super) fn with_digits([u, digits]: [f32; 2]) -> f64 {
    // Random numbers are multiples of 2^-24.
    f64::from(u) + f64::from(digits) * (1.0 / 16_777_216.0)
}

/// The probability of each light from its power and whether it is at infinity; all zero if no light has power.
fn probabilities(powers: &[f64], far: &[bool]) -> Vec<f64> {
    // Relative to the strongest, no sum overflows.
    let strongest = powers.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let total =
        |kind: bool| powers.iter().zip(far).filter(|(_, f)| **f == kind).map(|(p, _)| p / strongest).sum::<f64>();
    let count = |kind: bool| powers.iter().zip(far).filter(|(p, f)| **f == kind && **p > 0.0).count() as f64;
    let (near_total, far_total) = (total(false), total(true));
    let far_share = if count(true) == 0.0 {
        0.0
    } else if count(false) == 0.0 {
        1.0
    } else {
        (far_total / (near_total + far_total)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE)
    };
    let kind = |is_far: bool| {
        let (share, total) = if is_far { (far_share, far_total) } else { (1.0 - far_share, near_total) };
        (share, total, count(is_far))
    };
    let (near, far_kind) = (kind(false), kind(true));
    let probability = |(&power, &is_far): (&f64, &bool)| {
        let (share, total, count) = if is_far { far_kind } else { near };
        // A kind of no more than underflowing powers is spread evenly.
        let by_power = if total > 0.0 { power / strongest / total } else { 1.0 / count };
        if power > 0.0 { share * ((1.0 - EVEN_SHARE) * by_power + EVEN_SHARE / count) } else { 0.0 }
    };
    powers.iter().zip(far).map(probability).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;
    use crate::light::{DirectionalLight, Environment, PointLight};
    use crate::math::{DVec3, Vec3};

    const ANYWHERE: LightSampleContext = LightSampleContext { p: DVec3::ZERO, n: Vec3::ZERO };

    fn point(intensity: f32) -> Light {
        Light::Point(PointLight { position: DVec3::ZERO, intensity: Rgb::splat(intensity) })
    }

    fn set(lights: Vec<Light>) -> LightSet {
        LightSet::new(lights, &Geometry::default())
    }

    #[test]
    fn probabilities_add_up_and_are_those_of_the_choice() {
        let sun = Light::Directional(Box::new(DirectionalLight::new(-DVec3::Y, Rgb::splat(3.0), 0.01)));
        let sky = Light::Environment(Environment::Constant(Rgb::splat(1e-9)));
        let lights = set(vec![point(1.0), sun, point(0.0), point(1e-30), sky, point(50.0)]);
        let n = 1 << 20;
        let mut count = [0u32; 6];
        for i in 0..n {
            let choice = lights.choose(&ANYWHERE, [i as f32 / n as f32, 0.0], MisCompensation::Off).unwrap();
            assert_eq!(choice.pmf, lights.pmf(choice.id, &ANYWHERE, MisCompensation::Off));
            count[choice.id.index()] += 1;
        }
        let mut sum = 0.0;
        for (i, &c) in count.iter().enumerate() {
            let pmf = lights.pmf(LightId::new(i), &ANYWHERE, MisCompensation::Off);
            assert!((c as f32 / n as f32 - pmf).abs() < 1e-5, "{i}");
            assert_eq!(pmf > 0.0, i != 2, "{i}");
            sum += pmf;
        }
        assert!((sum - 1.0).abs() < 1e-6);
        assert!([1, 4].map(|i| lights.pmf(LightId(i), &ANYWHERE, MisCompensation::Off)).iter().sum::<f32>() >= 0.249);
        assert_eq!(lights.at_infinity(), [LightId(1), LightId(4)]);
    }

    #[test]
    fn equal_lights_are_chosen_equally() {
        let lights = set(vec![point(2.0); 5]);
        assert!((0..5).all(|i| (lights.pmf(LightId(i), &ANYWHERE, MisCompensation::Off) - 0.2).abs() < 1e-7));
    }

    #[test]
    fn a_sharp_sun_is_not_visible_and_no_light_is_no_choice() {
        let lights = set(vec![Light::Directional(Box::new(DirectionalLight::new(-DVec3::Y, Rgb::WHITE, 0.0)))]);
        assert!(lights.at_infinity().is_empty() && lights.pmf(LightId(0), &ANYWHERE, MisCompensation::Off) == 1.0);
        assert!(
            LightSet::default().choose(&ANYWHERE, [0.5, 0.0], MisCompensation::Off).is_none()
                && LightSet::default().is_empty()
        );
        assert!(set(vec![point(0.0)]).choose(&ANYWHERE, [0.5, 0.0], MisCompensation::Off).is_none());
    }
}
