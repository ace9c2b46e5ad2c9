//! Finished pictures: the statistics that every one carries, and the file with its scene. The command line and the window
//! save through here.

use std::path::Path;

use serde_json::{Value, json};

use crate::error::Result;
use crate::image::Image;
use crate::image::tone::Display;
use crate::io::picture::{self, Metadata};
use crate::render::Renderer;
use crate::render::film::Sums;
use crate::scene::Scene;

/// The statistics that a picture has wherever it was made; `samples` of each pixel.
pub fn stats(renderer: &Renderer, sums: &Sums, samples: u64) -> Value {
    let (scene, medium) = (&renderer.scene, &renderer.medium);
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "adapter": renderer.gpu.info.name,
        "backend": renderer.gpu.backend(),
        "width": sums.width,
        "height": sums.height,
        "spp": samples,
        "seed": scene.integrator.seed,
        "mode": scene.integrator.mode.name(),
        "paths": sums.square.iter().map(|s| s[3]).sum::<f64>() as u64,
        "relative_error": sums.relative_error(),
        "bytes": {
            "volume": medium.volume_bytes,
            "majorant": medium.majorant_bytes,
            "film": renderer.film.bytes(),
            "reservoirs": 0,
        },
        "cell": medium.cell,
        "density_scale": medium.density_scale(scene),
        "biased": false,
    })
}

/// Writes a picture with its scene and statistics, whole or not at all; paths in the scene are relative to it.
pub fn picture(path: &Path, image: &Image, scene: &Scene, stats: &Value) -> Result<()> {
    let folder = std::path::absolute(path).ok().and_then(|p| p.parent().map(Path::to_path_buf)).unwrap_or_default();
    let meta = Metadata {
        scene_toml: scene.to_toml(&folder),
        stats_json: stats.to_string(),
        software: format!("nephele {}", env!("CARGO_PKG_VERSION")),
        description: format!("{} samples per pixel, mode {}", stats["spp"], scene.integrator.mode.name()),
    };
    picture::save(path, image, &meta, &Display::of(&scene.display))
}
