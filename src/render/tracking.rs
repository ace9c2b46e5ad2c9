//! Estimators: the shader file of each, and what it asks for. A new estimator is a row of the enum in `src/scene`, a row
//! here and a file under `shaders/`.

use crate::gpu::shader::Variant;
use crate::scene::{FreeFlight, Scene, Tracking, Transmittance};

/// What a free-flight sampler or a transmittance estimator is to the renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Estimator {
    /// The file that fills its slot.
    pub file: &'static str,
    /// Whether it walks through segments itself rather than colliding in them.
    pub walks: bool,
    /// Whether it reads control and residual bound of the cells.
    pub control: bool,
}

const fn collides(file: &'static str) -> Estimator {
    Estimator { file, walks: false, control: false }
}

const fn controlled(file: &'static str) -> Estimator {
    Estimator { control: true, ..collides(file) }
}

const fn walks(file: &'static str) -> Estimator {
    Estimator { walks: true, ..collides(file) }
}

const fn walks_controlled(file: &'static str) -> Estimator {
    Estimator { control: true, ..walks(file) }
}

/// The free-flight sampler of that name.
pub fn flight(kind: FreeFlight) -> Estimator {
    match kind {
        FreeFlight::Delta | FreeFlight::Hero => collides("flight/delta"),
        FreeFlight::WeightedDelta => collides("flight/weighted_delta"),
        FreeFlight::Decomposition => controlled("flight/decomposition"),
        FreeFlight::WeightedDecomposition => controlled("flight/weighted_decomposition"),
        FreeFlight::SpectralMax => collides("flight/spectral_max"),
        FreeFlight::SpectralAvg => collides("flight/spectral_avg"),
        FreeFlight::SpectralHistory => collides("flight/spectral_history"),
        FreeFlight::Regular => walks("flight/regular"),
        FreeFlight::ClosedForm => walks("flight/closed_form"),
        FreeFlight::RayMarching => walks("flight/ray_marching"),
    }
}

/// The transmittance estimator of that name.
pub fn transmittance(kind: Transmittance) -> Estimator {
    match kind {
        Transmittance::Ratio => collides("transmittance/ratio"),
        Transmittance::ResidualRatio => controlled("transmittance/residual_ratio"),
        Transmittance::Delta => collides("transmittance/delta"),
        Transmittance::NextFlight => collides("transmittance/next_flight"),
        Transmittance::UnbiasedRayMarching => walks_controlled("transmittance/unbiased_ray_marching"),
        Transmittance::Telescoping => walks_controlled("transmittance/telescoping"),
        Transmittance::PowerSeries => walks("transmittance/power_series"),
        Transmittance::Regular => walks("transmittance/regular"),
        Transmittance::ClosedForm => walks("transmittance/closed_form"),
        Transmittance::RayMarching => walks("transmittance/ray_marching"),
        Transmittance::Jackknife => walks("transmittance/jackknife"),
    }
}

/// Whether the majorant cells must hold a control.
pub fn needs_control(tracking: &Tracking) -> bool {
    flight(tracking.free_flight).control || transmittance(tracking.transmittance).control
}

/// Whether an estimator counts on bounds that do not depend on where the ray stopped before. In a level grid they do:
/// cells within one cube may name different cubes. Delta and ratio tracking bear that, a rate need only be known before the
/// next collision; next-flight weighs collisions by the rate of all that would have followed.
pub fn needs_fixed_bounds(tracking: &Tracking) -> bool {
    tracking.transmittance == Transmittance::NextFlight
}

/// The file that fills slot `spectrum`.
pub fn spectrum(scene: &Scene) -> &'static str {
    let [r, g, b] = scene.medium.extinction.0;
    if r == g && g == b { "spectrum/grey" } else { "spectrum/colour" }
}

/// Fills the slots of the estimators and of the spectrum; in an `analytic` medium, regular tracking is the closed form.
pub fn variant(scene: &Scene, analytic: bool, variant: Variant) -> Variant {
    let tracking = &scene.tracking;
    let exact = |kind: FreeFlight| if analytic && kind == FreeFlight::Regular { FreeFlight::ClosedForm } else { kind };
    let flight = flight(exact(tracking.free_flight));
    let shadow = match tracking.transmittance {
        Transmittance::Regular if analytic => Transmittance::ClosedForm,
        kind => kind,
    };
    let shadow = transmittance(shadow);
    variant
        .slot("spectrum", spectrum(scene))
        .slot("flight", flight.file)
        .slot("transmittance", shadow.file)
        .flag("FLIGHT_WALKS", flight.walks)
        .flag("TRANSMITTANCE_WALKS", shadow.walks)
}
