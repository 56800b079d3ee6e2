//! Curves and hair.

use super::Reader;
use super::bsdfs::relative_index;
use super::element::Element;
use super::textures::UvOrigin;
use crate::desc::{
    CurveBasisDesc, CurveKindDesc, CurvesDesc, HairDesc, HairIor, HairRoughness, HairTilt, MaterialDesc,
};
use crate::error::Result;

impl<'a> Reader<'a> {
    /// The strands of a file.
    pub(super) fn curves(&mut self, element: &mut Element<'a>) -> Result<CurvesDesc> {
        let kind = element.kind();
        let file = element.file("filename", self.scene)?;
        let file = file.ok_or_else(|| element.place().error(format!("the shape {kind} needs \"filename\"")))?;
        let basis = if kind == "linearcurve" { CurveBasisDesc::Linear } else { CurveBasisDesc::BSpline };
        self.draft.files.insert(self.scene.parent().unwrap_or(std::path::Path::new("")).join(&file));
        Ok(CurvesDesc::new(Some(file), None, basis, CurveKindDesc::Round, 1.0, None, None))
    }

    /// The model of Chiang et al., as here.
    pub(super) fn hair(&mut self, element: &mut Element<'a>, uv: UvOrigin) -> Result<MaterialDesc> {
        let roughness = |element: &mut Element, name: &str| -> Result<HairRoughness> {
            Ok(HairRoughness(element.float(name)?.unwrap_or(0.3) as f32))
        };
        let mut desc = HairDesc {
            longitudinal_roughness: roughness(element, "longitudinal_roughness")?,
            azimuthal_roughness: roughness(element, "azimuthal_roughness")?,
            scale_tilt_degrees: HairTilt(element.float("scale_tilt")?.unwrap_or(2.0) as f32),
            ior: HairIor(relative_index(element, "amber")?),
            ..HairDesc::default()
        };
        desc.sigma_a = self.constant(element, "sigma_a", uv)?;
        let (eumelanin, pheomelanin) = (element.float("eumelanin")?, element.float("pheomelanin")?);
        if desc.sigma_a.is_none() {
            // Mitsuba's defaults, of which one stays where the other is given.
            desc.eumelanin = Some(eumelanin.unwrap_or(1.3) as f32);
            desc.pheomelanin = Some(pheomelanin.unwrap_or(0.2) as f32);
        }
        Ok(MaterialDesc::Hair(Box::new(desc)))
    }
}
