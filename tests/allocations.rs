//! Hits allocate no memory on the heap, whatever their materials: a program of its own, whose allocator counts.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use serde_json::{Value, json};
use steradian::internal::accel::AccelKind;
use steradian::internal::render::Overrides;
use steradian_bench::stability::render::{prepare, render_with};

/// The system's allocator.
struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every method is that of the system's allocator with the same arguments; what it returns is returned.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's obligations are those of the same method.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// Every kind of material that is evaluated at each hit: coats with textures, constant coats and coats over coats, some
/// as parts of others.
fn scene(integrator: &Value) -> Value {
    let tiles = json!({ "texture": "tiles" });
    json!({
        "film": { "width": 16, "height": 16 },
        "camera": { "position": [0, 1, 4], "look_at": [0, 0, 0], "vertical_fov_degrees": 50 },
        "integrator": integrator,
        "textures": { "tiles": { "type": "checker", "color0": [0.2, 0.2, 0.2], "color1": [0.6, 0.6, 0.6] } },
        "materials": {
            "red": { "type": "diffuse", "albedo": [0.7, 0.2, 0.2] },
            "tiled": { "type": "diffuse", "albedo": tiles },
            "gold": { "type": "conductor", "metal": "gold", "roughness": tiles },
            "varnish": { "type": "coated", "base": "red", "roughness": 0.3 },
            "lacquer": { "type": "coated", "base": "gold", "roughness": tiles },
            "twice": { "type": "coated", "base": "varnish", "roughness": tiles },
            "thrice": { "type": "coated", "base": "twice", "tint": 0.8 },
            "principled": { "type": "principled", "base_color": tiles, "clearcoat": tiles, "metallic": 0.5 },
            "plastic": { "type": "plastic", "albedo": tiles, "roughness": tiles },
            "mix": { "type": "mix", "materials": ["varnish", "lacquer"], "amount": tiles },
            "sides": { "type": "two_sided", "front": "mix", "back": "thrice" },
            "coats": { "type": "mix", "materials": ["sides", "thrice"] },
            "rest": { "type": "mix", "materials": ["principled", "plastic"] }
        },
        "shapes": [
            { "type": "quad", "material": "coats", "origin": [-3, -1, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6] },
            { "type": "sphere", "material": "sides", "transform": [{ "translate": [-1, 0, 0] }] },
            {
                "type": "sphere", "material": "sides", "reverse_normal": true, "radius": 0.5,
                "transform": [{ "translate": [1, 0, 1] }]
            },
            { "type": "sphere", "material": "rest", "transform": [{ "translate": [1, 0, -1] }] }
        ],
        "lights": [
            { "type": "environment", "radiance": [0.5, 0.6, 0.7] },
            { "type": "point", "position": [2, 3, 2], "intensity": [9, 9, 9] }
        ]
    })
}

/// Allocations while a scene is rendered on one thread.
fn allocations(integrator: &Value, spp: u32) -> u64 {
    let prepared = prepare(&scene(integrator), &Overrides { threads: Some(1), spp: Some(spp), ..Overrides::default() });
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    drop(render_with(&prepared, AccelKind::EMBREE));
    ALLOCATIONS.load(Ordering::Relaxed) - before
}

/// The one test of the program: a second one would be counted with it.
#[test]
fn samples_allocate_nothing() {
    for integrator in [
        json!({ "type": "path", "max_depth": 6 }),
        json!({ "type": "path", "max_depth": 6, "regularize": 0.3 }),
        json!({ "type": "whitted", "max_depth": 6 }),
    ] {
        // The first render also makes what lasts as long as the program; from 16 samples on there are pilots. With more
        // samples, more hits may need memory at the same time: a few allocations more, where one for each hit would be
        // tens of thousands.
        let [_, few, many] = [64, 16, 64].map(|spp| allocations(&integrator, spp));
        assert!(many <= few + 64, "{integrator}: {few} allocations at 16 samples a pixel, {many} at 64");
    }
}
