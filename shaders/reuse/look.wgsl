// Looks for light from a vertex: a light sample and the direction that scattering chooses, one of which goes on. A glimpse of what
// is in the way tells which is likely to bring more, so that only one leg is looked along.
//!use core/rng
//!use core/math
//!use reuse/end
//!use reuse/target

const LOOK_DOUBT: f32 = 0.3;   // of the choice, by chance alone: a glimpse may be wrong

// The look that goes on.
struct Look {
    path: Path,
    parts: Target,
    strength: f32,  // what it would bring were nothing in the way
    inverse: f32,   // of the density that it was drawn with, given its vertex
}

// One of the two.
struct LookOffer {
    path: Path,
    parts: Target,
    strength: f32,
    inverse: f32,   // 0: it brings nothing
    worth: f32,     // strength over density, about, with what is in the way
}

fn look_offer(pixel: vec2u, path: Path, density: f32) -> LookOffer {
    let parts = target_parts(pixel, path);
    let strength = target_strength(parts);
    let good = strength > 0.0 && strength < MATH_FAR && density > 0.0;
    let inverse = select(0.0, 1.0 / density, good);
    let leg = target_take(parts, parts.legs - 1u);
    let ray = ray_new(leg.origin, leg.world);
    let seen = exp(-leg_glimpse(ray, min(proxy_end(ray), leg.reach)));
    return LookOffer(path, parts, strength, inverse, select(0.0, strength * inverse * seen, good));
}

// From the last vertex (local space) of a path, after travelling along `before`. The path's kind is that of its vertices.
fn look_choose(pixel: vec2u, found: Path, vertex: vec3f, before: vec3f, rng: ptr<function, Rng>) -> Look {
    var light = LookOffer();
    var sky = LookOffer();
    if (LIGHT_SAMPLED) {
        var path = found;
        let density = end_lit(&path, vertex, found.kind, rng);
        light = look_offer(pixel, path, density);
    }
    if (end_finds()) {
        var path = found;
        let density = end_scattered(&path, before, found.kind, rng);
        sky = look_offer(pixel, path, density);
    }
    var chance = mix(light.worth / max(light.worth + sky.worth, 1e-30), 0.5, LOOK_DOUBT);
    chance = select(select(chance, 1.0, sky.inverse == 0.0), 0.0, light.inverse == 0.0);
    if (rng_next(rng) < chance) {
        return Look(light.path, light.parts, light.strength, light.inverse / chance);
    }
    return Look(sky.path, sky.parts, sky.strength, sky.inverse / max(1.0 - chance, 1e-30));
}
