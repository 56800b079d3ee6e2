//! Group G: scattering at surfaces.

mod density;
mod energy;
mod fresnel;
mod frozen;
mod limits;
mod materials;
mod normals;
mod shading;
mod weights;

use density::{g1_directions, g2_integrals};
use energy::{g5_energy, g6_furnace, g7_single_scattering};
use fresnel::g9_fresnel;
use frozen::g12_frozen;
use limits::g10_limits;
use normals::g8_visible_normals;
use shading::g11_shading_normals;
use weights::{g3_weights, g4_reciprocity};

checks! {
    "G1" g1_directions "sampled directions follow their density":
        "coloured BSDFs of every kind, from ahead, 45 degrees, cosines 0.05 and 0.001, behind and inside; chi-square \
         over 80 x 160 cells, those below 5 pooled (pbrt, bsdfs_test.cpp; Mitsuba, chi2.py)";
    "G2" g2_integrals "densities integrate to what sampling reaches":
        "adaptive Simpson's rule over the sphere against the share of samples that are not rejected, same BSDFs and \
         directions (Mitsuba, chi2.py)";
    "G3" g3_weights "weights of samples are value over density":
        "samples of every BSDF from random directions against the evaluation of the direction sampled; what one \
         rounding of that direction changes counts as its conditioning and not as an error (Mitsuba, eval_pdf checks)";
    "G4" g4_reciprocity "reciprocity":
        "pairs of directions, half of them sampled: f(a, b) n_b^2 = f(b, a) n_a^2; no BSDF is exempt, for light \
         scattered several times is Kulla's and Conty's; what one rounding of the directions changes is no error \
         (pbrt, hair; Veach)";
    "G5" g5_energy "nothing scatters more than it receives":
        "white BSDFs of every kind and corners of the principled model's parameters under a white sky, from cosine 1 \
         to 0.001 and from behind (pbrt, bsdfs_test.cpp TestEnergyConservation)";
    "G6" g6_furnace "white surfaces lose nothing":
        "white furnace from cosine 1 to 0.01, alpha from 0.001 to 1, scattering among microfacets included (Heitz; \
         Kulla and Conty)";
    "G7" g7_single_scattering "what microfacets scatter at once":
        "height-correlated Smith GGX with reflectance 1, by the midpoint rule over visible normals, against \
         quadratures in f64; a table of 24 values and their means";
    "G8" g8_visible_normals "visible normals":
        "sampling by spherical caps (Dupuy and Benyoub) against Heitz's by a disk, alpha 1e-4 to 1, isotropic or not, \
         cosines down to 1e-6; two-sample chi-square over 16 x 32 cells where alpha is divided out, and against the \
         density";
    "G9" g9_fresnel "Fresnel's equations":
        "random cosines and indices against complex arithmetic in f64; what relative changes of 2^-22 of cosine and \
         index explain is no error (Mitsuba, test_fresnel.py)";
    "G10" g10_limits "ends of ranges":
        "alpha 1e-4 against smooth surfaces by Welch's test; 2048 corners of the principled model down to cosine \
         1e-45; G1 to G3 for random corners";
    "G11" g11_shading_normals "shading normals":
        "white quads whose shading normals lean by 40 to 85 degrees, by normal map or vertex normals, under a white \
         sky and light from one direction; the terminator's factor and turned normals (Chiang, Li and Burley; Keller \
         et al.)";
    "G12" g12_frozen "stored values":
        "value and density of a principled material for 20 pairs of directions (Mitsuba, test_principled.py test05)";
}
