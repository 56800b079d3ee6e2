//! Denoising of a finished picture.

use super::oidn::Triple;
use super::prepared::Prepared;
use super::{Denoiser, Report};
use crate::error::Result;
use crate::film::{Image, Layer, LayerInfo, LayerKind, LayerSet, LayerSource};

/// The layers that help to denoise a picture.
pub const FEATURE_LAYERS: [LayerKind; 2] = [LayerKind::FeatureAlbedo, LayerKind::FeatureNormal];

/// Denoises a picture's colour and alpha with the help of those of [`FEATURE_LAYERS`] that it has, and keeps them as
/// they were as [`LayerKind::Noisy`]. Light groups, and kinds of light if all eight are there, are denoised so that
/// they sum to the colour, to the rounding of `f32`; all other layers stay as they are. On an error the picture is
/// unchanged.
///
/// # Errors
/// [`Error::OutOfMemory`](crate::Error::OutOfMemory), or [`Error::Internal`](crate::Error::Internal) with the library's
/// message.
pub fn denoise_image(denoiser: &Denoiser, image: &mut Image) -> Result<Report> {
    let size = [image.crop.width as usize, image.crop.height as usize];
    let [albedo, normal] = FEATURE_LAYERS.map(|kind| image.layer(kind).map(triples));
    let mut prepared = Prepared::new(denoiser, size, albedo, normal)?;
    let Some(color) = image.layers.iter().position(|layer| layer.kind == LayerKind::Color) else {
        return Ok(prepared.finish());
    };
    let noisy = Layer::new(LayerKind::Noisy, image.layers[color].data.clone());
    let total = prepared.picture(LayerInfo::of(LayerKind::Color).name, triples(&noisy))?;
    let alpha: Vec<f32> = noisy.channel(3).collect();
    let alpha = prepared.alpha(&alpha)?;

    let sets = [light_groups(image), kinds_of_light(image)];
    let mut results: Vec<(usize, Vec<Triple>)> = Vec::new();
    for set in sets.iter().filter(|set| !set.is_empty()) {
        let names: Vec<String> = set.iter().map(|&i| name(&image.layers[i])).collect();
        let parts = prepared.parts(&total, &names, set.iter().map(|&i| triples(&image.layers[i])).collect())?;
        results.extend(set.iter().copied().zip(parts));
    }
    for (i, pixels) in results {
        image.layers[i].data = pixels.into_flattened();
    }
    image.layers[color].data = total.iter().zip(alpha).flat_map(|([r, g, b], a)| [*r, *g, *b, a]).collect();
    let mut report = prepared.finish();
    if sets[1].is_empty() && image.layers.iter().any(|layer| is_kind_of_light(layer.kind)) {
        report.notes.push("kinds of light such as diffuse_direct stay noisy unless all eight are stored".to_owned());
    }
    image.layers.push(noisy);
    Ok(report)
}

/// Adds what denoising needs to the layers of a render.
pub fn add_features(layers: &mut LayerSet) {
    FEATURE_LAYERS.into_iter().for_each(|kind| layers.insert(kind));
}

fn light_groups(image: &Image) -> Vec<usize> {
    (0..image.layers.len()).filter(|i| image.layers[*i].kind == LayerKind::LightGroups).collect()
}

/// The layers of kinds of light, if all are there.
fn kinds_of_light(image: &Image) -> Vec<usize> {
    let found: Vec<usize> = (0..image.layers.len()).filter(|i| is_kind_of_light(image.layers[*i].kind)).collect();
    let all = LayerInfo::ALL.iter().filter(|info| is_kind_of_light(info.kind)).count();
    if found.len() == all { found } else { Vec::new() }
}

fn is_kind_of_light(kind: LayerKind) -> bool {
    matches!(LayerInfo::of(kind).source, LayerSource::LightAov(_))
}

/// A layer's name in a file.
fn name(layer: &Layer) -> String {
    let names = layer.channel_names();
    names
        .first()
        .and_then(|name| name.rsplit_once('.'))
        .map_or_else(|| LayerInfo::of(layer.kind).name.to_owned(), |(layer, _)| layer.to_owned())
}

/// The first three channels.
fn triples(layer: &Layer) -> Vec<Triple> {
    layer.pixels().map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}
