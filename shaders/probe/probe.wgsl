// What probes share: kernels for tests/stats that call one function each. Values in, values out, one invocation each.
// Groups 0 to 2 are those of the path tracer; `slice` carries the numbers that a probe needs.
//!use core/params

@group(3) @binding(0) var<storage, read> probe_in: array<vec4f>;
@group(3) @binding(1) var<storage, read_write> probe_out: array<vec4f>;

// Steps of a ray at most. Loops of probes end in two ways, by this and by what they wait for: Mesa's software driver gives
// values of a loop's last round to all lanes, however early they left, where there is one way out only.
const PROBE_STEPS: u32 = 65536u;
