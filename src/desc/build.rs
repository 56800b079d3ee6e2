//! Scenes built in code: everything that is not given has the default of the scene format.

use super::{
    CameraDesc, ColorDesc, CubeDesc, DielectricDesc, DiskDesc, DistributionDesc, EmissionDesc, EnvironmentLightDesc,
    LightDesc, MaterialDesc, MeshDesc, MeshShadingDesc, NormalWeightDesc, PlaneDesc, PointLightDesc, QuadDesc,
    RangedDesc, RoughnessDesc, ScalarDesc, SceneDesc, ShapeDesc, SmoothByDesc, SphereDesc, TransformStepDesc,
};

impl SceneDesc {
    /// Replaces the camera.
    #[must_use]
    pub fn with_camera(mut self, camera: CameraDesc) -> Self {
        self.camera = camera;
        self
    }

    /// Adds a material or replaces that of the same name.
    #[must_use]
    pub fn with_material(mut self, name: impl Into<String>, material: MaterialDesc) -> Self {
        self.materials.insert(name.into(), material);
        self
    }

    /// Adds a shape to the world.
    #[must_use]
    pub fn with_shape(mut self, shape: ShapeDesc) -> Self {
        self.shapes.push(shape);
        self
    }

    /// Adds a light.
    #[must_use]
    pub fn with_light(mut self, light: LightDesc) -> Self {
        self.lights.push(light);
        self
    }
}

impl CameraDesc {
    /// A perspective camera at a position that looks at a point, with +Y up and a vertical angle of view of 40 degrees.
    pub fn at(position: [f64; 3], look_at: [f64; 3]) -> Self {
        Self { position: Some(position), look_at: Some(look_at), ..Self::default() }
    }

    /// Sets the vertical angle of view in degrees.
    #[must_use]
    pub fn with_fov(mut self, degrees: f64) -> Self {
        self.vertical_fov_degrees = Some(degrees);
        self
    }
}

impl ShapeDesc {
    /// A sphere about the origin.
    pub fn sphere(radius: f64) -> Self {
        Self::Sphere(SphereDesc::new(radius, None, None, 360.0))
    }

    /// A parallelogram with its normal along `edge_u` x `edge_v`.
    pub fn quad(origin: [f64; 3], edge_u: [f64; 3], edge_v: [f64; 3]) -> Self {
        Self::Quad(QuadDesc::new(origin, edge_u, edge_v))
    }

    /// A plane without end.
    pub fn plane(point: [f64; 3], normal: [f64; 3]) -> Self {
        Self::Plane(PlaneDesc::new(point, normal))
    }

    /// A disk about the origin with normal +z.
    pub fn disk(radius: f64) -> Self {
        Self::Disk(DiskDesc::new(radius, 0.0, 360.0))
    }

    /// The cube from -1 to 1.
    pub fn cube() -> Self {
        Self::Cube(CubeDesc::new())
    }

    /// A flat triangle mesh: positions of the vertices, and the corners of each triangle as indices from 0,
    /// counter-clockwise seen from the front.
    pub fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Self {
        let mut mesh = MeshDesc::empty();
        (mesh.positions, mesh.triangles) = (Some(positions.to_vec()), Some(triangles.to_vec()));
        Self::Mesh(mesh)
    }

    /// The mesh in a PLY or OBJ file, or one that [`Renderer::with_mesh`](crate::Renderer::with_mesh) adds under this
    /// name.
    pub fn mesh_file(file: impl Into<String>) -> Self {
        Self::Mesh(MeshDesc::from_file(file))
    }

    /// Sets the material by its name.
    #[must_use]
    pub fn with_material(mut self, name: impl Into<String>) -> Self {
        *self.common_mut().material = Some(name.into());
        self
    }

    /// Sets the name by which layers pick the shape.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        *self.common_mut().name = Some(name.into());
        self
    }

    /// Adds a step to the transform, after those before.
    #[must_use]
    pub fn then(mut self, step: TransformStepDesc) -> Self {
        self.common_mut().transform.0.push(step);
        self
    }

    /// Moves the shape by a vector, after the steps before.
    #[must_use]
    pub fn moved(self, by: [f64; 3]) -> Self {
        self.then(TransformStepDesc::Translate(by))
    }

    /// The shape emits this radiance, linear RGB, from its front.
    #[must_use]
    pub fn emitting(mut self, radiance: [f32; 3]) -> Self {
        *self.common_mut().emission =
            Some(EmissionDesc { radiance, texture: None, two_sided: false, hidden: false, group: None });
        self
    }
}

impl MeshDesc {
    /// The mesh of a file, with every other default.
    pub fn from_file(file: impl Into<String>) -> Self {
        Self { file: Some(file.into()), ..Self::empty() }
    }

    /// A mesh without data, to be filled in.
    pub fn empty() -> Self {
        Self {
            file: None,
            positions: None,
            triangles: None,
            faces: None,
            normals: None,
            uvs: None,
            colors: None,
            attributes: Default::default(),
            deform_files: Vec::new(),
            deform_positions: Vec::new(),
            shading: MeshShadingDesc::default(),
            crease_angle_degrees: None,
            normal_weight: NormalWeightDesc::default(),
            smooth_by: SmoothByDesc::default(),
            subdivision: None,
            displacement: None,
            name: None,
            material: None,
            transform: Default::default(),
            motion: Vec::new(),
            opacity: None,
            emission: None,
            reverse_normal: false,
        }
    }
}

impl MaterialDesc {
    /// Ideal diffuse reflection of this fraction of light.
    pub fn diffuse(albedo: impl Into<ColorDesc>) -> Self {
        Self::Diffuse { albedo: albedo.into(), roughness: ScalarDesc::Constant(0.0) }
    }

    /// An ideal mirror.
    pub fn mirror() -> Self {
        Self::Mirror { reflectance: ColorDesc::Grey(1.0) }
    }

    /// Smooth glass of an index of refraction, from 1/10 to 10.
    pub fn glass(ior: f32) -> Self {
        Self::Dielectric(Box::new(DielectricDesc { ior: RangedDesc::Constant(ior), ..DielectricDesc::invisible() }))
    }

    /// A metal by name, such as `gold`, with a roughness from 0 to 1.
    pub fn metal(name: impl Into<String>, roughness: f32) -> Self {
        Self::Conductor {
            metal: Some(name.into()),
            eta: None,
            k: None,
            roughness: Some(RoughnessDesc::Isotropic(roughness)),
            alpha: None,
            distribution: DistributionDesc::default(),
            tint: ColorDesc::Grey(1.0),
            multiscatter: true,
        }
    }
}

impl LightDesc {
    /// The same radiance, linear RGB, from every direction.
    pub fn environment(radiance: [f32; 3]) -> Self {
        let radiance = Some(radiance);
        Self::Environment(EnvironmentLightDesc { radiance, file: None, scale: 1.0, transform: None, group: None })
    }

    /// A point light of this radiant intensity, linear RGB.
    pub fn point(position: [f64; 3], intensity: [f32; 3]) -> Self {
        Self::Point(PointLightDesc { position, intensity, group: None })
    }
}

impl From<[f32; 3]> for ColorDesc {
    fn from(rgb: [f32; 3]) -> Self {
        Self::Rgb(rgb)
    }
}

impl From<f32> for ColorDesc {
    fn from(grey: f32) -> Self {
        Self::Grey(grey)
    }
}
