// Slot @spectrum: the same extinction in all channels; nothing to weigh.
//!use core/params

struct Spectrum {
    rate: f32,  // extinction that drives the path, per density · sigma
}

fn spectrum_start(u: f32) -> Spectrum {
    return Spectrum(1.0);
}

// A tentative collision after `depth` = ∫ majorant dt, or a stretch without one.
fn spectrum_step(s: ptr<function, Spectrum>, depth: f32, event: bool) {
}

// The weight of what the path carries, for each channel.
fn spectrum_weight(s: Spectrum) -> vec3f {
    return vec3f(1.0);
}

// The transmittance of a shadow ray: one number for all channels.
fn spectrum_clear() -> f32 {
    return 1.0;
}

// The factor that a null collision of a shadow ray leaves, from density over majorant.
fn spectrum_ratio(share: f32) -> f32 {
    return 1.0 - share;
}

fn spectrum_strongest(transmittance: f32) -> f32 {
    return transmittance;
}
