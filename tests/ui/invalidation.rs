//! What a change of the scene invalidates: a row here for each row of the table that the project works by, where the
//! feature exists. A setting that restarts too much throws light away; one that restarts too little shows a wrong picture.

use glam::DVec3;
use nephele::scene::row::{Effect, Layers};
use nephele::scene::value::{Auto, Bounds, Colour, FilePath, Limit};
use nephele::scene::{
    Analytic, Environment, Filter, Light, MajorantKind, Overlay, Phase, Point, Precision, Scene, SkyLight, ToneMap,
};

const NOTHING: Layers = Layers {
    data: false,
    majorants: false,
    lights: false,
    pipelines: false,
    accumulation: false,
    view: false,
    history: false,
    suffixes: false,
};
const VIEW: Layers = Layers { view: true, ..NOTHING };
/// The picture begins anew; everything that it is made from is kept, light paths of earlier frames too.
const RESTART: Layers = Layers { accumulation: true, ..VIEW };
/// As `RESTART`; estimates of light that was scattered more than once are of a medium or lights that are no more.
const EDIT: Layers = Layers { suffixes: true, ..RESTART };
/// As `EDIT`, and no path of earlier frames can be used.
const ANEW: Layers = Layers { history: true, ..EDIT };
/// As `ANEW`, and the shader's variant may be another: pipelines are looked up, and built where they are new.
const VARIANT: Layers = Layers { pipelines: true, ..ANEW };
const NEW_COLOUR: Layers = Layers { pipelines: true, ..EDIT };
const NEW_LIGHTS: Layers = Layers { lights: true, ..VARIANT };
const NEW_BOUNDS: Layers = Layers { majorants: true, ..VARIANT };
const NEW_DATA: Layers = Layers { data: true, ..NEW_BOUNDS };

type Change = fn(&mut Scene);

/// A row of the table: its change in words, settings that make it, and the layers that must follow.
const ROWS: &[(&str, &[Change], Layers)] = &[
    ("nothing", &[|_| {}], NOTHING),
    (
        "exposure, tone map, false colour, overlay",
        &[
            |s| s.display.exposure = 1.5,
            |s| s.display.tone_map = ToneMap::Linear,
            |s| s.display.tone_map = ToneMap::FalseColour,
            |s| s.display.overlay = Overlay::Noise,
        ],
        VIEW,
    ),
    (
        "camera move, roll, field of view, lens",
        &[
            |s| s.camera.position = Auto::Is(DVec3::new(0.0, 0.5, 4.0)),
            |s| s.camera.target = Auto::Is(DVec3::X),
            |s| s.camera.up = DVec3::new(0.1, 1.0, 0.0),
            |s| s.camera.fov_y = 39.0,
            |s| s.camera.aperture_radius = 0.01,
            |s| s.camera.focus_distance = Auto::Is(3.0),
        ],
        RESTART,
    ),
    ("window resize", &[|s| s.film.width = 640, |s| s.film.height = 641], RESTART),
    ("density scale", &[|s| s.medium.density_scale = Auto::Is(80.0)], EDIT),
    ("albedo", &[|s| s.medium.albedo = Colour([0.9, 0.99, 0.99])], EDIT),
    ("g, phase model parameters", &[|s| s.medium.g = 0.5, |s| s.medium.g2 = 0.1, |s| s.medium.lobe_weight = 0.9], EDIT),
    ("phase model", &[|s| s.medium.phase = Phase::Rayleigh, |s| s.medium.phase = Phase::TwoLobeHg], VARIANT),
    ("colour of the extinction", &[|s| s.medium.extinction = Colour([1.0, 0.9, 0.8])], NEW_COLOUR),
    ("volume transform", &[|s| s.volume.to_world.0[3] = 2.0], ANEW),
    (
        "strength of a light",
        &[
            |s| {
                set(s, |l| {
                    if let Light::Sun(x) = l {
                        x.irradiance = Colour([1.0; 3])
                    }
                })
            },
            |s| {
                set(s, |l| {
                    if let Light::Constant(x) = l {
                        x.radiance = Colour([1.0; 3])
                    }
                })
            },
            |s| {
                set(s, |l| {
                    if let Light::Environment(x) = l {
                        x.scale = 2.0
                    }
                })
            },
            |s| {
                set(s, |l| {
                    if let Light::Sky(x) = l {
                        x.scale = 2.0
                    }
                })
            },
            |s| {
                set(s, |l| {
                    if let Light::Point(x) = l {
                        x.intensity = Colour([2.0; 3])
                    }
                })
            },
        ],
        EDIT,
    ),
    (
        "rotation of a map, direction of a sun, place of a lamp",
        &[
            |s| {
                set(s, |l| {
                    if let Light::Environment(x) = l {
                        x.rotation = 20.0
                    }
                })
            },
            |s| {
                set(s, |l| {
                    if let Light::Sun(x) = l {
                        x.direction = DVec3::Y
                    }
                })
            },
            |s| {
                set(s, |l| {
                    if let Light::Point(x) = l {
                        x.position = DVec3::Y
                    }
                })
            },
        ],
        EDIT,
    ),
    (
        "new map, sky, kind or number of lights",
        &[
            |s| {
                set(s, |l| {
                    if let Light::Environment(x) = l {
                        x.file = FilePath("b.hdr".into())
                    }
                })
            },
            |s| {
                set(s, |l| {
                    if let Light::Sky(x) = l {
                        x.turbidity = 6.0
                    }
                })
            },
            |s| {
                set(s, |l| {
                    if let Light::Sky(x) = l {
                        x.sun_elevation = 6.0
                    }
                })
            },
            |s| {
                s.lights.pop();
            },
            |s| s.lights.push(Light::Point(Point::default())),
            |s| s.lights.swap(0, 1),
        ],
        NEW_LIGHTS,
    ),
    (
        "estimator, majorant kind, bounces",
        &[
            |s| s.tracking.majorant = MajorantKind::Global,
            |s| s.tracking.cell = Auto::Is(8),
            |s| s.integrator.max_bounces = Limit::Unlimited,
        ],
        NEW_BOUNDS,
    ),
    (
        "resampling",
        &[|s| s.restir.candidates = Auto::Is(6), |s| s.restir.cap = 20, |s| s.restir.spatial = false],
        RESTART,
    ),
    ("seed", &[|s| s.integrator.seed = 7], ANEW),
    (
        "new file, other grid, other storage",
        &[
            |s| s.volume.file = FilePath("b.vdb".into()),
            |s| s.volume.grid = "#2".into(),
            |s| s.volume.seed = 2,
            |s| s.volume.resolution = 64,
            |s| s.volume.analytic = Analytic::Homogeneous,
            |s| s.volume.bounds = Bounds([DVec3::ZERO, DVec3::ONE]),
            |s| s.volume.filter = Filter::Nearest,
            |s| s.volume.max_resolution = 32,
            |s| s.volume.precision = Precision::F32,
        ],
        NEW_DATA,
    ),
];

fn set(scene: &mut Scene, change: impl Fn(&mut Light)) {
    scene.lights.iter_mut().for_each(change);
}

/// A scene with a light of every kind.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let map = Environment { file: FilePath("a.hdr".into()), ..Environment::default() };
    scene.lights.extend([Light::Environment(map), Light::Sky(SkyLight::default()), Light::Point(Point::default())]);
    scene
}

#[test]
fn each_change_invalidates_exactly_its_layers() {
    let old = scene();
    for (words, changes, layers) in ROWS {
        for (i, change) in changes.iter().enumerate() {
            let mut new = old.clone();
            change(&mut new);
            assert!(new != old || *words == "nothing", "{words}, change {i} changes nothing");
            assert_eq!(new.changes(&old), *layers, "{words}, change {i}");
            assert_eq!(old.changes(&new), *layers, "{words}, change {i}, and back");
        }
    }
}

#[test]
fn several_changes_invalidate_what_each_does() {
    let old = scene();
    let mut new = old.clone();
    new.display.exposure = 1.0;
    new.medium.g = 0.1;
    new.lights.pop();
    assert_eq!(new.changes(&old), NEW_LIGHTS);
}

/// Every kind of change stands in the table: a new one must be put there.
#[test]
fn the_table_has_every_effect() {
    for effect in Effect::ALL {
        let known = effect == Effect::None || ROWS.iter().any(|(_, _, layers)| *layers == effect.layers());
        assert!(known, "{effect:?} has no row");
    }
    // A setting without effect would be one that no picture depends on.
    for (key, row, _) in scene().settings() {
        assert_ne!(row.effect, Effect::None, "{key}");
    }
}
