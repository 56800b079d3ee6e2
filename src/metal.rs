//! Metals, and other absorbing materials, by the names that this program and others have for them.

/// Whose names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MetalNames {
    /// Those of this program: the constants at 650, 550 and 450 nm (refractiveindex.info: Johnson and Christy for noble
    /// metals, iron, chromium and titanium; Rakic for aluminium and tungsten; Querry for brass).
    Steradian,
    /// Mitsuba 3's, with the constants that it has when it renders in RGB: the spectra of the SOPRA database and of
    /// Palik's handbook, seen under D65. Names with `_palik` that are not here are the same as those without.
    Mitsuba,
    /// pbrt's, without `metal-` and `-eta` or `-k`: constants under D65, with eta such that the reflectance ahead is
    /// that of the spectrum (optical constants of luxpop.com, of which k is 0 within the accuracy for both oxides).
    Pbrt,
}

/// The index of refraction `eta + i k` of a metal for red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metal {
    names: &'static [(MetalNames, &'static str)],
    /// The real part.
    pub eta: [f32; 3],
    /// The imaginary part.
    pub k: [f32; 3],
}

impl Metal {
    /// The metal of a name.
    pub fn find(names: MetalNames, name: &str) -> Option<&'static Self> {
        METALS.iter().find(|metal| metal.names.contains(&(names, name)))
    }

    /// All names.
    pub fn names(names: MetalNames) -> impl Iterator<Item = &'static str> {
        METALS.iter().flat_map(|metal| metal.names).filter(move |(whose, _)| *whose == names).map(|(_, name)| *name)
    }
}

const fn metal(names: &'static [(MetalNames, &'static str)], eta: [f32; 3], k: [f32; 3]) -> Metal {
    Metal { names, eta, k }
}

use MetalNames::{Mitsuba, Pbrt, Steradian};

const METALS: &[Metal] = &[
    metal(&[(Steradian, "aluminium")], [1.657, 0.880, 0.521], [9.224, 6.270, 4.837]),
    metal(&[(Steradian, "brass"), (Pbrt, "CuZn")], [0.444, 0.527, 1.094], [3.695, 2.765, 1.829]),
    metal(&[(Steradian, "chromium")], [3.107, 3.181, 2.323], [3.331, 3.329, 3.135]),
    metal(&[(Steradian, "copper")], [0.200, 0.924, 1.102], [3.912, 2.452, 2.142]),
    metal(&[(Steradian, "gold")], [0.143, 0.375, 1.442], [3.983, 2.386, 1.603]),
    metal(&[(Steradian, "iron")], [2.911, 2.950, 2.585], [3.089, 2.932, 2.767]),
    metal(&[(Steradian, "silver")], [0.155, 0.116, 0.138], [4.828, 3.122, 2.147]),
    metal(&[(Steradian, "titanium")], [2.741, 2.542, 2.267], [3.814, 3.435, 3.039]),
    metal(&[(Steradian, "tungsten")], [4.370, 3.300, 2.999], [3.500, 2.605, 2.731]),
    metal(&[(Mitsuba, "Ag")], [0.1553, 0.1167, 0.1384], [4.828, 3.122, 2.147]),
    metal(&[(Mitsuba, "Al")], [1.658, 0.8804, 0.5212], [9.224, 6.27, 4.837]),
    metal(&[(Mitsuba, "AlAs")], [3.605, 3.233, 2.216], [0.0006794, 0.0, 0.007513]),
    metal(&[(Mitsuba, "AlSb")], [0.0, 4.139, 4.669], [0.0, 0.09401, 1.301]),
    metal(&[(Mitsuba, "Au")], [0.143, 0.3753, 1.442], [3.983, 2.386, 1.603]),
    metal(&[(Mitsuba, "Be")], [4.185, 3.185, 2.784], [3.835, 3.01, 2.869]),
    metal(&[(Mitsuba, "Cr")], [4.37, 2.917, 1.655], [5.207, 4.231, 3.755]),
    metal(&[(Mitsuba, "CsI")], [2.145, 1.702, 1.662], [0.0, 0.0, 0.0]),
    metal(&[(Mitsuba, "Cu")], [0.201, 0.9237, 1.102], [3.913, 2.453, 2.142]),
    metal(&[(Mitsuba, "Cu2O")], [3.552, 2.95, 2.752], [0.1142, 0.1939, 0.6061]),
    metal(&[(Mitsuba, "CuO")], [3.248, 2.448, 2.21], [0.5211, 0.57, 0.7222]),
    metal(&[(Mitsuba, "Cu_palik")], [0.2132, 0.9197, 1.102], [3.922, 2.457, 2.137]),
    metal(&[(Mitsuba, "Hg")], [2.399, 1.44, 0.9096], [6.328, 4.372, 3.422]),
    metal(&[(Mitsuba, "HgTe")], [4.779, 3.231, 2.66], [1.632, 1.581, 1.729]),
    metal(&[(Mitsuba, "Ir")], [3.086, 2.082, 1.618], [5.592, 4.067, 3.267]),
    metal(&[(Mitsuba, "K")], [0.06404, 0.04641, 0.03818], [2.104, 1.349, 0.9131]),
    metal(&[(Mitsuba, "Li")], [0.2658, 0.1956, 0.2209], [3.54, 2.311, 1.669]),
    metal(&[(Mitsuba, "MgO")], [2.09, 1.651, 1.595], [0.0, 0.0, 0.0]),
    metal(&[(Mitsuba, "Mo")], [4.484, 3.525, 2.776], [4.111, 3.421, 3.151]),
    metal(&[(Mitsuba, "Na_palik")], [0.06027, 0.05614, 0.06199], [3.179, 2.112, 1.579]),
    metal(&[(Mitsuba, "Nb")], [3.42, 2.79, 2.396], [3.441, 2.738, 2.58]),
    metal(&[(Mitsuba, "Ni_palik")], [2.367, 1.663, 1.467], [4.499, 3.05, 2.345]),
    metal(&[(Mitsuba, "Rh")], [2.586, 1.86, 1.554], [6.782, 4.703, 3.976]),
    metal(&[(Mitsuba, "Se")], [4.058, 2.843, 2.821], [0.754, 0.6384, 0.5218]),
    metal(&[(Mitsuba, "Se-e")], [5.723, 4.166, 4.081], [0.8711, 1.105, 1.565]),
    metal(&[(Mitsuba, "SiC")], [3.172, 2.526, 2.479], [0.0, 0.0, 0.0]),
    metal(&[(Mitsuba, "SnTe")], [4.524, 1.982, 1.282], [0.0, 0.0, 0.0]),
    metal(&[(Mitsuba, "Ta")], [2.063, 2.393, 2.628], [2.408, 1.741, 1.947]),
    metal(&[(Mitsuba, "Te")], [7.39, 4.482, 2.637], [3.256, 3.527, 3.292]),
    metal(&[(Mitsuba, "Te-e")], [7.509, 4.296, 2.37], [5.584, 4.947, 3.998]),
    metal(&[(Mitsuba, "ThF4")], [1.831, 1.442, 1.388], [0.0, 0.0, 0.0]),
    metal(&[(Mitsuba, "TiC")], [3.701, 2.837, 2.582], [3.266, 2.352, 2.173]),
    metal(&[(Mitsuba, "TiN")], [1.648, 1.151, 1.38], [3.368, 1.943, 1.102]),
    metal(&[(Mitsuba, "TiO2")], [3.457, 2.802, 2.905], [0.0001053, 0.0, 0.0006529]),
    metal(&[(Mitsuba, "TiO2-e")], [3.107, 2.513, 2.582], [0.0, 0.0, 0.0001827]),
    metal(&[(Mitsuba, "VC")], [3.658, 2.753, 2.533], [3.068, 2.199, 1.963]),
    metal(&[(Mitsuba, "VN")], [2.866, 2.119, 1.94], [3.032, 2.056, 1.616]),
    metal(&[(Mitsuba, "V_palik")], [4.278, 3.513, 2.761], [3.491, 2.889, 3.112]),
    metal(&[(Mitsuba, "W")], [4.371, 3.3, 2.998], [3.501, 2.605, 2.273]),
    metal(&[(Mitsuba, "a-C")], [2.944, 2.227, 1.968], [0.8875, 0.7993, 0.8153]),
    metal(&[(Mitsuba, "d-C")], [2.709, 2.319, 2.229], [0.0, 0.0, 0.0]),
    metal(&[(Pbrt, "Ag")], [0.1267, 0.1207, 0.1491], [4.0649, 3.2863, 2.3918]),
    metal(&[(Pbrt, "Al")], [1.4286, 0.9285, 0.5905], [7.7405, 6.6026, 5.3604]),
    metal(&[(Pbrt, "Au")], [0.0800, 0.4563, 1.5612], [3.3905, 2.5038, 1.7709]),
    metal(&[(Pbrt, "Cu")], [0.1337, 0.9552, 1.2142], [3.2734, 2.5923, 2.3693]),
    metal(&[(Pbrt, "MgO")], [1.7337, 1.7409, 1.7535], [0.0; 3]),
    metal(&[(Pbrt, "TiO2")], [2.8601, 2.9571, 3.1855], [0.0; 3]),
];
