// Adds a buffer of block sums to the totals and clears it.

@group(0) @binding(0) var<storage, read_write> flush_block: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> flush_total: array<vec4f>;

@compute @workgroup_size(64)
fn flush_main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let i = id.x + id.y * groups.x * 64u;
    if (i < arrayLength(&flush_block)) {
        flush_total[i] += flush_block[i];
        flush_block[i] = vec4f(0.0);
    }
}
