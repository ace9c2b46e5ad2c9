// Slot @aim: what a path is worth to a pixel, by the table of the pixel's ray.
//!use reuse/target
//!use reuse/frame

@group(3) @binding(13) var aim_table: texture_2d_array<u32>;

fn aim_value(pixel: vec2u, path: Path) -> f32 {
    return target_value(pixel, frame_read(aim_table, pixel), path);
}
