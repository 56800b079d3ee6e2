//! The directives of a scene in their order.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::area_light::AreaLight;
use super::camera::{self, CameraDirective};
use super::colors::{ColorSpace, Colors};
use super::curves::{joined, push};
use super::lights::Lights;
use super::materials::Materials;
use super::media::{MediumDirective, MediumInterface, MediumTable};
use super::options::{self, Typed};
use super::params::{Params, Values};
use super::shapes::{Directive, Shapes};
use super::state::{Ctm, Graphics, MAX_DEPTH, Material, ShapeMaterial, Times, World};
use super::textures::{TextureDirective, Textures};
use super::tokens::{Lexer, Position, TokenKind};
use super::transforms::{self, Change};
use crate::desc::{InstanceDesc, ShapeDesc};
use crate::error::{Error, Result};
use crate::import::foreign::{Draft, Imported};

/// Files within files.
const MAX_INCLUDE_DEPTH: usize = 32;

/// Files in all.
const MAX_INCLUDES: usize = 10_000;

/// What is open: an attribute block, a transform block, an object.
enum Open {
    Attribute(Box<Graphics>),
    Transform(Ctm),
    Object(Box<Graphics>),
}

/// An object that is being defined.
struct Object {
    name: String,
    place: String,
    shapes: Vec<(String, ShapeDesc)>,
}

/// Reads a scene.
pub(crate) struct Reader {
    scene: PathBuf,
    folder: PathBuf,
    lexers: Vec<Lexer>,
    includes: usize,
    draft: Draft,
    graphics: Graphics,
    open: Vec<Open>,
    coordinate_systems: BTreeMap<String, Ctm>,
    /// Directives before the world, by their names.
    options: BTreeMap<&'static str, Typed>,
    camera: Option<CameraDirective>,
    times: Times,
    world: World,
    exposure: f64,
    in_world: bool,
    textures: Textures,
    materials: BTreeMap<String, Rc<ShapeMaterial>>,
    /// Names in the scene by those in the file; `None` if nothing of the object can be seen.
    objects: BTreeMap<String, Option<String>>,
    object: Option<Object>,
    media: MediumTable,
}

impl Reader {
    /// A reader of a scene's main file.
    pub fn new(scene: &Path) -> Self {
        Self {
            scene: scene.into(),
            folder: scene.parent().map(Path::to_path_buf).unwrap_or_default(),
            lexers: Vec::new(),
            includes: 0,
            draft: Draft::default(),
            graphics: Graphics::default(),
            open: Vec::new(),
            coordinate_systems: BTreeMap::new(),
            options: BTreeMap::new(),
            camera: None,
            times: Times::default(),
            world: World::default(),
            exposure: 1.0,
            in_world: false,
            textures: Textures::default(),
            materials: BTreeMap::new(),
            objects: BTreeMap::new(),
            object: None,
            media: MediumTable::default(),
        }
    }

    /// Reads all of it.
    pub fn read(mut self) -> Result<Imported> {
        let bytes = crate::file::read_stream(&self.scene)
            .map_err(|e| Error::Missing { file: self.scene.clone(), message: e.to_string() })?;
        self.lexers.push(Lexer::new(self.scene.clone(), bytes));
        let mut last = None;
        while let Some(mut lexer) = self.lexers.pop() {
            let Some(token) = lexer.take()? else {
                last = Some((lexer.position(), lexer));
                continue;
            };
            if token.kind != TokenKind::Word {
                return Err(
                    lexer.error(token.at, format!("expected a directive such as Shape, not {}", lexer.text(&token)))
                );
            }
            let directive = lexer.text(&token).to_owned();
            let included = self.directive(&mut lexer, token.at, &directive)?;
            self.lexers.push(lexer);
            self.lexers.extend(included);
        }
        if let Some((at, lexer)) = last {
            if !self.open.is_empty() {
                return Err(lexer.error(at, "the file ends within an attribute, transform or object block"));
            }
            if !self.in_world {
                return Err(lexer.error(at, "no WorldBegin"));
            }
        }
        self.media.finish(&mut self.draft);
        Ok(self.draft.finish())
    }

    /// The parameters of a directive, whose files are noted.
    fn params(&mut self, lexer: &mut Lexer, at: Position, element: String) -> Result<Params> {
        let params = Params::read(lexer, at, element)?;
        self.draft.files.extend(params.strings().map(|name| self.folder.join(name)).filter(|file| file.is_file()));
        Ok(params)
    }

    /// Carries out a directive that changes the graphics state: attributes, transformations, orientation, colour space.
    /// False for any other directive.
    fn change_graphics_state(&mut self, lexer: &mut Lexer, at: Position, directive: &str) -> Result<bool> {
        match directive {
            "AttributeBegin" => self.push(lexer, at, |graphics| Open::Attribute(Box::new(graphics.clone())))?,
            "TransformBegin" => self.push(lexer, at, |graphics| Open::Transform(graphics.ctm))?,
            "AttributeEnd" => match self.open.pop() {
                Some(Open::Attribute(graphics)) => self.graphics = *graphics,
                _ => return Err(lexer.error(at, "AttributeEnd without AttributeBegin")),
            },
            "TransformEnd" => match self.open.pop() {
                Some(Open::Transform(ctm)) => self.graphics.ctm = ctm,
                _ => return Err(lexer.error(at, "TransformEnd without TransformBegin")),
            },
            "Attribute" => {
                let target = quoted(lexer, at, "shape, light, material, medium or texture")?;
                let params = self.params(lexer, at, format!("Attribute {target}"))?;
                let attributes = Rc::make_mut(&mut self.graphics.attributes).entry(target).or_default();
                for param in params.into_list() {
                    attributes.retain(|old| old.name != param.name);
                    attributes.push(param);
                }
            }
            "CoordinateSystem" => {
                let name = quoted(lexer, at, "a name")?;
                self.coordinate_systems.insert(name, self.graphics.ctm);
            }
            "CoordSysTransform" => {
                let name = quoted(lexer, at, "a name")?;
                let known = self.coordinate_systems.get(&name);
                self.graphics.ctm = *known.ok_or_else(|| {
                    lexer.error(at, format!("CoordSysTransform: no coordinate system named \"{name}\""))
                })?;
            }
            "ReverseOrientation" => self.graphics.reverse_orientation = !self.graphics.reverse_orientation,
            "ActiveTransform" => {
                let token = lexer.take()?;
                self.graphics.active = match token.map(|token| lexer.text(&token)) {
                    Some("StartTime") => [true, false],
                    Some("EndTime") => [false, true],
                    Some("All") => [true, true],
                    _ => return Err(lexer.error(at, "ActiveTransform: expected StartTime, EndTime or All")),
                };
            }
            "TransformTimes" => self.transform_times(lexer, at)?,
            "ColorSpace" => {
                let name = quoted(lexer, at, "a colour space")?;
                let space = ColorSpace::named(&name);
                self.graphics.color_space =
                    space.ok_or_else(|| lexer.error(at, format!("unknown colour space \"{name}\"")))?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Carries out a directive; the result is a file to read next.
    fn directive(&mut self, lexer: &mut Lexer, at: Position, directive: &str) -> Result<Option<Lexer>> {
        if let Some(change) = transforms::read(lexer, at, directive)? {
            match change {
                Change::Concatenate(map) => self.graphics.concatenate(map),
                Change::Replace(map) => self.graphics.change(|_| map),
            }
            return Ok(None);
        }
        if self.change_graphics_state(lexer, at, directive)? {
            return Ok(None);
        }
        match directive {
            "Include" | "Import" => return self.include(lexer, at).map(Some),
            "WorldBegin" => self.world_begin(lexer, at)?,
            "WorldEnd" => {}
            "Option" => {
                let params = self.params(lexer, at, "Option".into())?;
                self.draft.ignored(&params.place, "Option", "", "options are those of the command line");
            }
            "Film" | "PixelFilter" | "Sampler" | "Integrator" | "Accelerator" | "Camera" => {
                self.option(lexer, at, directive)?;
            }
            "ObjectBegin" | "ObjectEnd" | "ObjectInstance" => self.object(lexer, at, directive)?,
            "MediumInterface" => self.graphics.media = Rc::new(MediumInterface::read(lexer, at)?),
            "MakeNamedMedium" => {
                let name = quoted(lexer, at, "a name")?;
                let params = self.params(lexer, at, format!("{directive} \"{name}\""))?;
                let params =
                    params.with_defaults(self.graphics.attributes.get("medium").map_or(&[][..], Vec::as_slice));
                let colors = Colors { folder: &self.folder, space: self.graphics.color_space };
                let (transform, motion) = self.world.place(&self.graphics.ctm, crate::math::DAffine3::IDENTITY);
                let (name, params, scene) = (&*name, &params, &*self.scene);
                let medium = MediumDirective { name, params, colors: &colors, scene, transform, motion };
                self.media.define(&mut self.draft, &medium)?;
            }
            "Material" | "MakeNamedMaterial" | "NamedMaterial" => self.material(lexer, at, directive)?,
            "Texture" => self.texture(lexer, at)?,
            "LightSource" => {
                let (kind, params) = self.typed(lexer, at, directive, "light")?;
                let colors = Colors { folder: &self.folder, space: self.graphics.color_space };
                let lights = Lights { colors, world: self.world, exposure: self.exposure, scene: &self.scene };
                lights.add(&mut self.draft, &kind, &params, &self.graphics.ctm)?;
            }
            "AreaLightSource" => {
                let (kind, params) = self.typed(lexer, at, directive, "light")?;
                let colors = Colors { folder: &self.folder, space: self.graphics.color_space };
                let light = AreaLight::read(&mut self.draft, &kind, &params, &colors, self.exposure)?;
                self.graphics.area_light = Some(Rc::new(light));
            }
            "Shape" => self.shape(lexer, at)?,
            other => return Err(lexer.error(at, format!("unknown directive \"{other}\""))),
        }
        Ok(None)
    }

    /// `Directive "kind" parameters`, with the attributes in force for its target.
    fn typed(&mut self, lexer: &mut Lexer, at: Position, directive: &str, target: &str) -> Result<(String, Params)> {
        if !self.in_world {
            return Err(lexer.error(at, format!("{directive} stands before WorldBegin")));
        }
        let kind = quoted(lexer, at, "a type")?;
        let params = self.params(lexer, at, format!("{directive} {kind}"))?;
        let defaults = self.graphics.attributes.get(target).map_or(&[][..], Vec::as_slice);
        Ok((kind, params.with_defaults(defaults)))
    }

    fn push(&mut self, lexer: &Lexer, at: Position, open: impl Fn(&Graphics) -> Open) -> Result<()> {
        if self.open.len() == MAX_DEPTH {
            return Err(lexer.error(at, format!("blocks are nested more than {MAX_DEPTH} deep")));
        }
        self.open.push(open(&self.graphics));
        Ok(())
    }

    fn include(&mut self, lexer: &mut Lexer, at: Position) -> Result<Lexer> {
        let name = quoted(lexer, at, "a file")?;
        self.includes += 1;
        if self.lexers.len() >= MAX_INCLUDE_DEPTH || self.includes > MAX_INCLUDES {
            return Err(lexer.error(at, format!("\"{name}\": too many files include each other")));
        }
        let file = self.folder.join(&name);
        if name.ends_with(".gz") {
            return Err(lexer.error(at, format!("\"{name}\": compressed files are not read")));
        }
        let bytes = crate::file::read(&file).map_err(|e| Error::Missing {
            file: file.clone(),
            message: format!("{e} (included by {})", lexer.place(at)),
        })?;
        self.draft.files.insert(file.clone());
        Ok(Lexer::new(file, bytes))
    }

    fn transform_times(&mut self, lexer: &mut Lexer, at: Position) -> Result<()> {
        for time in &mut self.times.0 {
            let token = lexer.take()?;
            let number = token.and_then(|token| lexer.text(&token).parse::<f64>().ok()).filter(|time| time.is_finite());
            *time = number.ok_or_else(|| lexer.error(at, "TransformTimes: expected two times"))?;
        }
        if self.times.0[1] <= self.times.0[0] {
            return Err(lexer.error(at, "TransformTimes: the second time must be above the first"));
        }
        Ok(())
    }

    fn option(&mut self, lexer: &mut Lexer, at: Position, directive: &str) -> Result<()> {
        if self.in_world {
            return Err(lexer.error(at, format!("{directive} stands after WorldBegin")));
        }
        let kind = quoted(lexer, at, "a type")?;
        let params = self.params(lexer, at, format!("{directive} {kind}"))?;
        let key = match directive {
            "Film" => "Film",
            "PixelFilter" => "PixelFilter",
            "Sampler" => "Sampler",
            "Integrator" => "Integrator",
            "Camera" => {
                self.media.surround(&mut self.draft, &params, &self.graphics.media.outside);
                if let Some(inverse) = self.graphics.ctm.inverse() {
                    self.coordinate_systems.insert("camera".into(), inverse);
                }
                self.camera = Some(CameraDirective { kind, params, camera_from_world: self.graphics.ctm });
                return Ok(());
            }
            _ => {
                self.draft.ignored(&params.place, &params.element, "", "it changes the speed only");
                return Ok(());
            }
        };
        self.options.insert(key, Typed { kind, params });
        Ok(())
    }

    fn world_begin(&mut self, lexer: &Lexer, at: Position) -> Result<()> {
        if self.in_world {
            return Err(lexer.error(at, "a second WorldBegin"));
        }
        let get = |key: &str| self.options.get(key);
        let draft = &mut self.draft;
        self.exposure =
            options::exposure(get("Film"), camera::shutter(self.camera.as_ref().map(|camera| &camera.params))?)?;
        options::set_film(draft, get("Film"))?;
        options::set_filter(draft, get("PixelFilter"))?;
        options::set_sampler(draft, get("Sampler"))?;
        options::set_integrator(draft, get("Integrator"))?;
        self.media.are_hidden = get("Integrator").is_some_and(|i| matches!(i.kind.as_str(), "path" | "simplepath"));
        let size = [draft.desc.film.width, draft.desc.film.height];
        let default = || {
            let params = Params::none(lexer, at, "Camera perspective".into());
            CameraDirective { kind: "perspective".into(), params, camera_from_world: Ctm::default() }
        };
        let directive = self.camera.take().unwrap_or_else(default);
        self.world = camera::set_camera(draft, &directive, size, self.times)?;
        self.graphics.ctm = Ctm::default();
        self.graphics.active = [true; 2];
        self.coordinate_systems.insert("world".into(), Ctm::default());
        self.in_world = true;
        Ok(())
    }

    fn object(&mut self, lexer: &mut Lexer, at: Position, directive: &str) -> Result<()> {
        if !self.in_world {
            return Err(lexer.error(at, format!("{directive} stands before WorldBegin")));
        }
        match directive {
            "ObjectBegin" => {
                let name = quoted(lexer, at, "a name")?;
                if self.object.is_some() {
                    return Err(lexer.error(at, "an object within an object"));
                }
                if self.objects.contains_key(&name) {
                    return Err(lexer.error(at, format!("the object \"{name}\" is defined twice")));
                }
                self.push(lexer, at, |graphics| Open::Object(Box::new(graphics.clone())))?;
                self.object = Some(Object { name, place: lexer.place(at), shapes: Vec::new() });
            }
            "ObjectEnd" => {
                let (Some(Open::Object(graphics)), Some(object)) = (self.open.pop(), self.object.take()) else {
                    return Err(lexer.error(at, "ObjectEnd without ObjectBegin"));
                };
                self.graphics = *graphics;
                let name = if object.shapes.is_empty() {
                    None
                } else {
                    Some(self.draft.add_object(&object.name, &object.place, object.shapes, Vec::new()))
                };
                self.objects.insert(object.name, name);
            }
            _ => {
                let name = quoted(lexer, at, "a name")?;
                if self.object.is_some() {
                    return Err(lexer.error(at, "an instance within an object"));
                }
                let known = self.objects.get(&name);
                let known = known.ok_or_else(|| lexer.error(at, format!("no object named \"{name}\"")))?;
                if let Some(object) = known.clone() {
                    let (transform, motion) = self.world.place(&self.graphics.ctm, crate::math::DAffine3::IDENTITY);
                    self.draft.add_instance(&lexer.place(at), InstanceDesc { object, name: None, transform, motion });
                }
            }
        }
        Ok(())
    }

    fn material(&mut self, lexer: &mut Lexer, at: Position, directive: &str) -> Result<()> {
        let first = quoted(lexer, at, "a name or type")?;
        if directive == "NamedMaterial" {
            let known = self.materials.get(&first).cloned();
            self.graphics.material = Some(known.ok_or_else(|| {
                let hint =
                    crate::suggestion::did_you_mean(&first, self.materials.keys().map(String::as_str), ["\"", "\""]);
                lexer.error(at, format!("no material named \"{first}\"{hint}"))
            })?);
            return Ok(());
        }
        let params = self.params(lexer, at, format!("{directive} \"{first}\""))?;
        let params = params.with_defaults(self.graphics.attributes.get("material").map_or(&[][..], Vec::as_slice));
        let (name, kind) = match directive {
            // Numbered, so that finding a free name is quick.
            "Material" => (format!("{first}_{}", self.draft.desc.materials.len()), first),
            _ => {
                if self.materials.contains_key(&first) {
                    return Err(lexer.error(at, format!("the material \"{first}\" is defined twice")));
                }
                let kind = params.string("type")?.ok_or_else(|| params.error("needs a type"))?.to_owned();
                (first, kind)
            }
        };
        let material = if matches!(kind.as_str(), "interface" | "none" | "") {
            params.report(&mut self.draft);
            ShapeMaterial::Interface
        } else {
            self.new_material(&name, &kind, &params)?
        };
        let material = Rc::new(material);
        if directive == "Material" {
            self.graphics.material = Some(material);
        } else {
            self.materials.insert(name, material);
        }
        Ok(())
    }

    fn new_material(&mut self, name: &str, kind: &str, params: &Params) -> Result<ShapeMaterial> {
        let known = |name: &str| match self.materials.get(name).map(Rc::as_ref) {
            Some(ShapeMaterial::Material(material)) => Some(material.clone()),
            _ => None,
        };
        let parts: Vec<Material> = match params.get("materials").map(|param| &param.values) {
            Some(Values::Strings(names)) => names.iter().filter_map(|name| known(name)).collect(),
            _ => Vec::new(),
        };
        let colors = Colors { folder: &self.folder, space: self.graphics.color_space };
        let mut materials = Materials { textures: &self.textures, colors, draft: &mut self.draft };
        let added = materials.add(name, kind, params, |name| known(name).map(|material| material.name))?;
        Ok(ShapeMaterial::Material(Material {
            name: added,
            is_textured: params.names_textures()
                || params.has("normalmap")
                || parts.iter().any(|part| part.is_textured),
            has_inside: kind == "dielectric" || parts.iter().any(|part| part.has_inside),
        }))
    }

    fn texture(&mut self, lexer: &mut Lexer, at: Position) -> Result<()> {
        let (name, of) = (quoted(lexer, at, "a name")?, quoted(lexer, at, "float or spectrum")?);
        let kind = quoted(lexer, at, "a type")?;
        let params = self.params(lexer, at, format!("Texture {kind} \"{name}\""))?;
        let params = params.with_defaults(self.graphics.attributes.get("texture").map_or(&[][..], Vec::as_slice));
        let of_numbers = match of.as_str() {
            "float" => true,
            "spectrum" => false,
            _ => return Err(lexer.error(at, format!("textures are of float or spectrum, not \"{of}\""))),
        };
        let colors = Colors { folder: &self.folder, space: self.graphics.color_space };
        let directive = TextureDirective { name: &name, of_numbers, kind: &kind, params };
        self.textures.define(&mut self.draft, &directive, &colors)
    }

    fn shape(&mut self, lexer: &mut Lexer, at: Position) -> Result<()> {
        let (kind, params) = self.typed(lexer, at, "Shape", "shape")?;
        let in_object = self.object.is_some();
        let world = if in_object { World { mirrored: false, ..self.world } } else { self.world };
        let colors = Colors { folder: &self.folder, space: self.graphics.color_space };
        let shapes = Shapes { textures: &self.textures, colors, world, scene: &self.scene, in_object };
        let read = shapes.read(
            &mut self.draft,
            &mut self.media,
            Directive { kind: &kind, params: &params },
            &self.graphics,
        )?;
        let Some(mut shape) = read else { return Ok(()) };
        match &mut self.object {
            Some(object) => push(&mut object.shapes, params.place, shape),
            None if joined(self.draft.desc.shapes.last_mut(), &mut shape) => {}
            None => self.draft.add_shape(&params.place, shape),
        }
        Ok(())
    }
}

/// A string that has to follow.
pub(super) fn quoted(lexer: &mut Lexer, at: Position, what: &str) -> Result<String> {
    match lexer.take()? {
        Some(token) if token.kind == TokenKind::Quoted => Ok(lexer.string(&token)),
        Some(token) => Err(lexer.error(token.at, format!("expected {what} in quotes, not {}", lexer.text(&token)))),
        None => Err(lexer.error(at, format!("the file ends where {what} in quotes has to follow"))),
    }
}
