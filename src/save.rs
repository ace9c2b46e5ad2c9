//! Finished pictures: the statistics that every one carries, and the file with its scene. The command line and the window
//! save through here.

use std::path::Path;

use serde_json::{Value, json};

use crate::error::Result;
use crate::image::Image;
use crate::image::tone::{Display, ToneMap};
use crate::io::picture::{self, Metadata};
use crate::render::Renderer;
use crate::render::film::Sums;
use crate::render::heat;
use crate::scene::{Bias, Scene};

/// The statistics that a picture has wherever it was made; `samples` of each pixel.
pub fn stats(renderer: &Renderer, sums: &Sums, samples: u64) -> Value {
    let (scene, medium) = (&renderer.scene, &renderer.medium);
    let biases = scene.biases();
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
        "relative_error": sums.relative_error().filter(|_| !renderer.is_correlated()),
        "bytes": {
            "volume": medium.volume_bytes,
            "majorant": medium.majorant_bytes,
            "film": renderer.film.bytes(),
            "reservoirs": renderer.reuse().map_or(0, crate::render::reuse::Reuse::bytes),
        },
        "cell": medium.cell,
        "density_scale": medium.density_scale(scene),
        "majorant_seconds": medium.majorant_seconds,
        "biased": !biases.is_empty(),
        "bias": (!biases.is_empty()).then(|| Bias::whys(&biases)),
    })
}

/// Writes what a scene's overlay shows of a picture as that picture: a PNG, which is for the screen; notes its scale in
/// `stats`. False, and nothing is written, where no overlay is on or the file has another ending.
pub fn overlay(path: &Path, sums: &Sums, scene: &Scene, stats: &mut Value) -> Result<bool> {
    let overlay = scene.display.overlay;
    if picture::Format::of_path(path)? != picture::Format::Png {
        return Ok(false);
    }
    let (Some(look), Some((image, range))) = (heat::look(overlay), heat::image(sums, overlay)) else {
        return Ok(false);
    };
    stats["overlay"] = json!({
        "name": overlay.name(),
        "shows": look.name,
        "low": range.low,
        "median": range.median,
        "high": range.high,
        "logarithmic": look.is_log(),
    });
    if !look.names().is_empty() {
        stats["overlay"]["names"] = look.names().iter().map(|(name, _)| *name).collect();
    }
    // Its colours are what the screen shall show.
    write(path, &image, scene, stats, &Display { exposure: 0.0, tone_map: ToneMap::Linear })?;
    Ok(true)
}

/// Writes a picture with its scene and statistics, whole or not at all; paths in the scene are relative to it.
pub fn picture(path: &Path, image: &Image, scene: &Scene, stats: &Value) -> Result<()> {
    write(path, image, scene, stats, &Display::of(&scene.display))
}

fn write(path: &Path, image: &Image, scene: &Scene, stats: &Value, display: &Display) -> Result<()> {
    let folder = std::path::absolute(path).ok().and_then(|p| p.parent().map(Path::to_path_buf)).unwrap_or_default();
    let meta = Metadata {
        scene_toml: scene.to_toml(&folder),
        stats_json: stats.to_string(),
        software: format!("nephele {}", env!("CARGO_PKG_VERSION")),
        description: format!("{} samples per pixel, mode {}", stats["spp"], scene.integrator.mode.name()),
    };
    picture::save(path, image, &meta, display)
}
