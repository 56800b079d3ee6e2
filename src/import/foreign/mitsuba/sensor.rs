//! Sensors and their films to the camera and the film.

use super::element::Element;
use super::tree::{PluginId, Value};
use super::{Reader, values};
use crate::desc::{
    CameraDesc, CameraKindDesc, FilterDesc, LensDesc, OutputDesc, PixelTypeDesc, TransformDesc, TransformStepDesc,
};
use crate::error::Result;
use crate::import::foreign::draft::SOBOL_FOR_INDEPENDENT;
use crate::math::{DAffine3, DMat3, DVec3};

/// Mitsuba's camera looks along +Z with +X to the left of the picture; this turns Steradian's camera into it.
const HALF_TURN: DMat3 = DMat3 { x_axis: DVec3::NEG_X, y_axis: DVec3::Y, z_axis: DVec3::NEG_Z };

/// The lens of a `thinlens`; `None` if it is a pinhole.
fn lens(element: &mut Element, far_clip: Option<f64>) -> Result<Option<LensDesc>> {
    let radius = element.float("aperture_radius")?;
    let radius = radius.ok_or_else(|| element.place().error("a thinlens needs \"aperture_radius\""))?;
    let focus_distance = Some(element.float("focus_distance")?.or(far_clip).unwrap_or(1e4));
    Ok((radius > 0.0).then_some(LensDesc {
        radius: Some(radius),
        f_number: None,
        focal_length: None,
        focus_distance,
        focus_point: None,
        sensor_distance: None,
        sensor_height: None,
        blades: None,
    }))
}

impl Reader<'_> {
    /// Reads a sensor with its film and sampler, which becomes the camera.
    pub(super) fn sensor(&mut self, id: PluginId) -> Result<()> {
        let mut element = Element::new(self.document, id);
        let aspect = match element.one("film")? {
            Some(film) => self.film(film)?,
            None => self.default_film(),
        };
        match element.one("sampler")? {
            Some(sampler) => self.sampler(sampler)?,
            None => self.draft.desc.sampler.spp = 4,
        }
        let map = element.transform("to_world")?;
        let near = element.float("near_clip")?.unwrap_or(1e-2);
        let mut camera = CameraDesc { near, ..CameraDesc::default() };
        let far = element.float("far_clip")?;
        if far.is_some() {
            element.ignored("far_clip", "nothing is cut far away");
        }
        let kind = element.kind();
        if kind == "orthographic" {
            camera.kind = CameraKindDesc::Orthographic;
            // The picture is 2 wide before the transform's scale.
            let (width, height) = (map.matrix3.x_axis.length(), map.matrix3.y_axis.length());
            camera.view_height = Some(2.0 * height / aspect);
            if (width / height - 1.0).abs() > 1e-6 {
                camera.pixel_aspect = Some(width / height);
            }
        } else {
            camera.vertical_fov_degrees = Some(fov(&mut element, aspect)?);
            // What would be seen at this offset from the middle, to the right and down, is seen in the middle.
            let offset = [
                element.float("principal_point_offset_x")?.unwrap_or(0.0),
                element.float("principal_point_offset_y")?.unwrap_or(0.0),
            ];
            if offset != [0.0; 2] {
                camera.shift = Some([offset[0], -offset[1]]);
            }
        }
        if kind == "thinlens" {
            camera.lens = lens(&mut element, far)?;
        }
        for name in ["shutter_open", "shutter_close"] {
            if element.take(name).is_some() {
                element.ignored(name, "nothing moves");
            }
        }
        if element.take("srf").is_some() {
            element.ignored("srf", "the camera sees red, green and blue");
        }
        camera.transform = Some(placement(&mut element, &map)?);
        self.medium_outside(&mut element)?;
        let place = element.place().to_string();
        element.finish(&mut self.draft);
        self.draft.set_camera(&place, camera);
        Ok(())
    }

    /// Reads a film; the result is the picture's width over its height.
    fn film(&mut self, id: PluginId) -> Result<f64> {
        let mut element = Element::new(self.document, id);
        if element.kind() == "specfilm" {
            element.approximated("", "a film of red, green and blue in place of one of bands of wavelengths");
        }
        let mut film = self.draft.desc.film.clone();
        film.width = element.count("width", 1)?.unwrap_or(768);
        film.height = element.count("height", 1)?.unwrap_or(576);
        let crop = [
            element.count("crop_offset_x", 0)?,
            element.count("crop_offset_y", 0)?,
            element.count("crop_width", 1)?,
            element.count("crop_height", 1)?,
        ];
        if crop.iter().any(Option::is_some) {
            let [x, y, width, height] = crop;
            film.crop =
                Some([x.unwrap_or(0), y.unwrap_or(0), width.unwrap_or(film.width), height.unwrap_or(film.height)]);
        }
        film.filter = match element.one("rfilter")? {
            Some(filter) => self.filter(filter)?,
            None => FilterDesc::Gaussian { radius: 2.0, sigma: 0.5, samples: None },
        };
        if element.text("pixel_format")?.is_some_and(|format| format != "rgb") {
            element.ignored("pixel_format", "the picture has red, green and blue");
        }
        if element.text("file_format")?.is_some_and(|format| format != "openexr") {
            element.ignored("file_format", "the format follows from the extension of the output");
        }
        if element.text("component_format")?.is_some_and(|format| format != "float16") {
            let stem =
                self.scene.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned());
            let exr = OutputDesc { pixel_type: PixelTypeDesc::Float, ..OutputDesc::new(format!("{stem}.exr")) };
            self.draft.desc.outputs = vec![exr, OutputDesc::new(format!("{stem}.png"))];
        }
        for name in ["sample_border", "compensate", "banner"] {
            element.boolean(name, false)?;
        }
        element.finish(&mut self.draft);
        let aspect = f64::from(film.width) / f64::from(film.height);
        self.draft.desc.film = film;
        Ok(aspect)
    }

    /// The film of a sensor without one.
    fn default_film(&mut self) -> f64 {
        let film = &mut self.draft.desc.film;
        (film.width, film.height, film.filter) =
            (768, 576, FilterDesc::Gaussian { radius: 2.0, sigma: 0.5, samples: None });
        768.0 / 576.0
    }

    fn filter(&mut self, id: PluginId) -> Result<FilterDesc> {
        let mut element = Element::new(self.document, id);
        let filter = match element.kind() {
            "box" => FilterDesc::Box { radius: 0.5, samples: None },
            "tent" => FilterDesc::Tent { radius: element.float("radius")?.unwrap_or(1.0) as f32, samples: None },
            "gaussian" => {
                let sigma = element.float("stddev")?.unwrap_or(0.5);
                FilterDesc::Gaussian { radius: (4.0 * sigma) as f32, sigma: sigma as f32, samples: None }
            }
            "mitchell" => {
                let (b, c) = (element.float("B")?, element.float("C")?);
                FilterDesc::Mitchell {
                    radius: 2.0,
                    b: b.unwrap_or(1.0 / 3.0) as f32,
                    c: c.unwrap_or(1.0 / 3.0) as f32,
                    samples: None,
                }
            }
            other => {
                if other == "lanczos" {
                    element.float("lobes")?;
                    element.approximated("lobes", "a Catmull-Rom filter in place of Lanczos's");
                }
                FilterDesc::Mitchell { radius: 2.0, b: 0.0, c: 0.5, samples: None }
            }
        };
        element.finish(&mut self.draft);
        Ok(filter)
    }

    fn sampler(&mut self, id: PluginId) -> Result<()> {
        let mut element = Element::new(self.document, id);
        let spp = element.count("sample_count", 1)?.unwrap_or(4);
        let seed = element.integer("seed")?.unwrap_or(0);
        // What stratifies the samples in other ways has the same mean: Sobol points do it here.
        element.boolean("jitter", true)?;
        if element.kind() == "independent" {
            element.mapped("", SOBOL_FOR_INDEPENDENT);
        }
        let sampler = &mut self.draft.desc.sampler;
        (sampler.spp, sampler.seed) = (spp, seed.unsigned_abs());
        element.finish(&mut self.draft);
        Ok(())
    }
}

/// The vertical angle of view in degrees.
pub(super) fn fov(element: &mut Element, aspect: f64) -> Result<f64> {
    let focal_length = element.text("focal_length")?;
    let (fov, axis) = match (element.float("fov")?, focal_length) {
        (Some(_), Some(_)) => {
            return Err(element.place_of("focal_length").error("give either \"fov\" or \"focal_length\""));
        }
        (Some(fov), None) => (fov, element.text("fov_axis")?.unwrap_or("x")),
        (None, text) => {
            let text = text.unwrap_or("50mm");
            let number = values::number(text.trim().strip_suffix("mm").unwrap_or(text));
            let length = number.ok().filter(|&length| length > 0.0);
            let length = length.ok_or_else(|| {
                element.place_of("focal_length").error(format!("\"{text}\" is not a focal length, as 50mm"))
            })?;
            if element.take("fov_axis").is_some() {
                element.ignored("fov_axis", "the focal length is that of a film of 36 x 24 mm, by the diagonal");
            }
            (2.0 * (0.5 * 36f64.hypot(24.0) / length).atan().to_degrees(), "diagonal")
        }
    };
    if !(fov > 0.0 && fov < 180.0) {
        return Err(element.place_of("fov").error(format!("\"fov\" must be above 0 and below 180, not {fov}")));
    }
    let half = (0.5 * fov.to_radians()).tan();
    let half_height = match axis {
        "x" => half / aspect,
        "y" => half,
        "diagonal" => half / (1.0 + aspect * aspect).sqrt(),
        "smaller" => half / aspect.min(1.0),
        "larger" => half / aspect.max(1.0),
        other => {
            let message = format!("\"fov_axis\" must be x, y, diagonal, smaller or larger, not \"{other}\"");
            return Err(element.place_of("fov_axis").error(message));
        }
    };
    Ok(2.0 * half_height.atan().to_degrees())
}

/// Where the camera stands: the rotation and translation of `map`.
fn placement(element: &mut Element, map: &DAffine3) -> Result<TransformDesc> {
    let m = map.matrix3;
    let singular = || element.place_of("to_world").error("the transform of the camera is singular");
    let z = m.z_axis.try_normalize().ok_or_else(singular)?;
    let x = (m.x_axis - z * m.x_axis.dot(z)).try_normalize().ok_or_else(singular)?;
    let y = z.cross(x);
    if y.dot(m.y_axis) <= 0.0 {
        if m.determinant() == 0.0 {
            return Err(singular());
        }
        element.approximated("to_world", "the camera mirrors the picture, which is not supported: it is not mirrored");
    } else if y.dot(m.y_axis.normalize_or_zero()) < 1.0 - 1e-4 {
        element.approximated("to_world", "the camera's transform shears, which is left out");
    } else if element.kind() != "orthographic"
        && matches!(element.take("to_world").map(|p| &p.value), Some(Value::Transform(_)))
    {
        let scale = m.x_axis.length();
        if (scale - 1.0).abs() > 1e-3
            || (m.y_axis.length() - scale).abs() > 1e-3
            || (m.z_axis.length() - scale).abs() > 1e-3
        {
            element.approximated("to_world", "a camera has no scale: it is left out");
        }
    }
    let placed = DAffine3 { matrix3: DMat3::from_cols(x, y, z) * HALF_TURN, translation: map.translation };
    Ok(TransformDesc(vec![TransformStepDesc::Matrix(values::rows(&placed))]))
}
