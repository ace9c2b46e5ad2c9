//! Room that paths take.

use super::*;

/// Bytes for each pixel at most, paths of one scattering.
const MOST: u64 = 150;
/// The same of all buffers where paths go on.
const MOST_SECOND: u64 = 220;

#[test]
fn reservoirs_are_small() {
    let Some(a) = adapter() else { return };
    for (bounces, most) in [(1, MOST), (3, MOST_SECOND)] {
        let mut scene = sunny(bounces);
        (scene.film.width, scene.film.height) = (160, 90);
        let r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
        let bytes = r.reuse().expect("the mode keeps reservoirs").bytes() as f64 / f64::from(160 * 90);
        assert!(bytes <= most as f64 + 0.1, "{bytes} bytes a pixel, {bounces} bounces");
        eprintln!("{bytes:.1} bytes a pixel, {bounces} bounces");
    }
    let mut scene = sunny(1);
    scene.integrator.mode = Mode::Path;
    assert!(renderer(&a, &standard(), &scene, Some(cloud_field()), false).reuse().is_none());
}
