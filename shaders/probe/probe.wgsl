// What probes share: kernels for tests/stats that call one function each. Values in, values out, one invocation each.
// Groups 0 to 2 are those of the path tracer; `slice` carries the numbers that a probe needs.
//!use core/params

@group(3) @binding(0) var<storage, read> probe_in: array<vec4f>;
@group(3) @binding(1) var<storage, read_write> probe_out: array<vec4f>;
