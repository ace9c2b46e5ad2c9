// Slot @aim: what a path is worth to a pixel, both legs looked along from afar.
//!use reuse/target

fn aim_value(pixel: vec2u, path: Path) -> f32 {
    return target_value(pixel, path);
}
