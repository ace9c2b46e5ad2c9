// What the passes of resampling know of a frame: settings, and the frame before.
//!use core/params

struct Frame {
    frame: u32,          // its number, which keys the random numbers
    candidates: u32,
    cap: f32,            // most confidence of a history
    neighbours: u32,
    reach: u32,          // offsets of neighbours are below 2^reach pixels
    history: u32,        // bits: paths whose factors are all known, those with frozen light
    still: u32,          // 1: camera, medium and lights are those of the frame before
    reconnect: f32,      // a leg that is kept is so many times as long as the way that its vertex moved, at least
    walks: u32,          // of the last step
    permute: u32,        // 1: histories are read from a neighbour now and then
    old_lights: u32,     // where the frame before's lights begin in the list
    suffixes: u32,       // second vertices that a pixel tries
}

@group(0) @binding(2) var<uniform> frame_previous: Params;
@group(3) @binding(13) var<uniform> frame_uniform: Frame;
